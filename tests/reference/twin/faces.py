"""Typed faces for the self-assembly kernel's twin: who latches, what poles refuse, what becomes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from driftwalk.assembly.lattice.joined_faces import FaceTable
from twin.body import NEIGHBOURS, Assembly, Ints


@dataclass
class Faces:
    """The rules, and the kind that each block of a world is of now."""

    table: FaceTable
    kind: list[int]

    def type_of(self, block: int, own_face: int) -> int:
        """Return the type of a face in its block's own frame."""
        return int(self.table.type[self.kind[block], own_face])

    def latch(self, block: int, own_face: int, other: int, other_face: int) -> bool:
        """Return whether two faces, each in its block's own frame, may latch."""
        pair = self.type_of(block, own_face), self.type_of(other, other_face)
        return bool(self.table.latches[pair])

    def poles(self, body: Assembly) -> Ints:
        """Return the poles of the members' faces in the assembly's frame, shape (n, 4)."""
        return np.array(
            [
                [self.table.pole[self.kind[block], (face - quarter) % 4] for face in range(4)]
                for block, quarter in zip(body.blocks, body.quarters, strict=True)
            ]
        )

    def refused(self, made: Assembly, stayed: list[int]) -> bool:
        """Return whether a merge brings as many like poles together as faces that latch."""
        like = latching = 0
        cells = {(int(x), int(y)): k for k, (x, y) in enumerate(made.cells)}
        for k, block in enumerate(made.blocks):
            for face, step in enumerate(NEIGHBOURS):
                at = cells.get((int(made.cells[k][0] + step[0]), int(made.cells[k][1] + step[1])))
                if block not in stayed or at is None or made.blocks[at] in stayed:
                    continue
                other = made.blocks[at]
                own = int(face - made.quarters[k]) % 4
                their = int(face + 2 - made.quarters[at]) % 4
                poles = (
                    self.table.pole[self.kind[block], own],
                    self.table.pole[self.kind[other], their],
                )
                like += poles[0] * poles[1] > 0
                latching += self.latch(block, own, other, their)
        return bool(like and like >= latching)

    def become(self, blocks: tuple[int, int], faces: tuple[int, int]) -> None:
        """Give two blocks the kinds that they are of after these faces, in own frames, latched."""
        types = [self.type_of(*end) for end in zip(blocks, faces, strict=True)]
        for block, face, met in zip(blocks, faces, reversed(types), strict=True):
            self.kind[block] = int(self.table.becomes[self.kind[block], face, met])
