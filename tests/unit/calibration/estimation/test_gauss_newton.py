"""From a start to the setting of least discrepancy, where the truth and the valley to it are
known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from driftwalk.calibration.estimation.gauss_newton import (
    GAUSS_NEWTON,
    LocalOptimum,
    drawn_settings,
    minimise_discrepancy,
    rounded,
    simulations_of,
)
from driftwalk.calibration.evolution import RESOLUTION

SPREAD = np.array([0.003, 0.1, 0.1, 0.05])


def valley(settings: np.ndarray) -> np.ndarray:
    """Return expected summaries: one holds b to a bent line in a, the others tell the rest."""
    a, b = settings.T
    return np.column_stack([b - 0.2 - 2.4 * (a - 0.5) ** 2, a + b, np.exp(a), a * b])


class Recorder:
    """A simulator that keeps what it was asked for."""

    def __init__(self, expected: Callable[[np.ndarray], np.ndarray], seed: int) -> None:
        self.expected, self.rng = expected, np.random.default_rng(seed)
        self.asked: list[np.ndarray] = []

    def __call__(self, settings: np.ndarray, *, parts: int) -> np.ndarray:
        self.asked.append(settings)
        found = self.expected(settings)
        noise = SPREAD[: found.shape[1]] * self.rng.normal(size=(parts, *found.shape))
        return np.swapaxes(found + noise, 0, 1)


def from_start(
    truth: list[float], start: list[float], seed: int, *, width: float = GAUSS_NEWTON.widest
) -> tuple[LocalOptimum, Recorder]:
    simulate = Recorder(valley, seed)
    recorded = valley(np.array([truth]))[0]
    wide = np.full(2, width)
    return minimise_discrepancy(simulate, recorded, np.array(start), wide, seed=seed), simulate


@pytest.mark.false_alarm(1e-4)
@pytest.mark.parametrize("start", [(0.1, 0.6), (0.9, 0.2), (0.15, 0.05), (0.0, 0.0), (1.0, 1.0)])
@pytest.mark.parametrize("truth", [(0.8, 0.416), (0.2, 0.416), (0.5, 0.2)])
def test_the_end_of_a_bent_valley_is_reached(
    truth: list[float], start: list[float], fresh_seed: Callable[[int], int]
):
    """A recording without noise of its own: what is left is the error of 256 simulations.

    That is about a sixth of the standard deviation of the answer; one of it is allowed.
    """
    found, simulate = from_start(truth, list(start), fresh_seed(3))
    apart = (found.solution.setting - truth) / found.solution.std
    assert np.abs(apart).max() < 1.0
    assert found.solution.discrepancy < found.emulator.summaries
    assert found.rounds == len(simulate.asked) <= GAUSS_NEWTON.most_rounds


@pytest.mark.parametrize("truth", [(0.0, 0.8), (1.0, 0.8), (0.5, 0.2), (1.4, 0.9)])
@pytest.mark.parametrize("start", [(0.0, 1.0), (1.0, 0.0)])
def test_settings_are_always_in_the_cube(truth: list[float], start: list[float]):
    """Also where the truth is at its end, or outside."""
    found, simulate = from_start(truth, list(start), 4)
    for settings in simulate.asked:
        assert settings.shape == (256, 2)
        assert settings.min() >= 0.0
        assert settings.max() <= 1.0
        np.testing.assert_array_equal(settings, rounded(settings))
    assert (found.solution.setting >= 0.0).all()
    assert (found.solution.setting <= 1.0).all()
    if truth[0] in (0.0, 1.0):
        assert abs(found.solution.setting[0] - truth[0]) < 2 * found.solution.std[0]


def test_the_deviations_at_the_end_are_those_of_the_model():
    """The curvature at the truth from derivatives of the summaries, taken by hand."""
    truth = np.array([0.8, 0.416])
    found, _ = from_start(truth.tolist(), [0.7, 0.4], 5)
    a, b = truth
    slopes = np.array([[-4.8 * (a - 0.5), 1.0], [1.0, 1.0], [np.exp(a), 0.0], [b, a]])
    scaled = slopes / SPREAD[:, None]
    wanted = np.sqrt(np.diag(np.linalg.inv(scaled.T @ scaled)))
    np.testing.assert_allclose(found.solution.std, wanted, rtol=0.25)


def test_a_model_far_from_the_recording_still_ends():
    """No setting gives these summaries: the search stops by itself, at the least bad place."""
    simulate = Recorder(valley, 6)
    recorded = np.array([0.0, 0.5, 5.0, -3.0])
    found = minimise_discrepancy(simulate, recorded, np.array([0.5, 0.5]), np.full(2, 0.1), seed=6)
    assert found.rounds <= GAUSS_NEWTON.most_rounds
    assert np.isfinite(found.solution.setting).all()
    assert found.solution.discrepancy > 100.0


def test_a_search_that_stays_far_from_the_recording_is_given_up_early():
    """Of a recording that no setting gives; one that a setting gives is followed to its end."""
    far, near = np.array([0.0, 0.5, 5.0, -3.0]), valley(np.array([[0.8, 0.416]]))[0]
    start, width = np.array([0.5, 0.5]), np.full(2, 0.1)
    rounds = [
        minimise_discrepancy(
            Recorder(valley, 6), recorded, start, width, seed=6, give_up=give_up
        ).rounds
        for recorded in (far, near)
        for give_up in (np.inf, 3.0)
    ]
    assert rounds[0] > rounds[1] == GAUSS_NEWTON.fewest_rounds
    assert rounds[2] == rounds[3]


def test_the_same_seed_gives_the_same_end():
    first, again, other = (
        from_start([0.8, 0.416], [0.3, 0.3], seed)[0].solution.setting for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("parameters", [1, 3, 6, 12])
def test_there_are_enough_simulations_for_every_coefficient(parameters: int):
    """A constant, slopes, squares and products: (p + 1)(p + 2) / 2 of them."""
    coefficients = (parameters + 1) * (parameters + 2) // 2
    for count, each, fewest in zip(simulations_of(parameters), (4, 16), (256, 512), strict=True):
        assert count == max(fewest, 2 ** int(np.ceil(np.log2(each * coefficients))))


@pytest.mark.parametrize("centre", [(0.5, 0.5), (0.05, 0.99), (0.0, 1.0)])
def test_drawn_settings_fill_the_box_in_the_cube(centre: tuple[float, float]):
    """256 points of a Sobol' sequence: one in each of 256 equal parts along each axis."""
    middle, width = np.array(centre), np.array([0.1, 0.02])
    drawn = drawn_settings(middle, width, 256, 9)
    low, high = np.maximum(middle - width, 0.0), np.minimum(middle + width, 1.0)
    share = (drawn - low) / (high - low)
    slack = RESOLUTION / (high - low)
    for column, one in zip(np.sort(share, axis=0).T, slack, strict=True):
        assert (np.abs(column - (np.arange(256) + 0.5) / 256) <= 0.5 / 256 + one).all()
