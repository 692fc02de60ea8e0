"""Possible outcome classes while some blocks are hidden.

Visible blocks constrain the classes: blocks that are joined are one shape, and two shapes of seen
blocks that do not fit on a common lattice are not one. Hidden blocks may be anywhere: alone, joined
to each other, on any free cell next to a shape, or between two shapes that do fit. The set holds
every class that can be, so the true one is always in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache

from driftwalk.assembly import class_name, outcome_classes
from driftwalk.assembly.lattice.polyomino import Chirality, name_of, neighbours
from driftwalk.assembly.outcomes.class_names import MOST_BLOCKS
from driftwalk.schema.shapes import Cell, moved_to_origin

Lattice = dict[Cell, int]
"""From a cell to the assembly whose block stands there."""


def possible_classes(
    lattices: Sequence[Lattice], hidden: int, *, chirality: Chirality
) -> frozenset[str]:
    """Return the outcome classes that are possible.

    Parameters
    ----------
    lattices : sequence of dict
        For each set of assemblies that fit on a common lattice, their cells there.
    hidden : int
        Number of blocks that are not seen.
    chirality : {"merged", "distinct"}
        Whether mirror images are one shape or two.

    Returns
    -------
    frozenset of str
        Names of the classes. Empty: nothing is known, which is said of more than eight blocks with
        more than three hidden.

    Examples
    --------
    >>> pair = {(0, 0): 0, (1, 0): 0}
    >>> sorted(possible_classes([pair], 1, chirality="merged"))
    ['2+1', 'I3', 'L3']
    """
    blocks = hidden + sum(len(lattice) for lattice in lattices)
    # With more than three hidden blocks, no class is excluded.
    if hidden > 3:
        listed = blocks <= MOST_BLOCKS
        return frozenset(outcome_classes(blocks, chirality=chirality) if listed else ())
    frozen = tuple(tuple(sorted(lattice.items())) for lattice in lattices)
    return _enumerated(frozen, hidden, chirality)


@lru_cache(maxsize=256)
def _enumerated(
    frozen: tuple[tuple[tuple[Cell, int], ...], ...], hidden: int, chirality: Chirality
) -> frozenset[str]:
    lattices = [dict(items) for items in frozen]
    found = set()
    for placed in range(hidden + 1):
        apart = hidden - placed
        others = outcome_classes(apart, chirality=chirality) if apart else ("",)
        for cells in _placements(lattices, placed):
            shapes = list(_shapes(lattices, cells, chirality))
            for other in others:
                found.add(class_name([*shapes, *filter(None, other.split("+"))]))
    return frozenset(found)


def _placements(lattices: Sequence[Lattice], number: int) -> Iterable[frozenset[tuple[int, Cell]]]:
    """Return all sets of free cells that hidden blocks may occupy, each next to another block."""
    found: set[frozenset[tuple[int, Cell]]] = {frozenset()}
    for _ in range(number):
        found = {cells | {new} for cells in found for new in _free_cells(lattices, cells)}
    return found


def _free_cells(
    lattices: Sequence[Lattice], cells: frozenset[tuple[int, Cell]]
) -> set[tuple[int, Cell]]:
    return {
        (place, next_to)
        for place, lattice in enumerate(lattices)
        for cell in [*lattice, *(cell for at, cell in cells if at == place)]
        for next_to in neighbours((cell,))
        if next_to not in lattice and (place, next_to) not in cells
    }


def _shapes(
    lattices: Sequence[Lattice], cells: Iterable[tuple[int, Cell]], chirality: Chirality
) -> Iterator[str]:
    """Give the shape of each assembly, hidden blocks at the cells given."""
    hidden = set(cells)
    for place, lattice in enumerate(lattices):
        own: dict[Cell, int] = {cell: -1 for at, cell in hidden if at == place}
        left = {**lattice, **own}
        while left:
            yield name_of(moved_to_origin(tuple(_connected(left))), chirality)


def _connected(left: Lattice) -> list[Cell]:
    """Take one connected assembly out of the cells that are left."""
    first = next(iter(left))
    waiting, found = [(first, left.pop(first))], [first]
    while waiting:
        cell, assembly = waiting.pop()
        for other in [cell for cell, label in left.items() if label == assembly >= 0]:
            waiting.append((other, left.pop(other)))
            found.append(other)
        for other in neighbours((cell,)):
            # Seen blocks of two assemblies side by side are not joined: that would have been seen.
            if other in left and -1 in (assembly, left[other]):
                waiting.append((other, left.pop(other)))
                found.append(other)
    return found
