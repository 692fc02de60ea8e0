"""The search over several parameters, on functions whose minimum is known."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.calibration.evolution import RESOLUTION, Budget, population, search_minimum

QUICK = Budget(design=32, starts=2, short=8, long=12)


def noisy(function, spread):
    """Return an objective with noise that follows from the number of the evaluation."""

    def objective(settings, first, replicates):
        return np.array(
            [
                function(one)
                + spread * np.random.default_rng([9, first + k]).normal() / np.sqrt(replicates)
                for k, one in enumerate(settings)
            ]
        )

    return objective


def bowl(setting):
    return float(((setting - np.linspace(0.2, 0.8, setting.size)) ** 2).sum())


def banana(setting):
    x, y = 3.0 * setting - 1.0
    return float((1.0 - x) ** 2 + 100.0 * (y - x**2) ** 2)


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("parameters", [1, 2, 5, 9])
def test_the_lowest_point_of_a_bowl_is_found(parameters):
    found = search_minimum(noisy(bowl, 0.0), parameters)
    np.testing.assert_allclose(found.best, np.linspace(0.2, 0.8, parameters), atol=0.02)


@pytest.mark.slow
def test_a_narrow_valley_is_followed():
    found = search_minimum(noisy(banana, 0.0), 2)
    assert found.score < 1e-3
    np.testing.assert_allclose(3.0 * found.best - 1.0, 1.0, atol=0.05)


@pytest.mark.slow
def test_noise_moves_the_answer_by_little():
    """A bowl with noise of a tenth: a point 0.15 off the lowest one is 0.02 higher."""
    found = search_minimum(noisy(bowl, 0.1), 4, seed=2)
    assert bowl(found.best) < 0.05


@pytest.mark.slow
def test_the_best_of_two_valleys_wins():
    def two(setting):
        return min(bowl(setting), 0.02 + float(((setting - 0.9) ** 2).sum()))

    found = search_minimum(noisy(two, 0.0), 3)
    np.testing.assert_allclose(found.best, [0.2, 0.5, 0.8], atol=0.02)
    assert found.optimum_scores.shape == (Budget().starts + 1,)


@pytest.mark.slow
def test_a_minimum_at_the_end_of_a_range_is_reached():
    found = search_minimum(noisy(lambda setting: float(setting.sum()), 0.0), 3)
    assert found.best.max() < 0.02


def test_the_same_seed_gives_the_same_answer_and_another_another():
    first, again, other = (
        search_minimum(noisy(bowl, 0.05), 3, budget=QUICK, seed=seed) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first.best, again.best)
    assert not np.array_equal(first.best, other.best)


def test_evaluations_are_numbered_and_counted():
    seen, told = [], []

    def objective(settings, first, replicates):
        seen.append((first, len(settings), replicates))
        assert np.array_equal(settings, np.round(settings / RESOLUTION) * RESOLUTION)
        assert (settings >= 0.0).all()
        assert (settings <= 1.0).all()
        return ((settings - 0.5) ** 2).sum(axis=1)

    found = search_minimum(
        objective, 2, budget=QUICK, tell=lambda done, most: told.append((done, most))
    )
    assert [first for first, _, _ in seen] == np.cumsum([0, *(n for _, n, _ in seen)])[:-1].tolist()
    assert found.evaluations == sum(n for _, n, _ in seen) <= QUICK.evaluations(2)
    assert told[-1] == (found.evaluations, QUICK.evaluations(2))
    assert {replicates for _, _, replicates in seen} == {QUICK.replicates, QUICK.retest}


@pytest.mark.parametrize(
    ("parameters", "usual", "even"), [(1, 4, 6), (2, 6, 8), (3, 7, 8), (8, 10, 12), (12, 11, 12)]
)
def test_a_generation_is_the_usual_one_made_even(parameters, usual, even):
    """4 + 3 ln n of Hansen's CMA-ES, and one or two more."""
    assert int(4 + 3 * np.log(parameters)) == usual
    assert population(parameters) == even
