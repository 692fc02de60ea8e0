"""Clean a track: rows of several bodies, duplicate and unsorted times, outliers and gaps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Codes, Indices, Integers
from driftwalk.core.errors import InputError, argument_text
from driftwalk.record.cleaning.clock import overlap, starts_over
from driftwalk.record.cleaning.jumps import PART, find_jumps
from driftwalk.record.cleaning.warn import refuse_many_bodies
from driftwalk.record.raw import Array, RawBody

LARGEST_SHARE = 0.01
"""Share of the times at which a tracker's slip may have left two places; chosen by hand."""

BodyColumns = Callable[[bool], list[str]]
"""Returns the columns that could name the body; the argument: whether times must be in order."""


def times_in_two_places(clock: Array, x: Array, y: Array, *, quantum: float = 0.0) -> Array:
    """Return the times that have rows in different places.

    Parameters
    ----------
    clock : array, shape (n,)
        Times in order; those that are equal stand together.
    x, y : array, shape (n,)
        Positions; a row without one is in no place.
    quantum : float
        Rows no further apart than the resolution of the positions are in the same place.

    Examples
    --------
    >>> times = np.array([0.0, 1.0, 1.0, 2.0, 2.0])
    >>> times_in_two_places(times, np.array([0.0, 1.0, 1.0, 2.0, 5.0]), np.zeros(5)).tolist()
    [2.0]
    """
    repeated = clock[1:] == clock[:-1]
    known = np.isfinite(x) & np.isfinite(y)
    rows = (np.append(repeated, False) | np.append(False, repeated)) & known
    times, places = clock[rows], np.array([x[rows], y[rows]])
    starts = starts_of_runs(times)
    spread = np.maximum.reduceat(places, starts, 1) - np.minimum.reduceat(places, starts, 1)
    # The scale to metres leaves a resolution rounded.
    return np.asarray(times[starts[(spread > quantum * (1.0 + 1e-6)).any(axis=0)]])


def starts_of_runs(values: npt.NDArray[Any]) -> Indices:
    """Return where runs of equal values begin.

    Examples
    --------
    >>> starts_of_runs(np.array([5, 5, 7, 5])).tolist()
    [0, 2, 3]
    """
    return np.flatnonzero(np.append(True, values[1:] != values[:-1])[: values.size])


def refuse_several_bodies(body: RawBody, apart: Array, columns: BodyColumns | None) -> None:
    """Raise an error when the times in two places are more than a tracker's slips.

    Parameters
    ----------
    body : RawBody
        Its times in order.
    apart : array
        Result of `times_in_two_places`.
    columns : callable, optional
        Finds the columns that could name the body; None: the format has no columns to choose from.

    Raises
    ------
    InputError
        Naming these columns.
    """
    times = 1 + int((body.clock[1:] != body.clock[:-1]).sum())
    if apart.size > LARGEST_SHARE * times:
        raise InputError(
            f"body '{body.name}' is in several places at {apart.size} of {times} times, first at "
            f"{apart[0]:.6g} s; {_advice(columns)}"
        )


def _advice(columns: BodyColumns | None) -> str:
    if columns is None:
        return (
            "the format has no column that distinguishes bodies: split the file, or "
            "correct these rows"
        )
    if found := columns(False):
        return name_the_body(found)
    return (
        'if these are several bodies, add a column that names them (`columns={"body": "NAME"}`); '
        "if the clock is coarser than the frames, count frames "
        '(`columns={"frame": "NAME"}` and `frame_rate`)'
    )


def name_the_body(columns: list[str]) -> str:
    """Return what to do when one of these columns could name the body.

    Examples
    --------
    >>> print(name_the_body(["particle"]))
    the column 'particle' could name the body: add `columns={"body": "particle"}`
    """
    argument = argument_text("columns", {"body": columns[0]})
    if len(columns) == 1:
        return f"the column '{columns[0]}' could name the body: add {argument}"
    shown = " or ".join(f"'{name}'" for name in columns)
    return f"the column {shown} could name the body: add {argument} or the like"


