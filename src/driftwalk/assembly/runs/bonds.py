"""Bonds that break, and blocks that start glued together: joined at time 0, permanently.

Some bonds are refused, and the number of events of a run is limited.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.polyomino import STEPS
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.schema.shapes import cells_of_shape

if TYPE_CHECKING:
    from driftwalk.model import Assembly, Study


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


def event_rows(study: Study, *, duration: float) -> int:
    """Return for how many events a run has room at first: a run with more is simulated again.

    It is what bonds without load make if all blocks are always in one assembly, and half as much.
    """
    rules = study.assembly
    least = max(rules.blocks - 1, 1)
    if not rules.bonds_break:
        return least
    return least + 16 + int(6.0 * rules.blocks * rules.bond_rate_per_s * duration)


def bond_attrs(study: Study) -> dict[str, Any]:
    """Return the attributes that say how bonds break; none where they are permanent."""
    rules = study.assembly
    if not rules.bonds_break:
        return {}
    names = ("bond_rate_per_s", "bond_force_N", "bond_strength_N", "relatch_clearance")
    return {name: float(getattr(rules, name)) for name in names}


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
    ends = [
        (first + parent, first + block, face)
        for first in range(0, blocks, len(order))
        for parent, face, block in joins
    ]
    block = np.array([[parent, child] for parent, child, _ in ends])
    face = np.array([[one, (one + 2) % 4] for *_, one in ends])
    before = {"event_step": np.zeros(len(ends)), "event_block": block, "event_face": face}
    runs, rows = found["event_step"].shape
    made = {"event_count": found["event_count"] + np.int32(len(ends))}
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
