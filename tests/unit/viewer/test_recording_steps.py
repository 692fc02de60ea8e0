"""What a page shows of a recording while it is calibrated is what the calibration will hold."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import driftwalk as dw
from driftwalk.model import Study
from driftwalk.schema import build_trajectory
from driftwalk.viewer.watch.recording_steps import recorded_steps

ONE_SETTING = {
    "calibration.drag_coefficient_min": 0.4,
    "calibration.drag_coefficient_max": 0.4,
    "calibration.force_std_min_N": 5e-4,
    "calibration.force_std_max_N": 5e-4,
    "calibration.replicates": 1,
    "calibration.refine": "none",
    "calibration.bootstrap": 0,
}


def with_gaps() -> xr.Dataset:
    """Return a recording that was interrupted twice in its first half minute."""
    whole = dw.tank30_recording()
    time = whole["time"].values
    return whole.isel(time=~(((time > 5) & (time < 9)) | ((time > 20) & (time < 21))))


def straight() -> xr.Dataset:
    """Return a recording without any turn: the angles' bins cannot follow from it."""
    time = 0.1 * np.arange(200)
    return build_trajectory(time, 0.05 * np.sin(time / 10), 0 * time, 0 * time)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("recording", "change"),
    [
        (dw.tank30_recording, {}),
        (dw.tank30_recording, {"steps.step_interval_s": 0.2}),
        (with_gaps, {}),
        (with_gaps, {"observation.gaps": "none"}),
        (straight, {}),
    ],
)
def test_steps_bins_and_excerpt_are_those_of_the_calibration(
    recording: Any, change: dict[str, Any]
) -> None:
    study = dw.apply_overrides(Study(), {**ONE_SETTING, **change})
    track, flow = recording(), dw.tank30_flow()
    shown = recorded_steps(track, study)
    found = dw.calibrate(track, study, flow=flow, threads=1)
    np.testing.assert_array_equal(shown.points[:, 0], found["recording_step_length"].values)
    np.testing.assert_array_equal(shown.points[:, 1], found["recording_turning_angle"].values)
    np.testing.assert_array_equal(shown.length_edge, found["step_length_edge"].values)
    np.testing.assert_array_equal(shown.angle_edge, found["turning_angle_edge"].values)
    np.testing.assert_allclose(
        shown.density(), found["recording_step_density"].values, rtol=1e-6, atol=1e-12
    )
    np.testing.assert_array_equal(shown.excerpt_time, found["excerpt_time"].values)
