"""Join history of a recorded world: its states and events, and the lattice of its assemblies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from driftwalk.assembly.lattice.joined_faces import Join
from driftwalk.assembly.lattice.polyomino import Chirality, name_of, put_beside
from driftwalk.assembly.outcomes.outcome_classes import world_class
from driftwalk.schema.shapes import Cell, moved_to_origin


class Event(NamedTuple):
    """Two assemblies that became one, or one that became two."""

    sample: int
    blocks: tuple[int, int]
    """The blocks whose faces joined or came apart; of a join first that of the assembly that
    stayed, by the rule of the simulation."""
    faces: tuple[int, int]
    outcome: str
    """Class of the world afterwards."""
    assemblies: tuple[int, int] = (-1, -1)
    """Lowest block of the assembly that stayed and of the one that moved."""
    shapes: tuple[str, str, str] = ("", "", "")
    """Shapes of the two assemblies and of their union."""


class JoinHistory:
    """The world from sample to sample: it changes only where joins begin or end.

    Parameters
    ----------
    shape : tuple of int
        Samples and blocks of the recording.
    joins : sequence of Join
        The joins and their times.
    chirality : {"merged", "distinct"}
        Whether mirror images are one shape or two.
    """

    def __init__(
        self, shape: tuple[int, ...], joins: Sequence[Join], *, chirality: Chirality
    ) -> None:
        samples, blocks = shape
        self.chirality = chirality
        self.joined: list[Event] = []
        self.split: list[Event] = []
        self.outcome: list[str] = []
        self.assembly = np.zeros((samples, blocks), dtype=np.int32)
        self.dropped: set[Join] = set()
        world = LatticeWorld(blocks)
        ends = {join.start for join in joins} | {join.stop for join in joins}
        changes = sorted({0, *ends} - {samples})
        for sample, following in zip(changes, [*changes[1:], samples], strict=True):
            active = [join for join in joins if join.start <= sample < join.stop]
            before, world = world, LatticeWorld(blocks, active)
            self._tell_apart(sample, before, world)
            self.dropped.update(world.dropped)
            self.assembly[sample:following] = world.partition.labels
            self.outcome += [world.outcome(chirality)] * (following - sample)

    def _tell_apart(self, sample: int, before: LatticeWorld, after: LatticeWorld) -> None:
        """Add the events that lead from one world to the next."""
        kept = set(before.accepted) & set(after.accepted)
        common = Partition(range(len(before.cell)))
        for join in kept:
            common.unite(join.blocks)
        gone = [join for join in before.accepted if join not in kept]
        self.split += self._splits(sample, gone, common, before)
        new = [join for join in after.accepted if join not in kept]
        self.joined += self._joins(sample, new, common, after)

    def _splits(
        self, sample: int, gone: list[Join], common: Partition, world: LatticeWorld
    ) -> list[Event]:
        """Return one event for each further part that assemblies fell into.

        They are found backwards: what is put together again last came apart first.
        """
        parts = Partition(common.labels)
        events = []
        for join in gone:
            outcome = world.outcome(self.chirality, parts)
            if parts.unite(join.blocks):
                events.append(Event(sample, join.blocks, join.faces, outcome))
        return events[::-1]

    def _joins(
        self, sample: int, new: list[Join], common: Partition, world: LatticeWorld
    ) -> Iterator[Event]:
        """Give one event for each pair of assemblies that became one."""
        parts = Partition(common.labels)
        for join in new:
            moves = parts.moves(join.blocks)
            first, second = 1 - moves, moves
            labels = [parts.labels[block] for block in join.blocks]
            shapes = [world.shape(parts.members(label), self.chirality) for label in labels]
            if not parts.unite(join.blocks):
                continue
            became = world.shape(parts.members(min(labels)), self.chirality)
            yield Event(
                sample,
                (join.blocks[first], join.blocks[second]),
                (join.faces[first], join.faces[second]),
                world.outcome(self.chirality, parts),
                (labels[first], labels[second]),
                (shapes[first], shapes[second], became),
            )


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
            fits = self.join(join.blocks, join.faces)
            (self.accepted if fits else self.dropped).append(join)

    def shape(self, members: Sequence[int], chirality: Chirality) -> str:
        """Name the shape of some blocks of one assembly."""
        return name_of(moved_to_origin(tuple(self.cell[block] for block in members)), chirality)

    def outcome(self, chirality: Chirality, parts: Partition | None = None) -> str:
        """Name the outcome class of the blocks, parted as they are or as said."""
        return world_class(self.cell, (parts or self.partition).labels, chirality=chirality)

    def join(self, blocks: tuple[int, int], faces: tuple[int, int]) -> bool:
        """Join two faces; False when that contradicts the joins that there are."""
        moving = self.partition.moves(blocks)
        stays, moves = blocks[1 - moving], blocks[moving]
        outward = (faces[1 - moving] + self.quarter[stays]) % 4
        turn = (outward + 2 - faces[moving] - self.quarter[moves]) % 4
        label, other = (self.partition.labels[block] for block in (stays, moves))
        moved = self.partition.members(other)
        own = [self.cell[block] for block in moved]
        cells = put_beside(own, self.cell[moves], self.cell[stays], outward, turn)
        if label == other:
            return cells == own and turn == 0
        if set(cells) & {self.cell[block] for block in self.partition.members(label)}:
            return False
        for block, cell in zip(moved, cells, strict=True):
            self.cell[block] = cell
            self.quarter[block] = (self.quarter[block] + turn) % 4
        return self.partition.unite(blocks)
