"""Sentences about numbers that no tank and no robot would give."""

from __future__ import annotations

import numpy as np

from driftwalk.record.raw import RawBody

LARGEST_EXTENT_M = 20.0
SMALLEST_EXTENT_M = 1e-3
LARGEST_SPEED_M_S = 10.0


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
    extent = max(
        float(np.ptp(values[known]))
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
    speeds = [_usual_speed(body) for body in bodies]
    if speeds and max(speeds) > LARGEST_SPEED_M_S and extent <= LARGEST_EXTENT_M:
        warnings.append(f"the usual speed is {max(speeds):.3g} m/s: is the clock's unit right?")
    return warnings


def _usual_speed(body: RawBody) -> float:
    steps = np.hypot(np.diff(body.x[:10_000]), np.diff(body.y[:10_000]))
    speed = steps / np.diff(body.clock[:10_000])
    known = speed[np.isfinite(speed)]
    return float(np.median(known)) if known.size else 0.0
