"""Synthetic worlds of several blocks for the tests of the self-assembly kernel and its twin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr
from twin.assembly import Rules, World, make_rules, start_world
from twin.body import Assembly, Shape
from twin.latch import Latch

import driftwalk as dw

Floats = npt.NDArray[np.float64]

SIDE, MASS = 0.03, 0.0116
SQUARE, RECTANGLE = Shape(SIDE, MASS), Shape(0.04, MASS, 0.02)
SETTINGS: dict[str, Any] = {
    "drag_coefficient": 0.0,
    "hidden_face_drag": "none",
    "block_restitution": 0.5,
    "block_friction": 0.0,
}


def study(size: float | dict[str, Any] = 0.3, **sections: Any) -> dw.Study:
    """Return a study of a round tank by its diameter [m], or of a tank by its keys."""
    given = size if isinstance(size, dict) else {"diameter_m": size}
    return dw.Study(tank={**given, **sections.pop("tank", {})}, **sections)


def swirl(study: dw.Study, *, angular_velocity: float = 0.6) -> xr.Dataset:
    """A vortex with a core, which has no straight streamline."""
    return dw.vortex_flow(
        angular_velocity=angular_velocity, core_radius=0.04, arena=study.tank.to_arena()
    )


def rules(
    model: dw.Study | None = None,
    flow: xr.Dataset | None = None,
    *,
    latching: Any = "none",
    distance: float = 0.0,
    axis: float = 0.0,
    **changes: Any,
) -> Rules:
    """Return rules without drag and flow in a tank far away, unless told otherwise."""
    return make_rules(
        study(100.0) if model is None else model,
        dw.uniform_flow(0.0, 0.0) if flow is None else flow,
        latch=Latch(latching, distance, axis),
        **{**SETTINGS, **changes},
    )


def world(the_rules: Rules, poses: npt.ArrayLike, motions: npt.ArrayLike) -> World:
    """Return single blocks in motion."""
    made = start_world(the_rules, np.asarray(poses, dtype=np.float64))
    for body, motion in zip(made.assemblies, np.asarray(motions, dtype=np.float64), strict=True):
        body.motion = motion.copy()
    return made


def rigid(
    first: int,
    cells: Sequence[Sequence[int]],
    pose: Sequence[float],
    motion: Sequence[float] = (0.0, 0.0, 0.0),
) -> Assembly:
    """Return an assembly of blocks first, first + 1, ... in cells, all with the same axes."""
    return Assembly(
        SQUARE,
        list(range(first, first + len(cells))),
        np.array(cells),
        np.zeros(len(cells), dtype=np.int64),
        np.array(pose, dtype=np.float64),
        np.array(motion, dtype=np.float64),
    )


def laid(
    first: int, places: Sequence[Sequence[float]], pose: Sequence[float], motion: Sequence[float]
) -> Assembly:
    """Return an assembly of rectangles at places (x, y, angle) from their mean, as they lie."""
    none = np.zeros((len(places), 2), dtype=np.int64)
    blocks = list(range(first, first + len(places)))
    return Assembly(
        RECTANGLE, blocks, none, none[:, 0], np.array(pose), np.array(motion), laid=np.array(places)
    )


def momentum(bodies: Sequence[Assembly]) -> Floats:
    """Return linear momentum and angular momentum about the origin, from every block alone."""
    total = np.zeros(3)
    for body in bodies:
        vx, vy, spin = body.motion
        for x, y in body.centres():
            dx, dy = x - body.pose[0], y - body.pose[1]
            px, py = MASS * (vx - spin * dy), MASS * (vy + spin * dx)
            total += [px, py, x * py - y * px + MASS * square_radius(body) * spin]
    return total


def square_radius(body: Assembly) -> float:
    """Return the moment of inertia of one block over its mass [m²]."""
    side, width = body.shape.side, body.shape.width
    return (side**2 + (side if width is None else width) ** 2) / 12


def energy(bodies: Sequence[Assembly]) -> float:
    """Return the kinetic energy [J], from every block alone."""
    total = 0.0
    for body in bodies:
        vx, vy, spin = body.motion
        for x, y in body.centres() - body.pose[:2]:
            total += MASS / 2 * ((vx - spin * y) ** 2 + (vy + spin * x) ** 2)
            total += MASS / 2 * square_radius(body) * spin**2
    return total
