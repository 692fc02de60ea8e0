"""Start poses of the blocks of a run: random or given."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.assembly.runs.cover import inward_depth
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    from driftwalk.model import Study, Tank

Floats = npt.NDArray[np.float64]

TOUCHING_M = 1e-9
"""Depth up to which blocks and walls may touch at the start [m]."""


def require_room(study: Study) -> None:
    """Refuse more blocks than the tank has room for by area alone.

    Raises
    ------
    InputError
        Names both areas.
    """
    count, side, tank = study.assembly.blocks, study.block.side_m, study.tank
    room = tank_area(tank)
    if count * side**2 > room:
        raise InputError(
            f"{count} blocks of {side:g} m do not fit into the tank, a {tank.describe()}: they "
            f"cover {count * side**2:.4g} m2, the tank {room:.4g} m2; use fewer blocks "
            "(`assembly.blocks`) or a larger tank"
        )


def tank_area(tank: Tank) -> float:
    """Return the area of the tank [m2]."""
    if tank.radius_m is not None:
        return math.pi * tank.radius_m**2
    x, y = np.asarray(tank.corners_m).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def place_blocks(
    study: Study, model: _core.Model, keys: npt.NDArray[np.uint64], *, threads: int
) -> Floats:
    """Return random poses in the tank that do not overlap, [m, m, rad], shape (runs, blocks, 3).

    Raises
    ------
    InputError
        When the blocks of a run find no place; names the run and how many of its blocks did.
    """
    count = study.assembly.blocks
    start, placed = _core.place_blocks(model, blocks=count, key=keys, threads=threads)
    short = np.flatnonzero(placed < count)
    if short.size:
        run = int(short[0])
        raise InputError(
            f"run {run}: {int(placed[run])} of {count} blocks found a place in the tank, a "
            f"{study.tank.describe()}; use fewer blocks (`assembly.blocks`) or a larger tank"
        )
    return np.asarray(start)


def given_start(study: Study, start: npt.ArrayLike, *, runs: int) -> Floats:
    """Return given poses, one set for all runs or one per run, after checking them.

    Parameters
    ----------
    study : Study
        Tank, side and number of the blocks.
    start : array_like, shape (blocks, 3) or (runs, blocks, 3)
        Poses x [m], y [m], theta [rad].
    runs : int
        Number of runs.

    Returns
    -------
    ndarray, shape (runs, blocks, 3)

    Raises
    ------
    InputError
        When the shape is another, a number is not finite, a block crosses the wall or two overlap.
    """
    poses = np.asarray(start, dtype=np.float64)
    whole = (runs, study.assembly.blocks, 3)
    if poses.shape not in (whole, whole[1:]):
        raise InputError(
            f"start: expected poses of shape {whole[1:]} or {whole} (x, y in m, theta in rad), "
            f"got shape {poses.shape}"
        )
    if not np.isfinite(poses).all():
        raise InputError("start: a pose is not finite")
    poses = np.ascontiguousarray(np.broadcast_to(poses, whole))
    _require_inside(study, poses)
    _require_apart(study, poses)
    return poses


def _require_inside(study: Study, poses: Floats) -> None:
    angle = poses[..., 2, None] + np.pi * (0.25 + 0.5 * np.arange(4))
    reach = study.block.side_m / math.sqrt(2.0)
    depth = inward_depth(
        study.tank,
        poses[..., 0, None] + reach * np.cos(angle),
        poses[..., 1, None] + reach * np.sin(angle),
    ).min(axis=-1)
    beyond = np.argwhere(depth < -TOUCHING_M)
    if beyond.size:
        run, block = beyond[0]
        raise InputError(
            f"start: block {block} of run {run} reaches {-depth[run, block]:.3g} m beyond the wall "
            f"of the tank, a {study.tank.describe()}"
        )


def _require_apart(study: Study, poses: Floats) -> None:
    for first in range(poses.shape[1]):
        for second in range(first + 1, poses.shape[1]):
            depth = overlap_depth(poses[:, first], poses[:, second], side=study.block.side_m)
            overlapping = np.flatnonzero(depth > TOUCHING_M)
            if overlapping.size:
                run = overlapping[0]
                raise InputError(
                    f"start: blocks {first} and {second} of run {run} overlap by {depth[run]:.3g} m"
                )


def overlap_depth(first: Floats, second: Floats, *, side: float) -> Floats:
    """Return how deep squares overlap [m], negative where they are apart, shape (n,).

    By the separating axes: the smallest over the four face directions.

    Parameters
    ----------
    first, second : ndarray, shape (n, 3)
        Poses [m, m, rad].
    side : float
        Side of the squares [m].
    """
    turn = second[:, 2] - first[:, 2]
    reach = 0.5 * side * (1.0 + np.abs(np.cos(turn)) + np.abs(np.sin(turn)))
    along = np.stack([first[:, 2], first[:, 2], second[:, 2], second[:, 2]])
    along += np.array([0.0, 0.5, 0.0, 0.5])[:, None] * np.pi
    apart = second[:, :2] - first[:, :2]
    reached = np.abs(np.cos(along) * apart[:, 0] + np.sin(along) * apart[:, 1])
    return np.asarray((reach - reached).min(axis=0))
