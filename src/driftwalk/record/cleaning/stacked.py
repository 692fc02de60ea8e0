"""Split rows of several bodies, stacked one below the other, into bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from driftwalk.record.cleaning.extent import refuse_many_bodies
from driftwalk.record.raw import Array, RawBody


def split_bodies(
    codes: npt.NDArray[np.int32],
    labels: Sequence[str],
    *,
    clock: Array,
    x: Array,
    y: Array,
    theta: Array | None = None,
) -> list[RawBody]:
    """Return one body per label, each with its rows in the file's order.

    Parameters
    ----------
    codes : array of int32, shape (n,)
        Index of each row's body in `labels`.
    labels : sequence of str
        Names of the bodies.
    clock, x, y, theta : array, shape (n,)
        The rows.

    Raises
    ------
    FormatError
        When there are more labels than bodies are read.
    """
    refuse_many_bodies(labels)
    if len(labels) == 1:
        return [RawBody(labels[0], clock, x, y, theta)]
    order = np.argsort(codes, kind="stable")
    ends = np.cumsum(np.bincount(codes, minlength=len(labels)))[:-1]
    rows = np.split(order, ends)
    return [
        RawBody(name, clock[at], x[at], y[at], None if theta is None else theta[at])
        for name, at in zip(labels, rows, strict=True)
        if at.size
    ]


def number_codes(values: Array) -> tuple[npt.NDArray[np.int32], list[str]]:
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


def order_in_frame(frame: npt.ArrayLike) -> npt.NDArray[np.int32]:
    """Return, for rows in the order of their frames, the place of each row within its frame."""
    values = np.asarray(frame)
    if not values.size:
        return np.zeros(0, dtype=np.int32)
    starts = np.flatnonzero(np.concatenate(([True], values[1:] != values[:-1])))
    lengths = np.diff(np.append(starts, values.size))
    return (np.arange(values.size) - np.repeat(starts, lengths)).astype(np.int32)


def order_in_body(codes: npt.NDArray[np.int32]) -> Array:
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
