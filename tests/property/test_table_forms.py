"""A table written as a spreadsheet may write it and read again is the same recording."""

from __future__ import annotations

import tempfile
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from driftwalk.record import load

NUMBERS = st.floats(-1e9, 1e9, allow_nan=False, allow_subnormal=False)
ZONES = st.sampled_from([None, *(timezone(timedelta(minutes=m)) for m in (-210, 0, 120, 765))])


def read(content: bytes) -> tuple[np.ndarray, np.ndarray, dict[str, object]]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "synthetic.csv"
        path.write_bytes(content)
        dataset = load(path)
    return dataset["time"].to_numpy(), dataset["x"].to_numpy()[:, 0], dataset.attrs


@pytest.mark.slow
@settings(deadline=None, max_examples=40)
@given(
    values=st.lists(NUMBERS, min_size=1, max_size=40),
    delimiter=st.sampled_from([";", "\t", " "]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    end=st.sampled_from(["\n", "\r\n"]),
    decimal=st.sampled_from([".", ","]),
)
def test_every_form_of_numbers_is_read_to_the_last_bit(
    values: list[float], delimiter: str, encoding: str, end: str, decimal: str
) -> None:
    rows = [["t", "x", "y"], *([repr(float(k)), repr(x), "0.5"] for k, x in enumerate(values))]
    text = end.join(delimiter.join(row) for row in rows).replace(".", decimal)
    time, x, _ = read((text + end).encode(encoding))
    np.testing.assert_array_equal(time, np.arange(len(values)))
    np.testing.assert_array_equal(x, values)


@pytest.mark.slow
@settings(deadline=None, max_examples=40)
@given(
    start=st.datetimes(datetime(1800, 1, 1), datetime(2200, 1, 1)),
    zone=ZONES,
    steps=st.lists(st.integers(1, 10**9), min_size=1, max_size=30),
    between=st.sampled_from("T "),
    sign=st.sampled_from(".,"),
)
def test_every_form_of_time_stamps_is_read_to_the_microsecond(
    start: datetime, zone: timezone | None, steps: list[int], between: str, sign: str
) -> None:
    passed = np.cumsum([0, *steps]).tolist()
    moments = [start.replace(tzinfo=zone) + timedelta(microseconds=k) for k in passed]
    texts = [one.isoformat(sep=between).replace(".", sign) for one in moments]
    rows = ["time;x;y", *(f"{text};{k};1" for k, text in enumerate(texts))]
    time, _, attrs = read("\n".join(rows).encode())
    np.testing.assert_array_equal(time, np.array(passed) / 1e6)
    origin = datetime.fromisoformat(str(attrs["time_origin"]))
    assert origin == moments[0]
