"""Every real file of motion capture, robots and PIV is read, or refused with what to do."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from command_line import here, refusal

PIXELS = ("--scale", "0.1mm")
SHIFTS = (*PIXELS, "--frame-interval", "10ms")
UNITS = "does not name its units: give --scale and --frame-interval"
NAMES = "u=velocity_n,v=velocity_s,x=grid_n,y=grid_z"

# File, options, and what info says of it: parts of a refusal, or facts.
Expected = str | dict[str, Any]
FILES: list[tuple[str, tuple[str, ...], Expected]] = [
    (
        *("format-optitrack/1blackTake 2024-04-10 03.24.49 PM.csv", ()),
        {"format": "optitrack", "bodies": ["Rigid Body 1"], "samples": 2166, "rate": 120.0},
    ),
    (
        *("format-vicon/QBii_Square_2m_cw.csv", ()),
        {"format": "vicon", "bodies": ["QBii"], "samples": 3594, "rate": 100.0},
    ),
    *(
        (
            *(f"formats-2/{name}", ()),
            {"format": "ros", "bodies": ["block/pose"], "samples": 600, "rate": 10.0},
        )
        for name in (
            "ros2_pose_sqlite3",
            "ros2_pose_sqlite3/ros2_pose_sqlite3.db3",
            "ros2_pose_mcap",
            "ros2_pose_mcap/ros2_pose_mcap.mcap",
        )
    ),
    ("formats-2/davis_B00001.txt", (), {"columns": 64, "rows": 64, "measured": 0.382324}),
    ("formats-2/insight_pixels.vec", (), "positions are in pixels: give --scale"),
    ("formats-2/insight_pixels.vec", PIXELS, {"columns": 41, "rows": 43, "measured": 0.870108}),
    (
        *("formats-2/piv_named_otherwise.nc", ()),
        "name its variables with --flow-variables u=NAME,v=NAME,x=NAME,y=NAME",
    ),
    (
        *("formats-2/piv_named_otherwise.nc", ("--flow-variables", NAMES, *SHIFTS)),
        {"columns": 40, "rows": 32, "measured": 1.0},
    ),
    ("piv-pivpy/OpenPIVtxtFilePair0.txt", (), UNITS),
    (
        "piv-pivpy/OpenPIVtxtFilePair0.txt",
        SHIFTS,
        {"columns": 79, "rows": 63, "measured": 0.504521},
    ),
    ("piv-pivpy/OpenPIVtxtFilePair1.txt", (), UNITS),
    (
        "piv-pivpy/OpenPIVtxtFilePair1.txt",
        SHIFTS,
        {"columns": 79, "rows": 63, "measured": 0.504521},
    ),
    ("piv-pivpy/PIVchallengeCaseBvelField.txt", (), UNITS),
    (
        *("piv-pivpy/PIVchallengeCaseBvelField.txt", SHIFTS),
        {"columns": 31, "rows": 31, "measured": 1.0},
    ),
    ("piv-pivpy/exp1_001_b.txt", (), UNITS),
    ("piv-pivpy/exp1_001_b.txt", SHIFTS, {"columns": 30, "rows": 22, "measured": 1.0}),
    (
        *("piv-pivpy/Run000001.T000.D000.P000.H001.L.vec", ()),
        {"columns": 63, "rows": 63, "measured": 0.911061},
    ),
    (
        *("piv-pivpy/Run000002.T000.D000.P000.H001.L.vec", ()),
        {"columns": 63, "rows": 63, "measured": 0.909549},
    ),
    ("piv-pivpy/test_pivlab.mat", (), "positions are in pixels: give --scale"),
    ("piv-pivpy/test_pivlab.mat", SHIFTS, {"columns": 10, "rows": 8, "measured": 0.9875}),
]
NO_DATA = {"PROVENANCE.md", "LICENSE", "CREDIT.txt", "metadata.yaml"}
TRACKERS = ("movement_", "sleap_", "trackmate_", "trackpy_", "traja_")
"""Beginnings of the names of tracking programs' files, which have tests of their own."""


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize(("name", "options", "expected"), FILES)
def test_a_real_file(
    shared_data: Callable[[str], Path], name: str, options: tuple[str, ...], expected: Expected
) -> None:
    folder, _, rest = name.partition("/")
    done = here("info", shared_data(folder) / rest, *options, "--json")
    if isinstance(expected, str):
        assert expected in refusal(done)
        return
    assert done.code == 0, done.err
    found = json.loads(done.out)
    if "format" in expected:
        (body,) = found["bodies"].values()
        assert found["format"] == expected["format"]
        assert list(found["bodies"]) == expected["bodies"]
        assert body["samples"] == expected["samples"]
        assert body["rate_Hz"] == pytest.approx(expected["rate"], rel=1e-4)
        assert body["has_orientation"]
    else:
        assert (found["columns"], found["rows"]) == (expected["columns"], expected["rows"])
        assert found["measured_share"] == pytest.approx(expected["measured"], abs=1e-6)


@pytest.mark.parametrize("folder", ["format-optitrack", "format-vicon", "formats-2", "piv-pivpy"])
def test_no_real_file_is_left_out(shared_data: Callable[[str], Path], folder: str) -> None:
    root = shared_data(folder)
    files = {str(path.relative_to(root)) for path in root.rglob("*") if path.is_file()}
    own = {name for name in files if Path(name).name not in NO_DATA}
    own -= {name for name in own if Path(name).name.startswith(TRACKERS)}
    assert own - {name.partition("/")[2] for name, *_ in FILES if name.startswith(folder)} == set()
