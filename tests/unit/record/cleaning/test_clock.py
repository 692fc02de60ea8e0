"""A clock without a unit: refused where its numbers cannot be seconds, and never converted."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from driftwalk.cli.main import main
from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_track

UNIX_NS = 1_403_636_579_763_555_584


def write(folder: Path, name: str, times: list[object], header: str = "") -> Path:
    path = folder / "synthetic.csv"
    rows = [f"{t},{0.1 * np.cos(i / 9):.5f},{0.1 * np.sin(i / 9):.5f}" for i, t in enumerate(times)]
    path.write_text("\n".join([header or f"{name},x_m,y_m", *rows, ""]))
    return path


REFUSED = {
    # name: (times, units that the error offers)
    "ns since 1970": ([UNIX_NS + 5_000_000 * i for i in range(50)], ["ns"]),
    "us since 1970": ([1_700_000_000_000_000 + 33_333 * i for i in range(50)], ["us"]),
    "ms since 1970": ([1_700_000_000_000 + 40 * i for i in range(50)], ["ms"]),
    "ns from zero": ([16_666_667 * i for i in range(50)], ["ns"]),
    "ns from zero, 1 kHz": ([1_000_000 * i for i in range(50)], ["us", "ns"]),
    "us from zero": ([33_333 * i for i in range(50)], ["us"]),
    "one row": ([UNIX_NS], ["ns"]),
    "days": ([739_000 + 0.04 / 86400 * i for i in range(50)], ["h", "d"]),
    "days of a spreadsheet": ([45_413.5 + 0.1 / 86400 * i for i in range(50)], ["h", "d"]),
    "in the order of nothing": ([UNIX_NS + 5_000_000 * (i ^ 1) for i in range(50)], ["ns"]),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_seconds(case: str, tmp_path: Path) -> None:
    times, units = REFUSED[case]
    with pytest.raises(InputError, match="column 'timestamp' names no unit, and as seco") as caught:
        load(write(tmp_path, "timestamp", times))
    offered = re.findall(r"`columns={\"t\": \"timestamp:(\w+)\"}`(?: makes|,)", str(caught.value))
    assert offered == units
    assert str(caught.value).endswith('if it is seconds, `columns={"t": "timestamp:s"}`')


PASS = {
    "the third day": [2 * 86_400 + 0.04 * i for i in range(50)],
    "seconds since 1970": [1_700_000_000 + 0.04 * i for i in range(50)],
    "a frame an hour": [3600 * i for i in range(50)],
    "a frame every six hours": [21_600 * i for i in range(50)],
    "a frame a day, since 1970": [1_700_000_000 + 86_400 * i for i in range(50)],
    "whole seconds": list(range(50)),
    "a gap of a month": [*range(25), *range(2_600_000, 2_600_025)],
}


@pytest.mark.parametrize("case", PASS)
def test_what_can_be_seconds(case: str, tmp_path: Path) -> None:
    times = PASS[case]
    dataset = load(write(tmp_path, "time", times))
    np.testing.assert_allclose(
        body_track(dataset).time, np.array(times) - (times[0] if times[0] > 1e9 else 0), atol=1e-6
    )
    warnings = json.loads(dataset.attrs["counts"])["warnings"]
    assert not any("clock" in warning for warning in warnings)


@pytest.mark.parametrize("step", [17, 33.333, 40, 1000])
def test_what_may_be_milliseconds_is_said_and_not_converted(step: float, tmp_path: Path) -> None:
    dataset = load(write(tmp_path, "time", [step * i for i in range(50)]))
    warning, *_ = json.loads(dataset.attrs["counts"])["warnings"]
    assert warning.endswith('if it is ms, `columns={"t": "time:ms"}`')
    assert body_track(dataset).time[-1] == pytest.approx(step * 49)
    named = load(write(tmp_path, "time", [step * i for i in range(50)]), columns={"t": "time:ms"})
    assert body_track(named).time[-1] == pytest.approx(step * 49 / 1000)
    assert "clock" not in str(json.loads(named.attrs["counts"])["warnings"])


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("header", "columns"),
    [
        ("#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m]", {}),
        ("timestamp,x_m,y_m", {"t": "timestamp:ns"}),
        ("timestamp,x_m,y_m", {"t": "1:ns"}),
        ("%time,x_m,y_m", {"t": "%time:ns"}),
        ("time stamp,x_m,y_m", {"t": "time stamp:ns"}),
        ("timestamp [ns],x_m,y_m", {}),
        ("timestamp_ns,x_m,y_m", {}),
    ],
)
def test_nanoseconds_since_1970_are_kept_to_the_last(
    header: str, columns: dict[str, str], tmp_path: Path
) -> None:
    """Float64 holds them to 256 ns."""
    times = [UNIX_NS + 5_000_000 * i + (7 * i) % 13 for i in range(200)]
    path = write(tmp_path, "", times, header)
    dataset = load(path, columns=columns)
    nanoseconds = body_track(dataset).time * 1e9
    np.testing.assert_allclose(nanoseconds, np.array(times) - times[0], rtol=0, atol=1e-3)
    assert dataset.attrs["time_origin_unix_s"] == pytest.approx(UNIX_NS / 1e9)
    option = [f"{quantity}={name}" for quantity, name in columns.items()]
    words = ["--columns", *option] if option else []
    assert main(["read", str(path), "-o", str(tmp_path / "out.nc"), *words]) == 0


def test_a_far_clock_that_began_with_the_machine_keeps_its_numbers(tmp_path: Path) -> None:
    times = [9_100_000_000_000_000 + 5_000_000 * i for i in range(50)]
    dataset = load(write(tmp_path, "time", times), columns={"t": "time:ns"})
    np.testing.assert_allclose(dataset["time"].values, np.array(times) / 1e9, rtol=1e-15)
    assert "time_origin_unix_s" not in dataset.attrs


def test_a_lost_time_far_into_the_file_moves_no_other(tmp_path: Path) -> None:
    times: list[object] = [UNIX_NS + 5_000_000 * i for i in range(50)]
    times[20] = ""
    dataset = load(write(tmp_path, "timestamp_ns", times))
    np.testing.assert_allclose(
        dataset["time"].values, np.delete(np.arange(50), 20) * 5e-3, atol=300e-9
    )


def test_who_insists_on_seconds_is_taken_at_his_word_and_told(tmp_path: Path) -> None:
    path = write(tmp_path, "timestamp", [33_333 * i for i in range(50_000)])
    dataset = load(path, columns={"t": "timestamp:s"})
    warnings = json.loads(dataset.attrs["counts"])["warnings"]
    assert warnings == ["the recording lasts 1.67e+09 s: is the unit of its clock right?"]


def test_points_in_json_with_nanoseconds(tmp_path: Path) -> None:
    path = tmp_path / "synthetic.json"
    points = [{"x": i / 100, "y": 0.0, "t": UNIX_NS + 5_000_000 * i} for i in range(50)]
    path.write_text(json.dumps(points))
    with pytest.raises(InputError, match="the format has its times in seconds"):
        load(path, length_unit="m")


@pytest.mark.parametrize(
    ("angles", "said"),
    [
        ([(300 + 7 * i) % 360 for i in range(50)], True),
        ([90 + 0.1 * i for i in range(50)], True),
        ([-179, 179, -178, 178], True),
        ([0.2 * i for i in range(500)], False),
        ([(0.2 * i) % (2 * np.pi) for i in range(50)], False),
    ],
)
def test_angles_that_are_hardly_radians(angles: list[float], said: bool, tmp_path: Path) -> None:
    rows = [f"{i},{i / 100},0,{angle}" for i, angle in enumerate(angles)]
    path = tmp_path / "synthetic.csv"
    path.write_text("\n".join(["t,x,y,theta", *rows, ""]))
    warnings = json.loads(load(path).attrs["counts"])["warnings"]
    assert any('`columns={"theta": "NAME:deg"}`' in warning for warning in warnings) == said
    named = load(path, columns={"theta": "theta:deg"})
    assert json.loads(named.attrs["counts"])["warnings"] == []


@pytest.mark.parametrize("header", ["time,x_m,y_m", "t_s,x_m,y_m", "t_ns,x_m,y_m"])
def test_times_that_no_recording_has(header: str, tmp_path: Path) -> None:
    path = write(tmp_path, "", [0.1 * i for i in range(49)] + [1.7e308], header)
    with pytest.raises(InputError, match=r"the times are .* apart: one"):
        load(path)


def test_an_angle_that_is_not_finite_is_none(tmp_path: Path) -> None:
    path = tmp_path / "synthetic.csv"
    path.write_text("t,x,y,theta\n0,1,2,inf\n1,2,3,0.5\n2,3,4,-inf\n")
    np.testing.assert_array_equal(load(path)["theta"].values[:, 0], [np.nan, 0.5, np.nan])
