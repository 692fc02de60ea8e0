"""Hidden semi-Markov chains of outcome classes: fits by expectation-maximisation, and predictions.

A run in class i has a hidden state z, such as fast or slow. It goes to class j with the
cause-specific hazard h_ij^z(u), piecewise constant in the time u since the class was entered, and
there has the hidden state z' with probability A_j(z, z'). One hidden state and one bin are the
continuous-time Markov chain, one hidden state and several bins the semi-Markov chain, several
hidden states and one bin a chain with phase-type (hyperexponential) sojourns.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from driftwalk.assembly.chains.histories import Histories
from driftwalk.core.arrays import Floats, Integers


class Form(NamedTuple):
    """How many bins of the time since entry a model has, and how many hidden states."""

    name: str
    bins: int
    states: int


FORMS = (
    Form("Markov chain", 1, 1),
    Form("semi-Markov chain", 10, 1),
    Form("2 hidden states", 1, 2),
    Form("3 hidden states", 1, 3),
    Form("semi-Markov with 2 hidden states", 10, 2),
    Form("semi-Markov with 3 hidden states", 10, 3),
)
"""The candidates, the simplest first."""


class EmPolicy(NamedTuple):
    """How the likelihood is maximised; checked on the settings of `studies/kinetics`."""

    events_per_bin: int = 20
    """Fewer events of a class than ten bins of these give it fewer bins; chosen by hand."""
    weight: float = 1.0
    """Events that are added to each bin, at the mean rate of the class, and to each transition, in
    its mean share of them. By hand: .3 and 2 change the held-out log likelihood per run by .012 at
    most (2000 runs, seven settings of `studies/kinetics`)."""
    switch_weight: float = 0.5
    """Runs that are added to each change of hidden state; chosen by hand."""
    spread: float = 6.0
    """Ratio of the rates of neighbouring hidden states at the start; chosen by hand."""
    sticky: float = 0.7
    """Probability to keep the hidden state at the start; chosen by hand."""
    iterations: int = 400
    """Iterations at most; the settings of `studies/kinetics` took up to 300."""
    tolerance: float = 1e-2
    """Gain of the log likelihood below which the iterations end; chosen by hand."""


EM_POLICY = EmPolicy()


class Model(NamedTuple):
    """A fitted chain."""

    form: Form
    edges: Floats
    """Inner edges of the bins of each class [s], shape (class, bin - 1); infinite where unused."""
    hazard: Floats
    """Cause-specific hazards [1/s], shape (class, bin, next class, hidden)."""
    start: Floats
    """Share of the runs that begin in a class and a hidden state, shape (class, hidden)."""
    switch: Floats
    """Probability of the hidden state in the class that is entered, shape (class, from, to)."""


class _Data(NamedTuple):
    """The sojourns in the form of the likelihood."""

    exposure: Any
    """Time in each bin of each class, sparse, shape (sojourn, class x bin)."""
    place: Integers
    """Class, bin and next class of the sojourns that ended: index into the hazards."""
    events: Any
    """The same as a sparse matrix of ones, shape (class x bin x class, sojourn)."""
    ranks: list[Integers]
    """Sojourns that are first in their run, second, ...; each in the order of the runs."""


def bin_edges(found: Histories, bins: int) -> Floats:
    """Return the inner edges of the bins: quantiles of the sojourns that ended, per class."""
    edges = np.full((len(found.classes), bins - 1), np.inf)
    for state in range(len(found.classes)):
        ended = found.duration[(found.state == state) & (found.target >= 0)]
        own = min(bins, ended.size // EM_POLICY.events_per_bin)
        if own > 1:
            edges[state, : own - 1] = np.quantile(ended, np.arange(1, own) / own)
    return edges


def _data(found: Histories, edges: Floats) -> _Data:
    from scipy.sparse import csr_array

    size, bins, number = len(found.classes), edges.shape[1] + 1, found.run.size
    own, at = edges[found.state], found.duration[:, None]
    low = np.hstack([np.zeros((number, 1)), own])
    high = np.hstack([own, np.full((number, 1), np.inf)])
    inside = low < at
    row, column = np.nonzero(inside)
    lasted = np.minimum(at, high)[inside] - low[inside]
    exposure = csr_array(
        (lasted, (row, found.state[row] * bins + column)), shape=(number, size * bins)
    )
    gone = np.flatnonzero(found.target >= 0)
    place = (found.state[gone] * bins + (own < at).sum(axis=1)[gone]) * size + found.target[gone]
    events = csr_array((np.ones(gone.size), (place, gone)), shape=(size * bins * size, number))
    since = np.arange(number)
    order = since - np.maximum.accumulate(np.where(found.first, since, 0))
    ranks = [np.flatnonzero(order == k) for k in range(int(order.max(initial=0)) + 1)]
    return _Data(exposure, place, events, ranks)


def counts_and_times(found: Histories, weight: Floats | None = None) -> tuple[Floats, Floats]:
    """Return the transitions N_ij, shape (class, class), and the time T_i in each class [s]."""
    each = np.ones(found.run.size) if weight is None else weight[found.run]
    size, gone = len(found.classes), found.target >= 0
    counts = np.zeros((size, size))
    np.add.at(counts, (found.state[gone], found.target[gone]), each[gone])
    times: Floats = np.bincount(found.state, each * found.duration, size).astype(np.float64)
    return counts, times


def fit(
    found: Histories,
    form: Form,
    *,
    edges: Floats | None = None,
    weight: Floats | None = None,
    begin: Model | None = None,
    iterations: int | None = None,
) -> Model:
    """Return the chain that makes the histories most likely.

    Parameters
    ----------
    found : Histories
        The histories.
    form : Form
        Number of bins and of hidden states.
    edges : ndarray, optional
        Edges of the bins; default: quantiles of the histories themselves.
    weight : ndarray, shape (run,), optional
        How often each run counts, for a bootstrap.
    begin : Model, optional
        Where to begin; default: hidden states whose rates differ by a fixed ratio.
    iterations : int, optional
        Iterations at most.
    """
    edges = bin_edges(found, form.bins) if edges is None else edges
    data = _data(found, edges)
    runs = np.ones(found.runs) if weight is None else weight
    counts, times = counts_and_times(found, runs)
    mean = counts / np.where(times > 0, times, 1.0)[:, None]
    model = begin or _begin(found, form, edges, mean)
    before = -np.inf
    limit = iterations or (EM_POLICY.iterations if form.states > 1 else 1)
    for _ in range(limit):
        gamma, switches, score = _expected(found, data, model)
        model = _maximised(found, data, model, gamma, switches, runs, mean)
        total = float(runs @ score)
        if total - before < EM_POLICY.tolerance:
            break
        before = total
    return model


def log_likelihood(found: Histories, model: Model) -> Floats:
    """Return the log likelihood of each run, shape (run,); times in seconds."""
    return _expected(found, _data(found, model.edges), model)[2]


def _begin(found: Histories, form: Form, edges: Floats, mean: Floats) -> Model:
    size, states = len(found.classes), form.states
    ratio = EM_POLICY.spread ** (0.5 * (states - 1) - np.arange(states))
    hazard = np.repeat(mean[:, None, :, None], form.bins, axis=1) * ratio
    share = np.bincount(found.state[found.first], minlength=size) / found.runs
    keep = EM_POLICY.sticky if states > 1 else 1.0
    switch = np.full((states, states), (1.0 - keep) / max(states - 1, 1))
    np.fill_diagonal(switch, keep)
    start = np.outer(share, np.full(states, 1.0 / states))
    return Model(form, edges, hazard, start, np.repeat(switch[None], size, axis=0))


def _expected(
    found: Histories, data: _Data, model: Model
) -> tuple[Floats, list[tuple[Integers, Floats]], Floats]:
    """Return P(z | run) of each sojourn, P(z, z' | run) of each change, and ln L of each run.

    Forward and backward over the sojourns of all runs at once, the k-th of every run together.
    """
    states = model.form.states
    # ln f: the hazard of what happened, less the hazard of all causes over the exposure.
    log = -(data.exposure @ model.hazard.sum(axis=2).reshape(-1, states))
    happened = np.maximum(model.hazard.reshape(-1, states)[data.place], 1e-300)
    log[found.target >= 0] += np.log(happened)
    top = log.max(axis=1, keepdims=True)
    own = np.exp(log - top)
    forward, backward, scale = np.empty_like(own), np.ones_like(own), np.empty(own.shape[0])
    switches = []
    for k, rows in enumerate(data.ranks):
        prior = model.start[found.state[rows]]
        if k:
            prior = np.einsum("nz,nzy->ny", forward[rows - 1], model.switch[found.state[rows]])
        joint = prior * own[rows]
        scale[rows] = np.maximum(joint.sum(axis=1), 1e-300)
        forward[rows] = joint / scale[rows, None]
    for rows in data.ranks[:0:-1]:
        after = own[rows] * backward[rows] / scale[rows, None]
        step = model.switch[found.state[rows]]
        switches.append((rows, forward[rows - 1][:, :, None] * step * after[:, None, :]))
        backward[rows - 1] = np.einsum("nzy,ny->nz", step, after)
    first = data.ranks[0]
    share = model.start[found.state[first]].sum(axis=1)
    score: Floats = np.bincount(found.run, np.log(scale) + top[:, 0], found.runs).astype(np.float64)
    # Of the class in which a run begins nothing is asked.
    score[found.run[first]] -= np.log(np.maximum(share, 1e-300))
    return forward * backward, switches, score


def _with_prior(events: Floats, times: Floats, rate: Floats) -> Floats:
    """Return rates, with a prior of some events at a given rate; a rate of zero stays zero."""
    lasted = np.divide(EM_POLICY.weight, rate, out=np.zeros_like(rate), where=rate > 0)
    above, below = events + EM_POLICY.weight, times + lasted
    return np.divide(above, below, out=np.zeros_like(events), where=rate > 0)


def _maximised(
    found: Histories,
    data: _Data,
    model: Model,
    gamma: Floats,
    switches: list[tuple[Integers, Floats]],
    runs: Floats,
    mean: Floats,
) -> Model:
    """Return the model with the largest expected likelihood."""
    size, bins, _, states = model.hazard.shape
    share = gamma * runs[found.run][:, None]
    events = (data.events @ share).reshape(model.hazard.shape)
    times = (data.exposure.T @ share).reshape(size, bins, 1, states)
    # One event of the class, then one of each transition in its share of the bin's rate. One each
    # at its own mean rate would count as several events of the class.
    total = mean.sum(axis=1)[:, None, None, None]
    whole = _with_prior(events.sum(axis=2, keepdims=True), times, total)
    hazard = _with_prior(
        events, times, whole * mean[:, None, :, None] / np.where(total > 0, total, 1.0)
    )
    first = data.ranks[0]
    start = np.zeros((size, states))
    np.add.at(start, found.state[first], share[first])
    switch = np.full((size, states, states), EM_POLICY.switch_weight)
    for rows, expected in switches:
        np.add.at(switch, found.state[rows], expected * runs[found.run[rows]][:, None, None])
    return Model(
        model.form, model.edges, hazard, start / start.sum(),
        switch / switch.sum(axis=2, keepdims=True),
    )  # fmt: skip


GRID_STEPS = 600
"""Steps of the grid; twice as many change no share by .002 (`studies/kinetics`)."""


def shares(model: Model, duration: float, *, steps: int = GRID_STEPS) -> tuple[Floats, Floats]:
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
