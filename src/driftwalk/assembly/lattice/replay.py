"""Worlds of squares, discs or rectangles while the events of a run are replayed, run after run.

An event changes two assemblies, and the one that moves is the smaller: all events of a run of n
blocks together move fewer than n log2(n) of them. Among many blocks large assemblies are called by
two counts, and the class of a world by the number of its assemblies: hardly two of them would have
the same shape.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.joined_faces import CLOSING, JOINING, OPENING
from driftwalk.assembly.lattice.polyomino import Chirality, name_of, put_beside
from driftwalk.assembly.outcomes.outcome_classes import (
    class_name,
    listed_classes,
    listed_shapes,
)
from driftwalk.core.arrays import Integers
from driftwalk.core.errors import InputError
from driftwalk.schema.shapes import (
    MOST_CELLS_NAMED,
    MOST_DISCS,
    MOST_NAMED,
    STEPS,
    all_single,
    counted_class,
    counted_graph,
    counted_shape,
    graph_name,
    joins_of_cells,
    moved_to_origin,
)


class ReplayedEvents(NamedTuple):
    """Results of the events of some runs; -1 where a run had no such event."""

    event_assembly: npt.NDArray[np.int32]
    """Lowest block of the assembly that stayed and of the one that moved, (run, event, side); of a
    parting of the two parts."""
    event_shape: npt.NDArray[np.int32]
    """Shapes of the two and of what they became, (run, event, part): indices into `shapes`. Of a
    parting those of the two parts and of what they were; -1 where only a bond of a loop changed."""
    event_class: npt.NDArray[np.int32]
    """Outcome class of the world after the event, (run, event): an index into `classes`."""
    outcome: npt.NDArray[np.int32]
    """Outcome class at the end, (run,): an index into `classes`."""
    classes: tuple[str, ...]
    """Names of the classes: all for up to 8 blocks, beyond that those that occurred."""
    shapes: tuple[str, ...]
    """Names of the shapes, by the same rule."""
    kind: Integers | None = None
    """Kinds of the blocks at the end, (run, block); None where faces have no types."""


class _Names:
    """Names by number, in the order in which they came."""

    def __init__(self, *names: str) -> None:
        self.known = {name: number for number, name in enumerate(names)}

    def number(self, name: str) -> int:
        return self.known.setdefault(name, len(self.known))

    def index_into(self, listed: tuple[str, ...]) -> npt.NDArray[np.int32]:
        """Return from number to place in a list; at its end -1, so that -1 stays what it is."""
        place = {name: index for index, name in enumerate(listed)}
        return np.array([*(place[name] for name in self.known), -1], dtype=np.int32)


class SquareWorld:
    """The squares of one run while its events are applied, each in the body of one of them."""

    def __init__(self, blocks: int, chirality: Chirality) -> None:
        self.chirality = chirality
        self.body = list(range(blocks))
        self.members = [[block] for block in range(blocks)]
        self.lowest = list(range(blocks))
        self.joins = [0] * blocks
        self.cell = [(0, 0)] * blocks
        self.quarter = [0] * blocks
        self.taken = [{(0, 0)} for _ in range(blocks)]
        self.bonded: list[set[int]] = [set() for _ in range(blocks)]

    def join(self, block: list[int], face: list[int]) -> tuple[int, int]:
        """Join the second block's body to the first one's; return the two bodies."""
        stays, moves = self.body[block[0]], self.body[block[1]]
        if stays == moves:
            raise InputError("joins two blocks of one assembly")
        self.joins[stays] += self.joins[moves] + self._contacts(stays, moves, block, face)
        for member in self.members[moves]:
            self.body[member] = stays
        self.members[stays] += self.members[moves]
        self.members[moves] = []
        self.lowest[stays] = min(self.lowest[stays], self.lowest[moves])
        return stays, moves

    def bond(self, block: list[int], *, whole: bool) -> None:
        """Make or break the bond of two blocks."""
        for one, other in (block, block[::-1]):
            (self.bonded[one].add if whole else self.bonded[one].discard)(other)

    def begin(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Begin with the assemblies and bonds of a world of the native core."""
        self.cell = [(x, y) for x, y in state["cell"].tolist()]
        self.quarter = state["quarter"].tolist()
        self.body = state["assembly"].tolist()
        self.members = [[] for _ in self.body]
        for block, body in enumerate(self.body):
            self.members[body].append(block)
        self.taken = [{self.cell[one] for one in members} for members in self.members]
        for pair in state["bond"].tolist():
            self.bond(pair, whole=True)

    def touch(self, block: list[int]) -> None:
        """Note that two blocks touch; of squares the lattice tells it."""

    def part(self, block: list[int]) -> tuple[int, int]:
        """Cut the body of two blocks where their bond breaks; return the bodies of both.

        A body is called by one of its blocks.
        """
        self.bond(block, whole=False)
        was = self.body[block[0]]
        side = self._reached(block[0])
        if self.body[block[1]] != was or block[1] in side:
            raise InputError("parts two blocks that are not held by that bond alone")
        bodies = []
        for part in (sorted(side), sorted(set(self.members[was]) - side)):
            body = was if was in part else part[0]
            self.lowest[body] = part[0]
            bodies.append((body, part))
        for body, part in bodies:
            self.members[body] = part
            self.taken[body] = {self.cell[member] for member in part}
            for member in part:
                self.body[member] = body
            self.joins[body] = self._joins_within(body)
        return bodies[0][0], bodies[1][0]

    def _reached(self, block: int) -> set[int]:
        found, ahead = {block}, [block]
        while ahead:
            new = self.bonded[ahead.pop()] - found
            found |= new
            ahead += new
        return found

    def _joins_within(self, body: int) -> int:
        return joins_of_cells(self.taken[body])

    def shape(self, body: int) -> str:
        """Return the name of the shape of a body."""
        size = len(self.members[body])
        if size > MOST_CELLS_NAMED and len(self.body) > MOST_NAMED:
            return counted_shape(size, self.joins[body])
        cells = tuple(self.cell[member] for member in self.members[body])
        return name_of(moved_to_origin(cells), self.chirality)

    def _contacts(self, stays: int, moves: int, block: list[int], face: list[int]) -> int:
        """Put the moved squares on the lattice of the others; return how many faces meet."""
        outward = (face[0] + self.quarter[block[0]]) % 4
        turn = (outward + 2 - face[1] - self.quarter[block[1]]) % 4
        own = [self.cell[member] for member in self.members[moves]]
        there = put_beside(own, self.cell[block[1]], self.cell[block[0]], outward, turn)
        taken = self.taken[stays]
        if not taken.isdisjoint(there):
            raise InputError("puts two blocks into one cell")
        for member, cell in zip(self.members[moves], there, strict=True):
            self.cell[member] = cell
            self.quarter[member] = (self.quarter[member] + turn) % 4
        met = sum((x + dx, y + dy) in taken for x, y in there for dx, dy in STEPS)
        taken.update(there)
        self.taken[moves] = set()
        return met