def split_bodies(rows: RawBody, codes: Codes, labels: Sequence[str]) -> list[RawBody]:
    """Return one body per label, each with its rows in the file's order.

    Parameters
    ----------
    rows : RawBody
        The rows of all bodies, without further values; it loses them where there are several.
    codes : array of int32, shape (n,)
        Index of each row's body in `labels`.
    labels : sequence of str
        Names of the bodies.

    Raises
    ------
    FormatError
        When there are more labels than bodies are read.
    """
    refuse_many_bodies(labels)
    if len(labels) == 1:
        return [replace(rows, name=labels[0])]
    # A mask has one byte a row, and the number of a row has eight.
    masks = [codes == at for at in range(len(labels))] if len(labels) <= 8 else None
    places = masks or rows_of_bodies(codes, number=len(labels))
    columns = []
    for column in ("clock", "x", "y", "theta"):  # each is let go as soon as the bodies have it
        values = vars(rows).pop(column)
        columns.append([None if values is None else values[at] for at in places])
    parts = zip(labels, *columns, strict=True)
    return [RawBody(name, clock, *of) for name, clock, *of in parts if clock.size]


def rows_of_bodies(codes: Codes, *, number: int = 0) -> list[Integers]:
    """Return the rows of each body in the file's order, of `number` bodies or all that have rows.

    Examples
    --------
    >>> [rows.tolist() for rows in rows_of_bodies(np.array([1, 0, 1], dtype=np.int32))]
    [[1], [0, 2]]
    """
    ends = np.cumsum(np.bincount(codes, minlength=number))[:-1]
    return np.split(np.argsort(codes, kind="stable"), ends)


def number_codes(values: Array) -> tuple[Codes, list[str]]:
    """Return, for numbers that name bodies, the index of each row's body, and their names.

    Parameters
    ----------
    values : array, shape (n,)
        Numbers, all of them finite.

    Examples
    --------
    >>> number_codes(np.array([7.0, 3.0, 7.0]))[1]
    ['3', '7']
    """
    numbers, codes = np.unique(values, return_inverse=True)
    names = [str(int(number)) if number % 1 == 0 else f"{number:g}" for number in numbers.tolist()]
    return codes.ravel().astype(np.int32), names


def codes_in_arenas(
    arenas: tuple[Codes, list[str]], targets: tuple[Codes, list[str]]
) -> tuple[Codes, list[str]]:
    """Return the index of each row's body, and names; each arena numbers its bodies from the first.

    Examples
    --------
    >>> one = np.array([0, 0, 1], dtype=np.int32)
    >>> codes_in_arenas((one, ["A", "B"]), (0 * one, ["1"]))[1]
    ['A/1', 'B/1']
    """
    pairs, codes = np.unique(np.stack([arenas[0], targets[0]]), axis=1, return_inverse=True)
    several = len(arenas[1]) > 1
    names = [(f"{arenas[1][a]}/" if several else "") + targets[1][t] for a, t in pairs.T.tolist()]
    return codes.ravel().astype(np.int32), names


def order_in_frame(frame: npt.ArrayLike) -> Codes:
    """Return, for rows in the order of their frames, the place of each row within its frame."""
    values = np.asarray(frame)
    starts = starts_of_runs(values)
    lengths = np.diff(starts, append=values.size)
    return (np.arange(values.size) - np.repeat(starts, lengths)).astype(np.int32)


def order_in_body(codes: Codes) -> Array:
    """Return, for rows of several bodies, the place of each row among those of its body.

    Examples
    --------
    >>> order_in_body(np.array([0, 1, 0, 1, 1], dtype=np.int32)).tolist()
    [0.0, 0.0, 1.0, 1.0, 2.0]
    """
    order = np.argsort(codes, kind="stable")
    place = np.empty(codes.size)
    place[order] = order_in_frame(codes[order])
    return place


@dataclass
class Counts:
    """Findings of the cleaning in one body."""

    rows: int = 0
    """Rows of the body in the file."""
    without_time: int = 0
    """Rows without a time, dropped."""
    unsorted: int = 0
    """Times that went backwards, sorted because that was asked for."""
    duplicates_dropped: int = 0
    """Rows whose time a later row repeats, dropped: the last is kept."""
    times_in_two_places: int = 0
    """Times whose rows lie in different places; the last is kept."""
    outside_window: int = 0
    """Rows before `start` or after `stop`, dropped."""
    jumps_removed: int = 0
    """Samples beyond `max_speed`, turned into gaps."""
    impossible_steps: int = 0
    """Steps that are left and that no body makes: see `driftwalk.record.impossible_steps`."""
    missing: int = 0
    """Rows without a position, before jumps were removed."""
    samples: int = 0
    """Samples with a position at the end."""


