"""Rows of several bodies: split by name or order, and detected where they were read as one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Codes, Integers
from driftwalk.core.errors import InputError, argument_text
from driftwalk.record.cleaning.warn import refuse_many_bodies
from driftwalk.record.raw import Array, RawBody

LARGEST_SHARE = 0.01
"""Share of the times at which a tracker's slip may have left two places."""

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
    rows = np.flatnonzero((np.append(repeated, False) | np.append(False, repeated)) & known)
    if not rows.size:
        return clock[:0]
    times = clock[rows]
    starts = np.flatnonzero(np.append(True, times[1:] != times[:-1]))
    apart = np.zeros(starts.size, dtype=bool)
    for values in (x[rows], y[rows]):
        spread = np.maximum.reduceat(values, starts) - np.minimum.reduceat(values, starts)
        # The scale to metres leaves a resolution rounded.
        apart |= spread > quantum * (1.0 + 1e-6)
    return times[starts][apart]


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
    if apart.size <= LARGEST_SHARE * times:
        return
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
    found = columns(False)
    if found:
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
        The rows of all bodies.
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
    places = zip(labels, rows_of_bodies(codes, number=len(labels)), strict=True)
    return [replace(rows.take(at), name=name) for name, at in places if at.size]


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


def split_numbered(rows: RawBody, numbers: Array) -> tuple[list[RawBody], int]:
    """Return one body per number that names it, and how many rows have none and are left out."""
    named = np.isfinite(numbers)
    codes, names = number_codes(numbers[named])
    return split_bodies(rows.take(named), codes, names), int((~named).sum())


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
    if not values.size:
        return np.zeros(0, dtype=np.int32)
    starts = np.flatnonzero(np.concatenate(([True], values[1:] != values[:-1])))
    lengths = np.diff(np.append(starts, values.size))
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
