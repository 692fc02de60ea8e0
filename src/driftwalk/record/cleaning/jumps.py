"""Outliers of a track: samples that imply an impossible speed.

`find_jumps` takes the greatest speed; `impossible_steps` needs none: it finds single long steps
among short ones.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats, Integers
from driftwalk.record.cleaning.warn import PLAUSIBLE, span_of
from driftwalk.record.raw import Array, RawBody


class JumpPolicy(NamedTuple):
    """Which samples and steps are impossible."""

    effort: float = 0.5
    """Cost of a step at the greatest speed, in samples that are left out. In closed form: with a
    half, no sample is left out that is within reach of both its neighbours."""
    longest_excursion: int = 300
    """Samples back to which each is tried as the one before; earlier, only the best of all is;
    chosen by hand."""
    arena_share: float = 0.25
    """Share of the arena's diagonal from which on a step can be impossible. Measured: in recordings
    without a fault, a fish that darts stays below 0.22, seen 1.5 to 30 times a second, and robots
    that kick each other below 0.18; trackers that slip do so by 0.25 to 0.8."""
    alone: float = 5.0
    """Least length of an impossible step, in lengths of the steps around it. A fast body takes long
    steps one after the other; measured, a slip of a tracker was 16 times as long or more."""
    around: int = 3
    """Steps before and after that are looked at. The longest of them does not count: it may be
    the way back; chosen by hand."""
    neighbours: float = 1.5
    """Usual intervals beyond which a step is one over a gap, in which a body may go far; chosen
    by hand."""


JUMPS: Final = JumpPolicy()
PART: Final = 1 << 20
"""Samples that are compared at once, some 16 MB: a recording may have millions; chosen by hand."""


def find_jumps(body: RawBody, max_speed: float) -> Integers:
    """Return the indices of samples that the body cannot have been at, at `max_speed` [m/s].

    From each sample that is left to the next, the body is never faster than that. Of all ways to
    leave samples out, it is the one that leaves out fewest, and among similar ones the one with the
    slowest steps: a wrong sample goes, and not the good one after it. A step at the greatest speed
    counts as half a sample left out, and over n intervals as n times that; slower ones by the
    square of their speed. So a short excursion is removed whole, even if its later samples are
    within reach again.

    Parameters
    ----------
    body : RawBody
        With increasing times [s]; positions [m], NaN where there are none.
    max_speed : float
        Greatest plausible speed [m/s].

    Examples
    --------
    >>> time = np.arange(5.0)
    >>> find_jumps(RawBody("0", time, np.array([0.0, 1, 90, 3, 4]), time * 0), 2.0).tolist()
    [2]
    """
    present = np.flatnonzero(np.isfinite(body.x))
    t, x, y = body.clock[present], body.x[present], body.y[present]
    if t.size <= 1:
        return np.zeros(0, dtype=np.int64)
    removed = np.ones(t.size, dtype=bool)
    removed[_best_chain(t, x, y, max_speed)] = False
    return present[removed]


def _best_chain(t: Floats, x: Floats, y: Floats, max_speed: float) -> Integers:
    """Return the samples of the cheapest chain, in order.

    ``cost`` is that of the cheapest chain to end in a sample, less one for each sample up to there.
    """
    share = np.hypot(np.diff(x), np.diff(y)) / (max_speed * np.diff(t))
    suspects = np.append(np.flatnonzero(~(share <= 1.0)) + 1, t.size)
    fall = np.append(0.0, JUMPS.effort * share**2 - 1.0)
    cost, before = np.zeros(t.size), np.full(t.size, -1, dtype=np.int64)
    least = np.zeros(t.size, dtype=np.int64)
    """The cheapest sample up to each."""
    at = 1
    while at < t.size:
        last, best = at - 1, least[at - 1]
        rival = cost[least[at - 2]] if at > 1 else np.inf
        upto = int(suspects[np.searchsorted(suspects, at)])
        if rival >= cost[last] + JUMPS.effort and upto > at:
            # No sample of an undisturbed stretch follows another than the one before it.
            cost[at:upto] = cost[last] + np.cumsum(fall[at:upto])
            before[at:upto] = np.arange(last, upto - 1)
            least[at:upto] = np.arange(at, upto)
            at = upto
            continue
        first = max(at - JUMPS.longest_excursion, 0)
        tried = np.arange(first, at)
        if first and least[first - 1] >= 0:
            tried = np.append(least[first - 1], tried)
        speed = np.hypot(x[at] - x[tried], y[at] - y[tried]) / (max_speed * (t[at] - t[tried]))
        value = np.where(
            speed <= 1.0, cost[tried] - 1.0 + JUMPS.effort * (at - tried) * speed**2, np.inf
        )
        chosen = int(np.argmin(value))
        if value[chosen] < 0.0:
            cost[at], before[at] = value[chosen], tried[chosen]
        least[at] = at if cost[at] < cost[best] else best
        at += 1
    chain = [int(least[-1])]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    return np.array(chain[::-1], dtype=np.int64)


class Impossible(NamedTuple):
    """The impossible steps of one body."""

    number: int
    longest: float
    """[m]"""
    first: float
    """Time of the sample before the first of them [s]."""
    between: float
    """A speed that is faster than its other steps, and slower than these [m/s]."""


def squared_steps(x: Array, y: Array) -> Array:
    """Return the squares of the lengths of the steps: a root of each would take time."""
    square: Array = np.diff(x)
    with np.errstate(over="ignore"):
        square *= square
        for start in range(0, square.size, PART):
            across = np.diff(y[start : start + PART + 1])
            across *= across
            square[start : start + PART] += across
    return square


def impossible_steps(time: Array, x: Array, y: Array, *, diagonal: float) -> Impossible | None:
    """Return the steps of a body that it cannot have made; None where there are none.

    Parameters
    ----------
    time : array, shape (n,)
        Increasing times [s].
    x, y : array, shape (n,)
        Positions [m], NaN where there are none.
    diagonal : float
        Of the arena [m], see `arena_diagonal`.

    Examples
    --------
    >>> x = np.append(np.arange(20.0), np.arange(20.0))
    >>> impossible_steps(np.arange(40.0), x, 0.0 * x, diagonal=19.0)
    Impossible(number=1, longest=19.0, first=19.0, between=4.4)
    """
    if diagonal < math.sqrt(2.0) * PLAUSIBLE.smallest_extent_m:
        return None  # at rest, or in a wrong unit: `plausibility_warnings` speaks of it
    square = squared_steps(x, y)
    far = np.flatnonzero(square > (JUMPS.arena_share * diagonal) ** 2)
    if not far.size:
        return None
    length = np.sqrt(square)
    interval = np.diff(time)
    near = interval <= JUMPS.neighbours * np.median(interval)
    length[~near] = np.nan
    far = far[near[far]]
    padded = np.pad(length, JUMPS.around, constant_values=np.nan)
    places = [*range(JUMPS.around), *range(JUMPS.around + 1, 2 * JUMPS.around + 1)]
    around = np.sort(padded[far[:, None] + np.array(places)], axis=1)  # NaN go to the end
    known = np.isfinite(around).sum(axis=1)
    second = np.take_along_axis(around, np.maximum(known - 2, 0)[:, None], axis=1)[:, 0]
    found = far[(known >= JUMPS.around) & (length[far] > JUMPS.alone * second)]
    if not found.size:
        return None
    speed = length / interval
    slowest = float(speed[found].min())
    speed[found] = np.nan
    others = speed[np.isfinite(speed)]
    fastest = min(float(others.max()), slowest) if others.size else slowest
    between = float(f"{math.sqrt(max(fastest, 1e-3 * slowest) * slowest):.2g}")
    longest, first = float(length[found].max()), float(time[found[0]])
    return Impossible(int(found.size), longest, first, between)


def arena_diagonal(
    x: Sequence[Array], y: Sequence[Array], arena: Mapping[str, Any] | None = None
) -> float:
    """Return the diagonal of what holds all positions, or of the stated tank where that is larger.

    Parameters
    ----------
    x, y : sequence of array
        Positions of all bodies [m]: one alone may be at rest.
    arena : mapping, optional
        The arena of the dataset.

    Examples
    --------
    >>> x, y = np.array([0.0, 0.3]), np.array([0.0, 0.4])
    >>> arena_diagonal([x], [y])
    0.5
    >>> arena_diagonal([x], [y], {"shape": "rectangle", "width_m": 6.0, "height_m": 8.0})
    10.0
    """
    stated = arena or {}
    if "vertices_m" in stated:
        tank = np.ptp(np.asarray(stated["vertices_m"], dtype=np.float64), axis=0).tolist()
    else:
        side = stated.get("diameter_m", 0.0)
        tank = [stated.get("width_m", side), stated.get("height_m", side)]
    return max(math.hypot(span_of(x), span_of(y)), math.hypot(*tank))


def impossible_warning(name: str, steps: Impossible) -> str:
    """Return what to say of a body's impossible steps, and what to do.

    Parameters
    ----------
    name : str
        The body.
    steps : Impossible
        Its impossible steps.

    Examples
    --------
    >>> impossible_warning("0", Impossible(178, 0.371, 3.2, 1.2))[:44]
    "body '0' jumps 178 times between two samples"
    """
    times = "once" if steps.number == 1 else f"{steps.number} times"
    return (
        f"body '{name}' jumps {times} between two samples, by up to {steps.longest:.3g} m, first "
        f"at {steps.first:.6g} s, and moves slowly before and after: several bodies? Name the "
        'column that tells them apart (`columns={"body": "NAME"}`), or keep the time of one '
        f"(`start`, `stop`); if it is one body, `max_speed={steps.between:g}` [m/s] leaves out the "
        "samples that are wrong"
    )
