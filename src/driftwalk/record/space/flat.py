"""Project 3-D tracks onto the plane of the water."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from driftwalk.record.raw import Array, RawBody, RawRecording
from driftwalk.record.space.plane import Plane
from driftwalk.record.space.turns import Turns

MOST_TILT: Final = math.radians(30.0)
"""A body that leans further as a rule does not float in that plane."""


@dataclass(frozen=True)
class SpaceTrack:
    """The samples of one body in space, in the units and axes of the file."""

    name: str
    clock: Array
    """Time stamps or frame numbers, shape (n,)."""
    position: Array
    """Positions, shape (n, 3), NaN where the body was not seen."""
    turns: Turns | None = None
    """Orientations; None when the file has none."""


def lay_flat(tracks: Sequence[SpaceTrack], plane: Plane) -> RawRecording:
    """Return the bodies in the plane, with notes on what speaks against the plane.

    The loader says the rest: clock, units and rows.

    Parameters
    ----------
    tracks : sequence of SpaceTrack
        Bodies in space.
    plane : Plane
        The plane of the water.

    Raises
    ------
    InputError
        When the orientations of a body are none.
    """
    bodies, notes = [], []
    for track in tracks:
        with np.errstate(invalid="ignore"):  # an infinite position is a gap
            x, y, height = (track.position @ vector for vector in plane.vectors)
        angle, tilt = (None, None) if track.turns is None else track.turns.in_plane(plane)
        bodies.append(RawBody(track.name, track.clock, x, y, angle))
        notes += _against(track.name, plane, _span(height), max(_span(x), _span(y)), tilt)
    return RawRecording(bodies, y_axis="up", plane=plane.describe(), notes=notes)


def _span(values: Array) -> float:
    """Return how far a coordinate reaches, without the farthest hundredths, 0 when unknown."""
    known = values[np.isfinite(values)]
    return float(np.ptp(np.percentile(known, [1.0, 99.0]))) if known.size else 0.0


def _against(name: str, plane: Plane, height: float, width: float, tilt: Array | None) -> list[str]:
    notes = []
    if height > width:
        notes.append(
            f"body '{name}' moves farther along {plane.up}, which is taken to point up, than in "
            "the plane of the water: is `up` right?"
        )
    known = np.zeros(0) if tilt is None else tilt[np.isfinite(tilt)]
    leaning = float(np.median(known)) if known.size else 0.0
    if leaning > MOST_TILT:
        notes.append(
            f"body '{name}' leans by {math.degrees(leaning):.0f}° as a rule: is `up` right? Its "
            "angle is that of its own axis that lies in the plane where the body is not turned"
        )
    return notes
