"""Pose of a body from keypoints, or from markers that were tracked as separate bodies."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

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


Places = Mapping[str, Mapping[str, Mapping[str, Any]]]
"""Individual to keypoint to x, y and likelihood, where there is one, to where its values are."""
Confidence = tuple[float, str]
"""Least confidence of a keypoint in a format, and where that number comes from."""


def choose_keypoints(places: Mapping[str, Iterable[str]], options: ReadOptions) -> list[str]:
    """Return the keypoint that is the body, the named or the only one, and those of the heading.

    Parameters
    ----------
    places : mapping
        Individual to its keypoints.
    options : ReadOptions
        Its `keypoint` and `heading`.

    Raises
    ------
    InputError
        When several could be the body and none is named, or one that is named does not exist.
    """
    known = list(dict.fromkeys(name for own in places.values() for name in own))
    position = options.keypoint
    position = known[0] if position is None and len(known) == 1 else position
    if position not in known:
        got = "" if position is None else f" (got '{position}')"
        raise InputError(f"name the body's keypoint with `keypoint`{got}: {listed(known)}")
    if unknown := [name for name in options.heading or () if name not in known]:
        raise InputError(
            f"`heading`: there is no keypoint '{unknown[0]}'; there are {listed(known)}"
        )
    return list(dict.fromkeys((position, *(options.heading or ()))))


def recording_of_poses(
    places: Places,
    values: Callable[[Any], Array],
    clock: Array,
    options: ReadOptions,
    usual: Confidence,
) -> RawRecording:
    """Return one body per individual that has the chosen keypoint, and what the user should know.

    Parameters
    ----------
    places : mapping
        Individual to keypoint to x, y and, where there is one, likelihood to its place in the file.
    values : callable
        Returns what is at a place as a new array, shape (n,).
    clock : array, shape (n,)
        Times or frame numbers of the rows.
    options : ReadOptions
        Its `keypoint`, `heading` and `min_confidence`.
    usual : tuple of float and str
        Least confidence where `min_confidence` is not given, and where that number comes from.

    Raises
    ------
    InputError
        When no keypoint is chosen, or a least confidence is asked for and the file holds none.
    """
    names = choose_keypoints(places, options)
    stated = options.min_confidence is not None
    least = usual[0] if options.min_confidence is None else options.min_confidence
    bodies, notes = [], []
    dropped, known, confident = 0, 0, False
    for individual, own in places.items():
        if names[0] not in own:
            continue
        points = {}
        for name in [name for name in names if name in own]:
            x, y = (values(own[name][axis]) for axis in "xy")
            confidence = values(own[name]["likelihood"]) if "likelihood" in own[name] else None
            seen = np.isfinite(x) & np.isfinite(y)
            known += int(seen.sum())
            if confidence is not None and np.isfinite(confidence).any():
                confident = True
                unsure = seen & (confidence < least)  # a confidence that is missing says nothing
                x[unsure] = y[unsure] = np.nan
                dropped += int(unsure.sum())
            points[name] = (x, y)
        theta = None
        if options.heading is not None and set(options.heading) <= set(points):
            theta = angle_between(*(points[name] for name in options.heading))
        bodies.append(RawBody(individual, clock, *points[names[0]], theta))
    if without := [name for name, own in places.items() if names[0] not in own]:
        notes.append(f"without the keypoint, and left out: {listed(without)}")
    if not confident:
        if stated:
            raise InputError("the file holds no confidences: leave `min_confidence` out")
        notes.append("the file holds no confidences: every position counts as seen")
    else:
        source, change = ("", "") if stated else (f" ({usual[1]})", "; `min_confidence` changes it")
        notes.append(
            f"keypoints seen with a confidence below {least:g}{source} are missing: {dropped} of "
            f"{known}{change}"
        )
    return RawRecording(bodies, length_unit="px", has_keypoints=True, notes=notes)


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
    if rest := len(raw.bodies) - len({*options.heading, options.keypoint} - {None}):
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
