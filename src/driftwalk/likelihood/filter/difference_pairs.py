"""Derivatives by differences: pairs of passes that differ in one parameter alone.

The covariances of the innovations are many 2 x 2 or 3 x 3 matrices, factored all at once.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.law.candidate_laws import NUMBERS


def unpacked(lower: Floats) -> Floats:
    """Return symmetric matrices (D, D, n) from their lower parts (n, D (D + 1) / 2), row by row."""
    count = {3: 2, 6: 3}[lower.shape[1]]
    full = np.empty((count, count, lower.shape[0]))
    for column, (a, b) in enumerate(zip(*np.tril_indices(count), strict=True)):
        full[a, b] = full[b, a] = lower[:, column]
    return full


def factor(lower: Floats) -> Floats:
    """Return the Cholesky factors L (D, D, n), L L' the matrices of which these are lower parts."""
    full = unpacked(lower)
    root = np.zeros_like(full)
    for a in range(len(full)):
        for b in range(a + 1):
            rest = full[a, b] - (root[a, :b] * root[b, :b]).sum(axis=0)
            root[a, b] = np.sqrt(rest) if a == b else rest / root[b, b]
    return root


def forward(root: Floats, right: Floats) -> Floats:
    """Return L^-1 b for n triangular L (D, D, n) and b (D, n), or (D, m, n)."""
    found = np.empty_like(right)
    for a in range(len(root)):
        rest = right[a].copy()
        for b in range(a):
            rest -= root[a, b] * found[b]
        found[a] = rest / root[a, a]
    return found


class DifferencePolicy(NamedTuple):
    """When two passes give a derivative."""

    step: float = 1e-4
    """Change of the logarithm of a noise. Chosen by hand."""
    most_change: float = 1e-2
    """Largest relative change of a variance between the passes. It is a hundred steps: a larger one
    means that one pass restarted where the other did not; chosen by hand."""
    most_change_far: float = 1.0
    """The same for a number that is tried far from its value. Chosen by hand."""
    least_comparable: float = 0.95
    """Share of the samples that a pair has to compare; with fewer its step is too long. Chosen by
    hand."""
    largest_over_median: float = 8.0
    """Largest change of a variance over the median one, to shorten a step by. Chosen by hand: the
    effect of a wrong time grows with the squared speed."""


DIFFERENCE: Final = DifferencePolicy()


class Difference(NamedTuple):
    """Values of one parameter between which its derivative is taken."""

    low: float | None
    """None for the value that the parameter has: that pass exists already."""
    high: float
    step: float
    most_change: float = DIFFERENCE.most_change
    shortens: bool = False
    """Whether the step is shortened where variances change too much."""


def difference_of(point: Point, name: str, *, shorter: float = 1.0) -> Difference:
    """Return the two values of a parameter for its derivative, with a step `shorter` times less."""
    if name not in NUMBERS:
        return Difference(None, point.extras[name] + DIFFERENCE.step, DIFFERENCE.step)
    number, value = NUMBERS[name], point.number(name)
    most = DIFFERENCE.most_change if number.trial is None else DIFFERENCE.most_change_far
    if number.trial is not None and name not in point.opened:
        low, high = number.trial if value == number.model else (value, value + number.step)
        return Difference(None if low == value else low, high, high - low, most)
    high = value + number.step / shorter
    return Difference(None, high, high - value, most, shortens=True)


class Pair(NamedTuple):
    """Two passes that differ in one parameter alone."""

    one: dict[str, Any]
    other: dict[str, Any]
    step: float
    """By how much the parameter differs."""
    most_change: float = DIFFERENCE.most_change
    """Of a variance; where it is more, the two cannot be compared."""
    wave: Floats | None = None
    """How much of the difference counts at each sample, shape (n,); all of it by default."""
    spreads: bool = True
    """Whether the likelihood learns from the covariances of the innovations too."""

    @property
    def comparable(self) -> Bools:
        """Return which samples both passes have used, with nearly the same variances."""
        # A change that is not a number is not a near one.
        near = variance_changes(self.one, self.other) <= self.most_change
        return used_of(self.one) & used_of(self.other) & near

    @property
    def excess(self) -> float:
        """Return how many times too long the step is for most samples to be comparable."""
        both = used_of(self.one) & used_of(self.other)
        if not both.any() or np.mean(self.comparable[both]) >= DIFFERENCE.least_comparable:
            return 1.0
        median = float(np.median(variance_changes(self.one, self.other)[both]))
        return max(1.0, DIFFERENCE.largest_over_median * median / self.most_change)


def used_of(found: dict[str, Any]) -> Bools:
    """Return which samples a pass has used."""
    return np.asarray(found["used"], dtype=bool)


def variance_changes(base: dict[str, Any], other: dict[str, Any]) -> Floats:
    """Return the largest relative change of a variance at each sample, shape (n,)."""
    one, two = (np.einsum("aan->an", unpacked(found["covariance"])) for found in (base, other))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray((np.abs(two - one) / one).max(axis=0))


def noise_derivatives(
    base: dict[str, Any], pairs: list[Pair], used: Bools
) -> tuple[Floats, list[Floats], list[Floats]]:
    """Return whitened innovations (n, D), and the derivatives of them and of S by the noises.

    The derivatives of S are whitened from both sides, L^-1 dS L^-T, shape (D, D, n). The pairs are
    taken from their list one by one: of a fast camera they fill a gigabyte.
    """
    root = factor(base["covariance"][used])
    white = forward(root, base["innovation"][used].T).T
    changes, spreads = [], []
    while pairs:
        one, other, step, _, wave, of_spreads = pairs.pop(0)
        per = 1.0 / step if wave is None else wave[used, None] / step
        change = (one["innovation"][used] - other["innovation"][used]) * per
        changes.append(forward(root, change.T).T)
        widening = unpacked((other["covariance"][used] - one["covariance"][used]) * per)
        half = forward(root, widening if of_spreads else np.zeros_like(widening))
        spreads.append(forward(root, half.transpose(1, 0, 2)))
    return white, changes, spreads
