"""Predictions of a fitted chain: shares over time, committors and first-passage times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwalk.assembly.chains.hidden import Model
from driftwalk.core.arrays import Floats, Integers

STEPS = 600
"""Steps of the grid; twice as many change no share by .002 (`studies/kinetics`)."""


def shares(model: Model, duration: float, *, steps: int = STEPS) -> tuple[Floats, Floats]:
    """Return the shares of the classes over time by convolution on a grid.

    The mass in a class and hidden state is kept by its age. Mass that enters during a step has
    spent half of the step there.

    Parameters
    ----------
    model : Model
        The chain.
    duration : float
        Length of the grid [s].
    steps : int
        Steps of the grid.

    Returns
    -------
    times : ndarray, shape (steps + 1,)
        Times [s].
    shares : ndarray, shape (steps + 1, class)
        Shares of the runs.
    """
    step = duration / steps
    pairs = np.argwhere(model.hazard.any(axis=(1, 3)))
    start, end = pairs.T
    time: Floats = np.arange(steps + 1, dtype=np.float64) * step
    whole = _steps_of(model, pairs, time)
    # What enters in a step has the age of half a step at its end, and leaves from age 0 on.
    half = _steps_of(model, pairs, np.r_[0.0, (np.arange(steps) + 1.5) * step])
    begun, held = model.start.copy(), np.zeros((*model.start.shape, steps + 1))
    course = np.empty((steps + 1, model.start.shape[0]))
    course[0] = begun.sum(axis=1)
    for k in range(steps):
        out = np.einsum("pza,pza->pz", held[start, :, :k], half[1][:, :, :k])
        out += begun[start] * whole[1][:, :, k]
        begun = begun * whole[0][:, :, k]
        held[:, :, 1 : k + 1] = held[:, :, :k] * half[0][:, :, :k]
        held[:, :, 0] = 0.0
        np.add.at(held[:, :, 0], end, np.einsum("pz,pzy->py", out, model.switch[end]))
        course[k + 1] = held[:, :, : k + 1].sum(axis=(1, 2)) + begun.sum(axis=1)
    return time, course


def _steps_of(model: Model, pairs: Integers, ages: Floats) -> tuple[Floats, Floats]:
    """Return what stays from one age to the next, and what leaves by each transition.

    Shapes (class, hidden, age) and (transition, hidden, age).
    """
    start, end = pairs.T
    low = np.pad(model.edges, ((0, 0), (1, 0)))[start, None, :]
    high = np.pad(model.edges, ((0, 0), (0, 1)), constant_values=np.inf)[start, None, :]
    at = ages[None, :, None]
    inside = np.minimum(at, high) - np.minimum(at, low)
    risen = np.diff(np.einsum("pab,pbz->pza", inside, model.hazard[start, :, end]), axis=2)
    total = np.zeros((*model.start.shape, ages.size - 1))
    np.add.at(total, start, risen)
    share = np.divide(-np.expm1(-total), total, out=np.ones_like(total), where=total > 0)
    return np.exp(-total), share[start] * risen


class Passage(NamedTuple):
    """The way to a target class."""

    committor: Floats
    """Probability to reach the target at all, from each class as it is entered."""
    passage_time: Floats
    """Mean first-passage time of those that reach it [s]; NaN where none does."""


def passage(model: Model, target: int) -> Passage:
    """Return committor and mean first-passage time to a class from every class.

    Solves q = P q with q = 1 in the target, and the equation of first moments, with P the
    probabilities of the jumps; the last bin's hazard is extrapolated. A class is entered with the
    hidden states in which it is entered over all runs.
    """
    size, states = model.start.shape
    low = np.pad(model.edges, ((0, 0), (1, 0)))
    high = np.pad(model.edges, ((0, 0), (0, 1)), constant_values=np.inf)
    with np.errstate(invalid="ignore"):
        width = np.where(np.isfinite(low), high - low, 0.0)[:, :, None]
    total = model.hazard.sum(axis=2)
    open_ended = np.isinf(width)
    risen = np.where(
        open_ended, np.where(total > 0, np.inf, 0.0), total * np.where(open_ended, 0.0, width)
    )
    before = np.exp(-np.pad(np.cumsum(risen, axis=1), ((0, 0), (1, 0), (0, 0))))[:, :-1]
    rate = np.where(total > 0, total, 1.0)
    ended = np.where(total > 0, before * -np.expm1(-risen), 0.0)
    # E[u; u in bin] = S(low) (low + 1/h) - S(high) (high + 1/h)
    top = np.where(open_ended, 0.0, np.where(np.isfinite(high), high, 0.0)[:, :, None])
    after = before * np.exp(-risen)
    first = np.where(np.isfinite(low), low, 0.0)[:, :, None]
    moment = np.where(total > 0, before * (first + 1.0 / rate) - after * (top + 1.0 / rate), 0.0)
    cause = model.hazard / rate[:, :, None, :]
    jump = np.einsum("ibz,ibjz->ijz", ended, cause)
    lasts = np.einsum("ibz,ibjz->ijz", moment, cause)
    full = [
        np.einsum("ijz,jzy->izjy", one, model.switch).reshape(size * states, -1)
        for one in (jump, lasts)
    ]
    own = np.repeat(np.arange(size) == target, states)
    matrix, moments = (np.where(own[:, None], 0.0, one) for one in full)
    # Without a chance to leave a ring of classes, rounding keeps the equations solvable.
    equations = (1.0 + 1e-12) * np.eye(size * states) - matrix
    reach = np.clip(np.linalg.solve(equations, own.astype(np.float64)), 0.0, 1.0)
    time = np.where(own, 0.0, np.linalg.solve(equations, moments @ reach))
    weight = _entered(model, full[0])
    of = [(weight * one.reshape(size, states)).sum(axis=1) for one in (reach, time)]
    return Passage(of[0], np.where(of[0] > 1e-9, of[1] / np.maximum(of[0], 1e-9), np.nan))


def _entered(model: Model, whole: Floats) -> Floats:
    """Return the hidden states in which each class is entered, as shares, (class, hidden)."""
    size, states = model.start.shape
    visits, now = np.zeros(size * states), model.start.ravel()
    for _ in range(4 * size):
        visits, now = visits + now, now @ whole
    visits = visits.reshape(size, states)
    total = visits.sum(axis=1, keepdims=True)
    return np.where(total > 0, visits / np.where(total > 0, total, 1.0), 1.0 / states)
