"""The check of a flow that grows: it passes where the fit has found it, and fails where not.

The recordings are made by Euler and Maruyama's scheme, without code of driftwalk.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from euler_blocks import (
    DEPTH_M,
    FORCE_INTERVAL_S,
    MASS_KG,
    SIDE_M,
    euler_recordings,
    stirred,
)

import driftwalk as dw
from driftwalk.likelihood.check import replicates
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.spline import Spline
from driftwalk.model import Study, apply_overrides

SECONDS = 300.0


def study(flow_strength: str) -> Study:
    return apply_overrides(
        Study(),
        {
            "tank.diameter_m": 0.32,
            "block.side_m": SIDE_M,
            "block.mass_kg": MASS_KG,
            "block.depth_m": DEPTH_M,
            "forces.force_interval_s": FORCE_INTERVAL_S,
            "fit.spline_spacing_m": 0.03,
            "fit.law": "paper",
            "fit.camera": "exact",
            "fit.force_memory_s": "white",
            "fit.flow_strength": flow_strength,
        },
    )


@pytest.mark.slow
def test_a_growing_flow_that_was_not_fitted_fails() -> None:
    """A flow that grows by 30 %: in a tenth of the recording, far more than the 2 % tolerated."""

    def velocity(x: np.ndarray, y: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        return stirred(x, y, 1.0 + 0.3 * (time / SECONDS - 0.5))

    (growing,) = euler_recordings(velocity, worlds=1, seconds=SECONDS, seed=1)
    check = dw.check_model(dw.fit_motion(growing, study("constant")), growing, replicates=4)
    assert check["verdict"] == "does not explain"
    assert check["failed"].sel(criterion="flow strength") == 1


def made_up_series(seconds: float) -> Series:
    time = np.arange(0.0, seconds + 0.05, 0.1)
    none = np.zeros(time.size)
    return Series(time, none, none, none, none, none.astype(np.uint8), span=seconds)


def one_flow() -> xr.Dataset:
    return dw.uniform_flow(0.02, -0.01)


def point_of(**numbers: float) -> Point:
    return Point(np.zeros((2, 4, 4)), 0.0, 0.0, 0.0, opened=numbers)


SPLINE = Spline(-0.15, -0.15, 0.3, 4, 4)


def at(flow: xr.Dataset, time: Any) -> np.ndarray:
    return np.asarray(flow["u"].isel(x=0, y=0).interp(time=time).values)


def test_frames_follow_the_cosines_and_the_pulses() -> None:
    series, time = made_up_series(100.0), np.linspace(0.0, 100.0, 77)
    slow = point_of(strength_1=-0.1, strength_6=0.02)
    flow = replicates._in_frames(one_flow(), series, slow, SPLINE)
    expected = 1.0 - 0.1 * np.cos(np.pi * time / 100.0) + 0.02 * np.cos(6 * np.pi * time / 100.0)
    assert at(flow, time) / 0.02 == pytest.approx(expected, abs=1e-3)
    assert flow.attrs["repeat"] == "hold"
    pulsing = point_of(pulse_cosine=0.1, pulse_sine=0.2, pulse_frequency=0.05)
    flow = replicates._in_frames(one_flow(), series, pulsing, SPLINE)
    phase = 2.0 * np.pi * 0.05 * time
    expected = 1.0 + 0.1 * np.cos(phase) + 0.2 * np.sin(phase)
    # One period of 20 s, which is repeated.
    assert (flow.attrs["repeat"], float(flow["time"][-1])) == ("loop", pytest.approx(20.0))
    assert at(flow, time % 20.0) / 0.02 == pytest.approx(expected, abs=5e-3)


def test_a_steady_flow_stays_as_it_is_and_a_fast_one_is_refused() -> None:
    series, flow = made_up_series(100.0), one_flow()
    assert replicates._in_frames(flow, series, point_of(), SPLINE) is flow
    fast = point_of(strength_1=0.1, pulse_sine=0.1, pulse_frequency=4.0)
    with pytest.raises(dw.core.errors.InputError, match="6401 frames would be needed"):
        replicates._in_frames(flow, series, fast, SPLINE)


def test_a_camera_sees_the_marker_and_is_late() -> None:
    time = np.arange(0.0, 400.0, 0.1)
    angle = 0.3 * time
    x, y = 0.05 * time, np.zeros(time.size)
    offset = point_of(marker_x=0.004, marker_y=-0.002, angle_offset=0.2)
    seen = replicates._as_seen(x, y, angle, time=time, point=offset, key=1)
    turned = (0.004 - 0.002j) * np.exp(1j * (angle + 0.2))
    assert seen[0] - x == pytest.approx(turned.real)
    assert seen[1] - y == pytest.approx(turned.imag)
    late, _ = replicates._as_seen(x, y, angle, time=time, point=point_of(time_variance=4e-4), key=1)
    # 20 ms at 5 cm/s; 4000 samples, five standard deviations.
    assert (late - x).std() == pytest.approx(0.02 * 0.05, rel=5.0 / np.sqrt(2 * 4000))
