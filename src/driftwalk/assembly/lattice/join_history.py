"""Join history of a recorded world: its states and events."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from driftwalk.assembly.lattice.joined_faces import Join
from driftwalk.assembly.lattice.polyomino import Chirality
from driftwalk.assembly.lattice.world import LatticeWorld, Partition


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
            outcome = world.outcome(world.partition, chirality)
            self.outcome += [outcome] * (following - sample)

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
            outcome = world.outcome(parts, self.chirality)
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
                world.outcome(parts, self.chirality),
                (labels[first], labels[second]),
                (shapes[first], shapes[second], became),
            )
