"""Start of a run: whether the blocks fit the tank, and their start poses.

Blocks may start glued together: joined at time 0, permanently. Some bonds that break are refused,
and the number of events of a run is limited.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.assembly.outcomes.outcome_classes import overlap_depth
from driftwalk.core.arrays import Floats, Keys
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.model import Assembly, Study, Tank
from driftwalk.schema.shapes import STEPS, cells_of_shape
from driftwalk.simulation.backend import wall_depth


def require_bonds(study: Study) -> None:
    """Refuse bonds that cannot be as stated.

    These are a strength under a force without memory or length, a lone `bond_force_N`, and glued
    blocks whose bonds break.

    Raises
    ------
    InputError
        Says which keys to set.
    """
    rules, forces = study.assembly, study.forces
    if rules.bond_strength_N > 0 and not (
        forces.force_memory_s > 0 and forces.stirring_length_m > 0
    ):
        raise InputError(
            "a threshold on a white force depends on the time step: a strength of bonds "
            "(`assembly.bond_strength_N`) needs a force with memory and length "
            "([forces] force_memory_s and `forces.stirring_length_m`, both more than 0); or give "
            "a rate (`assembly.bond_rate_per_s`)"
        )
    if rules.bond_force_N > 0 and not rules.bond_rate_per_s > 0:
        raise InputError(
            "the force of a bond multiplies its rate, and bonds have none: give a rate above 0 "
            "(`assembly.bond_rate_per_s`), or leave the force out"
        )
    if rules.bonds_break and glued_cells(rules) is not None:
        raise InputError(
            "glued blocks (`assembly.glued`) never part: let them start alone, or leave the bonds "
            "permanent (`assembly.bond_rate_per_s` of 0)"
        )


def with_event_rows(arrays: Arrays, rows: int) -> Arrays:
    """Return results with another room for events: the last are cut off, or rows of -1 added."""
    changed = {}
    for name, values in arrays.items():
        if name.startswith("event_") and values.ndim > 1:
            kept = values[:, :rows]
            lacking = [(0, 0)] * values.ndim
            lacking[1] = (0, rows - kept.shape[1])
            changed[name] = np.pad(kept, lacking, constant_values=-1)
    return {**arrays, **changed}


def glued_cells(assembly: Assembly) -> npt.NDArray[np.int32] | None:
    """Return the cells of a body, each next to an earlier one, (cell, 2); None of single blocks."""
    left = sorted(cells_of_shape(assembly.glued))
    order = [left.pop(0)]
    while left:
        following = next(cell for cell in left if _parent(order, cell) is not None)
        left.remove(following)
        order.append(following)
    return np.array(order, dtype=np.int32) if len(order) > 1 else None


def with_glue_events(found: Arrays, cells: npt.NDArray[np.int32] | None, blocks: int) -> Arrays:
    """Return the results of the native core with the joinings of the glued blocks at step 0.

    Parameters
    ----------
    found : dict of ndarray
        Result of the native core, (run, ...).
    cells : ndarray of int, shape (cell, 2), or None
        Of `glued_cells`.
    blocks : int
        Blocks in the tank.
    """
    if cells is None:
        return found
    order = [(int(x), int(y)) for x, y in cells]
    joins = [(*parent, k) for k in range(1, len(order)) if (parent := _parent(order[:k], order[k]))]
    parent, side, child = np.array(joins).T
    first = np.arange(0, blocks, len(order))[:, None, None]
    block = (first + np.column_stack([parent, child])).reshape(-1, 2)
    face = np.tile(np.column_stack([side, (side + 2) % 4]), (len(first), 1))
    before = {"event_step": np.zeros(len(block)), "event_block": block, "event_face": face}
    runs, rows = found["event_step"].shape
    made = {"event_count": found["event_count"] + np.int32(len(block))}
    for name, values in before.items():
        whole = np.broadcast_to(values.astype(np.int32), (runs, *values.shape))
        made[name] = np.concatenate([whole, found[name]], axis=1)[:, :rows]
    return {**found, **made}


def _parent(order: list[tuple[int, int]], cell: tuple[int, int]) -> tuple[int, int] | None:
    """Return which earlier cell one is next to, and that cell's face."""
    for place, (x, y) in enumerate(order):
        for face, (dx, dy) in enumerate(STEPS):
            if (x + dx, y + dy) == cell:
                return place, face
    return None


TOUCHING_M = 1e-9
"""Depth up to which blocks and walls may touch at the start [m]; chosen by hand."""


