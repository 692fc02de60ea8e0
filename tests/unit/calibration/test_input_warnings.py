"""A recording at a wall of which nobody said how it is gets a warning from its calibration."""

from __future__ import annotations

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.calibration.warnings import WALL_WARNING, wall_warning
from driftwalk.schema import Track, build_trajectory

TOUCHING_M = 0.15 - 0.015 * np.sqrt(2.0) - WALL_WARNING.reach_m
"""From the centre of the default tank: beyond, a corner of the block may be at the wall."""


def track(share: float, count: int = 1000) -> Track:
    """Return a body whose corner may be at the wall in a share of the samples."""
    near = np.arange(count) < share * count
    x = np.where(near, TOUCHING_M + 1e-4, TOUCHING_M - 1e-4)
    return Track(0.1 * np.arange(count), x, np.zeros(count), np.zeros(count))


def test_it_says_how_often_and_what_was_taken() -> None:
    found = wall_warning(track(0.25), dw.Study())
    assert found is not None
    assert "in 25 % of the samples" in found
    assert "restitution 0.5, friction 0" in found
    assert wall_warning(track(WALL_WARNING.notable_share), dw.Study()) is None


@pytest.mark.parametrize("stated", [{"tank.wall_friction": 1.0}, {"tank.wall_restitution": 0.2}])
def test_a_wall_that_was_stated_needs_no_warning(stated: dict[str, float]) -> None:
    assert wall_warning(track(0.25), dw.apply_overrides(dw.Study(), stated)) is None


def test_a_calibration_carries_the_warning() -> None:
    """Synthetic: water that pushes the block against the wall."""
    water = dw.uniform_flow(0.05, 0.0)
    small = {
        "calibration.drag_coefficient_min": 0.3,
        "calibration.drag_coefficient_max": 0.5,
        "calibration.drag_coefficient_step": 0.2,
        "calibration.force_std_min_N": 4e-4,
        "calibration.force_std_max_N": 8e-4,
        "calibration.force_std_step_N": 4e-4,
        "calibration.replicates": 1,
        "calibration.refine": "none",
    }
    study = dw.apply_overrides(dw.Study(), small)
    run = dw.simulate(study, water, sample_time=0.1 * np.arange(400), replicates=1, seed=1)
    pose = (run[name].values[0, :, 0].astype(float) for name in ("x", "y", "theta"))
    recording = build_trajectory(run["time"], *pose)
    found = dw.calibrate(recording, study, flow=water)
    assert any("may touch the wall" in text for text in found["warning"].values.tolist())
