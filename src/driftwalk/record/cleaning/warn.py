"""Plausibility warnings about extent, speed, clock and angles."""

from __future__ import annotations

from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from driftwalk.record.raw import RawBody, RawRecording
from driftwalk.record.text import is_windows_text


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


def plausibility_warnings(bodies: list[RawBody]) -> list[str]:
    """Return what looks wrong about extent and speed: most often a unit or a scale.

    Parameters
    ----------
    bodies : list of RawBody
        In SI units.
    """
    present = [(body, np.isfinite(body.x)) for body in bodies]
    if not any(known.any() for _, known in present):
        return ["no row holds a position"]
    warnings = []
    # Without copies: a recording may have millions of positions.
    extent = max(
        float(
            np.max(values, where=known, initial=-np.inf)
            - np.min(values, where=known, initial=np.inf)
        )
        for body, known in present
        if known.any()
        for values in (body.x, body.y)
    )
    if extent > PLAUSIBLE.largest_extent_m:
        warnings.append(f"the positions span {extent:.3g} m: is the unit, or the scale, right?")
    elif extent == 0.0:
        warnings.append("the body never moves")
    elif extent < PLAUSIBLE.smallest_extent_m:
        warnings.append(
            f"the positions span only {extent:.3g} m: is the unit, or the scale, right?"
        )
    warnings += _clock_warnings(bodies)
    speeds = [_usual_speed(body) for body in bodies]
    if (
        speeds
        and max(speeds) > PLAUSIBLE.largest_speed_m_s
        and extent <= PLAUSIBLE.largest_extent_m
    ):
        warnings.append(f"the usual speed is {max(speeds):.3g} m/s: is the clock's unit right?")
    return warnings


def _clock_warnings(bodies: list[RawBody]) -> list[str]:
    clocks = [body.clock for body in bodies if body.clock.size > 1]
    if not clocks:
        return []
    last = max(float(clock[-1] - clock[0]) for clock in clocks)
    shortest = min(float(np.median(np.diff(clock), overwrite_input=True)) for clock in clocks)
    if last > PLAUSIBLE.longest_recording_s:
        return [f"the recording lasts {last:.3g} s: is the unit of its clock right?"]
    if shortest < PLAUSIBLE.shortest_interval_s:
        return [f"the usual interval is {shortest:.3g} s: is the unit of the clock right?"]
    return []


def encoding_notes(path: Path) -> list[str]:
    """Return the warning about text of an unknown encoding.

    Parameters
    ----------
    path : Path
        A file or folder that was read.
    """
    if not path.is_file() or not is_windows_text(path):
        return []
    return ["the text is not UTF-8 and was read as Windows-1252: check letters such as µ and °"]


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
    known = [body.theta[np.isfinite(body.theta)] for body in raw.bodies if body.theta is not None]
    for theta in known:
        with np.errstate(over="ignore"):  # a leap may be infinite
            steps = np.abs(np.diff(theta))
        fast = steps.size > 1 and np.median(steps) > PLAUSIBLE.usual_step_rad
        leaps = bool((steps > PLAUSIBLE.leap_rad).any())
        if theta.size and (abs(theta[0]) > 6.2832 or leaps or fast):
            low, high = float(theta.min()), float(theta.max())
            return [
                f"angles from {low:.4g} to {high:.4g} are read as radians: if they are degrees, "
                'name the unit, as in `columns={"theta": "NAME:deg"}`'
            ]
    return []


def _usual_speed(body: RawBody) -> float:
    steps = np.hypot(np.diff(body.x[:10_000]), np.diff(body.y[:10_000]))
    speed = steps / np.diff(body.clock[:10_000])
    known = speed[np.isfinite(speed)]
    return float(np.median(known)) if known.size else 0.0
