"""The angle from one point to another."""

from __future__ import annotations

import numpy as np

from driftwalk.record.raw import Array


def angle_between(start: tuple[Array, Array], end: tuple[Array, Array]) -> Array:
    """Return the direction from a point to another, in the axes of the file.

    Parameters
    ----------
    start, end : tuple of array, shape (n,)
        x and y of the two points.

    Returns
    -------
    array, shape (n,)
        Angle [rad], NaN where a point is missing or both are one.

    Examples
    --------
    >>> one = np.array([1.0])
    >>> angle_between((0 * one, 0 * one), (one, one)).tolist() == [np.pi / 4]
    True
    """
    dx, dy = end[0] - start[0], end[1] - start[1]
    angle: Array = np.arctan2(dy, dx)
    angle[(dx == 0.0) & (dy == 0.0)] = np.nan
    return angle
