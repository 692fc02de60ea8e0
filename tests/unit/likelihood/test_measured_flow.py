"""A measured flow as prior of a fit: its sum of squares, its limits, and what contradicts it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from fit_worlds import coarse_study, fitted, recording
from scipy.interpolate import BSpline
from scipy.optimize import minimize_scalar

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.likelihood.check.criteria import MODEL_CHECK, agreement_criteria
from driftwalk.likelihood.check.measured import agreement_facts, best_placement
from driftwalk.likelihood.measured_flow import (
    MEASURED,
    MeasuredFlow,
    measured_flow,
)
from driftwalk.likelihood.preparation import estimate_of, prepare, spline_of
from driftwalk.likelihood.prior import Weights
from driftwalk.likelihood.spline import Spline
from driftwalk.model import Study, apply_overrides
from driftwalk.schema import build_flow_field

SECONDS = 200.0


def study_with(**fit: Any) -> Study:
    return apply_overrides(coarse_study(), {f"fit.{key}": value for key, value in fit.items()})


def field_of(u: np.ndarray, v: np.ndarray, axis: np.ndarray, **more: Any) -> xr.Dataset:
    x, y = np.meshgrid(axis, axis)
    flag = np.where(np.hypot(x, y) < 0.148, 1, 0)
    attrs = {"method": "file", "source": "piv.csv", "cell_size_m": float(axis[1] - axis[0])}
    return build_flow_field(axis, axis, u=u, v=v, flag=flag, attrs=attrs, **more)


def of_fit(error: float = 0.0, *, scale: float = 1.0, step: float = 0.01) -> xr.Dataset:
    """Return the flow that was fitted to the recording, as if it had been measured."""
    fit = fitted(SECONDS)
    axis = np.arange(-15, 16) * 0.01 if step == 0.01 else np.arange(-0.15, 0.151, step)
    u, v = spline_of(coarse_study()).values(fit["coefficient"].values, axis, axis)
    noise = error * np.random.default_rng(5).normal(size=(2, *u.shape))
    return field_of(scale * u + noise[0], scale * v + noise[1], axis)


def read(field: xr.Dataset, **fit: Any) -> MeasuredFlow:
    return measured_flow(field, study_with(**fit), spline_of(coarse_study()))


def design(spline: Spline, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the bases of all coefficients at the nodes of a grid, by scipy's B-splines."""

    def along(at: np.ndarray, origin: float, count: int) -> np.ndarray:
        knots = origin + spline.spacing * np.arange(-3, count + 1)
        return np.asarray(BSpline.design_matrix(at, knots, 3).todense())

    along_x = along(x, spline.origin_x, spline.columns)
    along_y = along(y, spline.origin_y, spline.rows)
    return np.einsum("yj,xi->yxji", along_y, along_x).reshape(y.size * x.size, -1)


@pytest.mark.slow
@pytest.mark.parametrize("scale_std", [0.0, 0.03])
def test_the_sum_of_squares_is_that_of_every_vector(scale_std: float) -> None:
    field = of_fit(2e-3, scale=1.05)
    one = read(field, flow_error_m_s=4e-3, flow_scale_std=scale_std)
    generator = np.random.default_rng(2)
    flow = fitted(SECONDS)["coefficient"].values
    there = np.isfinite(one.velocity[0]).ravel()
    bases = design(one.spline, one.x, one.y)[there]
    vectors = one.velocity.reshape(2, -1)[:, there]

    def squares(coefficients: np.ndarray, k: float) -> float:
        off = vectors - k * coefficients.reshape(2, -1) @ bases.T
        scale = 0.0 if scale_std == 0.0 else ((k - 1.0) / scale_std) ** 2
        return float((off**2).sum() / 4e-3**2 + scale) / 2.0 + 40.0 * np.log(k)

    def best(coefficients: np.ndarray) -> float:
        if scale_std == 0.0:
            return squares(coefficients, 1.0)
        found = minimize_scalar(
            lambda k: squares(coefficients, k), bounds=(0.5, 2.0), method="bounded",
            options={"xatol": 1e-10},
        )  # fmt: skip
        return float(found.fun)

    value, score, _ = one.deviance(flow, 40.0)
    step = 1e-4 * generator.normal(size=flow.shape)
    higher, after, curvature = one.deviance(flow + step, 40.0)
    assert higher - value == pytest.approx(best(flow + step) - best(flow), rel=1e-4)
    assert higher - value == pytest.approx(-0.5 * (score + after) @ step.ravel(), rel=1e-4)
    expected = (after - score) @ step.ravel()
    assert -expected == pytest.approx(step.ravel() @ curvature @ step.ravel(), rel=0.05)