def clean_body(
    body: RawBody,
    *,
    sort: str = "error",
    start: float | None = None,
    stop: float | None = None,
    max_speed: float | None = None,
    quantum: float = 0.0,
    separate: bool = False,
    columns: BodyColumns | None = None,
) -> tuple[RawBody, Counts]:
    """Return the body with strictly increasing times, and what was done to it.

    Parameters
    ----------
    body : RawBody
        In SI units. Its arrays are written to, or replaced where rows are left out.
    sort : {"error", "sort"}
        Behaviour if times go backwards.
    start, stop : float, optional
        First and last time to keep [s].
    max_speed : float, optional
        Samples without which the body was never faster than this [m/s] become gaps: see
        `find_jumps`.
    quantum : float
        Resolution of the positions [m]: rows within it are in the same place.
    separate : bool
        Whether the rows are known to be of one body, so that two places at one time are counted
        however many they are.
    columns : callable, optional
        Finds the columns of the file that could name the body, for the errors.

    Raises
    ------
    InputError
        When times go backwards and `sort` is ``"error"``, or when at more than 1 % of the times
        rows are in different places, unless `separate`; when two times are nearly one.
    """
    if sort not in ("error", "sort"):
        raise InputError(f"sort is 'error' or 'sort', got '{sort}'")
    counts = Counts(rows=body.clock.size)
    known = np.isfinite(body.clock)
    counts.without_time = int(np.count_nonzero(~known))
    if counts.without_time:
        body = body.take(known)
    body = _in_order(body, counts, sort=sort, columns=columns)
    if start is not None or stop is not None:
        first, last = (-np.inf if start is None else start), (np.inf if stop is None else stop)
        inside = (body.clock >= first) & (body.clock <= last)
        counts.outside_window = int((~inside).sum())
        body = body.take(inside)
    repeated = body.clock[1:] == body.clock[:-1]
    if repeated.any():
        apart = times_in_two_places(body.clock, body.x, body.y, quantum=quantum)
        if not separate:
            refuse_several_bodies(body, apart, columns)
        counts.times_in_two_places = int(apart.size)
        counts.duplicates_dropped = int(repeated.sum())
        body = body.take(np.append(~repeated, True))
    _refuse_closest(body)
    lost = ~(np.isfinite(body.x) & np.isfinite(body.y))
    counts.missing = int(np.count_nonzero(lost))
    if counts.missing:  # half a position is none
        body.x[lost] = body.y[lost] = np.nan
    if body.theta is not None:
        body.theta[~np.isfinite(body.theta)] = np.nan
    if max_speed is not None:
        if not max_speed > 0:
            raise InputError(f"`max_speed` must be above zero, got {max_speed} m/s")
        jumps = find_jumps(body, max_speed)
        counts.jumps_removed = int(jumps.size)
        body.x[jumps] = body.y[jumps] = np.nan
    counts.samples = int(np.count_nonzero(np.isfinite(body.x)))
    return body, counts


def _in_order(body: RawBody, counts: Counts, *, sort: str, columns: BodyColumns | None) -> RawBody:
    backwards = np.flatnonzero(body.clock[1:] < body.clock[:-1])
    if not backwards.size:
        return body
    anew = starts_over(body.clock)
    if sort == "error" or (anew and overlap(body.clock)):
        at = int(backwards[0])
        if columns is not None and (found := columns(True)):
            remedy = f'{name_the_body(found)}, or `sort="sort"` if it is one body'
        elif anew:
            remedy = (
                "the clock starts over there, as where a counter was reset or recordings were "
                "joined: split the file before that row"
            )
        else:
            remedy = 'add `sort="sort"` to sort them'
        raise InputError(
            f"time goes backwards in row {at + 2} of body '{body.name}': {body.clock[at]:.6g} s is "
            f"followed by {body.clock[at + 1]:.6g} s ({backwards.size} such rows); {remedy}"
        )
    counts.unsorted = int(backwards.size)
    return body.take(np.argsort(body.clock, kind="stable"))


def _refuse_closest(body: RawBody) -> None:
    """Refuse two times by whose difference no speed can be divided."""
    for start in range(0, body.clock.size - 1, PART):
        steps = np.diff(body.clock[start : start + PART + 1])
        at = int(steps.argmin())
        # No camera is that fast; powers of 1e12 are still within float64.
        if steps[at] < 1e-12:
            raise InputError(
                f"two times of body '{body.name}' are {steps[at]:.3g} s apart, at "
                f"{body.clock[start + at]:.6g} s: one of them is wrong"
            )
