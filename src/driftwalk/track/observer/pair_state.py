"""Join state of two blocks, decided frame by frame.

The rules are those of `driftwalk.classify`, which looks at a whole recording: faces join when they
have fitted for the shortest duration, they part when they have been beyond the looser tolerances
for as long, and both are dated back to where that began.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwalk.assembly.lattice.joined_faces import ROUNDING, Join, JoinRules, PairPoses


class _Look(NamedTuple):
    """One frame that shows both blocks."""

    sample: int
    time: float
    pair: PairPoses
    kind: int
    """4 times the face of the first block plus that of the second, -1 when they do not fit."""


class PairState:
    """Two blocks from frame to frame.

    Parameters
    ----------
    blocks : tuple of int
        The blocks, the lower first.
    rules : JoinRules
        Criteria of a join.
    """

    def __init__(self, blocks: tuple[int, int], rules: JoinRules) -> None:
        self.blocks = blocks
        self.rules = rules
        self.faces: tuple[int, int] | None = None
        self._over: list[Join] = []
        self._began = 0
        self._looseness: list[float] = []
        self._streak: list[_Look] = []

    def joins(self, samples: int) -> list[Join]:
        """Return all joins up to now; one that holds ends with the last sample."""
        if self.faces is None:
            return self._over
        loose = float(np.median(self._looseness))
        return [*self._over, Join(self.blocks, self.faces, self._began, samples, loose)]

    def step(self, sample: int, pair: PairPoses) -> None:
        """Take a frame that shows both blocks; `pair` holds that one sample."""
        nearest = pair.nearest_faces()
        distance, angle = pair.misfit(nearest, self.rules.side)
        fits = distance[0] <= self.rules.join_distance and angle[0] <= self.rules.join_angle
        kind = 4 * int(nearest[0, 0]) + int(nearest[1, 0]) if fits else -1
        self._take(_Look(sample, float(pair.time[0]), pair, kind))

    def _take(self, look: _Look) -> None:
        if self.faces is None:
            self._look_for_join(look)
        else:
            self._look_for_parting(look)

    def _look_for_join(self, look: _Look) -> None:
        if look.kind < 0 or (self._streak and self._streak[-1].kind != look.kind):
            self._streak = []
        if look.kind >= 0 and self._lasts(look):
            looks, self._streak = self._streak, []
            self.faces = divmod(look.kind, 4)
            self._began, self._looseness = looks[0].sample, []
            for one in looks:
                self._look_for_parting(one)

    def _look_for_parting(self, look: _Look) -> None:
        assert self.faces is not None
        distance, angle = look.pair.misfit(np.array(self.faces)[:, None], self.rules.side)
        rules = self.rules
        if distance[0] <= rules.release_distance and angle[0] <= rules.release_angle:
            self._streak = []
        elif self._lasts(look):
            # What was seen since they came apart may be the beginning of another join.
            looks, self._streak = self._streak, []
            loose = float(np.median(self._looseness[: len(self._looseness) - len(looks) + 1]))
            self._over.append(Join(self.blocks, self.faces, self._began, looks[0].sample, loose))
            self.faces = None
            for one in looks:
                self._take(one)
            return
        loose = max(distance[0] / rules.join_distance, angle[0] / rules.join_angle)
        self._looseness.append(float(loose))

    def _lasts(self, look: _Look) -> bool:
        """Add to the streak; True when it has lasted for the shortest duration that counts."""
        if self._streak and look.time - self._streak[-1].time > self.rules.hold * (1 + ROUNDING):
            self._streak = []
        self._streak.append(look)
        return look.time - self._streak[0].time >= self.rules.min_duration * (1 - ROUNDING)
