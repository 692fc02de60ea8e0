"""Passages of the block along the wall: the parts of a recording that the fit leaves out."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from driftwalk.likelihood.estimate import Estimate
from driftwalk.likelihood.filter.series import Series, corrected
from driftwalk.likelihood.spline import Floats


class PassagePolicy(NamedTuple):
    """Samples of a passage along the wall."""

    before: int = 3
    """Samples that a passage begins before the wall. Chosen by hand, as what follows."""
    after: int = 4
    """Samples that it ends after the wall."""
    longest: int = 25
    """Most samples from the wall on."""
    uneven: float = 0.2
    """Largest relative difference of an interval from the usual one."""


PASSAGE: Final = PassagePolicy()


class Passages(NamedTuple):
    """Passages of the block along the wall; shapes (passages, samples)."""

    x: Floats
    y: Floats
    theta: Floats
    """Recorded poses, NaN after the end of a passage."""
    state: Floats
    """x, y, theta and their rates at the first sample, shape (passages, 6)."""


def passages_of(estimate: Estimate, series: Series) -> Passages:
    """Return the passages along the wall of one series."""
    point = estimate.point.in_flow(series.flow)
    x, y, theta = corrected(series, point)
    states = estimate.passes.states(series, point)
    usual = float(np.median(np.diff(series.time)))
    even = np.concatenate([[False], np.abs(np.diff(series.time) - usual) < PASSAGE.uneven * usual])
    whole = np.isfinite(x) & np.isfinite(y) & np.isfinite(theta)
    rows = []
    at = 0
    places = np.flatnonzero(series.excluded)
    while places.size:
        first = int(places[0])
        last = first
        while last + 1 < x.size and series.excluded[last + 1 : last + 1 + PASSAGE.after].any():
            last += 1
        begin, end = (
            first - 1 - PASSAGE.before,
            min(last + 1 + PASSAGE.after, first + PASSAGE.longest),
        )
        places = places[places > max(last, end)]
        inside = slice(begin + 1, end)
        if begin <= at or end >= x.size or series.excluded[begin - 1 : first].any():
            continue
        if not (whole[begin:end].all() and even[inside].all() and np.isfinite(states[begin]).all()):
            continue
        at = end
        pad = PASSAGE.longest + PASSAGE.before + 1 - (end - begin - 1)
        rows.append(
            (
                *(np.pad(part[inside], (0, pad), constant_values=np.nan) for part in (x, y, theta)),
                states[begin],
            )
        )
    if not rows:
        empty = np.zeros((0, PASSAGE.longest + PASSAGE.before + 1))
        return Passages(empty, empty, empty, np.zeros((0, 6)))
    return Passages(*(np.array(column) for column in zip(*rows, strict=True)))


def thinned(passages: Passages, share: float) -> Passages:
    """Return a share of the passages, evenly taken; one at least."""
    count = len(passages.x)
    retained = np.unique(np.linspace(0, count - 1, max(round(share * count), 1)).astype(np.intp))
    return Passages(*(part[retained] for part in passages))
