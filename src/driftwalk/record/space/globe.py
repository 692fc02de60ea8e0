"""Longitude and latitude, projected onto the ground about the first position."""

from __future__ import annotations

from typing import Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.record.raw import RawBody

_RADIUS_M: Final = 6_378_137.0
"""Equatorial radius of the ellipsoid WGS 84."""
_ECCENTRICITY: Final = 6.694379990141e-3
"""Square of its first eccentricity."""


def on_the_ground(bodies: list[RawBody]) -> str:
    """Turn longitude and latitude [deg] of all bodies into x, y [m], in place; return the note.

    The plane touches the ellipsoid at the first position: east is x, north is y. A kilometre away
    its error is a few centimetres.

    Raises
    ------
    InputError
        When a latitude is none.
    """
    known = [np.isfinite(body.x) & np.isfinite(body.y) for body in bodies]
    first = next((body, at) for body, at in zip(bodies, known, strict=True) if at.any())
    at = int(np.argmax(first[1]))
    lon, lat = float(first[0].x[at]), float(first[0].y[at])
    for body, there in zip(bodies, known, strict=True):
        if (np.abs(body.y[there]) > 90.0).any() or (np.abs(body.x[there]) > 360.0).any():
            raise InputError(
                "a latitude is beyond 90, or a longitude beyond 360 degrees: are the columns "
                "right, and are they in degrees?"
            )
    bend = 1.0 - _ECCENTRICITY * np.sin(np.radians(lat)) ** 2
    east = _RADIUS_M / np.sqrt(bend) * np.cos(np.radians(lat))
    north = _RADIUS_M * (1.0 - _ECCENTRICITY) / bend**1.5
    for body in bodies:
        away = (body.x - lon + 180.0) % 360.0 - 180.0
        body.x, body.y = east * np.radians(away), north * np.radians(body.y - lat)
    return (
        f"longitude and latitude are projected: x to the east and y to the north of the first "
        f"position, {lat:.7g}, {lon:.7g}"
    )
