"""Draws of settings where the posterior is known: linear summaries with normal noise.

With summaries A u + noise of covariance S, settings u are normal, with precision A' S^-1 A, about
the weighted least squares; the ends of the unit cube cut that off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import truncnorm

from driftwalk.calibration.estimation.gauss_newton import LocalOptimum, drawn_settings, rounded
from driftwalk.calibration.estimation.posterior import POSTERIOR, Posterior, sample_posterior
from driftwalk.calibration.estimation.synthetic_likelihood import fit_emulator

SLOPES = np.array([[1.0, 0.3], [0.2, 1.0], [0.5, 0.5], [0.4, -0.3]])
SPREAD = np.array([0.02, 0.04, 0.03, 0.05])
PRECISION = (SLOPES / SPREAD[:, None] ** 2).T @ SLOPES
COVARIANCE = np.linalg.inv(PRECISION)
STD = np.sqrt(np.diag(COVARIANCE))


class Sampled(NamedTuple):
    posterior: Posterior
    boxes: int


def centre_of(recorded: np.ndarray) -> np.ndarray:
    """Return the mean of the settings that could have given summaries."""
    return COVARIANCE @ (SLOPES / SPREAD[:, None] ** 2).T @ recorded


def sampled(recorded: np.ndarray, seed: int, *, width: float = 0.1) -> Sampled:
    """Sample from a first box about the solution, of a width in parts of the ranges."""
    rng = np.random.default_rng(seed)
    boxes = []

    def simulate(settings: np.ndarray, *, parts: int) -> np.ndarray:
        assert parts == len(recorded)
        assert settings.min() >= 0.0
        assert settings.max() <= 1.0
        boxes.append(settings)
        noise = SPREAD * rng.normal(size=(len(settings), parts, len(SPREAD)))
        return (settings @ SLOPES.T)[:, None] + noise

    centre, wide = rounded(np.clip(centre_of(recorded[0]), 0.0, 1.0)), np.full(2, width)
    first = drawn_settings(centre, wide, 512, seed)
    summaries = first @ SLOPES.T + SPREAD * rng.normal(size=(512, len(SPREAD)))
    emulator = fit_emulator(first, summaries, centre=centre, width=wide)
    solution = emulator.solve(recorded[0], reach=1.25)
    return Sampled(
        sample_posterior(simulate, recorded, LocalOptimum(emulator, solution, 1), seed=seed),
        len(boxes),
    )


@pytest.mark.slow
@pytest.mark.false_alarm(1e-3)
def test_mean_and_covariance_are_those_of_a_normal_posterior(fresh_seed: Callable[[int], int]):
    """Averages over 5 recordings.

    An emulator from 512 simulations has an error of 0.09 standard deviations (of 6 coefficients,
    the constant's is the largest: 3 / 512 of the noise's variance), and 512 draws of a chain that
    forgets within 30 to 50 steps one of 0.06: 0.05 for the mean of 5. The covariances have errors
    of 5 %, from draws and simulations, of 2.2 % after averaging. A mean beyond four deviations, of
    two, and a covariance beyond 4.5, of three: 1.5e-4, and some more for tails.
    """
    apart, spreads, correlations = [], [], []
    for number in range(5):
        seed = fresh_seed(10 + number)
        rng = np.random.default_rng(seed)
        truth = rng.uniform(0.35, 0.65, 2)
        recorded = np.array([truth @ SLOPES.T + SPREAD * rng.normal(size=4)] * 2)
        found = sampled(recorded, seed).posterior
        assert found.sample.shape == (POSTERIOR.size, 2)
        mean = centre_of(recorded[0])
        apart.append((found.sample.mean(axis=0) - mean) / STD)
        spreads.append(np.log(found.sample.std(axis=0) / STD))
        correlations.append(np.corrcoef(found.sample.T)[0, 1])
        assert np.abs(apart[-1]).max() < 0.6
        np.testing.assert_allclose(found.solution.setting, mean, atol=0.5 * STD.min())
    wanted = COVARIANCE[0, 1] / STD.prod()
    assert np.abs(np.mean(apart, axis=0)).max() < 0.2
    assert np.abs(np.mean(spreads, axis=0)).max() < 0.1
    assert abs(np.mean(correlations) - wanted) < 0.1


@pytest.mark.slow
@pytest.mark.false_alarm(1e-3)
@pytest.mark.parametrize(
    ("end", "outside"), [(0.0, -1.0), pytest.param(1.0, 1.0, marks=pytest.mark.study)]
)
def test_the_end_of_a_range_cuts_draws_off(
    end: float, outside: float, fresh_seed: Callable[[int], int]
):
    """One parameter within or beyond the end of its range by a standard deviation.

    Slopes of one parameter alone make the two independent: the first is a truncated normal, with
    mean and deviation in closed form; averages of 4 recordings.
    """
    means, spreads = [], []
    for number in range(4):
        found = cut_off(end, outside, fresh_seed(50 + number))
        away = (found - end) / 0.02 * (1.0 if end == 0.0 else -1.0)
        assert away.min() >= 0.0
        means.append(away.mean())
        spreads.append(away.std())
    law = truncnorm(outside, np.inf, loc=-outside)
    assert np.mean(means) == pytest.approx(law.mean(), abs=0.25)
    assert np.mean(spreads) == pytest.approx(law.std(), rel=0.2)


def cut_off(end: float, outside: float, seed: int) -> np.ndarray:
    """Return draws of a parameter with a standard deviation of 0.02 about a place at an end."""
    rng = np.random.default_rng(seed)
    beyond = end - 0.02 * outside if end == 0.0 else end + 0.02 * outside
    recorded = np.array([[beyond, 0.5], [beyond, 0.5]])

    def simulate(settings: np.ndarray, *, parts: int) -> np.ndarray:
        assert settings.min() >= 0.0
        assert settings.max() <= 1.0
        return settings[:, None] + 0.02 * rng.normal(size=(len(settings), parts, 2))

    centre, width = np.array([end, 0.5]), np.full(2, 0.08)
    first = drawn_settings(centre, width, 512, seed)
    emulator = fit_emulator(first, simulate(first, parts=1)[:, 0], centre=centre, width=width)
    solution = emulator.solve(recorded[0], reach=1.25)
    return sample_posterior(
        simulate, recorded, LocalOptimum(emulator, solution, 1), seed=seed
    ).sample[:, 0]


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.012, 0.1])
def test_a_box_that_is_too_small_is_widened(width: float):
    """The first one ends within half a standard deviation; draws fill the last one all the same.

    Deviations of one recording's draws have errors of 5 % from draws and simulations.
    """
    recorded = np.array([[0.5, 0.5] @ SLOPES.T, [0.52, 0.46] @ SLOPES.T])
    found, boxes = sampled(recorded, 3, width=width)
    np.testing.assert_allclose(found.sample.std(axis=0), STD, rtol=0.25)
    assert (np.abs(found.sample.mean(axis=0) - 0.5) < 0.6 * STD).all()
    assert (found.emulator.width > 1.5 * STD).all()
    assert boxes == (2 if width > STD.max() else 4)
    # Each part of the recording has a solution of its own.
    np.testing.assert_allclose(found.solution.setting, [0.5, 0.5], atol=0.4 * STD.max())
    (other,) = found.others
    np.testing.assert_allclose(other.setting, [0.52, 0.46], atol=0.4 * STD.max())


@pytest.mark.slow
def test_the_same_seed_gives_the_same_draws():
    recorded = np.array([[0.5, 0.5] @ SLOPES.T] * 2)
    first, again = (sampled(recorded, 5).posterior.sample for _ in range(2))
    np.testing.assert_array_equal(first, again)
