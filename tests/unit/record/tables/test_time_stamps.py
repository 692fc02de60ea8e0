"""Tables whose clock is dates and times; the expected ones are those of Python's datetime."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from driftwalk.core.errors import FormatError
from driftwalk.record import describe, load
from driftwalk.record.tables.date_stamps import NO_TIME, StampReader
from driftwalk.schema import body_track


def table(folder: Path, header: str, *rows: str) -> Path:
    path = folder / "synthetic.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("texts", "zone"),
    [
        (("2024-05-01T12:00:00Z", "2024-05-01T12:00:01.25Z"), "Z"),
        (("2024-05-01 14:00:00+02:00", "2024-05-01 13:00:01.25+01:00"), "Z"),
        (("2024-05-01T08:30:00-0330", "2024-05-01T08:30:01,25-0330"), "Z"),
        (("20240501T120000", "20240501T120001.25"), ""),
        (("01.05.2024 12:00:00", "01.05.2024 12:00:01.250000"), ""),
        (("2024-05-01T12:00:00", "2024-05-01 12:00:01.250000000"), ""),
        (("2024-05-01 12:00:00 PM", "2024-05-01 12:00:01.25 pm"), ""),
        (("01.05.2024 12:00 PM", "01.05.2024 12:00:01.25 p.m."), ""),
    ],
)
@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_moments(tmp_path: Path, texts: tuple[str, ...], zone: str, delimiter: str) -> None:
    rows = [delimiter.join([text, "1", f"{k}"]) for k, text in enumerate(texts)]
    dataset = load(table(tmp_path, delimiter.join(["timestamp", "x", "y"]), *rows))
    np.testing.assert_array_equal(dataset["time"], [0.0, 1.25])
    assert describe(dataset)["time_origin"] == f"2024-05-01T12:00:00{zone}"
    # Of a time without a zone nobody knows how long after 1970 it is.
    unix = datetime(2024, 5, 1, 12, tzinfo=UTC).timestamp()
    assert dataset.attrs.get("time_origin_unix_s") == (unix if zone else None)


def test_a_clock_across_the_end_of_a_leap_day_and_of_a_century(tmp_path: Path) -> None:
    for start in (datetime(2024, 2, 28, 23, 59, 59), datetime(1900, 2, 28, 23, 59, 59)):
        moments = [start, start + timedelta(seconds=2), start + timedelta(days=1, seconds=1)]
        rows = [f"{one.isoformat()},1,{k}" for k, one in enumerate(moments)]
        time = load(table(tmp_path, "time,x,y", *rows))["time"].to_numpy()
        np.testing.assert_array_equal(time, [(one - start).total_seconds() for one in moments])


def test_nanoseconds_are_exact(tmp_path: Path) -> None:
    rows = [f"2024-05-01T12:00:00.{k:09d}99,1,{k}" for k in (0, 1, 7, 100_000_003)]
    time = load(table(tmp_path, "time,x,y", *rows))["time"].to_numpy()
    np.testing.assert_array_equal(time, [0.0, 1e-9, 7e-9, 0.100000003])


def test_date_and_time_in_two_columns(tmp_path: Path) -> None:
    rows = ("2024-12-31;23:59:59,5;1;2", "2025-01-01;00:00:00,5;1,5;3")
    dataset = load(table(tmp_path, "date;time;x;y", *rows))
    np.testing.assert_array_equal(dataset["time"], [0.0, 1.0])
    assert dataset.attrs["time_origin"] == "2024-12-31T23:59:59.5"
    columns = {"date": "Datum", "t": "Uhrzeit", "x": "x", "y": "y"}
    again = load(table(tmp_path, "Datum;Uhrzeit;x;y", *rows), columns=columns)
    np.testing.assert_array_equal(again["time"], [0.0, 1.0])


def test_dates_beside_a_clock_of_numbers_do_not_count(tmp_path: Path) -> None:
    dataset = load(table(tmp_path, "date,t,x,y", "2024-05-01,7,1,2", "2024-05-01,8,1,3"))
    np.testing.assert_array_equal(dataset["time"], [7.0, 8.0])
    daily = load(table(tmp_path, "date,x,y", "2024-05-01,1,2", "2024-05-03,1,3"))
    np.testing.assert_array_equal(daily["time"], [0.0, 2 * 86400.0])


def test_times_of_day_go_on_after_midnight(tmp_path: Path) -> None:
    rows = ("23:59:59.5,1,2", ",1,2", "00:00:00.5,1,3", "23:59:59,1,4", "0:00:01,1,5")
    dataset = load(table(tmp_path, "time,x,y", *rows))
    day = 86400.0
    np.testing.assert_array_equal(
        dataset["time"], [day - 0.5, day + 0.5, 2 * day - 1.0, 2 * day + 1.0]
    )
    assert dataset.attrs["time_origin"] == "00:00:00"


def test_midnight_is_the_same_for_bodies_that_take_turns(tmp_path: Path) -> None:
    """The second body appears after midnight only."""
    rows = (
        "23:59:58,0,1,a",
        "00:00:02,0,2,a",
        "00:00:02,1,1,b",
        "00:00:03,0,3,a",
        "00:00:03,1,2,b",
    )
    dataset = load(table(tmp_path, "time,x,y,id", *rows))
    np.testing.assert_array_equal(body_track(dataset, "b").time, [86402.0, 86403.0])
    # One below the other each has midnights of its own, and noon to morning is none of them.
    rows = ("08:00:00,0,1,a", "21:00:00,0,2,a", "08:00:00,1,1,b", "21:00:00,1,2,b")
    dataset = load(table(tmp_path, "time,x,y,id", *rows))
    np.testing.assert_array_equal(dataset["time"], [8 * 3600.0, 21 * 3600.0])


def test_a_block_of_stamps_with_and_without_decimals() -> None:
    """Python's isoformat leaves the decimals of whole seconds out."""
    start = datetime(2024, 5, 1, 12)
    moments = [start + timedelta(milliseconds=250 * k) for k in range(9)]
    texts = np.array([*(one.isoformat() for one in moments), "", "NaN"], dtype=object)
    ticks = StampReader().read(texts)
    assert ticks[-2:].tolist() == [NO_TIME, NO_TIME]
    assert np.diff(ticks[:-2]).tolist() == [250_000_000] * 8


