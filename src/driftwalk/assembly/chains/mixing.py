"""Tests of a well-mixed tank: exponential sojourns, no memory, and equal rates of two data sets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from driftwalk.assembly.chains.histories import Histories
from driftwalk.core.arrays import Bools, Floats

WELL_MIXED = "well mixed"
NOT_EXPONENTIAL = "waiting times are not exponential"
MEMORY = "memory across states"
CANNOT_TELL = "cannot tell"


class MixingPolicy(NamedTuple):
    """When a tank counts as well mixed."""

    level: float = 0.05
    """Rate of false alarms over all tests together (Holm), shown on simulated chains in the
    tests."""
    least_events: int = 20
    """Events without which a class is not tested; chosen by hand, checked on simulated chains in
    the tests."""
    margin: float = 1.1
    """A shape within this factor of 1 counts as exponential: 1.04 to 1.08 in water at rest, where
    the Markov chain predicts 2000 runs to the floor (`studies/kinetics`)."""
    shape: float = 0.75
    """Weibull shape that has to be found; the weakest that was measured in the settings of
    `studies/kinetics` is 0.73."""
    power: float = 0.9
    """How often it has to be found; by convention, twice as often missed as falsely found."""
    permutations: int = 999
    """Permutations of the runs over two data sets; the smallest p-value is 0.001, in closed
    form."""


MIXING_POLICY = MixingPolicy()


class MixingTest(NamedTuple):
    """One test."""

    name: str
    against: str
    """The verdict where it refuses."""
    statistic: float
    """Weibull shape, or Spearman's coefficient."""
    low: float
    high: float
    """Its 90 % interval."""
    events: int
    p: float


def mixing_tests(found: Histories) -> list[MixingTest]:
    """Return the tests of exponential sojourns per class, and of memory per pair of sojourns."""
    made = []
    for state, name in enumerate(found.classes):
        own = found.state == state
        if (found.target[own] >= 0).sum() >= MIXING_POLICY.least_events:
            made.append(_exponential(name, found.duration[own], found.target[own] >= 0))
    second = np.flatnonzero(~found.first)
    pair = found.state[second - 1] * len(found.classes) + found.state[second]
    for one in np.unique(pair):
        rows = second[pair == one]
        ended = found.target[rows] >= 0
        if ended.sum() >= MIXING_POLICY.least_events:
            name = " -> ".join(found.classes[found.state[rows[0] + at]] for at in (-1, 0))
            made.append(_memory(name, found.duration[rows - 1], found.duration[rows], ended))
    return made


def _exponential(name: str, duration: Floats, ended: Bools) -> MixingTest:
    """Return the likelihood-ratio test of Weibull's shape k about 1, right-censored, and k."""
    from scipy.optimize import brentq, minimize_scalar
    from scipy.stats import chi2

    log = np.log(duration / duration.mean())
    events = int(ended.sum())

    def deviance(log_k: float) -> float:
        k = math.exp(log_k)
        fit = events * (log_k + math.log(events / np.exp(k * log).sum()) - 1.0)
        return -2.0 * (fit + (k - 1.0) * float(log[ended].sum()))

    best = minimize_scalar(deviance, bounds=(-4.0, 4.0), method="bounded")
    limit = best.fun + float(chi2.ppf(0.9, 1))
    low, high = (
        math.exp(
            brentq(lambda at: deviance(at) - limit, min(best.x, side), max(best.x, side))
            if deviance(side) > limit
            else side
        )
        for side in (best.x - 3.0, best.x + 3.0)
    )
    nearest = min(max(best.x, -math.log(MIXING_POLICY.margin)), math.log(MIXING_POLICY.margin))
    p = float(chi2.sf(max(deviance(nearest) - best.fun, 0.0), 1))
    return MixingTest(f"sojourn in {name}", NOT_EXPONENTIAL, math.exp(best.x), low, high, events, p)


def _memory(name: str, before: Floats, duration: Floats, ended: Bools) -> MixingTest:
    """Return the score test of Cox for the rank of the sojourn before, and Spearman of the two.

    Pairs that were both seen to end are a biased sample: the score test allows for the others.
    """
    from scipy.stats import norm, rankdata, spearmanr

    rank = rankdata(before) / before.size
    gain, variance = score(duration, ended, rank)
    p = 2.0 * norm.sf(np.abs(gain) / np.sqrt(variance)) if variance > 0 else 1.0
    rho = float(spearmanr(before[ended], duration[ended]).statistic)
    events = int(ended.sum())
    # Fisher's transform, with the variance of Fieller, Hartley and Pearson (1957).
    wide = 1.645 * math.sqrt(1.06 / max(events - 3, 1))
    middle = math.atanh(min(max(rho, -0.999), 0.999))
    return MixingTest(
        f"waits {name}", MEMORY, rho, math.tanh(middle - wide), math.tanh(middle + wide),
        events, float(p),
    )  # fmt: skip


