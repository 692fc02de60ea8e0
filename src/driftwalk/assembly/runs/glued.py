"""Blocks that start glued together: joined at time 0, permanently."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.polyomino import STEPS
from driftwalk.core.files.shards import Arrays
from driftwalk.schema.shapes import cells_of_shape

if TYPE_CHECKING:
    from driftwalk.model import Assembly


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
