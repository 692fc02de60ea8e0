"""Outliers of a track: samples that the tracker got wrong.

A mistake is an isolated position far from both of its neighbours. No model makes them. The filter
of a fit leaves out a sample that is far from its prediction, but its search begins with so much
unrest that nothing is far; if some in a hundred samples are wrong by many times the noise, the
noise grows until it holds them and stays there. Simulated recordings of a motion model have none,
and so even the true law would not explain a recording with some. So they are taken out before.

A sample is compared with the line between its neighbours. One that is wrong by D lies D off that
line, and each neighbour, whose line ends in it, lies D/2 off to the other side. A turn, a bounce
off the wall or a jump to another place has no such pattern, however fast it is.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats
from driftwalk.schema.trajectory import Track


class OutlierPolicy(NamedTuple):
    """When a sample is a mistake of the tracker."""

    far: float = 6.0
    """Robust standard deviations off the line between its neighbours beyond which a sample may be a
    mistake: by chance, of a normal law, one in 65 million."""
    opposite: float = 0.25
    """Least part of its own distance by which both neighbours lie off to the other side. A mistake
    alone has 0.5. Chosen by hand."""
    longest_gap: float = 1.5
    """Usual intervals between neighbours up to which they are neighbours. Chosen by hand: a missing
    frame makes it 2."""
    longest_far_gap: float = 3.5
    """The same where a mistake is longer than usual steps. Chosen by hand: two missing frames make
    it 3."""
    excursion: float = 3.0
    """Usual steps off the median of five samples beyond which one of two successive samples is
    a mistake: a body that turns back is one step off. Chosen by hand."""
    usual_steps: float = 0.9
    """Share of the steps of a body that drives itself than which a mistake is longer: animals turn
    back within a sample. Chosen by hand: in recordings of fish, mice and robots at most 2 % of the
    samples are left out, and all that the line shows where a tracker is wrong by 5 mm or more."""
    fewest: int = 50
    """Samples with neighbours without which no distance is usual. Chosen by hand."""


OUTLIER: Final = OutlierPolicy()


def outliers_in(
    track: Track, *, least: float = 0.0, longest_gap: float = OUTLIER.longest_gap
) -> Bools:
    """Return which samples of a track are outliers, shape (n,).

    None is less than `least` [m] off the line between its neighbours, which are at most so many
    usual intervals away.

    Examples
    --------
    >>> time = 0.1 * np.arange(1000.0)
    >>> noise = np.random.default_rng(1).normal(0.0, 3e-4, (2, 1000))
    >>> noise[0, 300] += 5e-3
    >>> x = 0.1 * np.sin(0.5 * time) + noise[0]
    >>> outliers_in(Track(time, x, noise[1], 0 * time)).nonzero()[0].tolist()
    [300]
    """
    found = np.zeros(track.time.size, dtype=bool)
    if track.time.size < OUTLIER.fewest:
        return found
    off = _off_the_line(track, longest_gap)
    known = np.isfinite(off[0])
    if known.sum() < OUTLIER.fewest:
        return found
    usual = 1.4826 * float(np.median(np.abs(off[:, known])))
    if usual == 0.0:
        return found
    square = (off**2).sum(axis=0)
    aside = (off[:, 1:] * off[:, :-1]).sum(axis=0)
    middle = square[1:-1]
    with np.errstate(invalid="ignore"):
        found[1:-1] = (
            (np.sqrt(middle) > max(OUTLIER.far * usual, least))
            & (aside[:-1] < -OUTLIER.opposite * middle)
            & (aside[1:] < -OUTLIER.opposite * middle)
            & (middle > square[:-2])
            & (middle > square[2:])
        )
    return found


def _off_the_line(track: Track, longest_gap: float) -> Floats:
    """Return how far each sample is from the line between its neighbours, shape (2, n) [m].

    NaN where a neighbour is missing.
    """
    time = track.time
    interval = np.diff(time)
    share = interval[:-1] / (interval[:-1] + interval[1:])
    off = np.full((2, time.size), math.nan)
    for row, axis in zip(off, (track.x, track.y), strict=True):
        row[1:-1] = axis[1:-1] - (axis[:-2] + share * (axis[2:] - axis[:-2]))
    longest = longest_gap * float(np.median(interval))
    off[:, 1:-1][:, np.maximum(interval[:-1], interval[1:]) > longest] = math.nan
    return off


def outliers_warning(outliers: int, samples: int) -> str:
    """Return the warning about samples that were left out.

    Parameters
    ----------
    outliers, samples : int
        Those that were left out, of how many.

    Examples
    --------
    >>> outliers_warning(3, 6000)[:38]
    '3 of 6000 samples were left out: each '
    """
    return (
        f"{outliers} of {samples} samples were left out: each lies far from both of its "
        "neighbours, as tracking errors do"
    )


def without_outliers(track: Track) -> Track:
    """Return a track without its outliers: they become gaps.

    Parameters
    ----------
    track : Track
        One body.

    Examples
    --------
    >>> time = 0.1 * np.arange(1000.0)
    >>> noise = np.random.default_rng(1).normal(0.0, 3e-4, (2, 1000))
    >>> noise[0, 300] += 5e-3
    >>> without_outliers(Track(time, 0.1 * time + noise[0], noise[1], 0 * time)).time.size
    999
    """
    wrong = outliers_in(track)
    return Track(*(column[~wrong] for column in track)) if wrong.any() else track


def without_far_outliers(track: Track) -> Track:
    """Return a track without the outliers that are longer than the body's usual steps.

    One that is found lets the next one show. Successive ones mask each other's pattern: they are
    far from the median of five samples.

    Parameters
    ----------
    track : Track
        One body.

    Examples
    --------
    >>> time = 0.1 * np.arange(1000.0)
    >>> noise = np.random.default_rng(1).normal(0.0, 3e-4, (2, 1000))
    >>> noise[0, 300] += 0.02
    >>> without_far_outliers(Track(time, 0.1 * time + noise[0], noise[1], 0 * time)).time.size
    999
    """
    from scipy.ndimage import median_filter

    if track.time.size < OUTLIER.fewest:
        return track
    interval = np.diff(track.time)
    speeds = np.hypot(np.diff(track.x), np.diff(track.y)) / interval
    usual = float(np.median(interval) * np.quantile(speeds, OUTLIER.usual_steps))
    if usual == 0.0:
        return track  # at rest nearly always: its steps say nothing of how far it goes
    gap = OUTLIER.longest_far_gap
    while (wrong := outliers_in(track, least=usual, longest_gap=gap)).any():
        track = Track(*(column[~wrong] for column in track))
    off = [axis - median_filter(axis, 5, mode="nearest") for axis in (track.x, track.y)]
    near = np.hypot(*off) <= OUTLIER.excursion * usual
    return track if near.all() else Track(*(column[near] for column in track))
