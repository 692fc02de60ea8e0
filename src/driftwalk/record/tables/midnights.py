"""Times of day across midnight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from driftwalk.record.raw import Array, RawBody
from driftwalk.record.tables.stamps import DAY_NS


def count_days(
    bodies: list[RawBody], clock: Array, codes: npt.NDArray[np.int32] | None
) -> list[RawBody]:
    """Return bodies whose times of day have a day more after each midnight.

    Rows of several bodies that take turns are in the order of their times: midnight is the same row
    for all. Where bodies stand one below the other, each has its own midnights.

    Parameters
    ----------
    bodies : list of RawBody
        Their clocks in nanoseconds since midnight.
    clock : array, shape (n,)
        The clock of all rows.
    codes : array of int32, shape (n,), optional
        Index of each row's body, in the order of the bodies; None: all share the clock.
    """
    if codes is None or len(bodies) == 1:
        counted = with_days_counted(clock)
        return [replace(body, clock=counted) for body in bodies]
    turns = int((codes[1:] != codes[:-1]).sum())
    if turns < len(bodies):
        return [replace(body, clock=with_days_counted(body.clock)) for body in bodies]
    counted = with_days_counted(clock)
    present = np.unique(codes)
    return [
        replace(body, clock=counted[codes == code])
        for body, code in zip(bodies, present, strict=True)
    ]


def with_days_counted(clock: Array) -> Array:
    """Return times of day [ns] with a day more after each midnight.

    A step back by more than half a day is a midnight.

    Parameters
    ----------
    clock : array, shape (n,)
        Nanoseconds since midnight, NaN where there is no time.

    Examples
    --------
    >>> hour = 3600e9
    >>> (with_days_counted(np.array([23.0 * hour, 1.0 * hour])) / hour).tolist()
    [23.0, 25.0]
    """
    known = np.flatnonzero(np.isfinite(clock))
    midnights = np.diff(clock[known]) < -0.5 * DAY_NS
    if not midnights.any():
        return clock
    counted = clock.copy()
    counted[known[1:]] += DAY_NS * np.cumsum(midnights)
    return counted
