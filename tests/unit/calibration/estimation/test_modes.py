"""Two places that fit as well, where the posterior is known: a summary that is a square.

With summaries (a - 1/2)^2 and b, settings a = 1/2 + d and 1/2 - d give the same. A third, a slope
of a as steep as wanted, makes one of them likelier. The posterior is integrated on a grid.
"""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.calibration.estimation.gauss_newton import LocalOptimum, drawn_settings
from driftwalk.calibration.estimation.posterior import (
    POSTERIOR,
    Modes,
    Posterior,
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
