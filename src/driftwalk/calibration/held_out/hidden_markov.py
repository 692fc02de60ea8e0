"""A hidden Markov walk, fitted by likelihood: the usual model of animal movement, for comparison.

In each of a few hidden states steps have a gamma distributed length and a von Mises distributed
turning angle, independent of each other (Langrock et al., Ecology 93 (2012) 2336; Michelot et al.,
Methods Ecol. Evol. 7 (2016) 1308). Fitted by expectation and maximisation (Baum and Welch).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats

LEAST_PROBABILITY: Final = 1e-6
"""Added to each count, so that no state becomes impossible to reach; chosen by hand."""


class HiddenMarkovModel(NamedTuple):
    """Steps in hidden states, shapes (states,) unless said."""

    begin: Floats
    """Probability of each state at the first step."""
    transition: Floats
    """Probability of the next state, shape (states, states); a row for each state."""
    shape: Floats
    """Of the gamma distributed step length."""
    scale: Floats
    """Of the step length [m]."""
    direction: Floats
    """Mean turning angle [rad]."""
    concentration: Floats
    """Of the von Mises distributed turning angle."""
    log_likelihood: float

    @property
    def parameters(self) -> int:
        """Free numbers: those of the steps, and of the transitions."""
        states = self.shape.size
        return 4 * states + states * (states - 1)


def fit_hidden_markov_model(runs: Sequence[Floats], *, states: int = 3) -> HiddenMarkovModel:
    """Fit a hidden Markov walk to runs of steps that follow each other.

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> slow = np.column_stack([random.gamma(4.0, 1e-3, 300), random.vonmises(0.0, 1.0, 300)])
    >>> quick = np.column_stack([random.gamma(4.0, 1e-2, 300), random.vonmises(0.0, 9.0, 300)])
    >>> walk = fit_hidden_markov_model([slow, quick], states=2)
    >>> (1e3 * walk.shape * walk.scale).round()  # mean lengths [mm]; the truth is 4 and 40
    array([ 4., 42.])
    """
    steps, there = _side_by_side(runs)
    walk = _first(steps[there], states)
    last = -np.inf
    for _ in range(200):
        state, joint, log_likelihood = _expected(walk, steps, there)
        walk = _most_likely(steps, there, state, joint)._replace(log_likelihood=log_likelihood)
        if log_likelihood - last < 0.01:
            break
        last = log_likelihood
    return walk


def log_densities(walk: HiddenMarkovModel, steps: Floats) -> Floats:
    """Return the logarithm of the density of steps (..., 2) in each state, shape (..., states)."""
    from scipy.special import gammaln, i0e

    length, angle = steps[..., 0, None], steps[..., 1, None]
    gamma = (
        (walk.shape - 1.0) * np.log(length)
        - length / walk.scale
        - gammaln(walk.shape)
        - walk.shape * np.log(walk.scale)
    )
    turn = walk.concentration * (np.cos(angle - walk.direction) - 1.0)
    return np.asarray(gamma + turn - np.log(2.0 * np.pi * i0e(walk.concentration)))


def _side_by_side(runs: Sequence[Floats]) -> tuple[Floats, Bools]:
    """Return runs as rows of one array, and which of its places hold a step."""
    longest = max(len(run) for run in runs)
    steps = np.ones((len(runs), longest, 2))
    there = np.zeros((len(runs), longest), dtype=bool)
    for row, run in enumerate(runs):
        steps[row, : len(run)] = run
        there[row, : len(run)] = True
    return steps, there


def _first(steps: Floats, states: int) -> HiddenMarkovModel:
    order = np.argsort(steps[:, 0], kind="stable")
    weights = np.zeros((len(steps), states))
    for state, part in enumerate(np.array_split(order, states)):
        weights[part, state] = 1.0
    stay = np.full((states, states), 0.1 / max(states - 1, 1))
    np.fill_diagonal(stay, 0.9)
    return _of_steps(steps, weights + 1e-3, np.full(states, 1.0 / states), stay)


def _expected(walk: HiddenMarkovModel, steps: Floats, there: Bools) -> tuple[Floats, Floats, float]:
    """Return the probability of each state at each step, of each change, and the likelihood.

    The forward and backward passes run over all runs at once. After the end of a run nothing is
    observed: its densities are 1.
    """
    logs = np.where(there[..., None], log_densities(walk, steps), 0.0)
    most = logs.max(axis=-1, keepdims=True)
    density = np.exp(logs - most)
    rows, length, states = density.shape
    forward = np.empty((length, rows, states))
    scale = np.empty((length, rows))
    now = walk.begin * density[:, 0]
    for k in range(length):
        if k:
            now = (forward[k - 1] @ walk.transition) * density[:, k]
        scale[k] = now.sum(axis=1)
        forward[k] = now / scale[k][:, None]
    backward = np.ones((rows, states))
    state = np.empty((length, rows, states))
    joint = np.zeros((states, states))
    state[-1] = forward[-1]
    for k in range(length - 2, -1, -1):
        ahead = density[:, k + 1] * backward / scale[k + 1][:, None]
        both = there[:, k + 1, None]
        joint += walk.transition * ((forward[k] * both).T @ ahead)
        backward = ahead @ walk.transition.T
        state[k] = forward[k] * backward
    log_likelihood = float(np.log(scale).sum() + most[..., 0].sum())
    return state.transpose(1, 0, 2), joint, log_likelihood


def _most_likely(steps: Floats, there: Bools, state: Floats, joint: Floats) -> HiddenMarkovModel:
    begin = state[:, 0].mean(axis=0) + LEAST_PROBABILITY
    moves = joint + LEAST_PROBABILITY
    moves /= moves.sum(axis=1, keepdims=True)
    return _of_steps(steps[there], state[there], begin / begin.sum(), moves)


def _of_steps(
    steps: Floats, weights: Floats, begin: Floats, transition: Floats
) -> HiddenMarkovModel:
    """Return the walk that is most likely for steps that belong to states in parts."""
    share = weights / weights.sum(axis=0)
    length = steps[:, 0]
    mean = share.T @ length
    shape = _gamma_shape(np.log(mean) - share.T @ np.log(length))
    along, across = share.T @ np.cos(steps[:, 1]), share.T @ np.sin(steps[:, 1])
    concentration = _concentration(np.hypot(along, across))
    direction = np.arctan2(across, along)
    return HiddenMarkovModel(
        begin, transition, shape, mean / shape, direction, concentration, -np.inf
    )


def _gamma_shape(spread: Floats) -> Floats:
    """Return the shape for which ln(shape) - digamma(shape) is the spread."""
    from scipy.special import digamma, polygamma

    spread = np.maximum(spread, 1e-9)
    # The start of Minka (2002), within 1.5 % of the answer.
    shape = (3.0 - spread + np.sqrt((spread - 3.0) ** 2 + 24.0 * spread)) / (12.0 * spread)
    for _ in range(8):
        apart = np.log(shape) - digamma(shape) - spread
        slope = 1.0 / shape - polygamma(1, shape)
        shape = np.maximum(shape - apart / slope, 0.5 * shape)
    return np.asarray(np.clip(shape, 1.0 / 1e4, 1e4))


def _concentration(resultant: Floats) -> Floats:
    """Return the concentration of a von Mises distribution with this mean resultant length."""
    from scipy.special import i0e, i1e

    resultant = np.clip(resultant, 1e-9, 1.0 - 1e-6)
    # The start of Banerjee et al. (2005).
    kappa = resultant * (2.0 - resultant**2) / (1.0 - resultant**2)
    for _ in range(8):
        ratio = i1e(kappa) / i0e(kappa)
        slope = np.maximum(1.0 - ratio**2 - ratio / kappa, 1e-12)
        kappa = np.clip(kappa - (ratio - resultant) / slope, 0.1 * kappa, 10.0 * kappa)
    return np.asarray(np.clip(kappa, 1e-6, 500.0))
