"""Initial pose and velocity of a simulated block."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.core.arrays import Floats, Keys
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import Purpose
from driftwalk.model import Study, Tank
from driftwalk.model.simulation import Pose
from driftwalk.model.study import block_corners
from driftwalk.model.tank import edges, inward_distance

Fits = Callable[[float, float, float], bool]
"""Whether there is room for a pose x, y [m], theta [rad]."""


class Start(NamedTuple):
    """Pose and motion of a block at the start: numbers, or arrays with one entry per world."""

    x: npt.ArrayLike
    """Position x [m]."""
    y: npt.ArrayLike
    """Position y [m]."""
    theta: npt.ArrayLike
    """Orientation [rad]."""
    vx: npt.ArrayLike = 0.0
    """Velocity x [m/s]."""
    vy: npt.ArrayLike = 0.0
    """Velocity y [m/s]."""
    omega: npt.ArrayLike = 0.0
    """Angular velocity [rad/s]."""


def random_start(study: Study, keys: Keys) -> Start:
    """Draw one start pose at rest per world: uniform over the poses that fit into the tank.

    Rejection sampling from the tank's bounding box with the world's own random stream.

    Raises
    ------
    InputError
        When no pose that fits was found in 1000 draws.
    """
    tank, block = study.tank, study.block

    def fits(x: float, y: float, theta: float) -> bool:
        corners = block_corners(Pose(x_m=x, y_m=y, theta_rad=theta), block)
        return all(tank.contains(*corner) for corner in corners)

    return _draw_poses(tank, keys, fits, what=f"a block of {block.side_m:g} m")


def random_place(tank: Tank, keys: Keys, *, clearance: float = 0.0) -> Start:
    """Draw one place per world, at rest: uniform over the tank, with a direction uniform too.

    As `random_start`, for a point that stays a distance from the wall, the clearance [m].

    Raises
    ------
    InputError
        When no place so far from the wall was found in 1000 draws.
    """
    sides = edges(tank.corners_m) if tank.radius_m is None else ()

    def fits(x: float, y: float, _: float) -> bool:
        if tank.radius_m is not None:
            return math.hypot(x, y) <= tank.radius_m - clearance
        return all(inward_distance((x, y), side) >= clearance for side in sides)

    return _draw_poses(tank, keys, fits, what=f"a body {clearance:g} m from the wall")


def _draw_poses(tank: Tank, keys: Keys, fits: Fits, *, what: str) -> Start:
    corners = np.asarray(
        tank.corners_m or [(-tank.extent_m[0] / 2,) * 2, (tank.extent_m[0] / 2,) * 2]
    )
    low, high = corners.min(axis=0), corners.max(axis=0)

    def drawn(key: int) -> tuple[float, float, float]:
        for draw in range(1000):
            words = np.array(_core.philox(key, [0, draw, 0, Purpose.START]), dtype=np.float64)
            across, up, turn = words[:3] * 2.0**-32
            pose = (
                low[0] + across * (high[0] - low[0]),
                low[1] + up * (high[1] - low[1]),
                (2.0 * turn - 1.0) * np.pi,
            )
            if fits(*pose):
                return pose
        raise InputError(
            f"no start pose was found for {what} in a {tank.describe()}: "
            "give one ([simulation] start) or a larger tank"
        )

    poses = np.array([drawn(int(key)) for key in keys])
    return Start(poses[:, 0], poses[:, 1], poses[:, 2])


def world_orientations(theta: npt.ArrayLike, keys: Keys) -> Floats:
    """Return the start orientation of every world [rad]: the given one, or a random one for NaN."""
    given = np.broadcast_to(np.asarray(theta, dtype=np.float64), keys.shape).copy()
    for index in np.flatnonzero(np.isnan(given)):
        word = _core.philox(int(keys[index]), [0, 0, 0, Purpose.START])[0]
        given[index] = (word * 2.0**-31 - 1.0) * np.pi
    return given


def world_table(
    start: Start, keys: Keys, *, drag_coefficient: npt.ArrayLike, force_std: npt.ArrayLike
) -> Floats:
    """Return start poses [m, rad], motions [m/s, rad/s] and parameters of worlds, shape (n, 8).

    A world without an orientation draws its own.
    """
    begin = start._replace(theta=world_orientations(start.theta, keys))
    values = (np.asarray(one, np.float64) for one in (*begin, drag_coefficient, force_std))
    return np.ascontiguousarray(np.stack(np.broadcast_arrays(*values), axis=1))
