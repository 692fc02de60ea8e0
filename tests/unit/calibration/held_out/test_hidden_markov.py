"""The hidden Markov walk against sums over all paths, scipy's distributions and a known truth."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy import stats

from driftwalk.calibration.held_out.hidden_markov import (
    HiddenMarkovModel,
    _concentration,
    _expected,
    _gamma_shape,
    _side_by_side,
    fit_hidden_markov_model,
    log_densities,
)

WALK = HiddenMarkovModel(
    begin=np.array([0.6, 0.4]),
    transition=np.array([[0.9, 0.1], [0.3, 0.7]]),
    shape=np.array([4.0, 6.0]),
    scale=np.array([1e-3, 5e-3]),
    direction=np.array([0.3, -0.1]),
    concentration=np.array([0.5, 8.0]),
    log_likelihood=-math.inf,
)


def drawn(count: int, seed: int) -> np.ndarray:
    """Return steps of the walk."""
    random = np.random.default_rng(seed)
    state = int(random.random() > WALK.begin[0])
    steps = np.empty((count, 2))
    for k in range(count):
        steps[k] = (
            random.gamma(WALK.shape[state], WALK.scale[state]),
            random.vonmises(WALK.direction[state], WALK.concentration[state]),
        )
        state = int(random.random() > WALK.transition[state, 0])
    return steps


def test_densities_are_those_of_scipy() -> None:
    steps = drawn(50, 1)
    found = log_densities(WALK, steps)
    for state in range(2):
        gamma = stats.gamma(WALK.shape[state], scale=WALK.scale[state])
        turn = stats.vonmises(WALK.concentration[state], loc=WALK.direction[state])
        expected = gamma.logpdf(steps[:, 0]) + turn.logpdf(steps[:, 1])
        assert found[:, state] == pytest.approx(expected)


def test_the_likelihood_is_the_sum_over_all_paths() -> None:
    """Two runs of 5 and 7 steps: 2^5 and 2^7 paths; so are the probabilities of the states."""
    runs = [drawn(5, 2), drawn(7, 3)]
    state, _, found = _expected(WALK, *_side_by_side(runs))
    expected = 0.0
    for row, run in enumerate(runs):
        density = np.exp(log_densities(WALK, run))
        total, second = 0.0, np.zeros(len(run))
        for path in itertools.product(range(2), repeat=len(run)):
            chance = WALK.begin[path[0]] * density[0, path[0]]
            for k in range(1, len(run)):
                chance *= WALK.transition[path[k - 1], path[k]] * density[k, path[k]]
            total += chance
            second += chance * np.array(path)
        expected += math.log(total)
        assert state[row, : len(run), 1] == pytest.approx(second / total)
    assert found == pytest.approx(expected)


@pytest.mark.parametrize("shape", [0.05, 1.0, 30.0, 2000.0])
def test_the_shape_of_a_gamma_distribution_is_found(shape: float) -> None:
    from scipy.special import digamma

    spread = np.array([math.log(shape) - digamma(shape)])
    assert _gamma_shape(spread)[0] == pytest.approx(shape, rel=1e-6)


@pytest.mark.parametrize("concentration", [0.01, 1.0, 20.0, 300.0])
def test_the_concentration_of_angles_is_found(concentration: float) -> None:
    from scipy.special import i0e, i1e

    resultant = np.array([i1e(concentration) / i0e(concentration)])
    assert _concentration(resultant)[0] == pytest.approx(concentration, rel=1e-6)


@pytest.mark.slow
def test_the_truth_is_found_from_steps_alone() -> None:
    """6,000 steps: standard errors of some 2 %; the bound is about five of them."""
    found = fit_hidden_markov_model([drawn(3000, 4), drawn(3000, 5)], states=2)
    assert found.shape * found.scale == pytest.approx(WALK.shape * WALK.scale, rel=0.1)
    assert found.transition == pytest.approx(WALK.transition, abs=0.06)
    assert found.concentration == pytest.approx(WALK.concentration, rel=0.15)
    assert found.direction == pytest.approx(WALK.direction, abs=0.2)


def test_a_step_never_lowers_the_likelihood() -> None:
    """As the theory of expectation and maximisation has it."""
    steps, there = _side_by_side([drawn(400, 6)])
    from driftwalk.calibration.held_out.hidden_markov import _first, _most_likely

    walk, last = _first(steps[there], 3), -math.inf
    for _ in range(30):
        state, joint, now = _expected(walk, steps, there)
        assert now >= last - 1e-6
        walk, last = _most_likely(steps, there, state, joint), now
