"""Worlds on the lattice made in another way than driftwalk does it: cells are complex numbers.

A turn by a quarter is a product with i, and the form of a shape is found by trying all turns. Used
as an oracle, and to make synthetic runs and recordings.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Shape = frozenset[complex]
UNIT = (1, 1j, -1, -1j)

# Drawn by hand, one column per number of the real part, y up.
NAMED: dict[str, set[complex]] = {
    "1": {0},
    "2": {0, 1},
    "I3": {0, 1, 2},
    "L3": {0, 1, 1j},
    "I": {0, 1, 2, 3},
    "O": {0, 1, 1j, 1 + 1j},
    "T": {0, 1, 2, 1 - 1j},
    "S": {0, 1, 1 + 1j, 2 + 1j},
    "Z": {1j, 1 + 1j, 1, 2},
    "L": {0, 1, 1j, 2j},
    "J": {0, 1, 1 + 1j, 1 + 2j},
}


def whole(z: complex) -> complex:
    return complex(round(z.real), round(z.imag))


def form(cells: Any, *, mirror: bool) -> tuple[tuple[float, float], ...]:
    """Return one representative of all turned (and mirrored) copies of some cells."""
    points = [complex(*cell) if not isinstance(cell, complex) else cell for cell in cells]
    copies = []
    for reflected in [points, [z.conjugate() for z in points]][: 2 if mirror else 1]:
        for unit in UNIT:
            turned = [whole(z * unit) for z in reflected]
            corner = complex(min(z.real for z in turned), min(z.imag for z in turned))
            copies.append(tuple(sorted((z.real, z.imag) for z in (z - corner for z in turned))))
    return min(copies)


def small_name(cells: Any, *, mirror: bool) -> str:
    """Name a shape of up to four cells by comparing it with the drawings."""
    return next(
        name
        for name, drawn in NAMED.items()
        if form(map(complex, drawn), mirror=mirror) == form(cells, mirror=mirror)
    )


@dataclass
class World:
    """Blocks on the lattices of their assemblies: per assembly, per block, cell and quarter."""

    assemblies: dict[int, dict[int, tuple[complex, int]]]

    def copy(self) -> World:
        return World({label: dict(members) for label, members in self.assemblies.items()})

    def labels(self, blocks: int) -> list[int]:
        label_of = {b: label for label, members in self.assemblies.items() for b in members}
        return [label_of[block] for block in range(blocks)]

    def forms(self, *, mirror: bool) -> Counter[Any]:
        """Return the multiset of the shapes."""
        return Counter(
            form([cell for cell, _ in members.values()], mirror=mirror)
            for members in self.assemblies.values()
        )

    def small_class(self, *, mirror: bool) -> str:
        """Name the outcome class of up to four blocks."""
        names = [
            small_name([cell for cell, _ in members.values()], mirror=mirror)
            for members in self.assemblies.values()
        ]
        drawn = list(NAMED)
        return "+".join(sorted(names, key=lambda name: (-len(NAMED[name]), drawn.index(name))))

    def faces_between(self, one: int, other: int) -> set[tuple[int, int, int, int]]:
        """Return (block, block, face, face) of all cells of two assemblies that touch.

        Both are on one lattice: for worlds after an event, with the members of before.
        """
        return {
            (i, j, (side - q) % 4, (side + 2 - p) % 4)
            for i, (cell, q) in self.assemblies[one].items()
            for j, (place, p) in self.assemblies[other].items()
            for side in range(4)
            if cell + UNIT[side] == place
        }


@dataclass
class Run:
    """A run: its events, and the world at the start and after each event."""

    blocks: list[tuple[int, int]] = field(default_factory=list)
    faces: list[tuple[int, int]] = field(default_factory=list)
    labels: list[tuple[int, int]] = field(default_factory=list)
    touching: list[set[tuple[int, int, int, int]]] = field(default_factory=list)
    worlds: list[World] = field(default_factory=list)


def random_run(blocks: int, rng: np.random.Generator, *, stop: float = 0.1) -> Run:
    """Join blocks at random until one assembly is left, or by chance earlier."""
    world = World({block: {block: (0j, 0)} for block in range(blocks)})
    run = Run(worlds=[world.copy()])
    while len(world.assemblies) > 1 and rng.random() > stop / blocks:
        one, other = (int(label) for label in rng.choice(list(world.assemblies), 2, replace=False))
        size = {label: len(world.assemblies[label]) for label in (one, other)}
        if size[one] < size[other] or (size[one] == size[other] and one > other):
            one, other = other, one
        i = int(rng.choice(list(world.assemblies[one])))
        j = int(rng.choice(list(world.assemblies[other])))
        f, g = (int(face) for face in rng.integers(0, 4, 2))
        joined = _join(world, one, other, (i, j), (f, g))
        if joined is None:
            continue
        run.blocks.append((i, j))
        run.faces.append((f, g))
        run.labels.append((one, other))
        run.touching.append(World({0: world.assemblies[one], 1: joined}).faces_between(0, 1))
        merged = world.assemblies.pop(one) | joined
        del world.assemblies[other]
        world.assemblies[min(one, other)] = merged
        run.worlds.append(world.copy())
    return run


def _join(
    world: World, one: int, other: int, blocks: tuple[int, int], faces: tuple[int, int]
) -> dict[int, tuple[complex, int]] | None:
    """Return the members of `other` on the lattice of `one`; None when a cell is taken."""
    cell, q = world.assemblies[one][blocks[0]]
    pivot, p = world.assemblies[other][blocks[1]]
    outward = UNIT[(faces[0] + q) % 4]
    # The face of the block that moves looks back: the turn takes its normal to -outward.
    turn = -outward / UNIT[(faces[1] + p) % 4]
    quarters = UNIT.index(whole(turn))
    moved = {
        block: (whole((place - pivot) * turn + cell + outward), (own + quarters) % 4)
        for block, (place, own) in world.assemblies[other].items()
    }
    taken = {place for place, _ in world.assemblies[one].values()}
    return None if taken & {place for place, _ in moved.values()} else moved


def raw_arrays(runs: list[Run], blocks: int) -> dict[str, np.ndarray]:
    """Return the arrays of the native core for some runs."""
    slots = max(blocks - 1, 1)
    arrays = {
        "event_count": np.array([len(run.blocks) for run in runs], dtype=np.int32),
        "event_block": np.full((len(runs), slots, 2), -1, dtype=np.int32),
        "event_face": np.full((len(runs), slots, 2), -1, dtype=np.int32),
        "cell": np.zeros((len(runs), blocks, 2), dtype=np.int32),
        "quarter": np.zeros((len(runs), blocks), dtype=np.int32),
        "assembly": np.zeros((len(runs), blocks), dtype=np.int32),
    }
    for number, run in enumerate(runs):
        count = len(run.blocks)
        arrays["event_block"][number, :count] = np.reshape(run.blocks, (count, 2))
        arrays["event_face"][number, :count] = np.reshape(run.faces, (count, 2))
        for label, members in run.worlds[-1].assemblies.items():
            for block, (cell, quarter) in members.items():
                arrays["cell"][number, block] = cell.real, cell.imag
                arrays["quarter"][number, block] = quarter
                arrays["assembly"][number, block] = label
    return arrays
