"""Worlds of several blocks for the tests of the self-assembly kernel, measured without it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from single_block import SIDE, Floats, corner_positions

from driftwalk import _core
from driftwalk.core.random_streams import world_keys

SETTINGS: dict[str, Any] = {
    "latching": "connector",
    "connector_distance": 0.01,
    "connector_axis": 0.2,
    "hidden_face_drag": "none",
    "block_restitution": 0.5,
    "block_friction": 0.0,
    "stirring_length": 0.0,
    "incompressible": False,
    "sample_every": 0,
    "threads": 1,
    "precision": "single",
}

# Edges (normal, distance) of a box of 24 x 20 cm, and of a triangle around a circle of 20 cm.
BOX = np.array([[0.0, -1.0, 0.1], [1.0, 0.0, 0.12], [0.0, 1.0, 0.1], [-1.0, 0.0, 0.12]])
TRIANGLE = np.array(
    [[0.0, -1.0, 0.1], [np.sqrt(0.75), 0.5, 0.1], [-np.sqrt(0.75), 0.5, 0.1]]
)  # fmt: skip


def keys(worlds: int, seed: int = 1) -> npt.NDArray[np.uint64]:
    return world_keys(seed, trial=0, replicate=np.arange(worlds))


def assemble(
    native: _core.Model,
    start: npt.ArrayLike,
    own_keys: npt.NDArray[np.uint64],
    *,
    steps: int,
    drag: npt.ArrayLike = 0.45,
    force: npt.ArrayLike = 0.0,
    **changes: Any,
) -> dict[str, Any]:
    """Run worlds; drag and force are one number for all or one for each."""
    poses = np.ascontiguousarray(start, dtype=np.float64)
    settings = {**SETTINGS, **changes}
    share = settings.pop("hidden_face_drag")
    settings["hidden_share"] = {"none": 0.0, "full": 1.0}.get(share, share)
    return _core.assemble(
        native,
        start=poses,
        key=own_keys,
        drag_coefficient=np.array(np.broadcast_to(np.asarray(drag, float), len(poses))),
        force_std=np.array(np.broadcast_to(np.asarray(force, float), len(poses))),
        steps=steps,
        **settings,
    )


def random_starts(
    native: _core.Model, blocks: int, worlds: int, seed: int = 1
) -> tuple[Floats, npt.NDArray[np.uint64]]:
    """Return starts and keys of worlds in which all blocks found room."""
    own_keys = keys(worlds, seed)
    start, placed = _core.place_blocks(native, blocks=blocks, key=own_keys, threads=1)
    fits = placed == blocks
    return start[fits], own_keys[fits]


def deepest_overlap(poses: npt.ArrayLike) -> float:
    """Return the deepest overlap of two squares of a world, poses (..., block, 3).

    By the separating axes: the least overlap of the corners' extents over the sides' directions.
    """
    poses = np.asarray(poses, dtype=np.float64)
    first, second = np.triu_indices(poses.shape[-2], 1)
    a, b = poses[..., first, :], poses[..., second, :]
    near = np.hypot(*np.moveaxis(b[..., :2] - a[..., :2], -1, 0)) < np.sqrt(2) * SIDE
    a, b = a[near], b[near]
    if len(a) == 0:
        return -np.inf
    corners_a, corners_b = (np.stack(corner_positions(*p.T), axis=-1) for p in (a, b))
    depth = np.full(len(a), np.inf)
    for angle in (a[:, 2], a[:, 2] + np.pi / 2, b[:, 2], b[:, 2] + np.pi / 2):
        axis = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None, :]
        at_a, at_b = (corners_a * axis).sum(axis=-1), (corners_b * axis).sum(axis=-1)
        common = np.minimum(at_a.max(axis=1), at_b.max(axis=1)) - np.maximum(
            at_a.min(axis=1), at_b.min(axis=1)
        )
        depth = np.minimum(depth, common)
    return float(depth.max())


def farthest_outside(
    poses: npt.ArrayLike, *, radius: float = 0.15, edges: Floats | None = None
) -> float:
    """Return how far the outermost corner of all squares is outside the tank [m]."""
    poses = np.asarray(poses, dtype=np.float64)
    x, y = corner_positions(poses[..., 0], poses[..., 1], poses[..., 2])
    if edges is None:
        return float((np.hypot(x, y) - radius).max())
    return max(float((x * nx + y * ny - distance).max()) for nx, ny, distance in edges)
