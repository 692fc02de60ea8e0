"""Plausibility of extent, speed, clock and angles, and limits of a recording's size."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record.raw import Array, RawBody, RawRecording


class PlausibilityPolicy(NamedTuple):
    """Which numbers a tank, a robot and a camera can have."""

    largest_extent_m: float = 20.0
    """Largest range of the positions [m]; chosen by hand."""
    smallest_extent_m: float = 1e-3
    """Smallest range of the positions [m]; chosen by hand."""
    largest_speed_m_s: float = 10.0
    """Largest speed [m/s]; chosen by hand."""
    longest_recording_s: float = 1e9
    """Longest recording, 30 years [s]; chosen by hand."""
    shortest_interval_s: float = 1e-5
    """Shortest interval between samples [s]; chosen by hand."""
    usual_step_rad: float = 1.5
    """Median change of an angle between samples, beyond which it is hardly followed in radians;
    chosen by hand."""
    leap_rad: float = 90.0
    """Turn from one sample to the next [rad] that only degrees have, where they wrap around;
    chosen by hand."""


PLAUSIBLE: Final = PlausibilityPolicy()


def plausibility_warnings(bodies: list[RawBody], intervals: list[float]) -> list[str]:
    """Return what looks wrong about extent and speed: most often a unit or a scale.

    Parameters
    ----------
    bodies : list of RawBody
        In SI units.
    intervals : list of float
        The median interval [s] of each body that has several samples.
    """
    if not any(np.isfinite(body.x).any() for body in bodies):
        return ["no row holds a position"]
    warnings = []
    extent = max(span_of([values]) for body in bodies for values in (body.x, body.y))
    only = "only " if extent < PLAUSIBLE.smallest_extent_m else ""
    if extent == 0.0:
        warnings.append("the body never moves")
    elif only or extent > PLAUSIBLE.largest_extent_m:
        span = f"{only}{extent:.3g} m"
        warnings.append(f"the positions span {span}: is the unit, or the scale, right?")
    lasts = max(float(body.clock[-1] - body.clock[0]) for body in bodies if body.clock.size)
    usual = min(intervals, default=np.inf)
    if lasts > PLAUSIBLE.longest_recording_s:
        warnings.append(f"the recording lasts {lasts:.3g} s: is the unit of its clock right?")
    elif usual < PLAUSIBLE.shortest_interval_s:
        warnings.append(f"the usual interval is {usual:.3g} s: is the unit of the clock right?")
    speeds = [0.0]
    for body in bodies:
        t, x, y = (np.diff(values[:10_000]) for values in (body.clock, body.x, body.y))
        speed = np.hypot(x, y) / t
        known = speed[np.isfinite(speed)]
        speeds.append(float(np.median(known)) if known.size else 0.0)
    if max(speeds) > PLAUSIBLE.largest_speed_m_s and extent <= PLAUSIBLE.largest_extent_m:
        warnings.append(f"the usual speed is {max(speeds):.3g} m/s: is the clock's unit right?")
    return warnings


def span_of(series: Sequence[Array]) -> float:
    """Return the range of the finite values of some arrays, 0 where there are none."""
    # Without copies: a recording may have millions of positions.
    known = [(values, np.isfinite(values)) for values in series]
    high = max(float(np.max(one, where=at, initial=-np.inf)) for one, at in known)
    low = min(float(np.min(one, where=at, initial=np.inf)) for one, at in known)
    return high - low if high >= low else 0.0


def angle_warnings(raw: RawRecording) -> list[str]:
    """Return what speaks against radians where angles are taken as such though nothing says so.

    An orientation in radians is wrapped, or is followed from its first, wrapped, value on.

    Parameters
    ----------
    raw : RawRecording
        In the units of the file.
    """
    if not raw.bare_angle or raw.angle_unit != "rad":
        return []
    for column in (body.theta for body in raw.bodies if body.theta is not None):
        known = np.isfinite(column)
        theta = column if known.all() else column[known]
        with np.errstate(over="ignore"):  # a leap may be infinite
            steps = np.diff(theta)
        np.abs(steps, out=steps)
        leaps = bool((steps > PLAUSIBLE.leap_rad).any())
        fast = steps.size > 1 and np.median(steps, overwrite_input=True) > PLAUSIBLE.usual_step_rad
        if theta.size and (abs(theta[0]) > 6.2832 or leaps or fast):
            low, high = float(theta.min()), float(theta.max())
            return [
                f"angles from {low:.4g} to {high:.4g} are read as radians: if they are degrees, "
                'name the unit, as in `columns={"theta": "NAME:deg"}`'
            ]
    return []


class ExtentPolicy(NamedTuple):
    """How large a recording may be."""

    most_bodies: int = 5000
    """Bodies of a recording at most; chosen by hand."""
    empty_places: int = 20_000_000
    """Places, times by bodies, that a recording of any size may have: 0.5 GB; chosen by hand."""
    places_per_sample: int = 50
    """Places beyond that for each sample: bodies come and go, as fragments of tracks do; chosen
    by hand."""
    farthest_m: float = 1e12
    """Farthest position, beyond the planets [m]: by definition of float64, which must hold its
    powers."""
    nearest_m: float = 1e-25
    """If all positions are nearer to the origin, by definition of float64 their powers are 0
    [m]."""
    largest_angle: float = 1e12
    """In the file's unit; by definition float64 does not know the fraction of a turn."""


