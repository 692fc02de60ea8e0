"""Which tank and block a run takes: what is said, else the file's, else the default."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import RECORDING

import driftwalk as dw
from driftwalk.cli.inputs.recordings import opening_note
from driftwalk.cli.options.study import StudyOptions
from driftwalk.conditions import read_recordings, unstated_warning
from driftwalk.core.study_keys import FIT_KEYS
from driftwalk.model import Study
from driftwalk.record import save_trajectory


def circle(diameter: float) -> dict[str, Any]:
    return {"shape": "circle", "diameter_m": diameter, "center_m": [0.0, 0.0]}


def stored(folder: Path, arena: dict[str, Any] | None = None, *, named: str = "recording") -> Path:
    recording = dw.tank30_recording().isel(time=slice(0, 50))
    for name in ("arena", "block_side_m", "block_mass_kg"):
        del recording.attrs[name]
    if arena is not None:
        recording.attrs["arena"] = json.dumps(arena)
    return save_trajectory(recording, folder / f"{named}.nc")


def tank_of(path: Path, tank: Any, study: Study | None = None) -> tuple[float | None, bool]:
    read = read_recordings([path], study or dw.Study(), tank=tank)
    return read.study.tank.diameter_m, "diameter_m" in read.study.tank.model_fields_set


def test_the_arena_of_the_file_is_taken_where_nobody_says_another(tmp_path: Path) -> None:
    assert tank_of(stored(tmp_path, circle(0.4)), "unsaid") == (0.4, True)


def test_what_is_said_goes_over_the_arena_of_the_file(tmp_path: Path) -> None:
    path = stored(tmp_path, circle(0.4))
    assert tank_of(path, "stated") == (0.3, False)
    wide = dw.apply_overrides(dw.Study(), {"tank.diameter_m": 0.5})
    assert tank_of(path, "stated", wide) == (0.5, True)


def test_a_file_without_an_arena_has_the_default_tank(tmp_path: Path) -> None:
    assert tank_of(stored(tmp_path), "unsaid") == (0.3, False)


def test_the_arena_of_the_file_is_known_even_where_it_equals_the_default(tmp_path: Path) -> None:
    assert tank_of(stored(tmp_path, circle(0.3)), "unsaid") == (0.3, True)


def test_an_arena_that_is_given_goes_over_the_tank_of_the_study(tmp_path: Path) -> None:
    wide = dw.apply_overrides(
        dw.Study(), {"tank.diameter_m": 0.5, "tank.wall_friction": 0.2, "block.side_m": 0.31}
    )
    read = read_recordings([stored(tmp_path)], wide, {"tank": "circle:45cm"})
    assert (read.study.tank.diameter_m, read.study.tank.wall_friction) == (0.45, 0.2)


@pytest.mark.slow
def test_two_files_that_hold_two_tanks_are_refused(tmp_path: Path) -> None:
    paths = [stored(tmp_path, circle(size), named=f"{size}") for size in (0.4, 0.5)]
    with pytest.raises(dw.InputError, match=r"circle of diameter 0.5 m, and the study says .* 0.4"):
        read_recordings(paths, dw.Study(), tank="unsaid")
    assert read_recordings(paths, dw.Study()).study.tank.diameter_m == 0.3


@pytest.mark.slow
def test_circles_that_are_fitted_to_two_recordings_are_no_contradiction(tmp_path: Path) -> None:
    recording = dw.tank30_recording()
    paths = [
        save_trajectory(recording.isel(time=part), tmp_path / f"{part.start}.nc")
        for part in (slice(0, 9000), slice(9000, 18000))
    ]
    read = read_recordings(paths, dw.Study(), {"tank": "fit"})
    diameters = [json.loads(one.attrs["arena"])["diameter_m"] for one in read.trajectories]
    assert diameters[0] != diameters[1]
    assert read.study.tank.diameter_m == diameters[0]


@pytest.mark.parametrize("call", [dw.fit, dw.calibrate])
def test_a_body_that_never_moves_is_refused_from_python(call: Any) -> None:
    still = dw.tank30_recording().isel(time=slice(0, 200)).copy(deep=True)
    still["x"][:], still["y"][:] = 0.01, 0.02
    name = str(still["body"].values[0])
    words = rf"never moves \('{name}'\): all 200 positions are \(0.01, 0.02\) m"
    with pytest.raises(dw.InputError, match=words):
        call(still)
    with pytest.raises(dw.InputError, match="holds 2 positions in the time that is kept"):
        call(dw.tank30_recording().isel(time=slice(0, 2)))
    empty = still.copy(deep=True)
    empty["x"][:] = np.nan
    with pytest.raises(dw.InputError, match="holds 0 positions"):
        call(empty)


def test_a_run_says_who_stated_its_block_and_its_tank(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "study.toml"
    file.write_text('[block]\nmass_kg = "24g"\ndepth = "archimedes"\n', encoding="utf-8")
    given = StudyOptions(file, {"block.side_m": 0.04}, FIT_KEYS)
    recording = stored(tmp_path, circle(0.4))
    study = read_recordings([recording], given.study(), tank="unsaid").study
    opening_note(study, given, about="block")()
    # Floating, 24 g of water fill 1.5 cm under 16 cm².
    assert capsys.readouterr().err == (
        "driftwalk: tank: circle of diameter 0.4 m (recording); block of side 4 cm (--side); "
        f"mass 24 g ({file}); wetted depth 1.5 cm ({file}); force redrawn every 10 ms (default)\n"
    )
    assert unstated_warning(study, about="block") is None


def test_the_default_side_that_a_fitted_tank_took_is_nobodys_word(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for stated in ({}, {"block.side_m": 0.03}):
        given = StudyOptions(None, {"block.mass_kg": 0.0116, **stated}, FIT_KEYS)
        read = read_recordings([RECORDING], given.study(), {"tank": "fit"})
        opening_note(read.study, given, about="block")()
        said = "--side" if stated else "default"
        assert f"block of side 3 cm ({said})" in capsys.readouterr().err
        warning = unstated_warning(read.study, about="block")
        assert (warning is None) == bool(stated)
        assert stated or "the side was not stated" in str(warning)
        assert read.study.tank.diameter_m == pytest.approx(0.3, rel=0.05)


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        (
            {},
            "mass, side and tank were not stated: the defaults, 11.6 g, 3 cm and a circle of "
            "diameter 0.3 m, are assumed",
        ),
        (
            {"block.side_m": 0.03, "tank.diameter_m": 0.3},
            "mass was not stated: the default, 11.6 g, is assumed",
        ),
        (
            {"block.side_m": 0.03, "block.mass_kg": 0.0116},
            "tank was not stated: the default, a circle of",
        ),
    ],
)
def test_a_default_that_decides_a_number_is_warned_of(stated: dict[str, float], said: str) -> None:
    warning = unstated_warning(dw.apply_overrides(dw.Study(), stated), about="block")
    assert warning is not None
    assert warning.startswith(f"the {said}")


def test_a_recording_may_state_its_block(tmp_path: Path) -> None:
    recording = dw.tank30_recording()
    study = dw.conditions.study_for([recording])
    assert unstated_warning(study, about="block") is None
    heavy = dw.apply_overrides(dw.Study(), {"block.mass_kg": 0.02})
    with pytest.raises(dw.InputError, match=r"mass 0.0116 kg, and the study says 0.02 kg"):
        dw.conditions.study_for([recording], heavy)


@pytest.mark.parametrize(
    ("recorded", "stated", "said"),
    [
        ("0.02", {"depth": "immersed"}, "depth 0.02 m, and the study says immersed: state"),
        ("immersed", {"depth_m": 0.02}, "depth immersed, and the study says 0.02 m: state"),
    ],
)
def test_a_depth_is_stated_by_either_of_two_keys(
    recorded: str, stated: dict[str, Any], said: str
) -> None:
    name = "block_depth" if recorded == "immersed" else "block_depth_m"
    value = recorded if recorded == "immersed" else float(recorded)
    recording = dw.tank30_recording().assign_attrs({name: value})
    study = dw.apply_overrides(dw.Study(), {f"block.{k}": v for k, v in stated.items()})
    with pytest.raises(dw.InputError, match=said):
        dw.conditions.study_for([recording], study)
