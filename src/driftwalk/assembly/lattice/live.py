"""Lattice positions of the blocks of a live world, updated as blocks join."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.events import STEP, rotate
from driftwalk.assembly.lattice.polyomino import Chirality, name_of
from driftwalk.assembly.outcomes.classes import class_name
from driftwalk.schema.shapes import Cell, moved_to_origin

Integers = npt.NDArray[np.int64]


class Lattice(NamedTuple):
    """Cell, quarter turns and assembly (its lowest block) of every block."""

    cell: Integers
    quarter: Integers
    assembly: Integers

    @classmethod
    def of(cls, state: dict[str, npt.NDArray[Any]]) -> Lattice:
        """Return the lattice of a world of the native core."""
        return cls(*(state[name].astype(np.int64) for name in cls._fields))

    def joined(self, blocks: npt.NDArray[np.int32], faces: npt.NDArray[np.int32]) -> Lattice:
        """Return the lattice after two faces have joined; the second one's assembly moves.

        Parameters
        ----------
        blocks, faces : ndarray of int, shape (2,)
            The blocks, first that of the assembly that stays, and their faces in their own frames.
        """
        (stays, moves), (face, peer) = blocks.tolist(), faces.tolist()
        outward = (face + self.quarter[stays]) % 4
        turn = outward + 2 - peer - self.quarter[moves]
        moved = self.assembly == self.assembly[moves]
        arm = rotate(self.cell - self.cell[moves], np.full(moved.size, turn))
        lowest = min(self.assembly[stays], self.assembly[moves])
        member = moved | (self.assembly == self.assembly[stays])
        return Lattice(
            np.where(moved[:, None], arm + self.cell[stays] + STEP[outward], self.cell),
            np.where(moved, (self.quarter + turn) % 4, self.quarter),
            np.where(member, lowest, self.assembly),
        )

    def outcome(self, chirality: Chirality) -> str:
        """Return the outcome class of the world."""
        members: dict[int, list[Cell]] = {}
        for label, (x, y) in zip(self.assembly.tolist(), self.cell.tolist(), strict=True):
            members.setdefault(label, []).append((x, y))
        shapes = (name_of(moved_to_origin(tuple(cells)), chirality) for cells in members.values())
        return class_name(shapes)
