"""Clean a track: duplicate and unsorted times, outliers and gaps."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.record.cleaning.clock import overlap, starts_over
from driftwalk.record.cleaning.jumps import PART, find_jumps
from driftwalk.record.cleaning.several_bodies import (
    BodyColumns,
    name_the_body,
    refuse_several_bodies,
    times_in_two_places,
)
from driftwalk.record.raw import RawBody


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
        In SI units. Arrays without a fault are used as they are, not copied.
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
    if not known.all():
        counts.without_time = int((~known).sum())
        body = body.take(known)
    body = _in_order(body, counts, sort=sort, columns=columns)
    if start is not None or stop is not None:
        inside = np.ones(body.clock.size, dtype=bool)
        inside &= body.clock >= (-np.inf if start is None else start)
        inside &= body.clock <= (np.inf if stop is None else stop)
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
    counts.missing = int(lost.sum())
    if counts.missing:  # half a position is none
        body.x[lost] = body.y[lost] = np.nan
    if body.theta is not None and not np.isfinite(body.theta).all():
        body.theta = np.where(np.isfinite(body.theta), body.theta, np.nan)
    if max_speed is not None:
        if not max_speed > 0:
            raise InputError(f"`max_speed` must be above zero, got {max_speed} m/s")
        jumps = find_jumps(body, max_speed)
        counts.jumps_removed = int(jumps.size)
        if jumps.size:
            body = replace(body, x=body.x.copy(), y=body.y.copy())
            body.x[jumps] = body.y[jumps] = np.nan
    counts.samples = int(np.isfinite(body.x).sum())
    return body, counts


def _in_order(body: RawBody, counts: Counts, *, sort: str, columns: BodyColumns | None) -> RawBody:
    backwards = np.flatnonzero(body.clock[1:] < body.clock[:-1])
    if not backwards.size:
        return body
    anew = starts_over(body.clock)
    if sort == "error" or (anew and overlap(body.clock)):
        at = int(backwards[0])
        found = [] if columns is None else columns(True)
        if found:
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
