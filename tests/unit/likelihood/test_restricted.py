"""The restricted likelihood of C_d: normal laws whose integrals are known, and brute force."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.core.arrays import Floats
from driftwalk.likelihood import reml
from driftwalk.likelihood.filter.filter_pass import Sums
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.newton import Mode
from driftwalk.likelihood.prior import Weights
from driftwalk.likelihood.reml import Profile, Pull, due_share, profile_at, restricted_drag
from driftwalk.likelihood.spline import Spline

SHAPE = (2, 2, 3)
COUNT = 12


def searched(*, disc: float = 0.0, **passes: Any) -> Any:
    body = SimpleNamespace(outline=SimpleNamespace(disc_radius_m=disc))
    return SimpleNamespace(passes=SimpleNamespace(body=body, **passes))


def mode_of(covariance: Floats, *, log_drag: float = -0.7, **point: Any) -> Mode:
    start = Point(np.zeros(SHAPE), log_drag, -9.0, -8.0, **point)
    return Mode(start, Weights(1.0, 1.0), covariance, 100, 5, True, 0.0)


def random_covariance(size: int, seed: int) -> Floats:
    half = np.random.default_rng(seed).normal(size=(size, 2 * size))
    return half @ half.T / (2 * size)


@pytest.mark.parametrize("disc", [0.0, 0.02])
def test_the_profile_of_a_normal_law_is_that_of_its_minimum(disc: float) -> None:
    """Over the coefficients, at one C_d: a quadratic form is minimised by solving once."""
    generator = np.random.default_rng(1)
    known = np.linalg.inv(random_covariance(COUNT + 1, 2))
    middle = generator.normal(size=COUNT + 1)
    smooth = np.zeros((COUNT + 1, COUNT + 1))
    smooth[:-1, :-1] = np.linalg.inv(random_covariance(COUNT, 3))

    def vector(point: Point) -> Floats:
        return np.append(point.coefficients.ravel(), point.log_drag)

    def sums(point: Point, *, noise: str) -> Sums:
        assert noise == "without"
        off = vector(point) - middle
        return Sums(0.5 * float(off @ known @ off), -known @ off, known, 100)

    def add(found: Sums, point: Point, _: Weights) -> Sums:
        pull = smooth @ vector(point)
        return Sums(
            found.deviance + 0.5 * float(vector(point) @ pull),
            found.score - pull,
            found.information + smooth,
            found.used,
        )

    search = searched(disc=disc, sums=sums)
    search.prior = SimpleNamespace(add=add, log_scale=lambda *_: 0.25)
    mode = mode_of(np.eye(COUNT + 3))

    def lowest(log_drag: float) -> tuple[float, Floats]:
        """Return the smallest deviance at a C_d, and where it is."""
        both = known + smooth
        right = (known @ middle)[:-1] - both[:-1, -1] * log_drag
        best = np.linalg.solve(both[:-1, :-1], right)
        at = np.append(best, log_drag)
        return 0.5 * float((at - middle) @ known @ (at - middle) + at @ smooth @ at), best

    found = profile_at(search, mode, -0.4, 0.1 * generator.normal(size=COUNT))
    deviance, best = lowest(-0.4)
    assert found.deviance == pytest.approx(deviance)
    assert found.coefficients == pytest.approx(best)
    assert found.slope == pytest.approx((lowest(-0.399)[0] - lowest(-0.401)[0]) / 0.002)
    determinant = np.linalg.slogdet((known + smooth)[:-1, :-1])[1]
    assert found.half_log_determinant == pytest.approx(0.5 * determinant - 0.25)
    # The prior pulls a disc's coefficients from where the data alone have them.
    if not disc:
        assert found.pull == Pull()
        return
    inverse = np.linalg.inv((known + smooth)[:-1, :-1])
    away = inverse @ smooth[:-1, :-1] @ best
    assert found.pull.slope == pytest.approx(reml.REML.true_pull * known[-1, :-1] @ away)
    whole = np.trace(inverse @ known[:-1, :-1])
    both = np.trace(inverse @ known[:-1, :-1] @ inverse @ smooth[:-1, :-1])
    rest = both - away @ known[:-1, :-1] @ away
    assert found.pull.share == pytest.approx(reml.REML.true_pull * rest / whole)


class Law:
    """A criterion whose parts are polynomials of ln C_d, and the best coefficients a line."""

    def __init__(
        self,
        steep: float,
        lowest: float,
        determinant: tuple[float, float] = (0.0, 0.0),
        pull: float = 0.0,
        share: float = 0.0,
    ) -> None:
        self.steep, self.lowest, self.determinant = steep, lowest, determinant
        self.pull, self.share = pull, share
        self.line = np.random.default_rng(5).normal(size=(2, COUNT))
        self.asked: list[float] = []

    def __call__(self, search: Any, mode: Mode, log_drag: float, near: Floats) -> Profile:
        self.asked.append(log_drag)
        first, second = self.determinant
        return Profile(
            log_drag,
            0.5 * self.steep * (log_drag - self.lowest) ** 2,
            self.steep * (log_drag - self.lowest),
            7.0 + first * log_drag + second * log_drag**2,
            self.line[0] + self.line[1] * log_drag,
            Pull(self.pull, self.share),
        )

    def minimum(self, share: float = 1.0) -> tuple[float, float]:
        """Return where the criterion is lowest, and its standard deviation there."""
        bend = self.steep + 2.0 * share * self.determinant[1]
        at = (self.steep * self.lowest - share * self.determinant[0] - self.pull) / bend
        return at, 1.0 / math.sqrt(bend)


@pytest.mark.parametrize("share", [1.0, 0.4])
@pytest.mark.parametrize("pull", [0.0, -30.0])
def test_the_minimum_of_quadratics_is_the_closed_form(share: float, pull: float) -> None:
    law = Law(400.0, -0.7, (25.0, 18.0), pull=pull)
    nothing: Any = None
    found = [law(nothing, nothing, at, np.zeros(COUNT)) for at in (-0.75, -0.9, -0.62)]
    place, std = reml._minimum(found, share)
    want, wanted_std = law.minimum(share)
    # The places that are looked at are a thousandth of the span apart.
    assert place == pytest.approx(want, abs=0.28 * 1.01e-3)
    assert std == pytest.approx(wanted_std, rel=1e-9)


@pytest.mark.parametrize("up", [True, False])
def test_a_criterion_that_only_falls_has_no_minimum(up: bool) -> None:
    """The end that is half a span beyond the points is said then, and that nothing holds C_d."""
    law = Law(1e-3, 1e4 if up else -1e4)
    nothing: Any = None
    found = [law(nothing, nothing, at, np.zeros(COUNT)) for at in (-0.75, -0.85, -0.65)]
    place, std = reml._minimum(found)
    assert std == math.inf
    assert place == pytest.approx(-0.55 if up else -0.95)


@pytest.mark.parametrize("slope", [15.0, 55.0])
def test_the_estimate_is_the_minimum_with_what_belongs_to_it(
    monkeypatch: pytest.MonkeyPatch, slope: float
) -> None:
    """Coefficients on their line, noises on the ridge; two more profiles where it is far."""
    law = Law(400.0, -0.7, (slope, 0.0))
    monkeypatch.setattr(reml, "profile_at", law)
    covariance = 1e-4 * random_covariance(COUNT + 3, 6)
    covariance[COUNT, COUNT] = 1.0 / 400.0
    mode = mode_of(covariance)
    found = restricted_drag(searched(), mode, intensity=False)
    want, std = law.minimum()
    assert found.has_minimum
    assert found.log_drag_std == pytest.approx(std)
    log_drag = found.point.log_drag
    assert log_drag == pytest.approx(want, abs=3e-4)
    assert found.point.coefficients.ravel() == pytest.approx(law.line[0] + law.line[1] * log_drag)
    ridge = covariance[:, COUNT] * 400.0 * (log_drag + 0.7)
    assert found.point.log_intensity == pytest.approx(-9.0 + ridge[COUNT + 1])
    assert found.point.log_noise == pytest.approx(-8.0 + ridge[COUNT + 2])
    # At the likelihood's maximum and two standard deviations below; and about a guess that is far.
    assert law.asked[:2] == pytest.approx([-0.7, -0.8])
    assert len(law.asked) == (2 if slope == 15.0 else 4)
    assert law.asked[2:] == pytest.approx([want, want - 0.1][: len(law.asked) - 2], abs=2e-3)
    assert [one.log_drag for one in found.profiles] == sorted(law.asked)


@pytest.mark.parametrize(
    ("factor", "kept"), [(3.9, True), (4.1, False), (0.26, True), (0.24, False)]
)
def test_a_criterion_far_flatter_or_sharper_than_the_likelihood_is_none(
    monkeypatch: pytest.MonkeyPatch, factor: float, kept: bool
) -> None:
    monkeypatch.setattr(reml, "profile_at", Law(400.0 / factor**2, -0.7))
    covariance = np.diag(np.full(COUNT + 3, 1.0 / 400.0))
    mode = mode_of(covariance)
    found = restricted_drag(searched(), mode, intensity=False)
    assert found.has_minimum == kept
    assert found.log_drag_std == pytest.approx(0.05 * (factor if kept else 1.0))
    if not kept:
        assert found.point is mode.point


@pytest.mark.parametrize(("along", "kept"), [(9.0, True), (11.0, False)])
def test_a_noise_that_would_go_far_along_the_ridge_is_held_by_nothing(
    monkeypatch: pytest.MonkeyPatch, along: float, kept: bool
) -> None:
    """C_d moves by 0.1 in its logarithm, and the noise by `along` times that."""
    monkeypatch.setattr(reml, "profile_at", Law(400.0, -0.8))
    covariance = np.diag(np.full(COUNT + 3, 1.0 / 400.0))
    covariance[COUNT + 2, COUNT] = covariance[COUNT, COUNT + 2] = along / 400.0
    covariance[COUNT + 2, COUNT + 2] = 1.0
    found = restricted_drag(searched(), mode_of(covariance), intensity=False)
    assert found.has_minimum == kept


def test_of_a_disc_the_share_that_is_due_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    law = Law(400.0, -0.7, (30.0, 0.0), pull=4.0, share=-0.1)
    monkeypatch.setattr(reml, "profile_at", law)
    monkeypatch.setattr(reml, "due_share", lambda *_: 0.6)
    search = searched(disc=0.02)
    search.prior = SimpleNamespace(matrix=lambda _: np.eye(COUNT // 2))
    covariance = np.diag(np.full(COUNT + 3, 1.0 / 400.0))
    found = restricted_drag(search, mode_of(covariance), intensity=False)
    assert found.point.log_drag == pytest.approx(law.minimum(0.5)[0], abs=3e-4)


def test_the_force_is_corrected_by_a_newton_step_of_its_own_slope(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The other noises go along: the covariance of the noises at this C_d, times the slope."""
    law = Law(400.0, -0.7)
    slope = 0.8

    def profile(search: Any, mode: Mode, log_drag: float, near: Floats) -> Profile:
        q = mode.point.log_intensity + 3.0 * mode.point.number("flow_intensity_1")
        return law(search, mode, log_drag, near)._replace(half_log_determinant=slope * q)

    monkeypatch.setattr(reml, "profile_at", profile)
    covariance = 1e-2 * random_covariance(COUNT + 4, 7)
    covariance[COUNT, COUNT] = 1.0 / 400.0
    covariance[:COUNT, COUNT] = covariance[COUNT, :COUNT] = 0.0
    covariance[COUNT + 1 :, COUNT] = covariance[COUNT, COUNT + 1 :] = 1e-4 * np.array([1, -2, 3])
    mode = mode_of(covariance, opened={"flow_intensity_1": 0.3})
    with_step, without = (
        restricted_drag(searched(), mode, intensity=one).point for one in (True, False)
    )
    # Of normal numbers some of which are known the precision is that of the others.
    precision = np.linalg.inv(covariance[COUNT:, COUNT:])[1:, 1:]
    wanted = -np.linalg.solve(precision, slope * np.array([1.0, 0.0, 3.0]))
    moved = np.array([with_step.extras[name] - without.extras[name] for name in with_step.extras])
    assert moved == pytest.approx(wanted, rel=1e-6)
    assert with_step.log_drag == without.log_drag