@pytest.mark.slow
def test_errors_are_estimated_from_the_scatter_around_a_smooth_flow() -> None:
    one = read(of_fit(2e-3))
    assert np.nanmean(one.error) == pytest.approx(2e-3, rel=0.1)  # 3 sd
    assert "681 vectors, errors of 1.9 mm/s" in one.sentence
    assert "scatter" in one.sentence


def test_vectors_beyond_the_wall_do_not_count() -> None:
    field = of_fit(2e-3)
    beyond = field.assign(flag=xr.ones_like(field["flag"]))
    one = read(beyond)
    assert one.count == np.count_nonzero(np.hypot(*np.meshgrid(one.x, one.y)) <= 0.15)


def test_errors_of_the_file_and_stated_ones_are_taken() -> None:
    field = of_fit(2e-3)
    error = np.full(field["u"].shape, 2.5e-3)
    error[3, 15] = np.nan
    known = field.assign(
        u_standard_error=(("y", "x"), error), v_standard_error=(("y", "x"), 2.0 * error)
    )
    one = read(known)
    assert np.nanmin(one.error[1]) == 2.0 * np.nanmin(one.error[0]) == 5e-3
    assert one.count == read(field).count - 1
    assert "from the file" in one.sentence
    stated = read(known, flow_error_m_s=3e-3)
    assert np.nanmax(stated.error) == 3e-3
    assert "as stated" in stated.sentence
    # Vectors that scatter three times as much as stated have larger errors, or details.
    small = read(field, flow_error_m_s=2e-3 / 3)
    assert np.nanmean(small.error) == pytest.approx(2e-3, rel=0.1)
    assert "times 3" in small.errors or "times 2.9" in small.errors


@pytest.mark.slow
def test_a_fit_with_useless_vectors_is_a_fit_without_them() -> None:
    without = fitted(SECONDS)
    fit = dw.fit_motion(recording(SECONDS), study_with(flow_error_m_s=100.0), flow=of_fit())
    assert fit["converged"]
    for name in ("drag_coefficient", "force_std", "tracking_noise"):
        value, other = (one["estimate"].sel(parameter=name) for one in (fit, without))
        low, high = without["interval"].sel(parameter=name)
        assert abs(value - other) < 0.1 * (high - low)
    assert float(fit["measured_flow_scale_std"]) == pytest.approx(0.03, rel=1e-3)


@pytest.mark.slow
def test_with_exact_vectors_the_flow_is_the_measured_one() -> None:
    """C_d is the maximum of the likelihood in that flow, from values of the filter alone."""
    field, exact = of_fit(), study_with(flow_error_m_s=1e-6, flow_scale_std=0.0)
    fit = dw.fit_motion(recording(SECONDS), exact, flow=field)
    there = field["flag"].values == 1
    assert fit["converged"]
    for name in ("u", "v"):
        spline = spline_of(exact).values(
            fit["coefficient"].values, *(field[a].values for a in "xy")
        )
        assert np.abs(spline[int(name == "v")] - field[name].values)[there].max() < 1e-5
    estimate = estimate_of(fit, [recording(SECONDS)], body=None)
    at = estimate.point.log_drag
    std = float(fit["drag_coefficient_relative_std"])
    logs = at + std * np.linspace(-2.0, 2.0, 5)
    values = []
    for log_drag in logs:
        point = replace(estimate.point, log_drag=log_drag)
        values.append(estimate.passes.sums(point, noise="without").deviance)
    curve = np.polynomial.Polynomial.fit(logs, values, 2).convert()
    best = -curve.coef[1] / (2.0 * curve.coef[2])
    assert abs(best - at) < 0.5 * std


