"""Pose of a body from keypoints, or from markers that were tracked as separate bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from driftwalk.core.errors import InputError, listed
from driftwalk.record.raw import Array, RawBody, RawRecording, ReadOptions


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


def two_names(heading: Sequence[str] | None) -> tuple[str, str] | None:
    """Return the two points of a heading, None where there is none.

    Raises
    ------
    InputError
        When there are not two, or they are one.

    Examples
    --------
    >>> two_names(["tail", "nose"])
    ('tail', 'nose')
    """
    if heading is None:
        return None
    names = [heading] if isinstance(heading, str) else [str(name) for name in heading]
    if len(names) != 2 or names[0] == names[1] or not all(names):
        raise InputError(f"`heading` is two points, from and to; got {', '.join(names) or 'none'}")
    return names[0], names[1]


def join_markers(raw: RawRecording, options: ReadOptions) -> None:
    """Make one body of the markers that `heading` and `keypoint` name, in place.

    Where no keypoint is named the body is the middle between the two markers of its heading.

    Parameters
    ----------
    raw : RawRecording
        A recording whose bodies may be markers. Recordings of pose files, whose loader has chosen
        the keypoints, stay as they are.
    options : ReadOptions
        Its `heading`, `keypoint` and `min_confidence`.

    Raises
    ------
    InputError
        When a marker does not exist, or a confidence is asked of a format without any.
    """
    if options.min_confidence is not None and not (raw.has_keypoints or raw.has_confidence):
        raise InputError(
            "the format holds no confidences: leave `min_confidence` out, or name their column "
            'with `columns={"confidence": "NAME"}` in a plain table'
        )
    if raw.has_keypoints:
        return
    if options.heading is None:
        if options.keypoint is not None:
            raise InputError("the format has no keypoints: leave `keypoint` out (`body` keeps one)")
        return
    start, end = (_marker(raw, name, "heading") for name in options.heading)
    if options.keypoint is None:
        clock = np.intersect1d(start.clock, end.clock)
        (x0, y0), (x1, y1) = _at(start, clock), _at(end, clock)
        body = RawBody("0", clock, 0.5 * (x0 + x1), 0.5 * (y0 + y1))
    else:
        marker = _marker(raw, options.keypoint, "keypoint")
        body = RawBody("0", marker.clock, marker.x.copy(), marker.y.copy())
    body.theta = angle_between(_at(start, body.clock), _at(end, body.clock))
    used = {*options.heading, options.keypoint} - {None}
    rest = len(raw.bodies) - len(used)
    if rest:
        raw.notes.append(f"bodies that are no marker of this one, and left out: {rest}")
    raw.bodies = [body]
    raw.angle_unit, raw.theta_axis, raw.bare_angle = "rad", "", False
    raw.extra = {}


def _marker(raw: RawRecording, name: str, argument: str) -> RawBody:
    found = next((body for body in raw.bodies if body.name == name), None)
    if found is None:
        names = listed([body.name for body in raw.bodies])
        raise InputError(f"`{argument}`: there is no marker '{name}'; there are {names}")
    return found


def _at(body: RawBody, clock: Array) -> tuple[Array, Array]:
    """Return the positions of a body at the times of a clock, NaN where it has none."""
    order = np.argsort(body.clock, kind="stable")
    times = body.clock[order]
    # The last row of a time counts, as everywhere.
    place = np.searchsorted(times, clock, side="right") - 1
    found = (place >= 0) & (times[np.maximum(place, 0)] == clock) if times.size else place < -1
    x, y = np.full(clock.size, np.nan), np.full(clock.size, np.nan)
    rows = order[place[found]]
    x[found], y[found] = body.x[rows], body.y[rows]
    return x, y
