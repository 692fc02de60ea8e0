"""Which tank a calibration takes: what is said, else what the file holds, else the default."""

from __future__ import annotations

import json

import driftwalk as dw
from driftwalk.cli.inputs.study_recording import load_for_run
from driftwalk.cli.options.recording import RecordingOptions
from driftwalk.conditions.tank import study_in_arena
from driftwalk.record import save_trajectory


def stored(tmp_path, arena=None):
    recording = dw.tank30_recording().isel(time=slice(0, 50))
    recording.attrs.pop("arena")
    if arena is not None:
        recording.attrs["arena"] = json.dumps(arena)
    return save_trajectory(recording, tmp_path / "recording.nc")


def tank_of(path, tank):
    loaded = load_for_run(path, dw.Study(), RecordingOptions(), tank=tank)
    return study_in_arena(dw.Study(), loaded.trajectory).tank.diameter_m, loaded.has_tank


def test_the_arena_of_the_file_is_taken_where_nobody_says_another(tmp_path):
    path = stored(tmp_path, {"shape": "circle", "diameter_m": 0.4, "center_m": [0.0, 0.0]})
    assert tank_of(path, "unsaid") == (0.4, True)


def test_what_is_said_goes_over_the_arena_of_the_file(tmp_path):
    path = stored(tmp_path, {"shape": "circle", "diameter_m": 0.4, "center_m": [0.0, 0.0]})
    assert tank_of(path, "stated") == (0.3, True)


def test_a_file_without_an_arena_has_the_default_tank(tmp_path):
    assert tank_of(stored(tmp_path), "unsaid") == (0.3, False)


def test_the_arena_of_the_file_is_known_even_where_it_equals_the_default(tmp_path):
    path = stored(tmp_path, {"shape": "circle", "diameter_m": 0.3, "center_m": [0.0, 0.0]})
    assert tank_of(path, "unsaid") == (0.3, True)