class DiscWorld(SquareWorld):
    """The same of discs or rectangles (`noun`), which stay as they lie.

    All contacts at the end were there all along; without pairs they come from the events.
    """

    def __init__(
        self, blocks: int, pairs: list[tuple[int, int]] | None = None, *, noun: str = "discs"
    ) -> None:
        super().__init__(blocks, "merged")
        self.noun = noun
        self.near: list[list[int]] = [[] for _ in range(blocks)]
        for pair in pairs or ():
            self.touch(list(pair))

    def shape(self, body: int) -> str:
        """Return the name of the contact graph of a body."""
        members = self.members[body]
        if len(members) > MOST_DISCS and len(self.body) > MOST_NAMED:
            met = (sum(self.body[one] == body for one in self.near[member]) for member in members)
            if max(met) == 2:
                word = "ring" if self.joins[body] == len(members) else "chain"
                return f"{word}{len(members)}"
            return counted_graph(len(members), self.joins[body], self.noun)
        place = {member: index for index, member in enumerate(members)}
        pairs = [(place[a], place[b]) for a in members for b in self.near[a] if b in place]
        return graph_name(len(members), pairs, self.noun)

    def touch(self, block: list[int]) -> None:
        """Note that two of them touch."""
        for one, other in (block, block[::-1]):
            if other not in self.near[one]:
                self.near[one].append(other)

    def _joins_within(self, body: int) -> int:
        members = set(self.members[body])
        for member in members:
            self.near[member] = [one for one in self.near[member] if one in members]
        return sum(len(self.near[member]) for member in members) // 2

    def _contacts(self, stays: int, moves: int, block: list[int], face: list[int]) -> int:
        del block, face
        return sum(
            self.body[other] == stays
            for member in self.members[moves]
            for other in self.near[member]
        )