def score(duration: Floats, ended: Bools, covariate: Floats) -> tuple[Floats, Floats]:
    """Return the score of Cox's partial likelihood at no effect, and its variance.

    With a covariate of 0 and 1 it is the log-rank test. It holds for any hazard in the time since
    entry, and for right censoring that depends on the covariate. Ties by Breslow. Several
    covariates, shape (sojourn, covariate), give as many scores.
    """
    order = np.argsort(-duration, kind="stable")
    lasted, x, happened = duration[order], covariate[order], ended[order]
    # Everything that lasted as long is at risk too.
    last = (np.searchsorted(-lasted, -lasted, side="right") - 1)[happened]
    number = (last + 1.0).reshape(-1, *(1,) * (x.ndim - 1))
    mean = np.cumsum(x, axis=0)[last] / number
    spread = np.cumsum(x * x, axis=0)[last] / number - mean**2
    return (x[happened] - mean).sum(axis=0), np.maximum(spread, 0.0).sum(axis=0)


def holm(p: Sequence[float]) -> Floats:
    """Return p-values corrected for their number (Holm 1979): all false alarms together.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03]).round(3).tolist()
    [0.03, 0.06, 0.06]
    """
    values = np.asarray(p, dtype=np.float64)
    order = np.argsort(values, kind="stable")
    factor = values.size - np.arange(values.size)
    corrected = np.empty_like(values)
    corrected[order] = np.minimum(np.maximum.accumulate(values[order] * factor), 1.0)
    return corrected


def p_text(p: float) -> str:
    """Return a p-value in words: one that a double cannot hold is below the smallest.

    Examples
    --------
    >>> p_text(0.031), p_text(0.0)
    ('= 0.031', '< 1e-99')
    """
    return "< 1e-99" if p < 1e-99 else f"= {p:.2g}"


class Mixing(NamedTuple):
    """The verdict on a tank."""

    word: str
    reasons: list[str]
    tests: list[MixingTest]
    corrected: Floats
    """p-values, corrected for the number of tests."""


def needed_events(tests: int) -> int:
    """Return the events of a class with which the tests find the shape of the policy.

    ln k has the variance 0.608/n, as 6/π² of complete Weibull samples.
    """
    from scipy.stats import norm

    reach = norm.isf(0.5 * MIXING_POLICY.level / max(tests, 1)) + norm.ppf(MIXING_POLICY.power)
    return math.ceil(0.608 * (reach / math.log(MIXING_POLICY.shape * MIXING_POLICY.margin)) ** 2)


def judge_mixing(found: Histories) -> Mixing:
    """Return whether rates alone describe the histories, with the numbers behind it."""
    tests = mixing_tests(found)
    corrected = holm([one.p for one in tests])
    refused = [k for k in np.argsort(corrected) if corrected[k] <= MIXING_POLICY.level]
    words = {NOT_EXPONENTIAL: "Weibull shape", MEMORY: "Spearman"}
    reasons = [
        f"{one.name}: {words[one.against]} {one.statistic:.2f} ({one.low:.2f} to {one.high:.2f}, "
        f"90 %), {one.events} events, corrected p {p_text(corrected[k])}"
        for k, one in ((k, tests[k]) for k in refused)
    ]
    most = int(np.bincount(found.state[found.target >= 0], minlength=1).max())
    needed = needed_events(len(tests))
    if refused:
        named = {tests[k].against for k in refused}
        word = ", ".join(name for name in (NOT_EXPONENTIAL, MEMORY) if name in named)
    elif most < needed:
        runs = math.ceil(found.runs * needed / max(most, 1))
        word = CANNOT_TELL
        reasons = [
            f"{found.runs} runs are too few to detect that a tank is not well mixed: record {runs}"
        ]
    else:
        least = min((one.p for one in tests), default=1.0)
        word = WELL_MIXED
        reasons = [f"none of {len(tests)} tests rejects it; the smallest p is {least:.2g}"]
    return Mixing(word, reasons, tests, corrected)


def equal_rates(
    one: Histories, other: Histories, pairs: Sequence[tuple[int, int]], *, seed: int = 1
) -> tuple[Floats, Floats]:
    """Return p-values of equal rates of two data sets, and those corrected for their number.

    The log-rank statistic of each transition compares cause-specific hazards in the time since
    entry. Its law is that of runs whose data sets are permuted, which holds where sojourns depend
    on each other; the correction is by the largest statistic of each permutation (Westfall and
    Young, 1993). NaN where fewer than five events are seen in both together.
    """
    # With memory, the runs that get on in a short recording are the fast ones: equal lengths.
    length = min(one.recorded_s(), other.recorded_s())
    one, other = one.until(length), other.until(length)
    state, duration, target = (
        np.concatenate([getattr(one, name), getattr(other, name)])
        for name in ("state", "duration", "target")
    )
    run = np.r_[one.run, other.run + one.runs]
    random = np.random.default_rng([seed, 2])
    group = np.repeat([0.0, 1.0], [one.runs, other.runs])
    labels = [group, *(random.permutation(group) for _ in range(MIXING_POLICY.permutations))]
    label = np.stack(labels, axis=1)
    found = np.full((len(pairs), label.shape[1]), np.nan)
    for at, (i, j) in enumerate(pairs):
        own = state == i
        happened = target[own] == j
        if happened.sum() < 5:
            continue
        gain, variance = score(duration[own], happened, label[run[own]])
        found[at] = np.abs(gain) / np.sqrt(np.where(variance > 0, variance, np.inf))
    tested = np.isfinite(found[:, 0])
    p, corrected = np.full((2, len(pairs)), np.nan)
    if tested.any():
        largest = found[tested].max(axis=0)
        p[tested] = (found[tested] >= found[tested, :1]).mean(axis=1)
        corrected[tested] = (largest >= found[tested, :1]).mean(axis=1)
    return p, corrected
