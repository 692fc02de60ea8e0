"""Outcome classes of many runs at once, from where their blocks are at the end."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from driftwalk.assemble.outcome import class_name
from driftwalk.assemble.polyomino import Chirality, moved_to_origin, name_of

Integers = npt.NDArray[np.int64]


def final_classes(
    cell: npt.ArrayLike, assembly: npt.ArrayLike, *, chirality: Chirality
) -> tuple[tuple[str, ...], Integers]:
    """Return the outcome classes of runs as `world_class` does, but for all runs side by side.

    What has to be named one by one are only the different shapes, and the different sets of them.

    Parameters
    ----------
    cell : array_like of int, shape (runs, blocks, 2)
        Cell of each block on the lattice of its assembly.
    assembly : array_like of int, shape (runs, blocks)
        Lowest block of the assembly of each block.
    chirality : {"merged", "distinct"}
        Whether mirror images are one shape or two.

    Returns
    -------
    names : tuple of str
        The classes that occur.
    index : ndarray of int, shape (runs,)
        The class of each run, an index into `names`.
    """
    cells = np.asarray(cell, dtype=np.int64)
    labels = np.asarray(assembly, dtype=np.int64)
    runs, blocks = labels.shape
    # The number of the shape at the lowest block of each assembly, -1 at the other blocks.
    shape_of = np.full((runs, blocks), -1)
    known: dict[str, int] = {}
    for lowest in range(blocks):
        at = np.flatnonzero(labels[:, lowest] == lowest)
        if at.size:
            member = labels[at] == lowest
            shape_of[at, lowest] = _shape_numbers(cells[at], member, chirality, known)
    shapes = list(known)
    worlds, inverse = np.unique(np.sort(shape_of, axis=1), axis=0, return_inverse=True)
    names = (class_name(shapes[number] for number in row[row >= 0].tolist()) for row in worlds)
    return tuple(names), inverse.reshape(-1)


def _shape_numbers(
    cell: Integers, member: npt.NDArray[np.bool_], chirality: Chirality, known: dict[str, int]
) -> Integers:
    """Return the number of the shape that the members of each run make up."""
    blocks = member.shape[1]
    least = np.where(member[..., None], cell, cell.max() + 1).min(axis=1)
    place = cell - least[:, None]
    # An assembly of n blocks reaches no farther than n cells.
    code = np.where(member, place[..., 0] * blocks + place[..., 1], blocks * blocks)
    code.sort(axis=1)
    different, inverse = np.unique(code, axis=0, return_inverse=True)
    numbers = []
    for row in different:
        cells = tuple(divmod(one, blocks) for one in row[row < blocks * blocks].tolist())
        name = name_of(moved_to_origin(cells), chirality)
        numbers.append(known.setdefault(name, len(known)))
    return np.array(numbers, dtype=np.int64)[inverse.reshape(-1)]