def replay(
    number: Integers,
    block: Integers,
    face: Integers,
    kind: Integers | None,
    *,
    blocks: int,
    chirality: Chirality | None,
    world_of: Callable[[int], SquareWorld],
) -> tuple[ReplayedEvents, tuple[Integers, Integers, Integers]]:
    """Replay the events of runs one by one, return cells, quarters and assemblies after them.

    Parameters
    ----------
    number : ndarray of int, shape (runs,)
        Number of events of each run.
    block, face : ndarray of int, shape (runs, events, 2)
        As in `replay_events`.
    kind : ndarray of int, shape (runs, events), or None
        As in `replay_events`.
    blocks : int
        Blocks of each run.
    chirality : {"merged", "distinct"} or None
        As in `replay_events`; None of discs and rectangles.
    world_of : callable
        The world of a run at its start.

    Raises
    ------
    InputError
        When an event cannot be; names the run.
    """
    runs, slots = block.shape[:2]
    cell = np.zeros((runs, blocks, 2), dtype=np.int64)
    quarter, assembly = (np.zeros((runs, blocks), dtype=np.int64) for _ in range(2))
    shapes, classes = _Names("1"), _Names(all_single(blocks))
    kinds = np.full((runs, slots), JOINING) if kind is None else kind
    outcome = np.zeros(runs, dtype=np.int64)
    # Of each event its place, two assemblies, three shapes and the class after it.
    rows: list[tuple[int, ...]] = []
    for run in range(runs):
        world, now = world_of(run), 0
        shape_of = ["1"] * blocks
        pairs, faces, told = block[run].tolist(), face[run].tolist(), kinds[run].tolist()
        for event in range(int(number[run])):
            pair, what = pairs[event], told[event]
            lowest = [world.lowest[world.body[one]] for one in pair]
            if what in (OPENING, CLOSING):
                world.bond(pair, whole=what == CLOSING)
                rows.append((run, event, *lowest, -1, -1, -1, now))
                continue
            try:
                if what == JOINING:
                    parts = [shape_of[world.body[one]] for one in pair]
                    _touch_all(world, pairs, told, event, int(number[run]))
                    stays, moves = world.join(pair, faces[event])
                    world.bond(pair, whole=True)
                    became = shape_of[stays] = world.shape(stays)
                    shape_of[moves] = ""
                else:
                    became = shape_of[world.body[pair[0]]]
                    two = world.part(pair)
                    lowest = [world.lowest[body] for body in two]
                    parts = [world.shape(body) for body in two]
                    shape_of[two[0]], shape_of[two[1]] = parts
            except InputError as error:
                raise InputError(f"run {run}, event {event}: {error}") from None
            there = [name for name in shape_of if name]
            named = blocks <= MOST_NAMED
            name = _class_of(tuple(sorted(there))) if named else counted_class(len(there))
            now = classes.number(name)
            rows.append((run, event, *lowest, *map(shapes.number, (*parts, became)), now))
        cell[run], quarter[run], outcome[run] = world.cell, world.quarter, now
        assembly[run] = [world.lowest[body] for body in world.body]
    table = np.full((runs, slots, 6), -1)
    filled = np.array(rows, dtype=np.int64).reshape(-1, 8)
    table[filled[:, 0], filled[:, 1]] = filled[:, 2:]
    shape_names = listed_shapes(shapes.known, blocks, chirality=chirality)
    class_names = listed_classes(classes.known, blocks, chirality=chirality)
    class_index = classes.index_into(class_names)
    found = ReplayedEvents(
        table[..., :2].astype(np.int32),
        shapes.index_into(shape_names)[table[..., 2:5]],
        class_index[table[..., 5]],
        class_index[outcome],
        class_names,
        shape_names,
    )
    return found, (cell, quarter, assembly)


# Many runs meet in the same worlds.
_class_of = lru_cache(maxsize=1 << 14)(class_name)


def _touch_all(
    world: SquareWorld, pairs: list[list[int]], kinds: list[int], event: int, last: int
) -> None:
    """Note what touches by a joining: its two blocks, and contacts that come right after it."""
    world.touch(pairs[event])
    event += 1
    while event < last and kinds[event] == CLOSING:
        world.touch(pairs[event])
        event += 1
