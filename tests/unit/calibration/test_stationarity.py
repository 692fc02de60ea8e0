"""Whether a recording moves in its second half as in its first."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.calibration.problem import Problem, prepare_problem
from driftwalk.calibration.stationarity import (
    STATIONARITY,
    stationarity_of,
    stationarity_of_motion,
    unsteady_motion,
)
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


def motion_of(speed: np.ndarray, *, interval: float, duration: float) -> Any:
    """Return a recording whose steps have these speeds [m/s], evenly spread over a duration."""
    turn = np.random.default_rng(2).normal(0.0, 0.3, speed.size)
    time = duration * (np.arange(speed.size) + 0.5) / speed.size
    steps = SimpleNamespace(points=np.column_stack([speed * interval, turn]), time=time)
    plan = SimpleNamespace(short=SimpleNamespace(step_interval=interval))
    return SimpleNamespace(steps=steps, plan=plan, duration=duration)


def test_when_the_speed_changed_is_said() -> None:
    """From 8 to 5 mm/s after 0.45 of 200 s; the speeds scatter by a tenth.

    A mean of 450 such speeds is off by 0.05 mm/s, so that a split next to the right one wins by
    chance in no seed.
    """
    random = np.random.default_rng(1)
    speed = np.where(np.arange(1000) < 450, 8e-3, 5e-3) * random.normal(1.0, 0.1, 1000)
    motion = motion_of(speed, interval=0.2, duration=200.0)
    (said,) = unsteady_motion(motion)
    found = stationarity_of_motion(motion)
    assert found is not None
    assert said.startswith(str(found.warning))
    first, last = (1e3 * part.mean() for part in (speed[:450], speed[450:]))
    assert said.endswith(
        f"; the mean speed changed most at 90 s, from {first:.3g} to {last:.3g} mm/s"
    )
    half = motion.steps.points[:500], motion.steps.points[500:]
    assert found.distance == pytest.approx(ks_distance(*half))


def test_nothing_is_said_of_a_steady_or_a_short_recording() -> None:
    speed = 8e-3 * np.random.default_rng(3).normal(1.0, 0.1, 1000)
    assert unsteady_motion(motion_of(speed, interval=0.2, duration=200.0)) == []
    changed = np.where(np.arange(199) < 100, 8e-3, 2e-3)
    assert unsteady_motion(motion_of(changed, interval=0.2, duration=40.0)) == []


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
