"""A measured flow that changes in time: its modes, its clock, and the fit in it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from euler_blocks import (
    DRAG,
    euler_recordings,
    stirred,
)
from fit_worlds import coarse_study, recording
from fits_of_effects import AXIS, ERROR, alternating, frames_of, stirred_study as study_with
from scipy.integrate import trapezoid

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.likelihood.check import replicates
from driftwalk.likelihood.filter.parameters import Amplitudes
from driftwalk.likelihood.fitted_modes import stored_coefficients
from driftwalk.likelihood.measured_flow import MEASURED, MeasuredFlow, measured_flow
from driftwalk.likelihood.measured_series import stored_flow
from driftwalk.likelihood.preparation import estimate_of, prepare, spline_of
from driftwalk.model import apply_overrides
from driftwalk.schema import build_flow_field
from driftwalk.simulation.series import continued_flow, velocity_at


def wave(time: np.ndarray | float) -> Any:
    """Return an amplitude of unit rms that has no period."""
    return np.sin(0.21 * np.asarray(time)) + np.cos(0.37 * np.sqrt(2.0) * np.asarray(time))


def read(field: xr.Dataset, *, duration: float = 0.0, **more: Any) -> MeasuredFlow:
    study = study_with(**more)
    return measured_flow(field, study, spline_of(study), duration=duration)


@pytest.mark.slow
def test_mean_and_modes_are_those_of_the_flow_within_their_errors() -> None:
    time = np.arange(0.0, 200.0, 2.0)
    field = frames_of(alternating(0.3, wave), time)
    # A frame without vectors is no frame.
    field["flag"][7] = 2
    one, time = read(field), np.delete(time, 7)
    assert one.amplitudes is not None
    assert one.layers == 2
    np.testing.assert_array_equal(one.amplitudes.time, time)
    want = wave(time)
    found = one.amplitudes.at(time)[0]
    sign = math.copysign(1.0, float(found @ want))
    assert np.corrcoef(sign * found, want)[0, 1] > 0.9999
    x, y = np.meshgrid(AXIS, AXIS)
    # An amplitude of unit rms, of which the mean is a part of the mean flow.
    scale = np.sqrt(((want - want.mean()) ** 2).mean())
    image = stirred(-x, y)
    mode = sign * 0.3 * scale * np.stack([image[0], -image[1]])
    mean = np.stack(stirred(x, y)) + 0.3 * want.mean() * np.stack([image[0], -image[1]])
    for layer, true in enumerate((mean, mode)):
        part = slice(2 * layer, 2 * layer + 2)
        plain = np.isfinite(one.velocity[part])
        off = (one.velocity[part] - true)[plain] / (ERROR / np.sqrt(0.95 * time.size))
        assert np.sqrt((off**2).mean()) == pytest.approx(1.0, abs=0.1)  # 4 sd
    assert "in modes of 30 % of the mean" in one.sentence


@pytest.mark.slow
def test_the_sum_of_squares_counts_mean_and_modes() -> None:
    one = read(frames_of(alternating(0.3, wave), np.arange(60.0)), **{"fit.flow_error_m_s": 4e-3})
    spline = one.spline
    flow = one.own.reshape(2, 2, spline.rows, spline.columns)
    flow = flow + 0.01 * np.random.default_rng(1).normal(size=flow.shape)
    errors = np.nanmean(one.error, axis=(1, 2))

    def squares(coefficients: np.ndarray, k: float) -> float:
        values = spline.values(coefficients.reshape(4, *flow.shape[2:]), one.x, one.y)
        off = (one.velocity - k * values) / errors[:, None, None]
        return float(0.5 * np.nansum(off**2) + 0.5 * ((k - 1.0) / one.scale_std) ** 2)

    def best(coefficients: np.ndarray) -> float:
        return squares(coefficients, one.scale(coefficients, 0.0)[0])

    step = 1e-4 * np.random.default_rng(2).normal(size=flow.shape)
    value, score, _ = one.deviance(flow, 0.0)
    higher, after, _ = one.deviance(flow + step, 0.0)
    assert higher - value == pytest.approx(best(flow + step) - best(flow), rel=1e-6)
    assert higher - value == pytest.approx(-0.5 * (score + after) @ step.ravel(), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("repeat", ["loop", "mirror", "hold"])
def test_the_clock_goes_on_as_in_a_simulation(repeat: str) -> None:
    """Beyond the frames the sum of mean and modes is the series that is simulated."""
    time = np.arange(0.0, 10.0, 0.5)
    field = frames_of(alternating(0.3, wave), time, error=0.0)
    study = study_with(**{"flow.repeat": repeat})
    one = measured_flow(field, study, spline_of(study), duration=100.0)
    assert one.amplitudes is not None
    series = continued_flow(field, study, duration=100.0, begin=0.0)
    when = np.array([0.0, 3.3, 9.7, 13.3, 24.1, 99.0])
    at_x, at_y = 0.03, -0.04
    want, _ = velocity_at(series, at_x, at_y, when)
    column, row = (int(np.argmin(abs(AXIS - at))) for at in (at_x, at_y))
    mean, mode = one.velocity[0, row, column], one.velocity[2, row, column]
    np.testing.assert_allclose(mean + one.amplitudes.at(when)[0] * mode, want, atol=2e-5)


@pytest.mark.slow
def test_many_frames_become_means_of_a_few() -> None:
    time = np.arange(0.0, 450.0, 0.1)
    small = frames_of(alternating(0.3, wave), time).isel(y=slice(8, 25), x=slice(8, 25))
    one = read(small)
    assert one.amplitudes is not None
    assert one.amplitudes.time.size == 1500
    np.testing.assert_allclose(one.amplitudes.time[:2], [0.1, 0.4])
    found = trapezoid(one.amplitudes.value[0] * wave(one.amplitudes.time), one.amplitudes.time)
    assert abs(found) / 450.0 == pytest.approx(1.0, abs=0.02)


@pytest.mark.slow
def test_what_a_fit_cannot_take_is_refused_with_the_way() -> None:
    time = np.arange(0.0, 60.0)
    field = frames_of(alternating(0.3, wave), time)
    with pytest.raises(InputError, match=r"spans 0 to 59 s.*clock of the recording.*flow\.repeat"):
        read(field, duration=90.0)
    late = field.assign_coords(time=field["time"] + 30.0)
    with pytest.raises(InputError, match=r"spans 30 to 89 s"):
        read(late, duration=50.0)
    assert read(field, duration=59.5).layers == 2

    def restless(x: np.ndarray, y: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        u, v = stirred(x, y)
        for k in range(7):
            u = u + 0.01 * math.sin((k + 1) * 0.3 * time) * np.sin((k + 1) * 20.0 * y)
        return u, v

    with pytest.raises(InputError, match=r"in 7 modes, and the fit takes 5: the next one is \d+ %"):
        read(frames_of(restless, time))
    study = coarse_study()
    many = [recording(50.0), recording(50.0, "second")]
    with pytest.raises(InputError, match="clock of one recording"):
        prepare(many, study, None, None, field)
    modes = apply_overrides(study, {"fit.flow_modes": "auto"})
    with pytest.raises(InputError, match="leave one of them out"):
        dw.likelihood.check_fit(many[0], modes, flow=field)


@pytest.fixture(scope="module")
def made() -> tuple[xr.Dataset, xr.Dataset, xr.Dataset]:
    """Return a recording, the measured frames, and the fit with them."""
    velocity = alternating(0.35, wave)
    (seen,) = euler_recordings(velocity, worlds=1, seconds=400.0, seed=5)
    # Every second sample, for speed.
    seen = seen.isel(time=slice(None, None, 2))
    flow = frames_of(velocity, np.arange(0.0, 401.0))
    return seen, flow, dw.fit_motion(seen, study_with(), flow=flow)


def drag_of(fit: xr.Dataset) -> float:
    return float(fit["estimate"].sel(parameter="drag_coefficient"))


@pytest.mark.slow
def test_the_drag_is_right_in_a_measured_series_and_wrong_in_its_mean(made: Any) -> None:
    seen, flow, fit = made
    low, high = fit["interval"].sel(parameter="drag_coefficient").values
    assert low < DRAG < high
    assert drag_of(fit) == pytest.approx(DRAG, rel=0.05)
    assert float(fit["measured_flow_p_value"]) > MEASURED.level
    assert float(fit["estimate"].sel(parameter="measured_flow_scale")) == pytest.approx(1, abs=0.02)
    mean = build_flow_field(
        AXIS, AXIS, u=flow["u"].values.mean(axis=0), v=flow["v"].values.mean(axis=0),
        flag=flow["flag"].values.min(axis=0), attrs=flow.attrs,
    )  # fmt: skip
    assert drag_of(dw.fit_motion(seen, study_with(), flow=mean)) < 0.8 * DRAG


@pytest.mark.slow
def test_the_flow_of_the_fit_is_the_series_at_the_frames(made: Any) -> None:
    _, flow, fit = made
    found = dw.fitted_flow(fit)
    np.testing.assert_array_equal(found["time"].values, flow["time"].values)
    assert "repeat" not in found.attrs
    x, y = np.meshgrid(found["x"].values, found["y"].values)
    near = np.hypot(x, y) < 0.1
    for frame in (0, 77, 400):
        u, v = alternating(0.35, wave)(x, y, float(frame))
        off = np.hypot(found["u"].values[frame] - u, found["v"].values[frame] - v)[near]
        assert np.sqrt((off**2).mean()) < 0.04 * np.sqrt((np.hypot(u, v)[near] ** 2).mean())
    # It is long enough for the recording, and says so where it is not.
    assert continued_flow(found, study_with(), duration=400.0, begin=0.0).attrs["repeat"] == "none"
    with pytest.raises(InputError, match="say how it goes on"):
        continued_flow(found, study_with(), duration=500.0)


@pytest.mark.slow
def test_a_stored_fit_and_its_replicates_have_the_same_flow(made: Any) -> None:
    seen, flow, fit = made
    estimate = estimate_of(fit, [seen], body=None)
    again = estimate.prior.measured
    first = prepare([seen], study_with(), None, None, flow).measured
    assert again is not None
    assert first is not None
    for name in ("normal", "right"):
        one, other = getattr(again, name), getattr(first, name)
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-9 * abs(other).max())
    np.testing.assert_array_equal(estimate.point.coefficients, stored_coefficients(fit))
    assert estimate.point.layers == estimate.passes.layers == 2
    kept = stored_flow(fit)
    assert kept is not None
    assert kept.sizes["frame"] == 401
    mean = dw.fitted_flow(fit, interval=0)
    point, series = estimate.point, estimate.passes.series[0]
    frames = replicates._in_frames(mean, series, point, estimate.passes.spline)
    np.testing.assert_allclose(frames["u"].values, dw.fitted_flow(fit)["u"].values, atol=1e-6)
    # With a change of its strength the frames are those of both.
    growing = replace(point, opened={"strength_trend": -0.2})
    grown = replicates._in_frames(mean, series, growing, estimate.passes.spline)
    now = frames["u"].interp(time=300.0).values
    np.testing.assert_allclose(grown["u"].interp(time=300.0).values, 1.1 * now, atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("wrong", ["clock", "mirrored"])
def test_a_series_that_is_another_one_contradicts_the_motion(made: Any, wrong: str) -> None:
    seen, flow, _ = made
    other = {
        "clock": lambda: flow.assign(u=flow["u"].copy(data=flow["u"].values[::-1]),
                                     v=flow["v"].copy(data=flow["v"].values[::-1])),
        "mirrored": lambda: flow.assign(u=flow["u"].copy(data=flow["u"].values[:, ::-1]),
                                        v=flow["v"].copy(data=-flow["v"].values[:, ::-1])),
    }[wrong]()  # fmt: skip
    fit = dw.fit_motion(seen, study_with(), flow=other)
    assert float(fit["measured_flow_p_value"]) < MEASURED.level
    assert any("measured flow is not the one" in text for text in fit["warning"].values)


def test_amplitudes_are_linear_between_frames() -> None:
    one = Amplitudes(np.array([0.0, 2.0, 4.0]), np.array([[0.0, 1.0, 0.0]]), "none")
    np.testing.assert_array_equal(one.at(np.array([-1.0, 1.0, 3.0, 9.0])), [[0.0, 0.5, 0.5, 0.0]])
