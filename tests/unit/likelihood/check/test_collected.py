"""The errors of a small fit and what fitting took out of them, against dense linear algebra."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fast_camera import filmed_fast, point_of
from fit_worlds import coarse_study, recording

from driftwalk.core.arrays import Floats
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.check import errors as checked
from driftwalk.likelihood.check.errors import Contrast, Innovations, collect, innovations_of
from driftwalk.likelihood.check.place import residuals_of, spread_of, trend_of
from driftwalk.likelihood.filter.filter_pass import Passes, Sums
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.filter.series import series_of, smooth_angle
from driftwalk.likelihood.preparation import Estimate
from driftwalk.likelihood.prior import Prior, Weights
from driftwalk.likelihood.spline import lay_spline
from driftwalk.model import apply_overrides
from driftwalk.schema import body_track

LEAP, CONTACT, GAP = 60, 90, 120


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    """Two recordings, each in a flow of its own: the first with a leap, a contact and a gap."""
    study = apply_overrides(coarse_study(), {"fit.spline_spacing_m": 0.06})
    tracks = [
        body_track(recording(seconds, name)) for seconds, name in ((20, "first"), (14, "second"))
    ]
    late = np.arange(tracks[0].time.size) >= GAP
    x = tracks[0].x.copy()
    x[LEAP] += 0.05
    tracks[0] = tracks[0]._replace(time=tracks[0].time + 3.0 * late, x=x)
    series = series_of(tracks, study, "state", [(0, 0), (1, 1)])
    excluded = series[0].excluded.copy()
    excluded[CONTACT] = 1
    series[0] = replace(series[0], excluded=excluded)
    spline = lay_spline(outline_of(study.tank.to_arena()), side=0.03, spacing=0.06)
    passes = Passes(series, Body(study, "state"), spline, flows=2)
    flow = np.random.default_rng(1).normal(0.0, 0.01, (2, 2, spline.rows, spline.columns))
    point = Point(
        flow, math.log(0.5), math.log(2e-3), math.log(2.5e-4), math.log(3e-3), math.log(0.012)
    )
    prior = Prior(passes)
    return Estimate(study, passes, point, Weights(0.7, 2e4), tracks, prior)


@pytest.fixture(scope="module")
def errors(estimate: Estimate) -> list[Innovations]:
    return innovations_of(estimate)


def by_sample(lower: Floats) -> Floats:
    """Return symmetric 3 x 3 matrices from their lower parts, row by row."""
    order = [[0, 1, 3], [1, 2, 4], [3, 4, 5]]
    return lower[:, order]


def test_errors_are_whitened_and_those_that_do_not_count_are_0(
    estimate: Estimate, errors: list[Innovations]
) -> None:
    for one, series in zip(errors, estimate.passes.series, strict=True):
        found = estimate.passes.run(series, estimate.point.in_flow(series.flow))
        used = found["used"].astype(bool)
        np.testing.assert_array_equal(one.used, used)
        assert (one.white[~used] == 0.0).all()
        # Of independent numbers the squares add up to the distance in the covariance.
        distance = [
            e @ np.linalg.solve(s, e)
            for e, s in zip(
                found["innovation"][used], by_sample(found["covariance"][used]), strict=True
            )
        ]
        np.testing.assert_allclose((one.white[used] ** 2).sum(axis=1), distance, rtol=1e-9)
    assert (~errors[0].used).sum() > 4


def test_a_leap_is_an_outlier_and_what_begins_a_passage_is_none(
    errors: list[Innovations],
) -> None:
    found = np.flatnonzero(errors[0].outlier)
    assert LEAP in found
    assert not errors[0].outlier[[0, 1, CONTACT, CONTACT + 1, GAP, GAP + 1]].any()
    assert not (errors[0].used & errors[0].outlier).any()


def test_the_speed_past_the_block_is_that_of_the_state_before(
    estimate: Estimate, errors: list[Innovations]
) -> None:
    for one, series in zip(errors, estimate.passes.series, strict=True):
        point = estimate.point.in_flow(series.flow)
        state = estimate.passes.states(series, point)
        assert math.isnan(one.speed[0])
        for k in (7, 33, 70):
            x, y, _, vx, vy, _ = state[k - 1]
            u, v = estimate.passes.spline.values(
                point.coefficients, np.array([x]), np.array([y])
            ).ravel()
            assert one.speed[k] == pytest.approx(math.hypot(u - vx, v - vy))


def test_a_flow_that_grows_is_as_strong_as_it_is_then(estimate: Estimate) -> None:
    growing = {"strength_trend": -0.4}
    changed = replace(estimate, point=replace(estimate.point, opened=growing))
    (one, *_), series = innovations_of(changed), estimate.passes.series[0]
    point = changed.point.in_flow(0)
    k = 70
    x, y, _, vx, vy, _ = estimate.passes.states(series, point)[k - 1]
    strength = 1.0 - 0.4 * (1.0 - 2.0 * series.time[k - 1] / series.time[-1])
    u, v = (
        strength
        * estimate.passes.spline.values(point.coefficients, np.array([x]), np.array([y])).ravel()
    )
    assert one.speed[k] == pytest.approx(math.hypot(u - vx, v - vy))


class Dense:
    """All derivatives of all samples of all series, by all coefficients and ln C_d."""

    def __init__(self, estimate: Estimate, errors: Sequence[Innovations]) -> None:
        point, size = estimate.point, estimate.point.coefficients.size
        rows, white = [], []
        for one in errors:
            flow = one.series.flow
            kernel = estimate.passes.kernel(one.series, point.in_flow(flow), sensitivities=True)
            found = kernel.run(one.series.time.size)
            own = np.zeros((len(found["jacobian"]), size + 1))
            half = found["jacobian"].shape[1] - 1
            own[:, half * flow : half * (flow + 1)] = found["jacobian"][:, :-1]
            own[:, -1] = found["jacobian"][:, -1]
            rows.append(own)
            white.append(found["whitened"].ravel())
        self.parts = rows
        self.jacobian, self.white = np.concatenate(rows), np.concatenate(white)
        data = self.jacobian.T @ self.jacobian
        nothing = Sums(0.0, np.zeros(size + 1), data, 0)
        self.data = data
        known = estimate.prior.add(nothing, point, estimate.weights).information
        self.covariance = np.linalg.inv(known)
        self.weights = {
            "one": np.ones(len(self.jacobian)),
            "flow": self.jacobian[:, :-1] @ point.coefficients.ravel(),
            "drag": self.jacobian[:, -1],
        }


@pytest.fixture(scope="module")
def dense(estimate: Estimate, errors: list[Innovations]) -> Dense:
    return Dense(estimate, errors)


@pytest.mark.parametrize("at_once", [2048, 50])
def test_sums_over_parts_of_the_samples_are_those_of_all(
    monkeypatch: pytest.MonkeyPatch,
    estimate: Estimate,
    errors: list[Innovations],
    dense: Dense,
    at_once: int,
) -> None:
    monkeypatch.setattr(checked, "SAMPLES_AT_ONCE", at_once)
    generator = np.random.default_rng(2)
    groups = [
        np.where(one.used[:, None], generator.integers(-1, 4, one.white.shape), -1)
        for one in errors
    ]
    contrasts = [Contrast(groups, 4, by=by) for by in ("one", "flow", "drag")]
    leverage = collect(estimate, errors, contrasts, lags=3)
    group = np.concatenate([one.ravel() for one in groups])
    for contrast in contrasts:
        weight = dense.weights[contrast.by]
        matrix = np.array([(group == k) * weight for k in range(4)])
        np.testing.assert_allclose(contrast.score, matrix @ dense.white, rtol=1e-9)
        np.testing.assert_allclose(contrast.power, (matrix**2).sum(axis=1), rtol=1e-9)
        wanted = matrix @ dense.jacobian
        np.testing.assert_allclose(
            contrast.slope, wanted, atol=1e-9 * np.abs(wanted).max(), rtol=1e-9
        )
    np.testing.assert_allclose(
        leverage.covariance, dense.covariance, rtol=1e-6, atol=1e-9 * dense.covariance.max()
    )
    assert leverage.parameters == pytest.approx(np.trace(dense.data @ dense.covariance))


def test_of_a_fast_camera_sums_are_those_of_means_over_a_tenth_of_a_second() -> None:
    """Sums of the errors are exact; derivatives within ten samples differ by some percents."""
    passes = filmed_fast()
    fast: Any = SimpleNamespace(
        passes=passes, point=point_of(passes), prior=Prior(passes), weights=Weights(0.7, 2e4)
    )
    errors = innovations_of(fast)
    group = np.where(errors[0].used[:, None], np.arange(300)[:, None] // 100, -1)
    groups = [np.repeat(group, 3, axis=1)]
    one, flow = Contrast(groups, 3), Contrast(groups, 3, by="flow")
    leverage = collect(fast, errors, [one, flow], lags=2)
    dense = Dense(fast, errors)
    for contrast, close in ((one, 1e-9), (flow, 0.1)):
        weight = dense.weights[contrast.by]
        matrix = np.array([(groups[0].ravel() == k) * weight for k in range(3)])
        size = np.sqrt((matrix**2).sum(axis=1))
        assert np.abs((contrast.score - matrix @ dense.white) / size).max() < 3.0 * close
        np.testing.assert_allclose(contrast.power, size**2, rtol=close)
        wanted = matrix @ dense.jacobian
        assert np.abs(contrast.slope - wanted).max() < max(close, 1e-3) * np.abs(wanted).max()
    # The part with all samples is as exact as that of a slow camera.
    assert leverage.parameters == pytest.approx(np.trace(dense.data @ dense.covariance), rel=0.02)
    std = np.sqrt(np.diag(dense.covariance))
    assert np.sqrt(np.diag(leverage.covariance)) == pytest.approx(std, rel=0.02)


def test_what_fitting_puts_in_at_each_lag_is_the_mean_of_its_matrix(
    monkeypatch: pytest.MonkeyPatch, estimate: Estimate, errors: list[Innovations], dense: Dense
) -> None:
    """Mean of J C J' over the pairs of used samples, from 16 draws of a fixed seed.

    Of all derivatives the root of C as one draw each would give it exactly: so it does here.
    """
    lags, draws = 3, 16
    root = np.linalg.cholesky(dense.covariance)
    # As many draws as there are: the mean of their products is the sum of 16 of the roots' columns.
    size = len(root)
    chosen = np.zeros((size, draws))
    chosen[np.arange(draws), np.arange(draws)] = math.sqrt(draws)

    class Fixed:
        def normal(self, size: tuple[int, int]) -> Floats:
            assert size == chosen.shape
            return chosen

    monkeypatch.setattr(checked.np.random, "default_rng", lambda _: Fixed())
    retained: list[checked._Part] = []
    monkeypatch.setattr(checked, "SAMPLES_AT_ONCE", 50)
    for _ in checked._parts(estimate, errors, set(range(99)), retained):
        pass
    found = checked._autocovariance(root, errors, retained, lags)
    for lag in range(lags + 1):
        total, pairs = np.zeros(3), 0
        for number, (one, rows) in enumerate(zip(errors, dense.parts, strict=True)):
            moved = (rows @ root[:, :draws]).reshape(-1, 3, draws)
            assert number < 2
            for k in range(len(moved) - lag):
                # Pairs within a part of 50 samples.
                if k // 50 == (k + lag) // 50 and one.used[k] and one.used[k + lag]:
                    total += (moved[k] * moved[k + lag]).sum(axis=1)
                    pairs += 1
        np.testing.assert_allclose(found[:, lag], total / pairs, rtol=1e-6)


def test_the_statistics_by_place_and_time_are_sums_over_their_groups(
    estimate: Estimate, errors: list[Innovations], dense: Dense
) -> None:
    found = residuals_of(estimate, errors)
    layout = found.layout
    groups = checked_groups(found, errors)
    cell = np.concatenate([np.repeat(one[0], 3) for one in groups])
    part = np.concatenate([np.repeat(one[1], 3) for one in groups])
    component = np.tile(np.arange(3), len(cell) // 3)
    number = np.bincount(cell[(cell >= 0) & (component == 0)], minlength=layout.cells)
    np.testing.assert_array_equal(found.place.samples, number)
    for d in range(3):
        own = (cell >= 0) & (component == d)
        sums = np.bincount(cell[own], dense.white[own], minlength=layout.cells)
        np.testing.assert_allclose(found.place.mean[:, d], sums / np.maximum(number, 1), atol=1e-12)
        both = part[own] * layout.cells + cell[own]
        count = layout.cells * layout.parts
        numbers = np.maximum(np.bincount(both, minlength=count), 1)
        sums = np.bincount(both, dense.white[own], minlength=count)
        np.testing.assert_allclose(found.part.mean[:, d], sums / numbers, atol=1e-12)
    # A sum in a cell has the variance of its number less what was fitted.
    fullest = int(np.argmax(number))
    matrix = np.array([(cell == fullest) & (component == d) for d in range(3)], dtype=float)
    row = matrix @ dense.jacobian
    step = dense.covariance[-1] @ row.T @ (matrix @ dense.white / number[fullest])
    assert found.place.drag_change[fullest] == pytest.approx(step, rel=1e-6)
    for by, mine, contrast_groups in (
        ("flow", found.strength, [one[1] for one in groups]),
        ("drag", found.drag, [one[2] for one in groups]),
    ):
        size = mine.change.size
        contrast = Contrast(
            [np.repeat(one[:, None], 3, axis=1) for one in contrast_groups], size, by=by
        )
        collect(estimate, errors, [contrast], lags=1)
        np.testing.assert_allclose(
            mine.change, trend_of(contrast, dense.covariance).change, rtol=1e-5
        )
    np.testing.assert_array_equal(
        found.noise_by_part.ratio, spread_of(errors, [one[1] for one in groups], layout.parts).ratio
    )
    np.testing.assert_array_equal(
        found.noise_by_place.ratio,
        spread_of(errors, [one[0] for one in groups], layout.cells).ratio,
    )


def checked_groups(found: object, errors: list[Innovations]) -> list[tuple[np.ndarray, ...]]:
    """Return cell, part and range of speed of every sample, by plain comparisons."""
    layout = found.layout  # type: ignore[attr-defined]
    groups = []
    for index, one in enumerate(errors):
        count = one.used.size
        cell, part, speed = (np.full(count, -1) for _ in range(3))
        parts = [p for p in range(layout.parts) if layout.series[p] == index]
        for k in np.flatnonzero(one.used):
            x, y = one.series.x[max(k - 1, 0)], one.series.y[max(k - 1, 0)]
            column = int(np.argmin(np.abs(layout.x - x)))
            row = int(np.argmin(np.abs(layout.y - y)))
            cell[k] = row * layout.x.size + column
            part[k] = max(p for p in parts if layout.start[p] <= one.series.time[k])
            if np.isfinite(one.speed[k]):
                below = sum(edge <= one.speed[k] for edge in layout.speed[1:-1])
                speed[k] = below
        groups.append((cell, part, speed))
    return groups


def test_the_angle_of_a_hole_is_filled_by_its_neighbours() -> None:
    """The parabola through the nearest orientations is exact where they lie on one."""
    time = 0.1 * np.arange(30)
    angle = 0.2 + 0.5 * time - 0.1 * time**2
    seen = angle.copy()
    seen[[4, 5, 17]] = np.nan
    found = smooth_angle(time, seen)
    there = np.isfinite(seen)
    np.testing.assert_allclose(found.theta[there], angle[there], atol=1e-9)
    np.testing.assert_allclose(found.omega[there], (0.5 - 0.2 * time)[there], atol=1e-9)
    assert found.known.all()
    np.testing.assert_allclose(found.theta[17], 0.5 * (angle[16] + angle[18]), atol=1e-9)
