"""The part of the ranges in which parameters lie, with simulators whose truth is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from driftwalk.calibration.estimation.regression_abc import REGRESSION, sequential_regression
from driftwalk.core.errors import InputError

Simulate = Callable[[np.ndarray], np.ndarray]


def as_they_are(settings: np.ndarray) -> np.ndarray:
    return settings


def ordered(settings: np.ndarray) -> np.ndarray:
    """Put the first two parameters in order."""
    found = settings.copy()
    found[:, :2] = np.sort(settings[:, :2], axis=1)
    return found


def bent(settings: np.ndarray) -> np.ndarray:
    """Return expected summaries: none is linear, none depends on one parameter alone."""
    a, b, c = settings.T
    return np.column_stack(
        [np.exp(2 * a) + b, a * b, np.sin(3 * c) + a, c**2 * (1 + b), b / (0.3 + c), a - b**2]
    )


def alike(settings: np.ndarray) -> np.ndarray:
    """Return expected summaries to which the first two parameters are the same."""
    a, b, c = settings.T
    return np.column_stack([a + b, a * b, (a - b) ** 2, np.exp(c), c * (a + b)])


def noisy(expected: Simulate, spread: float, seed: int) -> Simulate:
    rng = np.random.default_rng(seed)

    def simulate(settings: np.ndarray) -> np.ndarray:
        found = expected(settings)
        return found + spread * rng.normal(size=found.shape)

    return simulate


@pytest.mark.false_alarm(2e-3)
def test_the_box_holds_the_truth(fresh_seed: Callable[[int], int]):
    """Twenty recordings of settings anywhere in the cube, each at a distance of under 5 errors.

    Errors are those of a regression that is bent a little: of sixty, no more than nine lie outside
    two of them (normal numbers: 2.7 on average, and ten or more once in 4000 times).
    """
    rng = np.random.default_rng(fresh_seed(1))
    apart = []
    for number in range(20):
        truth = rng.uniform(0.1, 0.9, (1, 3))
        simulate = noisy(bent, 0.02, fresh_seed(100 + number))
        regression = sequential_regression(
            simulate, simulate(truth)[0], 3, order=as_they_are, seed=number
        )
        assert regression.found
        assert (regression.error < 0.15).all()
        assert ((regression.centre >= 0.0) & (regression.centre <= 1.0)).all()
        apart += (np.abs(regression.centre - truth[0]) / regression.error).tolist()
    assert max(apart) < 5.0
    assert sum(one > 2.0 for one in apart) <= 9


def test_less_noise_makes_a_smaller_box():
    errors = []
    for spread in (0.3, 0.1, 0.03):
        simulate = noisy(bent, spread, 3)
        regression = sequential_regression(
            simulate, bent(np.array([[0.4, 0.6, 0.5]]))[0], 3, order=as_they_are, seed=3
        )
        errors.append(np.median(regression.error))
    assert errors[0] > errors[1] > errors[2]


def test_parameters_in_order_are_found_and_out_of_order_end_between():
    truth = np.array([[0.25, 0.7, 0.4]])
    simulate = noisy(alike, 0.01, 4)
    recorded = alike(truth)[0]
    regression = sequential_regression(simulate, recorded, 3, order=ordered, seed=4)
    assert regression.found
    np.testing.assert_allclose(regression.centre, truth[0], atol=0.05)
    assert (regression.error < 0.05).all()
    loose = sequential_regression(simulate, recorded, 3, order=as_they_are, seed=4)
    # Half of the simulations near the recording have one order, half the other.
    np.testing.assert_allclose(loose.centre[:2], 0.475, atol=0.15)
    assert (loose.error[:2] > 0.15).all()


def test_settings_are_simulated_in_order_and_in_the_cube():
    seen: list[np.ndarray] = []
    model = noisy(alike, 0.2, 5)

    def simulate(settings: np.ndarray) -> np.ndarray:
        seen.append(settings)
        return model(settings)

    sequential_regression(
        simulate, alike(np.array([[0.02, 0.97, 1.0]]))[0], 3, order=ordered, seed=5
    )
    assert 1 < len(seen) <= REGRESSION.most_rounds
    for settings in seen:
        assert settings.shape == (REGRESSION.simulations, 3)
        assert (settings[:, 0] <= settings[:, 1]).all()
        assert settings.min() >= 0.0
        assert settings.max() <= 1.0
    # The first box is the cube, the next one a part of it, along each axis.
    first, second = (np.ptp(one, axis=0) for one in seen[:2])
    assert (first > 0.9).all()
    assert (second < 0.8 * first).all()


def test_summaries_that_say_nothing_find_nothing():
    rng = np.random.default_rng(6)
    rounds = []

    def simulate(settings: np.ndarray) -> np.ndarray:
        rounds.append(len(settings))
        return rng.normal(size=(len(settings), 80))

    regression = sequential_regression(simulate, np.zeros(80), 4, order=as_they_are, seed=6)
    assert not regression.found
    # A uniform number has an error of 0.29, and a regression on noise no smaller one than LOST.
    assert (regression.error > REGRESSION.lost).all()
    assert len(rounds) == 2


@pytest.mark.parametrize("size", [0.0, 3.0, 1e-12])
def test_a_model_that_always_moves_alike_is_refused(size: float):
    with pytest.raises(InputError, match="in the same way at all settings"):
        sequential_regression(
            lambda settings: np.full((len(settings), 5), size),
            np.ones(5),
            2,
            order=as_they_are,
            seed=6,
        )


def test_one_parameter_that_says_nothing_does_not_hide_the_others():
    simulate = noisy(lambda one: bent(one[:, :3]), 0.02, 7)
    truth = np.array([[0.3, 0.6, 0.5, 0.9]])
    regression = sequential_regression(simulate, simulate(truth)[0], 4, order=as_they_are, seed=7)
    assert regression.found
    assert (np.abs(regression.centre - truth[0]) < 5 * regression.error)[:3].all()
    assert regression.error[3] > REGRESSION.lost > regression.error[:3].max()


def test_a_summary_far_from_all_simulations_is_bounded():
    """One of six that no setting gives, a thousand times its range off: the others still tell."""
    truth = np.array([[0.4, 0.6, 0.5]])
    recorded = np.append(bent(truth)[0], 1e3)
    rng = np.random.default_rng(8)

    def simulate(settings: np.ndarray) -> np.ndarray:
        return np.column_stack([noisy(bent, 0.02, 8)(settings), rng.normal(size=len(settings))])

    regression = sequential_regression(simulate, recorded, 3, order=as_they_are, seed=8)
    assert regression.found
    np.testing.assert_allclose(regression.centre, truth[0], atol=0.15)


def test_the_units_of_summaries_do_not_matter():
    truth, factor = np.array([[0.4, 0.6, 0.5]]), np.array([1e-6, 1.0, 1e6, 3.0, 1e3, 1e-3])
    plain, scaled = (
        sequential_regression(
            lambda s, k=k: k * bent(s), k * bent(truth)[0], 3, order=as_they_are, seed=9
        )
        for k in (np.ones(6), factor)
    )
    np.testing.assert_allclose(plain.centre, scaled.centre, atol=1e-6)
    np.testing.assert_allclose(plain.error, scaled.error, rtol=1e-4)


def test_the_same_seed_gives_the_same_box_and_another_another():
    recorded = bent(np.array([[0.4, 0.6, 0.5]]))[0]
    first, again, other = (
        sequential_regression(noisy(bent, 0.1, 1), recorded, 3, order=as_they_are, seed=seed)
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first.centre, again.centre)
    assert not np.array_equal(first.centre, other.centre)
