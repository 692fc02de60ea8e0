"""Lattice of one world: joins are added one by one if they are consistent."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from driftwalk.assembly.lattice.joined_faces import Join
from driftwalk.assembly.lattice.polyomino import Chirality, name_of
from driftwalk.assembly.outcomes.classes import class_name
from driftwalk.schema.shapes import Cell, moved_to_origin

# From a cell to its neighbour at each face.
STEPS: Final = ((1, 0), (0, 1), (-1, 0), (0, -1))


class Partition:
    """Which blocks are together: the lowest block of each block's assembly."""

    def __init__(self, labels: Iterable[int]) -> None:
        self.labels = list(labels)

    def unite(self, blocks: tuple[int, int]) -> bool:
        """Make the assemblies of two blocks one; False when they are one already."""
        one, other = (self.labels[block] for block in blocks)
        low, high = min(one, other), max(one, other)
        self.labels = [low if label == high else label for label in self.labels]
        return low != high

    def members(self, label: int) -> list[int]:
        """Return the blocks of an assembly."""
        return [block for block, own in enumerate(self.labels) if own == label]

    def moves(self, blocks: tuple[int, int]) -> int:
        """Return which of two blocks (0 or 1) is in the assembly that moves into line.

        It is that with fewer blocks; of equal ones that whose lowest block is the higher.
        """
        labels = [self.labels[block] for block in blocks]
        weights = [(-self.labels.count(label), label) for label in labels]
        return weights.index(max(weights))


class LatticeWorld:
    """Blocks on the lattices of their assemblies.

    Parameters
    ----------
    blocks : int
        Number of blocks; at first each is alone.
    joins : iterable of Join
        Joins to apply; those that fit best count first, and one that contradicts them is dropped.
    """

    def __init__(self, blocks: int, joins: Iterable[Join] = ()) -> None:
        self.partition = Partition(range(blocks))
        self.cell: list[Cell] = [(0, 0)] * blocks
        self.quarter = [0] * blocks
        self.accepted: list[Join] = []
        self.dropped: list[Join] = []
        # The tightest joins first: they are the most certain.
        for join in sorted(joins, key=lambda one: (one.looseness, one.blocks, one.start)):
            (self.accepted if self._put(join) else self.dropped).append(join)

    def shape(self, members: Sequence[int], chirality: Chirality) -> str:
        """Name the shape of some blocks of one assembly."""
        return name_of(moved_to_origin(tuple(self.cell[block] for block in members)), chirality)

    def outcome(self, partition: Partition, chirality: Chirality) -> str:
        """Name the outcome class of the blocks, parted as said."""
        labels = set(partition.labels)
        return class_name(self.shape(partition.members(label), chirality) for label in labels)

    def _put(self, join: Join) -> bool:
        """Put a join in; False when it contradicts those that are in."""
        moving = self.partition.moves(join.blocks)
        stays, moves = join.blocks[1 - moving], join.blocks[moving]
        outward = (join.faces[1 - moving] + self.quarter[stays]) % 4
        place = _sum(self.cell[stays], STEPS[outward])
        turn = (outward + 2 - join.faces[moving] - self.quarter[moves]) % 4
        label, other = (self.partition.labels[block] for block in (stays, moves))
        if label == other:
            return place == self.cell[moves] and turn == 0
        moved = self.partition.members(other)
        x, y = self.cell[moves]
        cells = [
            _sum(place, _turned((self.cell[block][0] - x, self.cell[block][1] - y), turn))
            for block in moved
        ]
        if set(cells) & {self.cell[block] for block in self.partition.members(label)}:
            return False
        for block, cell in zip(moved, cells, strict=True):
            self.cell[block] = cell
            self.quarter[block] = (self.quarter[block] + turn) % 4
        return self.partition.unite(join.blocks)


def _sum(one: Cell, other: Cell) -> Cell:
    return one[0] + other[0], one[1] + other[1]


def _turned(cell: Cell, quarters: int) -> Cell:
    x, y = cell
    return ((x, y), (-y, x), (-x, -y), (y, -x))[quarters]