def body() -> Any:
    block, water = SimpleNamespace(side_m=0.03, mass_kg=0.012), SimpleNamespace(density_kg_m3=1e3)
    return SimpleNamespace(study=SimpleNamespace(block=block, water=water, wetted_depth_m=0.02))


def tracks(generator: np.random.Generator, flows: int) -> tuple[list[Series], list[Floats]]:
    """Return short series with a gap and a contact in each, and states of a filter."""
    series, states = [], []
    for flow in range(flows):
        count = 40 + 7 * flow
        time = 3.0 + 0.1 * np.arange(count)
        time[25:] += 5.0
        excluded = np.zeros(count, dtype=np.uint8)
        excluded[12 + flow] = 1
        zero = np.zeros(count)
        series.append(Series(time, zero, zero, zero, zero, excluded, flow=flow))
        state = np.column_stack(
            [
                0.02 + 0.015 * np.sin(0.3 * np.arange(count)),
                0.02 + 0.015 * np.cos(0.2 * np.arange(count)),
                0.05 * generator.normal(size=(count, 2)),
            ]
        )
        state[[0, 5]] = np.nan
        states.append(state)
    return series, states


def sums_by_hand(series: Series, state: Floats, point: Point, spline: Spline) -> list[Floats]:
    """Return A and q M^-1 B of one series, with the memory integrated in 100 steps a sample."""
    one, other = np.zeros((spline.size, spline.size)), np.zeros((spline.size, spline.size))
    memory = np.zeros(spline.size)
    for k in range(series.time.size):
        step = series.time[k] - series.time[k - 1] if k else 0.0
        if series.excluded[k] or not np.isfinite(state[k]).all() or step > 1.0:
            memory = np.zeros(spline.size)
            continue
        x, y, vx, vy = state[k]
        along_x, along_y = spline.design(np.array([x]), np.array([y]))
        basis = np.outer(along_y[0], along_x[0]).ravel()
        water = [float(one.ravel() @ basis) for one in point.coefficients]
        slip = math.hypot(water[0] - vx, water[1] - vy)
        pull = 0.5 * 1000.0 * 0.03 * 0.02 * math.exp(point.log_drag) / 0.012 * slip
        # Along the slip the force pulls back with the slope 2, across it with 1.
        rate = 0.5 * (2.0 + 1.0) * pull
        total = np.zeros(spline.size)
        for _ in range(100):
            change = rate * (basis - memory) * step / 100
            total += (memory + 0.5 * change) / 100
            memory = memory + change
        weight = rate**2 * step / math.exp(point.log_intensity)
        one += weight * np.outer(basis, basis)
        other += weight * np.outer(basis, total)
    return [one, other]


