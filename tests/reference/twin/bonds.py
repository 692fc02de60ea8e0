"""Bonds that break, for the NumPy twin of the self-assembly kernel: at a constant rate.

* Bonded are members in neighbouring cells; off the lattice, those whose gap is at most CONTACT_GAP.
* A bond's hazard, from the exponential law of mean 1, is drawn in the step in which it forms.
* Bonds wear after the wall has acted and before blocks latch; those that come to their end in one
  step do so in the order of their blocks.
* A bond of a loop that breaks stays open as long as its blocks are in one assembly.
* Two assemblies do not latch while two blocks that parted, one in each, are closer than the
  clearance.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.random_streams import Purpose
from twin.block import philox
from twin.body import NEIGHBOURS, Assembly, Floats, turned
from twin.contacts import Pair as BlockPair, overlap

if TYPE_CHECKING:
    from twin.assembly import World

JOINING, PARTING, OPENING, CLOSING = range(4)
CONTACT_GAP = 0.01  # longer sides

Pair = tuple[int, int]


@dataclass
class Bonds:
    """The bonds of a world: those that hold, by the hazard that is left, and those that broke."""

    key: int
    rate: float  # [1/s]
    clearance: float  # [side]
    left: dict[Pair, float] = field(default_factory=dict)
    open: set[Pair] = field(default_factory=set)
    parted: set[Pair] = field(default_factory=set)

    def form(self, body: Assembly, step: int) -> list[Pair]:
        """Bond the neighbours of an assembly that has just been made, and return the new bonds."""
        pairs = sorted(neighbours(body))
        new = [pair for pair in pairs if pair not in self.left and pair not in self.open]
        for first, second in new:
            words = philox(
                np.array([self.key], dtype=np.uint64), (step, first, second, Purpose.BOND)
            )
            whole = int(words[0][0]) * 2**21 + (int(words[1][0]) >> 11)
            self.left[first, second] = -float(np.log((whole + 0.5) / 2**53))
        self.parted = {pair for pair in self.parted if not set(pair) <= set(body.blocks)}
        return new

    def wear(self, time_step: float, centres: Floats, side: float) -> list[Pair]:
        """Take the hazard of a step, forget what is clear, and return the bonds that break."""
        self.parted = {
            (first, second)
            for first, second in self.parted
            if np.hypot(*(centres[second] - centres[first])) < self.clearance * side
        }
        for pair in self.left:
            self.left[pair] -= self.rate * time_step
        return sorted(pair for pair, left in self.left.items() if left <= 0)

    def bars(self, one: Assembly, other: Assembly) -> bool:
        """Whether two assemblies must not latch yet."""
        return any(
            (first in one.blocks and second in other.blocks)
            or (second in one.blocks and first in other.blocks)
            for first, second in self.parted
        )

    def reached(self, block: int) -> set[int]:
        """Return the blocks to which bonds lead from one."""
        found, grown = set(), {block}
        while grown != found:
            found = grown
            grown = found | {b for pair in self.left if set(pair) & found for b in pair}
        return found


def neighbours(body: Assembly) -> Iterator[Pair]:
    """Yield the pairs of members in neighbouring cells, or in contact, the lower block first."""
    if not body.shape.on_lattice:
        for pair in combinations(body.blocks, 2):
            gap = -overlap(BlockPair((body, body), pair)).depth
            if gap <= CONTACT_GAP * 2 * body.shape.half.max():
                yield pair
        return
    at = {(int(x), int(y)): block for block, (x, y) in zip(body.blocks, body.cells, strict=True)}
    for (x, y), block in at.items():
        for dx, dy in NEIGHBOURS[:2]:
            other = at.get((x + int(dx), y + int(dy)))
            if other is not None:
                yield min(block, other), max(block, other)


def break_bonds(world: World, bonds: Bonds) -> list[tuple[int, Pair, Pair]]:
    """Break what is due in a world, and return kind, blocks and own faces of each event."""
    centres = world.gather("pose")[:, :2]
    square = world.rules.shape
    events = []
    for pair in bonds.wear(world.rules.model.time_step, centres, square.side):
        del bonds.left[pair]
        body = next(one for one in world.assemblies if pair[0] in one.blocks)
        side = bonds.reached(pair[0])
        if pair[1] in side:
            bonds.open.add(pair)
            events.append((OPENING, pair, faces_between(body, pair)))
            continue
        parts = [sorted(side), sorted(set(body.blocks) - side)]
        # More blocks stay; of equal ones the part with the lowest block.
        first_stays = min(parts, key=lambda part: (-len(part), part[0])) == parts[0]
        blocks = pair if first_stays else pair[::-1]
        events.append((PARTING, blocks, faces_between(body, blocks)))
        made = [part_of(body, part) for part in parts]
        crossing = {one for one in neighbours(body) if (one[0] in side) != (one[1] in side)}
        bonds.open -= crossing
        bonds.parted |= crossing
        kept = [one for one in world.assemblies if one is not body]
        world.assemblies = sorted([*kept, *made], key=lambda one: one.blocks[0])
    return events


def part_of(body: Assembly, blocks: list[int]) -> Assembly:
    """Return some members of an assembly as a body of their own, which moves on as they did."""
    rows = [body.blocks.index(block) for block in blocks]
    shift = body.offsets[rows].mean(axis=0)
    arm = turned(shift, body.pose[2])
    made = Assembly(
        body.shape,
        blocks,
        body.cells[rows] - body.cells[rows[0]],
        body.quarters[rows],
        np.array([*(body.pose[:2] + arm), body.pose[2]]),
        laid=None if body.laid is None else body.laid[rows] - np.array([*shift, 0.0]),
    )
    vx, vy, spin = body.motion
    made.motion = np.array([vx - spin * arm[1], vy + spin * arm[0], spin])
    return made


def faces_between(body: Assembly, pair: Pair) -> Pair:
    """Return the faces of two neighbours that look at each other, in the blocks' own frames.

    Off the lattice they are 0.
    """
    if not body.shape.on_lattice:
        return 0, 0
    rows = [body.blocks.index(block) for block in pair]
    step = body.cells[rows[1]] - body.cells[rows[0]]
    face = int(np.flatnonzero((step == NEIGHBOURS).all(axis=1))[0])
    return (
        int(face - body.quarters[rows[0]]) % 4,
        int(face + 2 - body.quarters[rows[1]]) % 4,
    )
