"""A study says how a recording is read, and options go over it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import driftwalk as dw
from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.conditions import block_attributes, load_with_study, reading, study_for
from driftwalk.core.errors import InputError
from driftwalk.model import Study, Tank, apply_overrides
from driftwalk.schema import build_trajectory
from driftwalk.schema.stores.netcdf import netcdf_bytes


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return the arguments that the loader is called with."""
    seen: dict[str, Any] = {}

    def load(path: Path, **arguments: Any) -> Any:
        seen.update(arguments, path=path)
        return build_trajectory([0.0, 1.0], [0.0, 1.0], [0.0, 1.0])

    monkeypatch.setattr(reading, "load", load)
    return seen


def test_study_stands_in_for_options_that_are_not_given(asked: dict[str, Any]) -> None:
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
    load_with_study(Path("a.csv"), study, RecordingOptions(body="b", fps=50.0).arguments())
    assert (asked["path"], asked["body"], asked["frame_rate"]) == (Path("a.csv"), "b", 50.0)
    assert (asked["format"], asked["start"], asked["sort"]) == ("table", 1.0, "sort")
    assert asked["columns"] == {"x": "2", "y": "py:mm"}
    assert (asked["x"], asked["tank"], asked["block"]) == ("x.csv", "circle:0.3", None)
    load_with_study(Path("a.csv"), study, RecordingOptions(tank="fit").arguments())
    assert (asked["tank"], asked["block"]) == ("fit", 0.03)


def test_a_start_of_zero_goes_over_that_of_the_study(asked: dict[str, Any]) -> None:
    study = Study(recording={"start_s": 5.0, "delimiter": ";"})
    how = RecordingOptions(start=0.0, delimiter="tab", columns=["t=1,x=2", "y=3"], sort=True)
    load_with_study(Path("a.csv"), study, how.arguments())
    assert (asked["start"], asked["delimiter"], asked["sort"]) == (0.0, "tab", "sort")
    assert asked["columns"] == {"t": "1", "x": "2", "y": "3"}


def test_recording_is_read_as_the_study_says(tmp_path: Path) -> None:
    path = tmp_path / "synthetic.csv"
    rows = [f"{k}\t{10 * k}\t{20 * k}" for k in range(10)]
    path.write_text("\n".join(["n\ta\tb", *rows]) + "\n", encoding="utf-8")
    triangle = ((-1.0, -1.0), (2.0, -1.0), (0.0, 2.0))
    study = Study(
        tank={"shape": "polygon", "vertices_m": triangle},
        recording={
            "columns": {"frame": "n", "x": "a", "y": "b"},
            "delimiter": "tab",
            "frame_rate_Hz": 10,
            "metres_per_pixel": "1mm",
            "length_unit": "px",
            "y_axis": "up",
        },
    )
    trajectory = load_with_study(path, study)
    assert trajectory["time"].values.tolist() == [k / 10 for k in range(10)]
    assert trajectory["x"].values[:, 0].tolist() == [0.01 * k for k in range(10)]
    assert trajectory["y"].values[-1, 0] == 0.18
    assert Tank.from_arena(json.loads(trajectory.attrs["arena"])) == study.tank


BODIES = ("square", "disc:4cm", "rectangle:4x2cm", "xx")


@pytest.mark.parametrize("shape", BODIES)
def test_a_recording_states_all_that_was_stated_of_its_body(shape: str) -> None:
    stated = apply_overrides(Study(), {"block.shape": shape, "block.mass_kg": "24g"})
    recording = build_trajectory([0.0, 1.0], [0.0, 0.01], [0.0, 0.01])
    recording.attrs.update(block_attributes(stated))
    assert study_for([recording]).block == stated.block


@pytest.mark.parametrize("shape", BODIES[1:3])
def test_a_simulation_states_its_body(shape: str, tmp_path: Path) -> None:
    stated = apply_overrides(
        Study(simulation={"duration_s": 1.0}),
        {"block.shape": shape, "block.mass_kg": "24g", "block.depth_m": "1cm"},
    )
    file = tmp_path / "simulated.nc"
    file.write_bytes(netcdf_bytes(dw.simulate(stated, dw.uniform_flow(0.0, 0.0))))
    recording = dw.load(file)
    assert study_for([recording]).block == stated.block
    with pytest.raises(InputError, match=r"of a block of mass 0\.024 kg, and the study says 0\.03"):
        study_for([recording], Study(block={"mass_kg": 0.03}))
