"""Sums over a pass: derivatives against differences, and against what chance gives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from fit_worlds import coarse_study, driven, recording

from driftwalk.core.arrays import Floats
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.filter.difference_pairs import Pair
from driftwalk.likelihood.filter.filter_pass import Passes, Sums
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.filter.series import (
    FILTER,
    Series,
    strength_of,
    stretches_unsettled,
    velocity_prior,
)
from driftwalk.likelihood.fit import fit_motion
from driftwalk.likelihood.law.candidate_laws import STRENGTHS
from driftwalk.likelihood.newton import inverse, limited, newton_step
from driftwalk.likelihood.preparation import estimate_of, series_of
from driftwalk.likelihood.prior import Prior, Weights
from driftwalk.likelihood.spline import lay_spline
from driftwalk.schema import body_track


@pytest.fixture(scope="module", params=["given", "state"])
def passes(request: pytest.FixtureRequest) -> Passes:
    study = coarse_study()
    outline = outline_of(study.tank.to_arena())
    tracks = [body_track(recording(60.0, name)) for name in ("first", "second")]
    series = series_of(tracks, study, request.param)
    spline = lay_spline(outline, side=0.03, spacing=0.03)
    return Passes(series, Body(study, request.param), spline)


@pytest.fixture(scope="module")
def point(passes: Passes) -> Point:
    shape = (2, passes.spline.rows, passes.spline.columns)
    noise = np.random.default_rng(1).normal(0.0, 0.01, shape)
    # So much unrest that no innovation is an outlier, which a small step could make or unmake.
    point = Point(noise, math.log(0.5), math.log(2e-3), math.log(2.5e-4))
    if passes.body.orientation == "given":
        return point
    return replace(point, log_lever=math.log(3e-3), log_angle_noise=math.log(0.012))


@pytest.mark.fast_cases(1)
def test_the_score_is_the_slope_of_the_likelihood(passes: Passes, point: Point) -> None:
    """Central differences of the likelihood along single parameters and random directions.

    The filter's own derivatives hold its gains fixed, which is what makes the information one of
    predictions; along the coefficients and C_d they differ from the slope by what the gains change.
    """
    score = passes.sums(point).score
    size = score.size
    for direction in np.eye(size)[-len(point.noises) :]:
        step = 1e-3
        change = [passes.sums(point.moved(sign * step * direction)).deviance for sign in (1, -1)]
        slope = -(change[0] - change[1]) / (2.0 * step)
        assert score @ direction == pytest.approx(slope, rel=5e-3, abs=0.5)


def test_two_recordings_add_up(passes: Passes, point: Point) -> None:
    both = passes.sums(point)
    parts = [replace(passes, series=[one]).sums(point) for one in passes.series]
    assert both.deviance == pytest.approx(sum(one.deviance for one in parts))
    assert both.score == pytest.approx(sum(one.score for one in parts))
    together = sum(one.information for one in parts)
    np.testing.assert_allclose(both.information, together, rtol=1e-6, atol=1e-12)
    assert both.used == sum(one.used for one in parts)


def test_without_noise_derivatives_the_rest_is_the_same(passes: Passes, point: Point) -> None:
    whole, part = passes.sums(point), passes.sums(point, noise="without")
    count = whole.score.size - len(point.noises)
    assert part.score == pytest.approx(whole.score[:count])
    shared = whole.information[:count, :count]
    np.testing.assert_allclose(part.information, shared, rtol=1e-6, atol=1e-12)
    assert np.linalg.eigvalsh(whole.information)[-1 - len(point.noises) :].min() > 0.0


def test_the_products_are_those_of_the_derivatives(passes: Passes, point: Point) -> None:
    """The filter's own sums against its derivatives, multiplied at once.

    Left out of the information is what is 1e-4 of the largest derivative among those of some two
    seconds. A column that is so small all along may be lost, but to the data it is as good as
    unknown: against what is known with the prior the error is below 1e-3 in any direction. Nothing
    is left out of the score.
    """
    series = passes.series[0]
    sums = replace(passes, series=[series]).sums(point, noise="without")
    whole = passes.kernel(series, point, sensitivities=True).run(series.time.size)
    wanted = whole["jacobian"].T @ whole["jacobian"]
    score = whole["jacobian"].T @ whole["whitened"]
    assert sums.used == whole["used"].sum()
    exact = Sums(sums.deviance, score, wanted, sums.used)
    known = Prior(passes).add(exact, point, Weights(0.7, 2e4)).information
    root = np.linalg.cholesky(known)
    half = np.linalg.solve(root, sums.information - wanted)
    assert np.linalg.norm(np.linalg.solve(root, half.T), 2) < 1e-3
    assert sums.score == pytest.approx(score, rel=1e-9, abs=1e-9 * np.abs(score).max())
    size = np.sqrt(np.diag(known))
    assert np.abs((sums.information - wanted) / np.outer(size, size)).max() < 3e-4


def test_a_held_parameter_stays_and_the_others_are_the_best(passes: Passes, point: Point) -> None:
    prior = Prior(passes)
    sums = prior.add(passes.sums(point), point, Weights(1.0, 1e4))
    drag = point.coefficients.size
    held = (drag, drag + 2)
    step = newton_step(sums, inverse(sums.information), held=held)
    free = np.ones(step.size, dtype=bool)
    free[list(held)] = False
    assert step[~free] == pytest.approx([0.0, 0.0], abs=1e-9)
    expected = np.linalg.solve(sums.information[np.ix_(free, free)], sums.score[free])
    assert step[free] == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_the_prior_is_the_gradient_of_its_own_deviance(passes: Passes, point: Point) -> None:
    prior, weights = Prior(passes), Weights(0.7, 2e4)
    sums = passes.sums(point)
    inside = prior.add(sums, point, weights)
    direction = np.random.default_rng(4).normal(size=sums.score.size)
    direction[[-4, -3, -1] if len(point.noises) == 4 else [-2, -1]] = 0.0
    moved = [point.moved(sign * 1e-4 * direction) for sign in (1, -1)]
    up, down = (prior.add(sums, at, weights).deviance for at in moved)
    slope = (down - up) / 2e-4
    assert (inside.score - sums.score) @ direction == pytest.approx(slope, rel=1e-6)
    bend = (up - 2.0 * inside.deviance + down) / 1e-8
    added = inside.information - sums.information
    assert direction @ added @ direction == pytest.approx(bend, rel=1e-3)


def test_a_wrong_variance_is_found_in_one_step() -> None:
    """n draws of a variance v, tried at v0: the step in ln v is n/2 (v/v0 - 1) over n/2."""
    for ratio in (0.2, 1.0, 7.0):
        step = limited(np.array([0.0, ratio - 1.0, 0.5 * (ratio - 1.0)]), 0)
        assert step[1:] == pytest.approx([math.log(ratio), 0.5 * math.log(ratio)])


def test_where_one_pass_restarted_the_noises_tell_nothing() -> None:
    """A step of a ten-thousandth in a noise changes a variance by as much, not by a factor."""
    used = np.ones(3, dtype=np.uint8)
    base = {
        "used": used,
        "covariance": np.array([[1.0, 0.2, 2.0], [1.0, 0.2, 2.0], [1.0, np.nan, np.nan]]),
    }
    other = {
        "used": used,
        "covariance": np.array([[1.0001, 0.2, 2.0], [1.0, 0.2, 1e12], [1.0, 0.2, 2.0]]),
    }
    for one, two in ((base, other), (other, base)):
        assert Pair(one, two, 1.0).comparable.tolist() == [True, False, False]


@pytest.mark.slow
def test_wrong_times_are_tried_on_all_samples_of_an_accurate_camera() -> None:
    """Positions known to 15 micrometres: what the usual step does then outweighs their noise.

    The derivative is that of the likelihood, by a difference of second order.
    """
    noises = {"observation.position_noise_m": 1.5e-5, "observation.orientation_noise_rad": 2e-3}
    accurate = driven(3, 120.0, noises)
    estimate = estimate_of(fit_motion(accurate, coarse_study()), [accurate], body=None)
    passes, point = estimate.passes, estimate.point
    name = "time_variance"
    sums = passes.sums(point, tried=(name,))
    assert sums.used == passes.sums(point, noise="without").used

    def deviance(variance: float) -> float:
        return passes.sums(replace(point, fixed={name: variance}), noise="without").deviance

    step = 1e-10
    slope = (4.0 * deviance(step) - 3.0 * deviance(0.0) - deviance(2.0 * step)) / (2.0 * step)
    assert sums.score[-1] == pytest.approx(-slope, rel=0.05)


def test_a_slow_change_of_the_flow_holds_a_straight_line() -> None:
    """1 + g (t / T - 1/2) exactly, and its change g; six cosines alone leave a part of the line.

    Of a line the odd cosines hold 8 / pi^2 (1 + 1/9 + 1/25) from its beginning to its end.
    """
    time = np.linspace(0.0, 60.0, 601)
    some = np.zeros(time.size)
    series = Series(time, some, some, some, some, some.astype(np.uint8), span=60.0)
    growth = 0.2
    names = ("strength_trend", *(f"strength_{k}" for k in range(1, 7)))
    assert names == STRENGTHS
    ramp = Point(some, 0.0, 0.0, 0.0, opened={"strength_trend": -0.5 * growth})
    assert strength_of(series, ramp) == pytest.approx(1.0 + growth * (time / 60.0 - 0.5), rel=1e-14)
    odd = {f"strength_{k}": -growth * 4.0 / (np.pi * k) ** 2 for k in (1, 3, 5)}
    cosines = strength_of(series, Point(some, 0.0, 0.0, 0.0, opened=odd))
    assert cosines is not None
    assert (cosines[-1] - cosines[0]) / growth == pytest.approx(0.933, abs=5e-4)


def test_a_slow_change_of_the_flow_is_a_steady_change_times_its_shape(
    passes: Passes, point: Point
) -> None:
    """Closed, a cosine is tried with the errors of a steady change; opened, with its own.

    What a change of the flow did is forgotten within a second or so, in which cosine 6 of a
    recording of a minute turns by 6 pi / 60, a third of a radian: off by half of its square.
    """
    named = list(STRENGTHS)
    tried = passes.sums(point, tried=named)
    opened = passes.sums(replace(point, opened=dict.fromkeys(named, 0.0)))
    at = slice(-len(named), None)
    size = np.sqrt(np.diag(opened.information)[at])
    apart = tried.information[at, at] - opened.information[at, at]
    assert np.abs(apart / np.outer(size, size)).max() < 0.05
    assert np.abs((tried.score - opened.score)[at] / size).max() < 0.3


@pytest.mark.slow
def test_errors_after_a_gap_and_a_contact_are_as_large_as_elsewhere() -> None:
    """The mean square of the errors is 1 in the two samples after that which gives the velocity.

    Of n of them, three numbers each and hardly correlated, it has a standard deviation of
    sqrt(2 / 3 n); the bound is five of those.
    """
    study = coarse_study()
    track = body_track(driven(3, 300.0, {}))
    late = np.arange(track.time.size) >= 1500
    track = track._replace(time=track.time + 5.0 * late)
    (series,) = series_of([track], study, "state")
    assert series.near_wall > 20
    fit = fit_motion(driven(3, 300.0, {}), study)
    estimate = estimate_of(fit, [driven(3, 300.0, {})], body=None)
    passes = replace(estimate.passes, series=[series])
    ((white, used),) = passes.innovations(estimate.point)
    begins = series.begins
    assert begins[[0, 1500]].all()
    assert not used[begins].any()
    after = np.convolve(begins, np.ones(4), "full")[: begins.size] > 0
    first, later = used & after & (np.arange(begins.size) > 1), used & ~after
    for some in (first, later):
        assert some.sum() > 50
        bound = 5.0 * math.sqrt(2.0 / (3.0 * int(some.sum())))
        assert abs((white[some] ** 2).mean() - 1.0) < bound


@pytest.mark.parametrize(("every", "free"), [(8, "0.7"), (17, "")])
def test_short_flights_between_contacts_settle_nothing(
    passes: Passes, every: int, free: str
) -> None:
    excluded = np.zeros(passes.series[0].time.size, dtype=np.uint8)
    excluded[::every] = 1
    said = stretches_unsettled([replace(passes.series[0], excluded=excluded)])
    assert said.startswith(f"the block moves freely for {free} s") if free else said == ""


def test_after_a_gap_two_samples_give_the_velocity_and_no_drag_does(
    passes: Passes, point: Point
) -> None:
    """Against the normal law of free motion: v ~ N(0, 0.1 m/s), and z = x + v t + noise.

    The second sample does not count. Counted, it asked for C_d 5 to 7 where 0.45 is true, in tracks
    with 140 gaps: such a drag makes any velocity the water's.
    """
    series = passes.series[0].part(0, 60)
    gap = 30
    series = replace(
        series,
        time=series.time + 5.0 * (np.arange(60) >= gap),
        excluded=np.zeros(60, dtype=np.uint8),
    )
    found = [passes.run(series, one) for one in (point, replace(point, log_drag=math.log(5.0)))]
    for one in found:
        assert one["used"][gap : gap + 2].tolist() == [0, 0]
    # Two stretches of three seconds; without the gap, one.
    assert "1 in all, and 2.9 s" in stretches_unsettled([series])
    assert stretches_unsettled([passes.series[0]]) == ""
    step = series.time[gap + 1] - series.time[gap]
    q, noise = math.exp(point.log_intensity), math.exp(2.0 * point.log_noise)
    drift = np.array([[1.0, step], [0.0, 1.0]])
    push = q * np.array([[step**3 / 3.0, step**2 / 2.0], [step**2 / 2.0, step]])
    before = drift @ np.diag([noise, 0.01]) @ drift.T + push
    gain = before[:, 0] / (before[0, 0] + noise)
    for axis, place in enumerate((series.x, series.y)):
        moved = place[gap + 1] - place[gap]
        wanted = np.array([place[gap], 0.0]) + gain * moved
        for one in found:
            velocity = axis + one["state"].shape[1] // 2
            np.testing.assert_allclose(one["state"][gap + 1, [axis, velocity]], wanted, rtol=1e-9)


@pytest.fixture(scope="module")
def stretches(passes: Passes) -> Series:
    """Stretches of 2 s with gaps of 1.5 s, and contacts at random."""
    rng = np.random.default_rng(4)
    time = np.concatenate([3.5 * n + 0.1 * np.arange(20) for n in range(40)])
    return replace(
        passes.series[0],
        time=time,
        x=0.02 * np.cos(1.3 * time),
        y=0.02 * np.sin(1.3 * time) + 1e-3 * rng.normal(size=800),
        theta=np.zeros(800),
        angle=np.zeros(800),
        omega=0.3 + np.cos(time),
        excluded=(rng.uniform(size=800) < 0.07).astype(np.uint8),
    )


def test_the_velocity_behind_a_contact_is_expected_from_the_nearest_ones(stretches: Series) -> None:
    """Against a plain loop over all pairs of contacts."""
    series = stretches
    found = velocity_prior(series, 0.01)
    assert found is not None
    time, x, y = series.time, series.x, series.y
    passage = np.cumsum(series.begins)
    contacts: list[int] = np.flatnonzero(series.excluded).tolist()
    own: dict[int, Floats] = {}
    begun: dict[int, Floats] = {}
    for k in contacts:
        if k + 4 < time.size and passage[k] == passage[k + 4]:
            mean, sooner = (
                np.array([x[n] - x[k], y[n] - y[k]]) / (time[n] - time[k]) for n in (k + 4, k + 2)
            )
            own[k] = np.append(mean, series.omega[k + 2])
            # The straight line through the velocities 0.1 and 0.2 s later, at 0.05 s.
            begun[k] = np.append(sooner + (sooner - mean) * 0.05 / 0.1, series.omega[k + 2])
    assert FILTER.least_prior_contacts < len(own) < len(contacts)
    means, starts = {}, {}
    for k in contacts:
        apart = {j: math.hypot(x[j] - x[k], y[j] - y[k]) for j in own if j != k}
        nearest = sorted(apart, key=apart.__getitem__)[: FILTER.prior_contacts]
        means[k], starts[k] = (np.mean([of[j] for j in nearest], axis=0) for of in (own, begun))
    away = [motion - means[k] for k, motion in own.items()]
    std = np.sqrt(np.mean(np.square(away), axis=0))
    for k in contacts:
        flight = found[passage == passage[k]]
        np.testing.assert_allclose(
            flight, np.broadcast_to(np.append(starts[k], std), flight.shape), rtol=1e-9
        )
    few, enough = list(own), FILTER.least_prior_contacts
    for count, known in ((enough - 1, False), (enough, True)):
        excluded = np.zeros(800, np.uint8)
        excluded[few[:count]] = 1
        prior = velocity_prior(replace(series, excluded=excluded), 0.01)
        assert prior is not None
        assert np.isfinite(prior[few[0]]).all() == known
    # Where the velocities scatter by more than 0.1 m/s, nothing is expected behind a contact.
    wild = velocity_prior(replace(series, x=40.0 * x, y=40.0 * y), 0.4)
    assert wild is not None
    assert np.isnan(wild[contacts]).all()


def test_noise_of_the_camera_behind_contacts_is_hardly_drag(passes: Passes) -> None:
    """2,400 flights of 0.6 s to and fro through still water; C_d is known to 1.3 %.

    Where nothing is expected of the velocity behind a contact, the filter does not begin again, and
    these contacts displace the block, too.
    """
    rng = np.random.default_rng(0)
    flights, samples, drag, intensity, noise = 2400, 7, 0.45, 1e-7, 3e-4
    body = passes.body
    block, water, depth = body.study.block, body.study.water, body.study.wetted_depth_m
    rate = 0.5 * water.density_kg_m3 * drag * block.side_m * depth / block.mass_kg
    way = (-1.0) ** np.arange(flights)
    velocity = way * (0.03 + 0.003 * rng.normal(size=flights))
    place, places = -0.01 * way, []
    for _ in range(samples):
        places.append(place)
        for _ in range(100):
            kick = math.sqrt(1e-3 * intensity) * rng.normal(size=flights)
            velocity = velocity - 1e-3 * rate * velocity * np.abs(velocity) + kick
            place = place + 1e-3 * velocity
    count = flights * samples
    excluded = np.zeros(count, dtype=np.uint8)
    excluded[::samples] = 1
    seen = body.orientation == "state"
    series = replace(
        passes.series[0],
        time=0.1 * np.arange(count),
        x=np.stack(places, axis=1).ravel() + noise * rng.normal(size=count),
        y=noise * rng.normal(size=count),
        theta=seen * 0.01 * rng.normal(size=count),
        angle=np.zeros(count),
        omega=np.zeros(count),
        excluded=excluded,
    )
    still = np.zeros((2, passes.spline.rows, passes.spline.columns))
    point = Point(still, math.log(drag), math.log(intensity), math.log(noise))
    if seen:
        point = replace(point, log_lever=math.log(1e-4), log_angle_noise=math.log(0.01))

    def off(prior: Floats | None) -> float:
        """Return where the likelihood is largest, in ln C_d from the truth."""
        known = replace(passes, series=[replace(series, velocity_prior=prior)])
        away = np.linspace(-0.1, 0.2, 4)
        points = [replace(point, log_drag=point.log_drag + one) for one in away]
        fall = [known.sums(one, noise="without").deviance for one in points]
        curve = np.polyfit(away, fall, 2)
        return float(-0.5 * curve[1] / curve[0])

    assert abs(off(None)) > 0.03
    assert abs(off(velocity_prior(series, 0.01))) < 0.03


def test_the_velocity_behind_a_gap_is_expected_from_other_passages(stretches: Series) -> None:
    """Against a plain loop over all pairs of samples."""
    series, time, x, y = stretches, stretches.time, stretches.x, stretches.y
    found = velocity_prior(series, 0.01)
    assert found is not None
    stretch = np.repeat(np.arange(40), 20)
    seen: list[tuple[int, int, float, list[float]]] = []
    for k in range(796):
        if stretch[k] == stretch[k + 4] and not series.excluded[k + 1 : k + 5].any():
            over = time[k + 4] - time[k]
            motion = [(x[k + 4] - x[k]) / over, (y[k + 4] - y[k]) / over, series.omega[k + 2]]
            seen.append((k, k + 2, stretch[k], motion))
    means, away = [], []
    for begin in range(0, 800, 20):
        near = [
            (number, motion)
            for _, middle, number, motion in seen
            if number != stretch[begin]
            and math.hypot(x[middle] - x[begin], y[middle] - y[begin]) <= 0.01
        ]
        assert len({number for number, _ in near}) >= FILTER.least_prior_stretches
        means.append(np.mean([motion for _, motion in near], axis=0))
        if not series.excluded[begin]:
            away += [motion - means[-1] for first, _, _, motion in seen if first == begin]
    assert 25 < len(away) < 40  # an interval that is left out ends the passage
    std = np.sqrt(np.mean(np.square(away), axis=0))
    after = np.cumsum(series.begins)
    # Until the first contact of the stretch.
    after = (after == after[20 * stretch]) & (series.excluded[20 * stretch] == 0)
    assert np.count_nonzero(~after) > 100
    np.testing.assert_allclose(found[after, :3], np.repeat(means, 20, axis=0)[after], rtol=1e-9)
    np.testing.assert_allclose(found[after, 3:], np.broadcast_to(std, (800, 3))[after], rtol=1e-9)
    kept = replace(series, velocity_prior=found).part(20, 60).velocity_prior
    assert kept is not None
    np.testing.assert_array_equal(kept, found[20:60])
    free = replace(series, excluded=np.zeros(800, np.uint8))
    assert velocity_prior(free.part(0, 20), 0.01) is None
    assert velocity_prior(free.part(0, 0), 0.01) is None
    # Two other stretches say too little.
    assert velocity_prior(free.part(0, 60), 0.01) is None


COLUMNS = ("x", "y", "theta", "omega", "angle")


@pytest.fixture(scope="module")
def fast(passes: Passes) -> Passes:
    """The first recording, as a camera of 100 Hz would have seen it."""
    series = passes.series[0]
    time = np.arange(series.time[0], series.time[-1], 0.01)
    generator = np.random.default_rng(3)
    seen = {name: np.interp(time, series.time, getattr(series, name)) for name in COLUMNS}
    for name in ("x", "y"):
        seen[name] += generator.normal(0.0, 3e-4, time.size)
    seen["theta"] += generator.normal(0.0, 0.01, time.size)
    excluded = np.zeros(time.size, dtype=np.uint8)
    excluded[1000:1040] = 1
    one = replace(series, time=time, excluded=excluded, **seen)
    return replace(passes, series=[one])


@pytest.mark.slow
def test_of_a_fast_camera_the_information_is_nearly_that_of_all_derivatives(
    fast: Passes, point: Point
) -> None:
    """Means over a tenth of a second: the score loses nothing, the information little.

    In every direction at most a tenth of what is known, of C_d at most one part in a hundred. The
    force is as usual here: an enormous one makes the derivatives change from sample to sample.
    """
    series = fast.series[0]
    assert series.pooled == 10
    point = replace(point, log_intensity=math.log(4.5e-5))
    sums = fast.sums(point, noise="without")
    whole = fast.kernel(series, point, sensitivities=True).run(series.time.size)
    wanted = whole["jacobian"].T @ whole["jacobian"]
    score = whole["jacobian"].T @ whole["whitened"]
    known = Prior(fast).add(Sums(0.0, score, wanted, 0), point, Weights(0.7, 2e4)).information
    root = np.linalg.cholesky(known)
    half = np.linalg.solve(root, sums.information - wanted)
    assert np.linalg.norm(np.linalg.solve(root, half.T), 2) < 0.1
    assert sums.information[-1, -1] == pytest.approx(wanted[-1, -1], rel=0.01)
    assert sums.score == pytest.approx(score, rel=1e-9, abs=1e-9 * np.abs(score).max())
    assert sums.used == whole["used"].sum()
    count = score.size
    noises = fast.sums(point)
    assert noises.score[:count] == pytest.approx(sums.score, rel=1e-9)
    assert noises.deviance == pytest.approx(sums.deviance, rel=1e-12)


def test_pooled_derivatives_are_sums_over_samples(fast: Passes, point: Point) -> None:
    series = fast.series[0]
    plain, pooled = (fast.kernel(series, point, sensitivities=True) for _ in range(2))
    one = plain.run(2003)
    parts = [pooled.run(count, states=False, pooled=7) for count in (700, 1303)]
    assert all("state" not in part for part in parts)
    samples = one["jacobian"].reshape(2003, -1)
    wanted = np.add.reduceat(samples, np.arange(0, 2003, 7)).reshape(-1, pooled.parameters)
    found = np.concatenate([part["jacobian"] for part in parts])
    np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-12)
    whitened = np.concatenate([part["whitened"] for part in parts])
    np.testing.assert_array_equal(whitened, one["whitened"])
    with pytest.raises(ValueError, match="pooled"):
        pooled.run(1, pooled=0)
