"""Tables in memory go into `load` by the rules of a CSV file, and are not changed."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

T = np.arange(6.0) / 8
X, Y = T * 3, 1 - T
FRAME = pd.DataFrame({"t": T, "x_mm": X, "y_mm": Y, "robot": list("ababab"), "theta_deg": 90 * T})
MATRIX = np.stack([T, X, Y], 1)
ROWS = np.array(list(zip(T, X, Y, strict=True)), dtype=[("t", "f8"), ("x", "f4"), ("y", "f8")])


def test_a_dataframe_is_read_as_its_csv_file(tmp_path: Path) -> None:
    FRAME.to_csv(tmp_path / "a.csv", index=False)
    expected = load(tmp_path / "a.csv", tank="circle:1m")
    before = FRAME.copy()
    found = load(FRAME, tank="circle:1m")
    xr.testing.assert_equal(found, expected)
    assert found.attrs["counts"] == expected.attrs["counts"]
    assert (found.attrs["source"], found.attrs["format"]) == ("DataFrame", "table")
    pd.testing.assert_frame_equal(FRAME, before)


@pytest.mark.parametrize(
    ("table", "options"),
    [
        ({"t": T, "x": X, "y": Y}, {}),
        ({"t": list(T), "x": tuple(X), "y": Y.astype(object)}, {}),
        (ROWS, {}),
        (MATRIX, {"columns": {"t": 1, "x": "2:m", "y": "3:m"}}),
        (np.asfortranarray(MATRIX), {"columns": {"t": "1", "x": "2:m", "y": "3:m"}}),
        (pd.DataFrame({"x": X, "y": Y}, index=pd.Index(T, name="t")), {}),
    ],
)
def test_arrays_and_mappings(table: Any, options: dict[str, Any]) -> None:
    track = body_track(load(table, **options))
    np.testing.assert_array_equal(track.time, T)
    np.testing.assert_array_equal(track.x, X)  # 3/8 is a 32-bit number too
    np.testing.assert_array_equal(MATRIX[:, 1], X)


def test_a_frame_of_polars() -> None:
    polars = pytest.importorskip("polars", reason="polars, which is large, is not installed")
    moments = [datetime(2024, 5, 1, tzinfo=UTC) + timedelta(seconds=s) for s in T.tolist()]
    frame = polars.DataFrame({"time": moments, "x": X, "y": [*Y[:-1], None], "id": list("ababab")})
    dataset = load(frame)
    assert body_names(dataset) == ["a", "b"]
    assert dataset.attrs["time_origin"] == "2024-05-01T00:00:00Z"
    np.testing.assert_array_equal(dataset["time"], T)
    assert np.isnan(dataset["x"].to_numpy()[-1]).all()
    with pytest.raises(InputError, match=r"got LazyFrame: collect\(\) it first"):
        load(frame.lazy())


def test_missing_values_and_names_of_every_kind() -> None:
    masked = np.ma.array(X, mask=[0, 1, 0, 0, 0, 0])
    assert np.isnan(load({"t": T, "x": masked, "y": Y})["x"].to_numpy()[1, 0])
    whole = pd.DataFrame({"t": pd.array([0, 1, None], dtype="Int64"), "x": 1.0, "y": 2.0})
    assert load(whole).sizes["time"] == 2
    words = pd.Categorical(["left", "right", "left"])
    for names, expected in ((words, ["left", "right"]), ([7.0, 3.0, 7.0], ["7", "3"])):
        dataset = load(pd.DataFrame({"t": [0, 0, 1], "x": 1.0, "y": 2.0, "id": names}))
        assert body_names(dataset) == expected


def test_times_of_pandas_and_numpy() -> None:
    index = pd.date_range("2024-05-01T12:00", periods=6, freq="125ms", tz="Europe/Berlin")
    dataset = load(pd.DataFrame({"x": X, "y": Y}, index=index))
    np.testing.assert_array_equal(dataset["time"], T)
    assert dataset.attrs["time_origin"] == "2024-05-01T10:00:00Z"
    lasting = pd.to_timedelta(T + 2, unit="s")
    np.testing.assert_array_equal(load({"t": lasting, "x": X, "y": Y})["time"], T + 2)
    ticks = 1_714_564_800_000_000_001 + np.arange(6) * 10
    far = load({"t": ticks, "x": X, "y": Y}, columns={"t": "t:ns"})
    np.testing.assert_allclose(far["time"], np.arange(6) * 1e-8, rtol=1e-15)


BAD: dict[str, tuple[Any, dict[str, Any], str]] = {
    "no columns": (FRAME.rename(columns={"x_mm": "a"}), {}, "no columns of x and y among 't', 'a'"),
    "a word": (
        FRAME.assign(x_mm=["1", "2", "oops", "", "3", "4"]),
        {},
        r"'oops' .*\(row 2, counted",
    ),
    "truth": (FRAME.assign(x_mm=True), {}, "'True' in column 'x_mm' is not a number"),
    "complex": ({"t": T, "x": X + 1j, "y": Y}, {}, "'1j' in column 'x' is not a number"),
    "dates": ({"t": T, "x": T.astype("M8[s]"), "y": Y}, {}, "in column 'x' is not a number"),
    "durations": ({"t": T, "x": T.astype("m8[s]"), "y": Y}, {}, "in column 'x' is not a number"),
    "lengths": ({"t": T, "x": X[:2], "y": Y}, {}, "column 'x' has 2 rows, and 't' has 6"),
    "axes": ({"t": T, "x": MATRIX, "y": Y}, {}, "column 'x' has 2 axes"),
    "no rows": (FRAME.iloc[:0], {}, "the DataFrame: holds no rows of data"),
    "no names": (MATRIX, {}, r"the array: .*3 columns and no header: name them with `columns`"),
    "one axis": (X, {}, r"one has the shape \(6,\)"),
    "a list": ([T, X], {}, "a recording is a path, a DataFrame .* got list"),
    "nothing": (None, {}, "got NoneType"),
    "a dataset": (xr.Dataset(), {}, "this is a dataset"),
    "an option of files": (FRAME, {"delimiter": ";"}, "the DataFrame: `delimiter` is about a file"),
    "a format": (FRAME, {"format": "csv"}, "`format` is about a file"),
    "backwards": ({"t": T[::-1], "x": X, "y": Y}, {}, r"mapping of columns: time goes backwards"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_refused(case: str) -> None:
    table, options, message = BAD[case]
    with pytest.raises(InputError, match=message) as caught:
        load(table, **options)
    assert "\n" not in str(caught.value)