EXTENT: Final = ExtentPolicy()


def refuse_many_bodies(names: Sequence[str]) -> None:
    """Refuse more bodies than any recording has.

    Raises
    ------
    FormatError
        Names the first ones.
    """
    if len(names) > EXTENT.most_bodies:
        first = ", ".join(f"'{name:.20}'" for name in names[:3])
        raise FormatError(
            f"has {len(names)} bodies ({first}, …), more than the {EXTENT.most_bodies} that are "
            "read: does the column that names the body count rows?"
        )


def refuse_sparse(time: Array, bodies: list[RawBody]) -> None:
    """Refuse bodies that have almost none of their times in common.

    Parameters
    ----------
    time : array, shape (n,)
        The times of all bodies.
    bodies : list of RawBody
        The bodies.

    Raises
    ------
    FormatError
        Says how many places there would be, and for how many samples.
    """
    samples = sum(body.clock.size for body in bodies)
    places = time.size * len(bodies)
    if places > EXTENT.empty_places + EXTENT.places_per_sample * samples:
        raise FormatError(
            f"has {len(bodies)} bodies at {time.size} different times, which is a table of "
            f"{3 * 8 * places / 1e9:.3g} GB for {samples} samples: choose bodies (`body`) or a "
            "part of the time (`start`, `stop`)"
        )


def refuse_far(bodies: Sequence[RawBody], scale: float) -> None:
    """Refuse numbers that are no position and no angle: a damaged file, or a mark of what is lost.

    Positions that all are practically zero are refused too.

    Parameters
    ----------
    bodies : sequence of RawBody
        In the units of the file.
    scale : float
        Metres per unit.

    Raises
    ------
    InputError
        Names the body and the number.
    """
    for body in bodies:
        most = EXTENT.farthest_m / scale
        reach = max(_farthest(body, "x", body.x, most), _farthest(body, "y", body.y, most))
        if 0.0 < reach < EXTENT.nearest_m / scale:
            raise InputError(
                f"body '{body.name}' has no position that is further than {reach:.3g} from "
                "the origin, in the file's unit: no camera sees that; are these the right columns, "
                "and is the unit right (`length_unit`)?"
            )
        if body.theta is not None:
            _farthest(body, "angle", body.theta, EXTENT.largest_angle)


def _farthest(body: RawBody, name: str, values: Array, most: float) -> float:
    """Return how far from zero some numbers are at most; refuse those beyond a limit."""
    known = np.isfinite(values)
    ends = [float(end(where=known, initial=0.0)) for end in (values.min, values.max)]
    number = max(ends, key=abs)
    if abs(number) > most:
        raise InputError(
            f"body '{body.name}' has {number:.3g} as {name}, which cannot be one: is the file "
            "damaged? Leave the field empty, or write nan, where nothing was measured"
        )
    return abs(number)
