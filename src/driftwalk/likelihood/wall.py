"""Intervals of a track that may hold a contact with the wall: the fit leaves them out.

The rule looks at the past only. To leave out an interval because of where the body is at its end
would select among the forces that brought it there, and bias what is estimated.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from driftwalk.flow.arena import Outline

Floats = npt.NDArray[np.float64]

MARGIN = 0.002
"""A corner nearer to the wall than this [m] may touch it within a sampling interval. Chosen by
hand."""


def wall_intervals(
    time: Floats,
    x: Floats,
    y: Floats,
    theta: Floats | None,
    *,
    outline: Outline,
    side: float,
    longest_gap: float,
) -> npt.NDArray[np.bool_]:
    """Return which intervals, by the sample at their end, may hold a contact with the wall, (n,).

    In the one from k - 1 to k a corner comes within 2 mm of the wall: at k - 1, or where the motion
    and the turning from k - 3 to k - 1 lead by k. Without orientations the circle around the block
    replaces its corners.
    """
    turned = None if theta is None else np.unwrap(theta)
    ahead_x, ahead_y = (_continued(time, axis, longest_gap) for axis in (x, y))
    ahead = None if turned is None else _continued(time, turned, longest_gap)
    here = _least_depth(x[:-1], y[:-1], None if turned is None else turned[:-1], outline, side)
    there = _least_depth(ahead_x, ahead_y, ahead, outline, side)
    near = np.zeros(time.size, dtype=bool)
    near[1:] = np.minimum(here, there) < MARGIN
    return near


def _continued(time: Floats, values: Floats, longest_gap: float) -> Floats:
    """Return where the change over the last two intervals leads in the next, shape (n - 1,)."""
    onward = np.zeros(time.size - 1)
    past = time[2:-1] - time[:-3]
    rate = (values[2:-1] - values[:-3]) / past
    onward[2:] = np.where(past <= longest_gap, rate * (time[3:] - time[2:-1]), 0.0)
    return np.asarray(values[:-1] + np.where(np.diff(time) <= longest_gap, onward, 0.0))


def _least_depth(
    x: Floats, y: Floats, theta: Floats | None, outline: Outline, side: float
) -> Floats:
    """Return the distance of the nearest corner to the wall [m], negative beyond it."""
    reach = side / math.sqrt(2.0)
    if theta is None:
        return outline.depth(x, y) - reach
    quarters = theta + math.pi * (0.25 + 0.5 * np.arange(4))[:, None]
    corners_x, corners_y = x + reach * np.cos(quarters), y + reach * np.sin(quarters)
    depths = [outline.depth(*corner) for corner in zip(corners_x, corners_y, strict=True)]
    return np.asarray(np.min(depths, axis=0))
