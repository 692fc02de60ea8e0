"""Typed faces as tables of numbers: for the native core, and to follow the kinds of blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.core.arrays import Bools, Integers

if TYPE_CHECKING:
    from driftwalk.model import Assembly


class FaceTable(NamedTuple):
    """Rules of typed faces; kinds and types by their places in the study."""

    latches: npt.NDArray[np.int32]
    """1 where two types latch, (type, type), symmetric."""
    type: npt.NDArray[np.int32]
    """Type of the faces +x, +y, -x, -y, (kind, face)."""
    pole: npt.NDArray[np.int32]
    """Pole of a fixed magnet at a face: +1 N, -1 S, 0 none, (kind, face)."""
    number: npt.NDArray[np.int32]
    """Blocks of the kind at the start, (kind,)."""
    becomes: npt.NDArray[np.int32]
    """Kind after a face has latched with a type, (kind, face, type)."""

    @property
    def rewrites(self) -> bool:
        """Whether a block ever becomes of another kind."""
        return bool((self.becomes != np.arange(len(self.type))[:, None, None]).any())

    def native(self) -> _core.FaceRules:
        """Return the native core's form of the rules."""
        return _core.FaceRules(
            latches=self.latches,
            type=self.type,
            pole=self.pole,
            count=self.number,
            becomes=self.becomes.reshape(-1, len(self.latches)),
        )

    def first_kinds(self, blocks: int) -> Integers:
        """Return the kinds of blocks at the start; beyond the counts they repeat."""
        ends = np.cumsum(self.number)
        return np.asarray(np.searchsorted(ends, np.arange(blocks) % ends[-1], side="right"))

    def latch(self, kind: Integers, face: Integers) -> tuple[Bools, Integers]:
        """Return of pairs of blocks whether their faces latch, and what the blocks become.

        Parameters
        ----------
        kind, face : ndarray of int, shape (pair, 2)
            Kinds of the two blocks, and the faces that meet, in the blocks' own frames.
        """
        types = self.type[kind, face]
        holds = np.asarray(self.latches[types[:, 0], types[:, 1]] != 0)
        return holds, self.becomes[kind, face, types[:, ::-1]].astype(np.int64)


def face_table(assembly: Assembly) -> FaceTable | None:
    """Return the rules of a study's typed faces, None where any face latches with any.

    Parameters
    ----------
    assembly : Assembly
        Its ``faces`` or ``binding``.

    Examples
    --------
    >>> from driftwalk.model import Assembly
    >>> face_table(Assembly(faces="N,S,N,S")).pole.tolist()
    [[1, -1, 1, -1]]
    """
    from driftwalk.model.binding import POLES, SIDES

    binding = assembly.typed_faces
    if binding is None:
        return None
    types = list(binding.types)
    names = [kind.name for kind in binding.kinds]
    latches = np.zeros((len(types), len(types)), dtype=np.int32)
    for pair in binding.latches:
        if set(pair) <= set(types):
            one, other = map(types.index, pair)
            latches[one, other] = latches[other, one] = 1
    becomes = np.empty((len(names), len(SIDES), len(types)), dtype=np.int32)
    becomes[:] = np.arange(len(names))[:, None, None]
    # A rule for one type wins over one for any.
    for rule in sorted(binding.after, key=lambda rule: rule.meets is not None):
        met = slice(None) if rule.meets is None else types.index(rule.meets)
        becomes[names.index(rule.kind), SIDES.index(rule.face), met] = names.index(rule.becomes)
    faces = [kind.faces for kind in binding.kinds]
    return FaceTable(
        latches,
        np.array([[types.index(name) for name in row] for row in faces], dtype=np.int32),
        np.array([[POLES.get(name, 0) for name in row] for row in faces], dtype=np.int32),
        np.array([kind.count for kind in binding.kinds], dtype=np.int32),
        becomes,
    )
