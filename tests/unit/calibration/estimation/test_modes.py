"""Two places that fit as well, where the posterior is known: a summary that is a square.

With summaries (a - 1/2)^2 and b, settings a = 1/2 + d and 1/2 - d give the same. A third, a slope
of a as steep as wanted, makes one of them likelier. The posterior is integrated on a grid.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.estimation.gauss_newton import LocalOptimum, drawn_settings
from driftwalk.calibration.estimation.posterior import (
    POSTERIOR,
    SIMULATED_REGION,
    Modes,
    Posterior,
    Region,
    _reaches,
    _stayed,
    find_modes,
    sample_posterior,
)
from driftwalk.calibration.estimation.synthetic_likelihood import fit_emulator

SPREAD = np.array([0.006, 0.01, 0.05])
TRUTH = np.array([0.7, 0.4])


def expected(settings: np.ndarray, steep: float) -> np.ndarray:
    a, b = settings.T
    return np.column_stack([(a - 0.5) ** 2, b, steep * a])


def end_at(centre: tuple[float, float], steep: float, seed: int) -> LocalOptimum:
    middle, width = np.array(centre), np.full(2, 0.05)
    settings = drawn_settings(middle, width, 512, seed)
    noise = SPREAD * np.random.default_rng(seed).normal(size=(512, 3))
    emulator = fit_emulator(settings, expected(settings, steep) + noise, centre=middle, width=width)
    return LocalOptimum(emulator, emulator.solve(expected(TRUTH[None], steep)[0], reach=1.25), 1)


def found_from(*centres: tuple[float, float], steep: float = 0.0) -> tuple[Modes, list[int]]:
    """Return the places that searches with these ends come to, and which were sampled."""
    rng = np.random.default_rng(3)
    recorded = np.repeat(expected(TRUTH[None], steep), 2, axis=0)
    sampled = []

    def simulate(settings: np.ndarray, *, parts: int) -> np.ndarray:
        noise = SPREAD * rng.normal(size=(len(settings), parts, 3))
        return expected(settings, steep)[:, None] + noise

    def sample_about(end: LocalOptimum, number: int) -> Posterior:
        sampled.append(number)
        return sample_posterior(simulate, recorded, end, seed=10 * number)

    optima = [end_at(one, steep, 5 + place) for place, one in enumerate(centres)]
    return find_modes(optima, sample_about), sampled


def share_above(steep: float) -> float:
    """Return the share of the posterior with a above 1/2, by sums over a fine grid of a."""
    at = np.column_stack([np.linspace(0.0, 1.0, 20_001), np.full(20_001, TRUTH[1])])
    apart = (expected(at, steep) - expected(TRUTH[None], steep)) / SPREAD
    density = np.exp(-0.5 * (apart**2).sum(axis=1))
    return float(density[at[:, 0] > 0.5].sum() / density.sum())


@pytest.mark.slow
@pytest.mark.parametrize("steep", [0.0, 0.15])
def test_both_places_have_their_shares(steep: float):
    """The discrepancies of covariances from simulations have errors of 0.1: 0.05 of a share, at
    most."""
    modes, _ = found_from((0.71, 0.41), (0.29, 0.39), steep=steep)
    assert len(modes.places) == 2
    first_is_below = modes.places[0].sample[:, 0].mean() < 0.5
    above = modes.weights[int(first_is_below)]
    sample = modes.mixed([one.sample for one in modes.places])
    assert sample.shape == (POSTERIOR.size, 2)
    assert np.mean(sample[:, 0] > 0.5) == pytest.approx(share_above(steep), abs=0.12)
    assert above == pytest.approx(share_above(steep), abs=0.12)


@pytest.mark.slow
def test_a_parameter_is_apart_where_its_places_are():
    modes, _ = found_from((0.71, 0.41), (0.29, 0.39))
    assert modes.apart([one.sample for one in modes.places]).tolist() == [True, False]


@pytest.mark.slow
def test_a_place_that_the_recording_rules_out_is_left_out():
    """A slope of 1.25 puts the other place 10 deviations off: 100 of discrepancy."""
    modes, sampled = found_from((0.29, 0.39), (0.71, 0.41), steep=1.25)
    assert sampled == [0, 1]
    assert len(modes.places) == 1
    assert modes.weights.tolist() == [1.0]
    np.testing.assert_allclose(modes.best.sample.mean(axis=0), TRUTH, atol=0.01)
    assert not modes.apart([modes.best.sample]).any()


@pytest.mark.slow
def test_searches_with_one_end_are_one_place():
    modes, sampled = found_from((0.71, 0.41), (0.7, 0.4))
    assert sampled == [0]
    assert len(modes.places) == 1


def place_at(centre: float, *, wide: float = 0.01, discrepancy: float = 0.0, variance: float = 0.0):
    """Return a posterior of two parameters about a place, as wide as it is stated exactly."""
    at = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
    sample = np.array([centre, 0.5]) + wide * math.sqrt(0.75) * at
    found: Any = SimpleNamespace(
        sample=sample,
        region=Region(np.array([centre, 0.5]), wide * np.eye(2)),
        solution=SimpleNamespace(discrepancy=discrepancy, setting=np.array([centre, 0.5])),
        emulator=SimpleNamespace(log_variance=variance),
    )
    return found


def found_among(*places: Any) -> tuple[Modes, list[int]]:
    sampled: list[int] = []

    def sample_about(optimum: Any, number: int) -> Any:
        sampled.append(number)
        return places[number]

    optima: Any = [SimpleNamespace(solution=one.solution) for one in places]
    return find_modes(optima, sample_about), sampled


def test_places_are_weighed_by_their_evidence() -> None:
    """The likelihood there times the volume: exp(-d / 2) std^2 / sqrt(det S)."""
    first = place_at(0.2, wide=0.01, discrepancy=7.0, variance=1.0)
    second = place_at(0.8, wide=0.02, discrepancy=9.0, variance=0.4)
    third = place_at(0.5, wide=0.01, discrepancy=30.0)
    modes, sampled = found_among(first, second, third)
    assert sampled == [0, 1, 2]
    evidence = [math.exp(-3.5 - 0.5) * 0.01**2, math.exp(-4.5 - 0.2) * 0.02**2]
    assert evidence[1] > evidence[0]
    # The likelier one comes first, and one that is ten behind in the deviance is ruled out.
    assert modes.places == (second, first)
    assert modes.best is second
    assert modes.weights == pytest.approx(np.array(evidence[::-1]) / sum(evidence))


@pytest.mark.parametrize(("behind", "left"), [(9.9, 2), (10.1, 1)])
def test_a_place_far_behind_is_ruled_out(behind: float, left: int) -> None:
    modes, _ = found_among(place_at(0.2), place_at(0.8, discrepancy=behind))
    assert len(modes.places) == left


def test_an_end_within_a_region_is_no_other_place() -> None:
    """A region of two parameters reaches 3 standard deviations."""
    modes, sampled = found_among(place_at(0.2), place_at(0.229), place_at(0.231))
    assert sampled == [0, 2]
    assert len(modes.places) == 2
    # Draws that come back to the first place are none either.
    wanders = place_at(0.8)
    wanders.sample = wanders.sample - np.array([0.6, 0.0])
    modes, sampled = found_among(place_at(0.2), wanders)
    assert sampled == [0, 1]
    assert len(modes.places) == 1
    assert _reaches(place_at(0.2), np.array([0.2, 0.529]))
    assert not _reaches(place_at(0.2), np.array([0.2, 0.531]))


def test_each_place_gives_draws_by_its_share() -> None:
    modes = Modes((place_at(0.2), place_at(0.8)), np.array([0.75, 0.25]))
    draws = [np.column_stack([np.arange(512.0), np.full(512, k)]) for k in range(2)]
    found = modes.mixed(draws)
    assert np.bincount(found[:, 1].astype(int)).tolist() == [384, 128]
    for k, count in ((0, 384), (1, 128)):
        own = found[found[:, 1] == k, 0]
        assert (own[0], own[-1]) == (0.0, 511.0)
        assert np.abs(np.diff(own) - 511.0 / (count - 1)).max() <= 1.0


def test_intervals_that_do_not_meet_the_first_s_are_apart() -> None:
    """Even draws between two ends have their 5 % and 95 % quantiles a twentieth inside."""
    share = np.linspace(0.0, 1.0, 101)

    def draws(*ends: tuple[float, float]) -> np.ndarray:
        return np.column_stack([low + (high - low) * share for low, high in ends])

    first = draws((0.4, 0.5), (0.4, 0.5), (0.4, 0.5), (0.4, 0.5))
    # Above by a little; meeting by a little; below; and far above only in the last place.
    second = draws((0.491, 0.591), (0.489, 0.589), (0.3, 0.408), (0.4, 0.5))
    third = draws((0.4, 0.5), (0.4, 0.5), (0.4, 0.5), (0.6, 0.7))
    modes = Modes((place_at(0.2),) * 3, np.full(3, 1 / 3))
    wanted = [True, False, True, True]
    for rest in ((second, third), (third, second)):
        assert modes.apart([first, *rest]).tolist() == wanted
    assert not modes.apart([first]).any()


@pytest.mark.parametrize(
    ("moved", "wider", "stayed"),
    [(0.49, 1.0, True), (-0.51, 1.0, False), (0.0, 1.29, True), (0.0, 1.31, False)],
)
def test_draws_stay_where_they_hardly_move_and_hardly_grow(
    moved: float, wider: float, stayed: bool
) -> None:
    region = Region(np.full(2, 0.5), 0.01 * np.eye(2))
    std = np.array([0.01, 0.01 * wider])
    assert _stayed(np.array([0.0, moved]) * std, std, region) is stayed


def test_a_region_that_is_as_wide_as_it_may_be_is_at_rest() -> None:
    widest = SIMULATED_REGION.widest / 3.0
    for share, stayed in ((0.985, False), (0.995, True)):
        region = Region(np.full(2, 0.5), share * widest * np.eye(2))
        std = np.full(2, 2.0 * widest)
        assert _stayed(np.zeros(2), std, region) is stayed
