"""A semi-Markov decision process over outcome classes: transitions by mode, and value iteration.

At each decision a world is in a class i and has been there for an age a; a mode m is held for one
period. Where N counts what worlds did, the probability of a change to class j is

    P(j | i, a, m) = (N(i, a, m, j) + n P(j | i, m)) / (N(i, a, m) + n),

shrunk towards that of all ages, which is shrunk in the same way towards that of all modes, with
the weights n of `PROCESS_POLICY`: the mean of a Dirichlet law with parameters N + n P, from which
probabilities can be drawn too. With k periods left the value of a class is, by backward induction,

    V_k(i, a) = max_m [ sum_j P(j | i, a, m) V_(k-1)(j, 0) + P(stay | i, a, m) V_(k-1)(i, a + 1) ].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats, Integers


class ProcessPolicy(NamedTuple):
    """How transitions are estimated."""

    age_starts: tuple[int, ...] = (0, 1, 2, 4, 8, 16)
    """First ages of the bins [periods]; chosen by hand, each twice as long as the one before."""
    age_weight: float = 30.0
    """Decisions that the estimate of all ages counts for; of 3 to 100 the best in held-out halves
    of 144,000 decisions, with 100 no worse (`studies/control`)."""
    phase_starts: tuple[int, ...] = (1, 5, 13)
    """Fewest decisions left of the phases of a policy; chosen by hand."""
    phase_places: tuple[float, ...] = (0.5, 0.5, 0.7)
    """Where in each phase, from its end, value iteration is read; chosen by hand."""
    mode_weight: float = 10.0
    """Decisions that the estimate of all modes counts for; chosen by hand."""


PROCESS_POLICY = ProcessPolicy()


class Decisions(NamedTuple):
    """Decisions of worlds, and the class one period later, shape (decision,)."""

    source: Integers
    """Class at the decision."""
    age: Integers
    """Whole periods that it had been there."""
    mode: Integers
    target: Integers
    """Class one period later."""
    entered: Integers
    """1 where a class was entered during the period, its own again too."""


def age_bin(age: Integers) -> Integers:
    """Return the bins of ages [periods].

    Examples
    --------
    >>> age_bin(np.array([0, 1, 3, 40])).tolist()
    [0, 1, 2, 5]
    """
    return np.searchsorted(np.array(PROCESS_POLICY.age_starts), age, side="right") - 1


def phase_of(left: int) -> int:
    """Return the phase of a decision by how many are left, this one too.

    Examples
    --------
    >>> [phase_of(left) for left in (1, 4, 5, 60)]
    [0, 0, 1, 2]
    """
    return int(np.searchsorted(PROCESS_POLICY.phase_starts, left, side="right")) - 1


def transitions(
    decisions: list[Decisions],
    *,
    classes: int,
    modes: int,
    random: np.random.Generator | None = None,
) -> Floats:
    """Return the probabilities of the changes of class in one period.

    Parameters
    ----------
    decisions : list of Decisions
        What worlds did.
    classes, modes : int
        Their numbers.
    random : numpy.random.Generator, optional
        Draws the probabilities from their posterior; their mean without it.

    Returns
    -------
    ndarray, shape (class, age bin, mode, class + 1)
        Probability to enter each class, and last that nothing happens; that is certain in a class
        from which no world ever went on.

    Examples
    --------
    >>> one = Decisions(*(np.array(values) for values in ([0, 0], [0, 0], [0, 0], [1, 0], [1, 0])))
    >>> transitions([one], classes=2, modes=1)[0, 0, 0].tolist()
    [0.0, 0.5, 0.5]
    """
    count = np.zeros((classes, len(PROCESS_POLICY.age_starts), modes, classes + 1))
    for one in decisions:
        to = np.where(one.entered > 0, one.target, classes)
        np.add.at(count, (one.source, age_bin(one.age), one.mode, to), 1.0)
    by_mode = count.sum(axis=1)
    whole = by_mode.sum(axis=1)
    seen = whole.sum(axis=1, keepdims=True)
    whole = np.where(seen > 0, whole, np.eye(classes + 1)[-1]) / np.where(seen > 0, seen, 1.0)
    by_mode = _posterior(by_mode + PROCESS_POLICY.mode_weight * whole[:, None], random)
    return _posterior(count + PROCESS_POLICY.age_weight * by_mode[:, None], random)


def _posterior(parameters: Floats, random: np.random.Generator | None) -> Floats:
    """Return the mean of Dirichlet laws, or a draw from them."""
    parts = parameters
    if random is not None:
        # A sum of gammas may vanish where all parameters are tiny: then the mean.
        parts = random.standard_gamma(parameters)
        parts = np.where(parts.sum(axis=-1, keepdims=True) > 0, parts, parameters)
    return np.asarray(parts / parts.sum(axis=-1, keepdims=True))


class Plan(NamedTuple):
    """A policy and what it promises."""

    action: Integers
    """Best mode with k + 1 periods left, shape (left, class, age); the last age is open."""
    value: Floats
    """Probability of the target with k periods left, shape (left + 1, class, age)."""


def value_iteration(probability: Floats, *, target: int, periods: int) -> Plan:
    """Return the policy that is in a class most probably after so many periods.

    Parameters
    ----------
    probability : ndarray, shape (class, age bin, mode, class + 1)
        As `transitions` returns it.
    target : int
        Index of the class.
    periods : int
        How many decisions there are.

    Returns
    -------
    Plan
        Modes and probabilities. The first mode is taken where several are equally good.

    Examples
    --------
    Mode 1 changes class twice as fast, and only class 1 counts:

    >>> slow, fast = [0.0, 0.1, 0.9], [0.0, 0.2, 0.8]
    >>> rates = np.array([[[slow, fast]] * 6, [[[0.0, 0.0, 1.0]] * 2] * 6])
    >>> plan = value_iteration(rates, target=1, periods=2)
    >>> plan.action[1, 0, 0].item(), plan.value[2, 0, 0].round(2).item()
    (1, 0.36)
    """
    classes = probability.shape[0]
    ages = age_bin(np.arange(min(periods, PROCESS_POLICY.age_starts[-1]) + 1))
    value = np.zeros((periods + 1, classes, ages.size))
    value[0, target] = 1.0
    action = np.zeros((periods, classes, ages.size), dtype=np.int64)
    enter, stay = probability[..., :-1], probability[..., -1][:, ages]
    for left in range(periods):
        before = value[left]
        older = np.concatenate([before[:, 1:], before[:, -1:]], axis=1)
        gain = (enter * before[:, 0]).sum(axis=-1)[:, ages] + stay * older[:, :, None]
        action[left] = gain.argmax(axis=-1)
        value[left + 1] = gain.max(axis=-1)
    return Plan(action, value)


def gains(probability: Floats, plan: Plan) -> Floats:
    """Return what each mode gains in each cell: phase of the run, class and age.

    Parameters
    ----------
    probability : ndarray, shape (class, age bin, mode, class + 1)
        As `transitions` returns it.
    plan : Plan
        Of these probabilities.

    Returns
    -------
    ndarray, shape (phase, class, age bin, mode)
        Probability of the target when the mode is taken once and the best ones after it, by value
        iteration.
    """
    periods, _, ages = plan.action.shape
    older_ages = np.minimum(np.array(PROCESS_POLICY.age_starts) + 1, ages - 1)
    found = []
    starts = (*PROCESS_POLICY.phase_starts, periods + 1)
    for start, end, place in zip(starts, starts[1:], PROCESS_POLICY.phase_places, strict=False):
        left = min(round(start + place * (max(end, start + 1) - 1 - start)), periods)
        before = plan.value[left - 1]
        older = before[:, older_ages]
        enter, stay = probability[..., :-1], probability[..., -1]
        found.append((enter * before[:, 0]).sum(axis=-1) + stay * older[:, :, None])
    return np.stack(found)