@pytest.mark.slow
def test_a_scale_that_is_off_is_found_and_leaves_the_drag_alone() -> None:
    vectors = of_fit(1e-3)
    right, wrong = (
        dw.fit_motion(recording(SECONDS), coarse_study(), flow=one)
        for one in (vectors, vectors.assign(u=1.15 * vectors["u"], v=1.15 * vectors["v"]))
    )
    scale = wrong["estimate"].sel(parameter="measured_flow_scale")
    assert abs(scale - 1.15) < 3.0 * float(wrong["measured_flow_scale_std"])
    assert float(wrong["measured_flow_scale_p_value"]) < MEASURED.level
    assert any("15 % too fast" in text for text in wrong["warning"].values)
    assert not any("measured flow" in text for text in right["warning"].values)
    drag, other = (
        float(one["estimate"].sel(parameter="drag_coefficient")) for one in (right, wrong)
    )
    assert other == pytest.approx(drag, rel=0.01)
    low, high = right["interval"].sel(parameter="drag_coefficient").values
    before = fitted(SECONDS)["interval"].sel(parameter="drag_coefficient").values
    assert high - low < before[1] - before[0]


@pytest.mark.slow
def test_the_statistic_of_agreement_has_its_distribution(monkeypatch: pytest.MonkeyPatch) -> None:
    """P values of flows and scales that are drawn as the fit takes them are uniform."""
    exact = MEASURED._replace(tolerated=0.0)
    monkeypatch.setattr("driftwalk.likelihood.check.measured.MEASURED", exact)
    generator = np.random.default_rng(3)
    one = read(of_fit(1e-3), flow_error_m_s=1e-3)
    size, shape = one.spline.size, fitted(SECONDS)["coefficient"].shape
    base = generator.normal(size=(2 * size, 2 * size))
    # What the recording tells, to some centimetres a second, and a prior of 3 cm/s.
    free = 1e3 * (base @ base.T / size + np.eye(2 * size))
    root, smooth = np.linalg.cholesky(np.linalg.inv(free)), np.eye(size) / 0.03**2
    prior = np.eye(2 * size) / 0.03**2
    found = []
    for _ in range(40):
        true = 0.03 * generator.normal(size=shape)
        seen = true + (root @ generator.normal(size=2 * size)).reshape(shape)
        scale = 1.0 + one.scale_std * generator.normal()
        noise = 1e-3 * generator.normal(size=one.velocity.shape)
        u, v = scale * one.spline.values(true, one.x, one.y) + noise
        made, point, determined = replace(one, **_sums(field_of(u, v, one.x))), seen, 0.0
        for _ in range(6):
            _, score, bent = made.deviance(point, determined)
            pull = free @ (seen - point).ravel() - prior @ point.ravel()
            covariance = np.linalg.inv(free + bent + prior)
            point = point + (covariance @ (score + pull)).reshape(shape)
            determined = made.determined(point, covariance, determined)
        smoothness: Any = SimpleNamespace(
            measured=made, matrix=lambda _: smooth, factors=lambda _, count: np.ones(count)
        )
        weights = Weights(1.0, 1.0, determined)
        facts = agreement_facts(smoothness, weights, point, free, confidence=0.9)
        found.append((facts["measured_flow_p_value"], facts["measured_flow_scale_p_value"]))
    for p_values in np.transpose(found):
        assert 0.32 < p_values.mean() < 0.68  # 4 sd of the mean of uniform numbers
        assert (p_values < 0.1).sum() <= 12


def _sums(field: xr.Dataset) -> dict[str, Any]:
    made = read(field, flow_error_m_s=1e-3)
    return {name: getattr(made, name) for name in ("velocity", "normal", "right", "own", "rank")}


@pytest.mark.slow
def test_a_mirrored_or_shifted_flow_is_recognised() -> None:
    free, axis = fitted(SECONDS), np.arange(-15, 16) * 0.01
    spline = spline_of(coarse_study())

    def words(sign_y: float, shift: float) -> str:
        u, v = spline.values(free["coefficient"].values, axis + shift, sign_y * axis)
        return best_placement(read(field_of(u, sign_y * v, axis)), free).words

    assert words(1.0, 0.0) == ""
    assert words(-1.0, 0.0) == "mirrored in y"
    assert words(1.0, 0.02) == "shifted by 20 mm in x and 0 mm in y"


