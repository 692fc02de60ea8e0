"""A short round of the fuzzer of readers, and what longer rounds found: each mistake once."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
import space_files
from command_line import here, refusal
from scipy.io import savemat

import driftwalk as dw
from driftwalk.core.errors import FormatError, InputError
from driftwalk.record.tables.in_memory import as_numbers

PIXELS = ("--scale", "0.001")


@pytest.mark.slow
def test_a_short_round_finds_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    from loader_run import fuzz_loaders

    tally = fuzz_loaders(tmp_path, seed=1, cases=range(120))
    assert not tally.findings, tally.findings
    # Both happen: damage that is read all the same, and damage that is refused.
    assert tally.ends["read"] > 10
    assert tally.ends["refused"] > 30
    # What is done is not run again.
    again = fuzz_loaders(tmp_path, seed=1, cases=range(120))
    assert again.ends == tally.ends


def table(path: Path, *, row: str = "") -> Path:
    rows = [f"{0.1 * k:.1f},{0.1 * np.cos(k):.5f},{0.1 * np.sin(k):.5f},{k}" for k in range(20)]
    path.write_text("\n".join(["t_s,x_m,y_m,theta_rad", *rows, row, ""]), encoding="utf-8")
    return path


@pytest.mark.parametrize("clock", ["1e999", "-1e999"])
def test_an_infinite_time_is_none(tmp_path: Path, clock: str) -> None:
    recording = dw.load(table(tmp_path / "a.csv", row=f"{clock},0.1,0.1,0"))
    assert recording.sizes["time"] == 20
    assert recording["time"].values[-1] == pytest.approx(1.9)


@pytest.mark.parametrize(
    ("row", "what"),
    [
        ("2.0,1e300,0,0", "1e+300 as x"),
        ("2.0,0,-2e12,0", "-2e+12 as y"),
        ("2.0,0,0,1e13", "1e+13 as angle"),
    ],
)
def test_what_is_no_position_is_refused(tmp_path: Path, row: str, what: str) -> None:
    path = table(tmp_path / "a.csv", row=row)
    with pytest.raises(InputError, match="which cannot be one") as caught:
        dw.load(path)
    assert what in str(caught.value)
    assert "a.csv" in str(caught.value)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        ("[" * 3000, r"metadata\.yaml: holds values nested more than 64"),
        # Its reader would take seconds.
        ("1" * 300_000, r"metadata\.yaml: is larger than 0\.25 MiB"),
    ],
    ids=["deep brackets", "too long"],
)
def test_a_damaged_description_is_refused(tmp_path: Path, damage: str, said: str) -> None:
    pytest.importorskip("rosbags")
    bag = tmp_path / "bag"
    space_files.write_bag(bag, mcap=False)
    description = bag / "metadata.yaml"
    whole = description.read_text()
    assert dw.load(bag).sizes["body"] == 2
    description.write_text(whole.replace("nanoseconds: 1900000000", f"nanoseconds: {damage}"))
    with pytest.raises(FormatError, match=said):
        dw.load(bag)


def test_xml_in_an_encoding_that_nobody_knows_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    path.write_text('<?xml version="1.0" encoding="UTF-NaN"?>\n<TrackMate version="7"></TrackMate>')
    assert "a.xml, line 1: is damaged XML: unknown encoding" in refusal(here("info", path))


def test_messages_about_options_name_the_file(tmp_path: Path) -> None:
    path = table(tmp_path / "one.csv")
    assert "one.csv: --frame-interval" in refusal(here("info", path, "--frame-interval", "10ms"))
    two = tmp_path / "two.csv"
    rows = [f"{0.1 * k:.1f},{0.01 * k},0.02,{name}" for k in range(9) for name in "ab"]
    two.write_text("\n".join(["t_s,x_m,y_m,id", *rows, ""]))
    said = refusal(here("flow", two, "--out", tmp_path / "o.nc", "--tank", "30cm"))
    assert "two.csv has 2 bodies: --tracers makes one flow" in said


def test_skipping_more_lines_than_there_are_ends(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rows = [f"{0.1 * k:.1f},{0.2 * k:.1f},0.1,a" for k in range(9)]
    path.write_text("\n".join(["v2,9999999999999999999", "walk,,2", "1,1,1", "", "", "tag", *rows]))
    assert "a.csv" in refusal(here("info", path, "--length-unit", "m"))


def test_a_quaternion_too_small_to_be_squared_is_none(tmp_path: Path) -> None:
    path = tmp_path / "trajectory.txt"
    rows = [f"{0.1 * k} {0.1 * k} 0.2 0 0 0 0 {'1e-320' if k == 3 else 1}" for k in range(9)]
    path.write_text("\n".join(["# timestamp tx ty tz qx qy qz qw", *rows, ""]))
    theta = dw.load(path)["theta"].values.ravel()
    assert np.flatnonzero(np.isnan(theta)).tolist() == [3]


def test_a_line_that_is_quoted_stays_on_one_line(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_bytes(b"$FRAMENUMBER,0\r$PARTICLE,4\r$FRAMENUMBER,1\n$PARTICLE,4,1,2,0,1,2\n")
    with pytest.raises(FormatError, match="cannot read") as caught:
        dw.load(path, frame_rate=10, metres_per_pixel=0.001)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.slow
def test_a_table_of_many_tracks_is_no_flow_field_at_once(tmp_path: Path) -> None:
    path = tmp_path / "tracking.txt"
    rows = [f"39\t{k}\t1\t39.0\t92.9\t1\n" for k in range(40_000)]
    path.write_text("0\t0\t1\t1\t0\t1\n1\t0\t1\t1\t5\t1\n" + "".join(rows))
    begin = time.process_time()
    assert "bodies" in refusal(here("info", path, "--fps", "10", *PIXELS))
    assert time.process_time() - begin < 10.0


def test_a_clock_with_a_nan_that_signals_is_read(tmp_path: Path) -> None:
    clock = 0.1 * np.arange(20)
    clock[7:8] = np.frombuffer(bytes.fromhex("010000000000f07f"))
    path = tmp_path / "a.mat"
    savemat(path, {"S": {"t": clock, "x": 0.02 * np.arange(20), "y": 0.01 * np.arange(20)}})
    assert dw.load(path).sizes["time"] == 19


def test_times_too_near_for_a_speed_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t_s,x_m,y_m\n0,0,0\n1e-320,5,0\n")
    assert "two times of body '0' are 1e-320 s apart, at 0 s" in refusal(here("info", path))
    path.write_text("t_s,x_m,y_m\n0,0,0\n1e-12,5,0\n")
    assert here("info", path).code == 0


def test_a_position_beyond_float64_is_a_gap(tmp_path: Path) -> None:
    path = tmp_path / "tracks.csv"
    head = (
        '\'list(Global=c(Date="2013"),Areas=matrix(c(200,190,407,252),4,1,dimname=list(c("W","H","X",'
        '"Y"),c("05"))))\'\nArea,Territory,X,Y,time,L\n'
    )
    rows = [f"05,255,{'1e308' if k == 3 else 0.5},0.{k},{100 * k},-11" for k in range(9)]
    path.write_text(head + "\n".join(rows) + "\n")
    x = dw.load(path, metres_per_pixel=0.001)["x"].values.ravel()
    assert np.flatnonzero(np.isnan(x)).tolist() == [3]


def test_a_long_text_among_time_stamps_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    moments = [f"2024-05-01T12:00:{k:02d}.25Z,{k}.5,{k}" for k in range(20)]
    path.write_text("\n".join(["time,x,y", *moments, "9" * 300 + ",1,2", ""]))
    assert "line 22, column 1: '9999" in refusal(here("info", path, "--length-unit", "m"))


@pytest.mark.parametrize("other", [1.5, "2.5"])
def test_a_whole_number_beyond_float64_is_a_gap(other: float | str) -> None:
    values = np.array([1, 10**400, -(10**400), other], dtype=object)
    assert as_numbers(values, "x").tolist() == [1.0, np.inf, -np.inf, float(other)]


def test_a_name_with_a_long_run_of_blanks_is_read_at_once(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv")
    path.write_text(path.read_text().replace("theta_rad", f"a{' ' * 40_000}b"))
    begin = time.process_time()
    assert dw.load(path).sizes["time"] == 20
    assert time.process_time() - begin < 2.0


def test_many_names_of_tracks_are_read_at_once(tmp_path: Path) -> None:
    rows = "".join(f"0:{k // 60:02}:{k % 60:02}:00 {k} 2\n" for k in range(3000))
    text = "#Kinovea Trajectory data export\n#T X Y\n# Label\n" + rows + 30_000 * "# Label\n"
    (tmp_path / "a.txt").write_text(text + "0:00:00:00 1 2\n0:00:01:00 3 4\n")
    begin = time.process_time()
    recording = dw.load(tmp_path / "a.txt", length_unit="mm")
    assert time.process_time() - begin < 1.0
    assert list(recording["body"].values) == ["Label", "Label 2"]
