"""Samples in which the body is not where the file says: mistakes of the tracker, and marks.

A mistake is an isolated position far from both of its neighbours. No model makes them. The filter
of a fit leaves out a sample that is far from its prediction, but its search begins with so much
unrest that nothing is far; if some in a hundred samples are wrong by many times the noise, the
noise grows until it holds them and stays there. Simulated recordings of a motion model have none,
and so even the true law would not explain a recording with some. So they are taken out before.

A sample is compared with the line between its neighbours. One that is wrong by D lies D off that
line, and each neighbour, whose line ends in it, lies D/2 off to the other side. A turn, a bounce
off the wall or a jump to another place has no such pattern, however fast it is.

A mark means that the body was not seen: one place far off, or the last one held.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError, argument_text
from driftwalk.record.cleaning.jumps import squared_steps
from driftwalk.record.raw import Array, RawBody, RawRecording
from driftwalk.schema import Track


class OutlierPolicy(NamedTuple):
    """When a sample is a mistake of the tracker."""

    far: float = 6.0
    """Robust standard deviations off the line between its neighbours beyond which a sample may be a
    mistake: of a normal law one in 65 million."""
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
    """Return which samples of a track are mistakes of the tracker, shape (n,).

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


def mistakes_warning(mistakes: int, samples: int) -> str:
    """Return what to say of so many samples that were left out.

    Parameters
    ----------
    mistakes, samples : int
        Those that were left out, of how many.

    Examples
    --------
    >>> mistakes_warning(3, 6000)[:38]
    '3 of 6000 samples were left out: each '
    """
    return (
        f"{mistakes} of {samples} samples were left out: each lies far from both of its "
        "neighbours, as mistakes of a tracker do"
    )


def without_outliers(track: Track) -> Track:
    """Return a track without the samples that are mistakes of the tracker: they become gaps.

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
    if not wrong.any():
        return track
    return Track(*(column[~wrong] for column in track))


def without_far_outliers(track: Track) -> Track:
    """Return a track without the mistakes that are longer than the body's usual steps.

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


HELD: Final = "held"


class MissingPolicy(NamedTuple):
    """When samples look like marks of a body that was not seen; chosen by hand."""

    far: float = 8.0
    """Lengths of the usual step beyond which a place is far from its neighbours."""
    far_whole: float = 4.0
    """The same of a place whose numbers are whole, such as 0 or -1."""
    fewest: int = 2
    """Samples in such a place that are a mark."""
    any_place: int = 4
    """Samples in any other place that are a mark."""
    held: int = 3
    """Rows in one place, in a body that moves otherwise, after which a leap shows a mark."""
    moving: float = 0.5
    """Share of the steps in which such a body moves."""
    leap: float = 2.0
    """Least length of such a leap, in lengths of the usual step."""


MARK: Final = MissingPolicy()


def blank_missing(raw: RawRecording, marks: tuple[str, ...]) -> None:
    """Make samples missing whose place means that nothing was seen, in place, in the file's units.

    Parameters
    ----------
    raw : RawRecording
        As a loader returned it.
    marks : tuple of str
        ``"X,Y"``, a number that x or y has, or ``"held"``: the place of the row before.

    Raises
    ------
    InputError
        When a mark is none of these.
    """
    for mark in marks:
        count = 0
        for body in raw.bodies:
            lost = _lost(body, mark)
            rows = int(lost.sum())
            if rows:
                body.blank(lost)
            count += rows
        raw.notes.append(f"samples that {argument_text('missing', mark)} makes missing: {count}")


def _lost(body: RawBody, mark: str) -> Bools:
    if mark == HELD:
        same = (np.diff(body.x) == 0.0) & (np.diff(body.y) == 0.0)
        return np.append(False, same)[: body.x.size]
    try:
        numbers = [float(part) for part in mark.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) == 1:
        return np.asarray((body.x == numbers[0]) | (body.y == numbers[0]))
    if len(numbers) == 2:
        return np.asarray((body.x == numbers[0]) & (body.y == numbers[1]))
    raise InputError(
        f"`missing` is a place such as '0,0', a number such as '-9999', or '{HELD}'; got '{mark}'"
    )