def test_a_dash_is_a_missing_time_in_a_file_and_in_memory(tmp_path: Path) -> None:
    """It is no ASCII, as time stamps are."""
    times = ["2024-05-01T12:00:00", "\u2014", "2024-05-01T12:00:02.5"]
    of_file = load(table(tmp_path, "time,x,y", *(f"{time},0,{k}" for k, time in enumerate(times))))
    of_memory = load({"time": times, "x": [0.0, 0.0, 0.0], "y": [0.0, 1.0, 2.0]})
    for dataset in (of_file, of_memory):
        np.testing.assert_array_equal(dataset["time"], [0.0, 2.5])
        assert json.loads(dataset.attrs["counts"])["without_time"] == 1


@pytest.mark.parametrize("text", ["2024-05-01T12:00:00." + "0" * 200, "\u00e9" * 150])
def test_a_text_of_any_length_is_no_time_stamp(tmp_path: Path, text: str) -> None:
    with pytest.raises(FormatError, match=f"'{text[:40]}' is no time stamp"):
        load(table(tmp_path, "time,x,y", "2024-05-01T12:00:00,0,0", f"{text},0,1"))


BAD = {
    "month first or day first": (
        "5/1/2024 12:00:00",
        "several ways, so write it as 2024-05-31T13:30:00",
    ),
    "minutes or hours": ("12:30", "several ways"),
    "minutes": ("30:01.3", "several ways"),
    "no such half of a day": ("13:30:00 PM", "not a valid date and time"),
    "no such day": ("2023-02-29T12:00:00", "not a valid date and time"),
    "no such hour": ("2024-05-01T25:00:00", "not a valid date and time"),
    "no such minute": ("12:61:00", "not a valid date and time"),
    "no such month": ("2024-13-01T12:00:00", "not a valid date and time"),
    "before the clock": ("0001-01-01T00:00:00", "not a valid date and time"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_time_that_is_none(tmp_path: Path, case: str) -> None:
    text, message = BAD[case]
    with pytest.raises(FormatError, match=f"line 2, column 1: .*({message})") as caught:
        load(table(tmp_path, "time,x,y", f"{text},1,2"))
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("second", "message"),
    [
        ("2024-05-01T12:00:01Z", "line 4, column 1: .* has a zone, and the first time has no zone"),
        ("12:00:01", "line 4, column 1: .* is a time of day, and the first time is a moment"),
        ("soon", "line 4, column 1: 'soon' is no time stamp"),
        ("14.5", "line 4, column 1: '14.5' is no time stamp"),
        ("2024-05-01T12:00:0\u0661", "line 4, column 1: .* is no time stamp"),
    ],
)
def test_a_time_unlike_the_first(tmp_path: Path, second: str, message: str) -> None:
    rows = ("2024-05-01T12:00:00,1,2", "", f"{second},1,3")
    with pytest.raises(FormatError, match=message):
        load(table(tmp_path, "time,x,y", *rows))


def test_a_date_with_a_time_beside_a_time(tmp_path: Path) -> None:
    rows = ("2024-05-01,12:00:00,1,2", "2024-05-01T01:00,12:00:01,1,3")
    with pytest.raises(FormatError, match=r"line 3.*has a time itself"):
        load(table(tmp_path, "date,time,x,y", *rows))
