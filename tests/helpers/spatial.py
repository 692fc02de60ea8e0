"""Motions in space whose angle in the plane is known, for the readers of motion capture."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

PLANES = {
    "x": ((0, 1, 0), (0, 0, 1)),
    "y": ((1, 0, 0), (0, 0, -1)),
    "z": ((1, 0, 0), (0, 1, 0)),
    "-x": ((0, 1, 0), (0, 0, -1)),
    "-y": ((1, 0, 0), (0, 0, 1)),
    "-z": ((1, 0, 0), (0, -1, 0)),
}
"""Axes of the plane in the file's axes, written by hand: x, y and up are right-handed."""


def spin(count: int = 40, turns: float = 1.7) -> tuple[Any, Any, Any, Any]:
    """Return time, x, y and angle of a body on a circle that also spins [s, m, rad]."""
    time = 0.1 * np.arange(count)
    way = 0.15 * np.arange(count)
    angle = np.linspace(-2.0, -2.0 + 2.0 * np.pi * turns, count)
    return time, 0.12 * np.cos(way) + 0.4, 0.1 * np.sin(way), angle


def in_space(up: str, x: Any, y: Any, angle: Any) -> tuple[Any, Rotation]:
    """Return positions in the file's axes, on a floor 0.2 m up, and rotations about `up`."""
    ex, ey = (np.array(axis, dtype=float) for axis in PLANES[up])
    ez = np.cross(ex, ey)
    position = np.outer(x, ex) + np.outer(y, ey) + 0.2 * ez
    return position, Rotation.from_rotvec(np.outer(angle, ez))


def wrapped(angle: Any) -> Any:
    """Return angles from -pi to pi."""
    return (np.asarray(angle) + np.pi) % (2.0 * np.pi) - np.pi


def assert_spin(
    track: Any, *, shift: float = 0.0, digits: float = 1e-9, turn: float = 1e-8
) -> None:
    """Compare a track, but for its times, with `spin` moved along x; tolerances in m and rad."""
    _, x, y, angle = spin()
    np.testing.assert_allclose(track.x, x + shift, rtol=0, atol=digits)
    np.testing.assert_allclose(track.y, y, rtol=0, atol=digits)
    np.testing.assert_allclose(wrapped(track.theta - angle), 0.0, atol=turn)
