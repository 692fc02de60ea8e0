"""A study says how a recording is read, and options go over it."""

from __future__ import annotations

import json
from pathlib import Path

from driftwalk.cli.inputs.study_recording import completed, load_with_study
from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.model import Study, Tank


def test_study_stands_in_for_options_that_are_not_given() -> None:
    study = Study(
        recording={
            "format": "table",
            "body": "a",
            "start_s": 1.0,
            "sort": "sort",
            "columns": {"x": 2, "y": "py:mm"},
            "x_file": "x.csv",
            "frame_rate_Hz": 25,
        }
    )
    how = completed(RecordingOptions(body="b", frame_rate=50.0), study)
    assert how.body == "b"
    assert how.frame_rate == 50.0
    assert (how.format, how.start, how.sort) == ("table", 1.0, True)
    assert how.columns == ["x=2", "y=py:mm"]
    assert how.x == Path("x.csv")
    assert how.arena == "circle:0.3"
    assert completed(RecordingOptions(arena="fit"), study).arena == "fit"


def test_recording_is_read_as_the_study_says(tmp_path: Path) -> None:
    path = tmp_path / "synthetic.csv"
    rows = [f"{k},{10 * k},{20 * k}" for k in range(10)]
    path.write_text("\n".join(["n,a,b", *rows]) + "\n", encoding="utf-8")
    triangle = ((-1.0, -1.0), (2.0, -1.0), (0.0, 2.0))
    study = Study(
        tank={"shape": "polygon", "vertices_m": triangle},
        recording={
            "columns": {"frame": "n", "x": "a", "y": "b"},
            "frame_rate_Hz": 10,
            "metres_per_pixel": "1mm",
            "length_unit": "px",
            "y_axis": "up",
        },
    )
    trajectory = load_with_study(path, study, RecordingOptions())
    assert trajectory["time"].values.tolist() == [k / 10 for k in range(10)]
    assert trajectory["x"].values[:, 0].tolist() == [0.01 * k for k in range(10)]
    assert trajectory["y"].values[-1, 0] == 0.18
    assert Tank.from_arena(json.loads(trajectory.attrs["arena"])) == study.tank