@pytest.mark.parametrize("flows", [1, 2])
def test_the_share_that_is_due_is_the_sum_over_the_samples(
    monkeypatch: pytest.MonkeyPatch, flows: int
) -> None:
    """tr(M B) / tr(M A), in parts of 16 samples; Euler's steps are off by a few parts in 1000."""
    monkeypatch.setattr(reml, "SAMPLES_AT_ONCE", 16)
    generator = np.random.default_rng(8)
    spline = Spline(-0.01, -0.02, 0.02, 6, 7)
    series, states = tracks(generator, flows)
    shape = (flows, 2, spline.rows, spline.columns)[1 if flows == 1 else 0 :]
    point = Point(0.02 * generator.normal(size=shape), math.log(0.6), math.log(2e-3), -8.0)
    if flows == 2:
        point = replace(point, opened={"flow_intensity_1": 0.7})

    def state_of(one: Series, _: Point) -> Floats:
        return states[one.flow]

    passes: Any = SimpleNamespace(
        body=body(), spline=spline, series=series, flows=flows, states=state_of
    )
    prior = 30.0 * np.eye(spline.size) + 5.0 * random_covariance(spline.size, 9)
    due = whole = 0.0
    for one, state in zip(series, states, strict=True):
        information, remembered = sums_by_hand(one, state, point.in_flow(one.flow), spline)
        inverse = np.linalg.inv(information + prior)
        due += float(np.trace(inverse @ remembered))
        whole += float(np.trace(inverse @ information))
    assert 0.05 < due / whole < 0.95
    assert due_share(passes, prior, point) == pytest.approx(due / whole, rel=5e-3)
