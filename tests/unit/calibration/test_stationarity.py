"""Whether a recording moves in its second half as in its first."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.calibration.problem import Problem, prepare_problem
from driftwalk.calibration.stationarity import STATIONARITY, stationarity_of
from driftwalk.comparison.ks import ks_distance
from driftwalk.conditions import load_with_study, recorded_camera
from driftwalk.schema import Track, body_track

STUDIES = Path(__file__).resolve().parents[3] / "studies" / "real"


def problem_of(track: Track, study: dw.Study | None = None) -> Problem:
    chosen = dw.Study() if study is None else study
    camera = recorded_camera(track, chosen, position_quantum=0.0)
    return prepare_problem(track, chosen, dw.uniform_flow(0.0, 0.0), camera=camera)


def walk(speed: np.ndarray, seed: int) -> Track:
    """Return a walk with given mean steps [m], whose direction forgets slowly."""
    random = np.random.default_rng(seed)
    heading = np.cumsum(random.normal(0.0, 0.3, speed.size))
    step = speed * random.gamma(4.0, 0.25, speed.size)
    x, y = (np.cumsum(step * part) for part in (np.cos(heading), np.sin(heading)))
    return Track(0.1 * np.arange(speed.size), x, y, heading)


@pytest.mark.slow
def test_a_steady_walk_gets_no_warning() -> None:
    """Each of 40 walks has p = 1/200 once in 200; two and more of them once in 60 seeds."""
    found = [stationarity_of(problem_of(walk(np.full(1000, 2e-3), seed))) for seed in range(40)]
    p_values = np.array([one.p_value for one in found if one is not None])
    assert p_values.size == 40
    assert np.count_nonzero(p_values <= STATIONARITY.level) <= 1
    # Uniform between 1/200 and 1: the mean of 40 has sd 0.046, of which 4 are allowed.
    assert abs(p_values.mean() - 0.5) < 0.19


def test_a_walk_that_slows_down_is_not_steady() -> None:
    speed = np.where(np.arange(1000) < 500, 2e-3, 1.6e-3)
    problem = problem_of(walk(speed, 1))
    found = stationarity_of(problem)
    assert found is not None
    assert found.p_value == 1.0 / (1 + STATIONARITY.permutations)
    assert found.distance > 1.5 * found.expected
    assert found.warning is not None
    assert f"D = {found.distance:.3f} between the recording's own two halves" in found.warning
    # The distance is that of the two halves themselves, by the plain function.
    steps = problem.steps
    middle = (len(steps) + 1) // 2
    assert found.distance == ks_distance(steps[:middle], steps[middle:])


def test_a_short_recording_says_nothing() -> None:
    short = problem_of(walk(np.full(STATIONARITY.fewest_pairs, 2e-3), 1))
    assert len(short.steps) < STATIONARITY.fewest_pairs
    assert stationarity_of(short) is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "file", "steady"),
    [
        ("hexbug", "hexbug-gatech/training_video1-centroid_data", False),
        ("termite", "tracktor-mouse-termite/termite_video_tracked.csv", True),
    ],
)
def test_real_recordings(
    name: str, file: str, steady: bool, shared_data: Callable[[str], Path]
) -> None:
    folder, _, rest = file.partition("/")
    study = dw.load_study(STUDIES / f"{name}.toml")
    recording = load_with_study(shared_data(folder) / rest, study)
    found = stationarity_of(problem_of(body_track(recording, study.recording.body), study))
    assert found is not None
    assert (found.warning is None) == steady
