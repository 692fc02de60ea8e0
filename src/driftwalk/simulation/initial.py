"""Where and how a simulated block starts."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.core.errors import InputError
from driftwalk.core.streams import Purpose

if TYPE_CHECKING:
    from driftwalk.model import Study


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


def random_start(study: Study, keys: npt.NDArray[np.uint64]) -> Start:
    """Draw one start pose at rest per world: uniform over the poses that fit into the tank.

    Rejection sampling from the tank's bounding box with the world's own random stream.

    Raises
    ------
    InputError
        When no pose that fits was found in 1000 draws.
    """
    poses = np.array([_draw_pose(study, int(key)) for key in keys])
    return Start(poses[:, 0], poses[:, 1], poses[:, 2])


def _draw_pose(study: Study, key: int) -> tuple[float, float, float]:
    from driftwalk.model.simulation import Pose
    from driftwalk.model.study import block_corners

    tank, side = study.tank, study.block.side_m
    corners = np.asarray(
        tank.corners_m or [(-tank.extent_m[0] / 2,) * 2, (tank.extent_m[0] / 2,) * 2]
    )
    low, high = corners.min(axis=0), corners.max(axis=0)
    for draw in range(1000):
        words = np.array(_core.philox(key, [0, draw, 0, Purpose.START]), dtype=np.float64)
        across, up, turn = words[:3] * 2.0**-32
        pose = Pose(
            x_m=low[0] + across * (high[0] - low[0]),
            y_m=low[1] + up * (high[1] - low[1]),
            theta_rad=(2.0 * turn - 1.0) * np.pi,
        )
        if all(tank.contains(x, y) for x, y in block_corners(pose, side_m=side)):
            return pose.x_m, pose.y_m, pose.theta_rad
    raise InputError(
        f"no start pose was found for a block of {side:g} m in a {tank.describe()}: "
        "give one ([simulation] start) or a larger tank"
    )


def world_orientations(
    theta: npt.ArrayLike, keys: npt.NDArray[np.uint64]
) -> npt.NDArray[np.float64]:
    """Return the start orientation of every world [rad]: the given one, or a random one for NaN."""
    given = np.broadcast_to(np.asarray(theta, dtype=np.float64), keys.shape).copy()
    for index in np.flatnonzero(np.isnan(given)):
        word = _core.philox(int(keys[index]), [0, 0, 0, Purpose.START])[0]
        given[index] = (word * 2.0**-31 - 1.0) * np.pi
    return given