def require_room(study: Study) -> None:
    """Refuse blocks that do not assemble, and more than the tank has room for by area alone.

    Raises
    ------
    InputError
        Names both areas, or the shape.
    """
    if study.block.shape not in ("square", "disc", "rectangle"):
        raise InputError(
            f"squares, discs and rectangles assemble, and the body is '{study.block.shape}' "
            "(`block.shape`): start from the fit of one of them; squares may start glued "
            "(`assembly.glued`)"
        )
    if (cells := glued_cells(study.assembly)) is not None:
        _require_glued(study, len(cells))
    _require_faces(study)
    count, side, tank = study.assembly.blocks, study.block.side_m, study.tank
    area, room = count * study.block.area_m2, tank_area(tank)
    if area > room:
        raise InputError(
            f"{count} blocks of {side:g} m do not fit into the tank, a {tank.describe()}: they "
            f"cover {area:.4g} m2, the tank {room:.4g} m2; use fewer blocks "
            "(`assembly.blocks`) or a larger tank"
        )


def _require_faces(study: Study) -> None:
    """Refuse what is said of the faces of bodies that latch as they lie."""
    if study.block.has_lattice:
        return
    why = "discs have no faces" if study.block.is_round else "rectangles latch as they lie"
    if study.assembly.latching == "connector":
        raise InputError(
            f"connectors latch face to face, and {why}: latching is 'collision' or 'none' for them "
            "(`assembly.latching`)"
        )
    if study.assembly.typed_faces is not None:
        raise InputError(f"{why}: leave out types of faces (`assembly.faces`), or take squares")


def _require_glued(study: Study, cells: int) -> None:
    """Refuse glued blocks that make up no two bodies, no squares, and faces with types."""
    rules = study.assembly
    if not study.block.has_lattice or rules.typed_faces is not None:
        raise InputError(
            f"blocks start glued as '{rules.glued}' (`assembly.glued`) where they are squares "
            "whose faces have no types"
        )
    if rules.blocks % cells or rules.blocks == cells:
        raise InputError(
            f"{rules.blocks} blocks make up no two bodies '{rules.glued}' or more "
            f"(`assembly.glued`): give {2 * cells} blocks or a further multiple of {cells} "
            "(`assembly.blocks`)"
        )


def tank_area(tank: Tank) -> float:
    """Return the area of the tank [m2]."""
    if tank.radius_m is not None:
        return math.pi * tank.radius_m**2
    x, y = np.asarray(tank.corners_m).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def place_blocks(study: Study, model: _core.Model, keys: Keys, *, threads: int) -> Floats:
    """Return random poses in the tank that do not overlap, [m, m, rad], shape (runs, blocks, 3).

    Raises
    ------
    InputError
        When the blocks of a run find no place; names the run and how many of its blocks did.
    """
    count = study.assembly.blocks
    start, placed = _core.place_blocks(
        model, blocks=count, key=keys, threads=threads, glued=glued_cells(study.assembly)
    )
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
    if glued_cells(study.assembly) is not None:
        raise InputError(
            "start: glued blocks start at random places; leave the poses out, or take single blocks"
        )
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
    if study.block.is_round:
        depth = wall_depth(study.tank, poses[..., 0], poses[..., 1]) - study.block.side_m / 2.0
    else:
        x, y = study.block.body().corners.T
        cosine, sine = np.cos(poses[..., 2, None]), np.sin(poses[..., 2, None])
        depth = wall_depth(
            study.tank,
            poses[..., 0, None] + cosine * x - sine * y,
            poses[..., 1, None] + sine * x + cosine * y,
        ).min(axis=-1)
    beyond = np.argwhere(depth < -TOUCHING_M)
    if beyond.size:
        run, block = beyond[0]
        raise InputError(
            f"start: block {block} of run {run} reaches {-depth[run, block]:.3g} m beyond the wall "
            f"of the tank, a {study.tank.describe()}"
        )


def _require_apart(study: Study, poses: Floats) -> None:
    from scipy.spatial import cKDTree

    side, width = study.block.side_m, study.block.width_m
    for run, placed in enumerate(poses):
        # What is farther apart than a diagonal does not overlap.
        diagonal = math.hypot(side, width or side)
        pairs = cKDTree(placed[:, :2]).query_pairs(diagonal, output_type="ndarray")
        pairs = pairs[np.lexsort(pairs.T[::-1])]
        first, second = placed[pairs[:, 0]], placed[pairs[:, 1]]
        if study.block.is_round:
            depth = side - np.hypot(*(second - first)[:, :2].T)
        else:
            depth = overlap_depth(first, second, side=side, width=width)
        overlapping = np.flatnonzero(depth > TOUCHING_M)
        if overlapping.size:
            one, other = pairs[overlapping[0]]
            raise InputError(
                f"start: blocks {one} and {other} of run {run} overlap by "
                f"{depth[overlapping[0]]:.3g} m"
            )
