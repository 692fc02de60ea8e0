"""Worlds of squares, discs or rectangles while the events of a run are replayed, run after run.

An event changes two assemblies, and the one that moves is the smaller: all events of a run of n
blocks together move fewer than n log2(n) of them. Among many blocks large assemblies are called by
two counts, and the class of a world by the number of its assemblies: hardly two of them would have
the same shape.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy.typing as npt

from driftwalk.assembly.lattice.polyomino import Chirality, name_of, put_beside
from driftwalk.core.errors import InputError
from driftwalk.schema.shapes import (
    MOST_CELLS_NAMED,
    MOST_DISCS,
    MOST_NAMED,
    STEPS,
    counted_graph,
    counted_shape,
    graph_name,
    joins_of_cells,
    moved_to_origin,
)


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
            bodies.append(body)
            self.lowest[body], self.members[body] = part[0], part
            self.taken[body] = {self.cell[member] for member in part}
            for member in part:
                self.body[member] = body
            self.joins[body] = self._joins_within(body)
        return bodies[0], bodies[1]

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
