"""Places that mean that a body was not seen: one place far off, or the last one held."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools
from driftwalk.core.errors import InputError, argument_text
from driftwalk.record.cleaning.jumps import squared_steps
from driftwalk.record.raw import Array, RawBody, RawRecording

HELD: Final = "held"


class MissingPolicy(NamedTuple):
    """When samples look like marks of a body that was not seen; chosen by hand."""

    far: float = 8.0
    """Lengths of the usual step beyond which a place is far from its neighbours; chosen by hand."""
    far_whole: float = 4.0
    """The same of a place whose numbers are whole, such as 0 or -1; chosen by hand."""
    fewest: int = 2
    """Samples in such a place that are a mark; chosen by hand."""
    any_place: int = 4
    """Samples in any other place that are a mark; chosen by hand."""
    held: int = 3
    """Rows in one place, in a body that moves otherwise, after which a leap shows a mark; chosen by
    hand."""
    moving: float = 0.5
    """Share of the steps in which such a body moves; chosen by hand."""
    leap: float = 2.0
    """Least length of such a leap, in lengths of the usual step; chosen by hand."""


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
            body.blank(lost)
            count += int(lost.sum())
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
    near = square > (MARK.far_whole * usual) ** 2
    # A place that is left and reached by long steps alone; noise has no such place.
    if 0 < np.count_nonzero(near) <= x.size // 2:
        marks += _far_places(x, y, near, square > (MARK.far * usual) ** 2)
    still = square == 0.0
    if 0 < np.count_nonzero(still) <= (1.0 - MARK.moving) * still.size:
        runs, rows = _held_runs(square, still, usual)
        if runs > 1 or rows > MARK.held:
            times = "once" if runs == 1 else f"{runs} times"
            what = f"stays at exactly one place for several samples and leaps, {times}"
            marks.append((HELD, what))
    return marks


def _far_places(x: Array, y: Array, near: Bools, far: Bools) -> list[tuple[str, str]]:
    """Return the place that samples share exactly, and reach by far steps alone."""
    by_near, by_far = (np.append(steps, False) | np.append(False, steps) for steps in (near, far))
    reached = np.flatnonzero(by_near)
    whole_there = (x[reached] % 1.0 == 0.0) & (y[reached] % 1.0 == 0.0)
    reached = reached[by_far[reached] | whole_there]
    candidates = np.column_stack([x[reached], y[reached]])
    places, counts = np.unique(candidates, axis=0, return_counts=True)
    for at in np.argsort(-counts, kind="stable")[:3]:
        px, py = places[at].tolist()
        there = (x == px) & (y == py)
        count = int(there.sum())
        whole = px == np.round(px) and py == np.round(py) and (px == py or min(px, py) < 0.0)
        if count < (MARK.fewest if whole else MARK.any_place) or 2 * count >= x.size:
            continue
        leaps = (near if whole else far)[there[1:] != there[:-1]]
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
