"""Sentences about numbers that no tank and no robot would give."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from driftwalk.record.raw import RawBody, RawRecording
from driftwalk.record.text import is_windows_text

LARGEST_EXTENT_M = 20.0
SMALLEST_EXTENT_M = 1e-3
LARGEST_SPEED_M_S = 10.0
LONGEST_RECORDING_S = 1e9
SHORTEST_INTERVAL_S = 1e-5
FULL_TURN = 6.2832
LEAP = 90.0
"""No body turns by so many radians between two samples; degrees that wrap around do."""


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
    if extent > LARGEST_EXTENT_M:
        warnings.append(f"the positions span {extent:.3g} m: is the unit, or the scale, right?")
    elif extent == 0.0:
        warnings.append("the body never moves")
    elif extent < SMALLEST_EXTENT_M:
        warnings.append(
            f"the positions span only {extent:.3g} m: is the unit, or the scale, right?"
        )
    warnings += _clock_warnings(bodies)
    speeds = [_usual_speed(body) for body in bodies]
    if speeds and max(speeds) > LARGEST_SPEED_M_S and extent <= LARGEST_EXTENT_M:
        warnings.append(f"the usual speed is {max(speeds):.3g} m/s: is the clock's unit right?")
    return warnings


def _clock_warnings(bodies: list[RawBody]) -> list[str]:
    clocks = [body.clock for body in bodies if body.clock.size > 1]
    if not clocks:
        return []
    last = max(float(clock[-1] - clock[0]) for clock in clocks)
    shortest = min(float(np.median(np.diff(clock), overwrite_input=True)) for clock in clocks)
    if last > LONGEST_RECORDING_S:
        return [f"the recording lasts {last:.3g} s: is the unit of its clock right?"]
    if shortest < SHORTEST_INTERVAL_S:
        return [f"the usual interval is {shortest:.3g} s: is the unit of the clock right?"]
    return []


def encoding_notes(path: Path) -> list[str]:
    """Return what to say about text whose encoding nobody named.

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
            leaps = np.abs(np.diff(theta)) > LEAP
        if theta.size and (abs(theta[0]) > FULL_TURN or leaps.any()):
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
