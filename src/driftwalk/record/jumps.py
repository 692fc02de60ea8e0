"""Samples that a body cannot have been at: it would have been faster than it can be."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from driftwalk.record.raw import RawBody

EFFORT: Final = 0.5
"""Cost of a step at the greatest speed, in samples that are left out. With a half no sample is left
out that is within reach of both its neighbours."""
LONGEST_EXCURSION: Final = 300
"""Samples back to which every one is tried as the one before; further back the best of all is."""


def find_jumps(body: RawBody, max_speed: float) -> npt.NDArray[np.int64]:
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


def _best_chain(
    t: npt.NDArray[np.float64],
    x: npt.NDArray[np.float64],
    y: npt.NDArray[np.float64],
    max_speed: float,
) -> npt.NDArray[np.int64]:
    """Return the samples of the cheapest chain, in order.

    ``cost`` is that of the cheapest chain to end in a sample, less one for each sample up to there.
    """
    share = np.hypot(np.diff(x), np.diff(y)) / (max_speed * np.diff(t))
    suspects = np.append(np.flatnonzero(~(share <= 1.0)) + 1, t.size)
    fall = np.append(0.0, EFFORT * share**2 - 1.0)
    cost, before = np.zeros(t.size), np.full(t.size, -1, dtype=np.int64)
    least = np.zeros(t.size, dtype=np.int64)
    """The cheapest sample up to each."""
    at = 1
    while at < t.size:
        last, best = at - 1, least[at - 1]
        rival = cost[least[at - 2]] if at > 1 else np.inf
        upto = int(suspects[np.searchsorted(suspects, at)])
        if rival >= cost[last] + EFFORT and upto > at:
            # No sample of an undisturbed stretch follows another than the one before it.
            cost[at:upto] = cost[last] + np.cumsum(fall[at:upto])
            before[at:upto] = np.arange(last, upto - 1)
            least[at:upto] = np.arange(at, upto)
            at = upto
            continue
        first = max(at - LONGEST_EXCURSION, 0)
        tried = np.arange(first, at)
        if first and least[first - 1] >= 0:
            tried = np.append(least[first - 1], tried)
        speed = np.hypot(x[at] - x[tried], y[at] - y[tried]) / (max_speed * (t[at] - t[tried]))
        value = np.where(speed <= 1.0, cost[tried] - 1.0 + EFFORT * (at - tried) * speed**2, np.inf)
        chosen = int(np.argmin(value))
        if value[chosen] < 0.0:
            cost[at], before[at] = value[chosen], tried[chosen]
        least[at] = at if cost[at] < cost[best] else best
        at += 1
    chain = [int(least[-1])]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    return np.array(chain[::-1], dtype=np.int64)