@pytest.mark.slow
def test_a_stored_fit_has_the_same_prior() -> None:
    flow = of_fit(2e-3)
    fit = dw.fit_motion(recording(SECONDS), study_with(), flow=flow)
    again = estimate_of(fit, [recording(SECONDS)], body=None).prior.measured
    first = prepare([recording(SECONDS)], coarse_study(), None, None, flow).measured
    assert again is not None
    assert first is not None
    np.testing.assert_allclose(again.normal, first.normal, rtol=1e-6)
    np.testing.assert_allclose(again.right, first.right, rtol=1e-6)
    assert fit.attrs["measured_flow"] == "piv.csv"
    assert [one.name for one in agreement_criteria(dw.schema.answers.facts.facts_of(fit))] == [
        "measured flow",
        "measured scale",
    ]


def test_one_level_is_that_of_the_check() -> None:
    assert MEASURED.level == MODEL_CHECK.level


def test_what_is_no_measurement_of_a_steady_flow_is_refused() -> None:
    field = of_fit(1e-3)
    with pytest.raises(InputError, match="one setting of the pumps"):
        read(field, switching_times_s=[100.0])
    with pytest.raises(InputError, match="fit both recordings together"):
        read(dw.fitted_flow(fitted(SECONDS)))
    with pytest.raises(InputError, match="taken from the recording itself"):
        measured_flow(
            field.assign_attrs(method="track", source="a.csv"), coarse_study(),
            spline_of(coarse_study()), sources=("a.csv",),
        )  # fmt: skip
    with pytest.raises(InputError, match="too few to tell"):
        read(of_fit(1e-3, step=0.03))
    with pytest.raises(InputError, match="no vector"):
        read(field.assign_coords(x=field["x"] + 1.0))


def frames(change: float, *, count: int = 40, error: float = 4e-3) -> xr.Dataset:
    """Return frames of the flow with errors, and with a change of its right half in time."""
    field, generator = of_fit(), np.random.default_rng(8)
    shape = (count, *field["u"].shape)
    pulse = np.where(field["x"].values > 0.0, np.sin(np.arange(count))[:, None, None], 0.0)
    made = {
        name: (1.0 + change * pulse) * field[name].values + error * generator.normal(size=shape)
        for name in ("u", "v")
    }
    flag = np.broadcast_to(field["flag"].values, shape).copy()
    flag[::3, 5, 15] = 2  # a vector that is rejected now and then
    axis = field["x"].values
    return build_flow_field(
        axis, axis, **made, flag=flag, time=0.1 * np.arange(count), attrs=field.attrs
    )


def test_frames_of_a_steady_flow_are_averaged_with_the_error_of_their_spread() -> None:
    one = read(frames(0.0))
    there = np.isfinite(one.velocity[0])
    expected = np.where(np.isfinite(one.error[0]), 4e-3 / np.sqrt(40), np.nan)
    expected[5, 15] = 4e-3 / np.sqrt(26)
    np.testing.assert_allclose(one.error[0][there], expected[there], rtol=0.4)
    assert np.nanmean(one.error) == pytest.approx(np.nanmean(expected), rel=0.05)
    assert "from the spread of 40 frames" in one.sentence
    off = one.velocity[0] - of_fit()["u"].values
    assert np.nanstd(off / one.error[0]) == pytest.approx(1.0, abs=0.15)


def test_two_frames_without_a_change_differ_by_their_errors_alone() -> None:
    assert read(frames(0.0, count=2)).count > 600


@pytest.mark.slow
def test_the_check_repeats_the_fit_without_a_flow_that_contradicts_the_motion() -> None:
    field = of_fit(1e-3)
    mirrored = field.assign(
        u=field["u"].copy(data=field["u"].values[::-1]),
        v=field["v"].copy(data=-field["v"].values[::-1]),
    )
    fit = dw.fit_motion(recording(SECONDS), coarse_study(), flow=mirrored)
    judged = dw.likelihood.judge_fit(fit, [recording(SECONDS)])
    assert judged.fit["verdict"] == "does not explain"
    said = str(judged.fit["verdict_reason"].values[0])
    drag = float(fitted(SECONDS)["estimate"].sel(parameter="drag_coefficient"))
    assert f"without it, with a C_d of {drag:.3g}" in said
    assert "mirrored in y it is the one" in said