def mark_warnings(raw: RawRecording, marks: tuple[str, ...]) -> list[str]:
    """Return what looks like a mark of samples in which the body was not seen.

    Parameters
    ----------
    raw : RawRecording
        In the units of the file.
    marks : tuple of str
        Those that are known.
    """
    found: dict[str, str] = {}
    for body in raw.bodies:
        for mark, what in _marks_of(body):
            if mark not in marks:
                found.setdefault(mark, f"body '{body.name}' {what}")
    return [
        f"{what}: if the body was not seen there, add {argument_text('missing', mark)}"
        for mark, what in found.items()
    ]


def _marks_of(body: RawBody) -> list[tuple[str, str]]:
    """Return the marks that one body may have, and what speaks for each."""
    known = np.isfinite(body.x) & np.isfinite(body.y)
    x, y = (body.x, body.y) if known.all() else (body.x[known], body.y[known])
    if x.size < 2 * MARK.any_place:
        return []
    # The median sorts its steps in place, and they are computed anew: a long recording is not to
    # be held once more.
    moving = squared_steps(x, y)
    if not moving.all():
        moving = moving[moving > 0.0]
    if not moving.size:
        return []
    usual = float(np.sqrt(np.median(moving, overwrite_input=True)))
    del moving
    square = squared_steps(x, y)
    marks = []
    with np.errstate(over="ignore"):
        near, far = (square > (least * usual) ** 2 for least in (MARK.far_whole, MARK.far))
    # A place that is left and reached by long steps alone; noise has no such place.
    if 0 < near.sum() <= x.size // 2:
        marks += _far_places(x, y, near, far)
    still = square == 0.0
    if 0.0 < still.mean() <= 1.0 - MARK.moving:
        runs, rows = _held_runs(square, still, usual)
        if runs > 1 or rows > MARK.held:
            times = "once" if runs == 1 else f"{runs} times"
            marks.append(
                (HELD, f"stays at exactly one place for several samples and leaps, {times}")
            )
    return marks


def _far_places(x: Array, y: Array, near: Bools, far: Bools) -> list[tuple[str, str]]:
    """Return the place that samples share exactly, and reach by far steps alone."""
    by_near, by_far = (np.append(steps, False) | np.append(False, steps) for steps in (near, far))
    reached = np.flatnonzero(by_near)
    whole_there = (x[reached] % 1.0 == 0.0) & (y[reached] % 1.0 == 0.0)
    reached = reached[by_far[reached] | whole_there]
    places, counts = np.unique(
        np.column_stack([x[reached], y[reached]]), axis=0, return_counts=True
    )
    for at in np.argsort(-counts, kind="stable")[:3]:
        px, py = places[at].tolist()
        there = (x == px) & (y == py)
        count = int(there.sum())
        whole = px == np.round(px) and py == np.round(py) and (px == py or min(px, py) < 0.0)
        if count < (MARK.fewest if whole else MARK.any_place) or 2 * count >= x.size:
            continue
        edges = np.flatnonzero(there[1:] != there[:-1])
        leaps = (near if whole else far)[edges]
        if not leaps.all() or np.hypot(x[~there] - px, y[~there] - py).min() <= 0.0:
            continue
        text = f"{px:.10g},{py:.10g}"
        what = f"is at exactly one place, {text} in the file, in {count} samples"
        return [(text, f"{what}, far from those around them")]
    return []


def _held_runs(square: Array, still: Bools, usual: float) -> tuple[int, int]:
    """Return how often the body stays for several rows and then leaps, and for how many rows."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    begins, ends = edges[::2], edges[1::2]
    after = np.append(square, 0.0)[ends]
    # The body went on: over a longer rest it leaps farther.
    leap = usual * np.maximum(MARK.leap, 0.5 * (ends - begins + 1))
    held = (ends - begins >= MARK.held - 1) & (after > leap**2)
    return int(held.sum()), int((ends - begins)[held].sum())
