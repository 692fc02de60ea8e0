"""Joins that hold, and the graph of bonds: which blocks a bond that breaks leaves together.

The faces of joined blocks fit and do not move against each other. Blocks that drift past each
other also fit for a while. Joined ones are one rigid body, so their
faces keep their place to each other, and all joins of a recording lie alike.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.assembly.lattice.joined_faces import (
    ROUNDING,
    Join,
    JoinRules,
    Poses,
    first_streak,
)
from driftwalk.core.arrays import Bools, Floats, Integers


class PlayPolicy(NamedTuple):
    """Which contacts of a recording are joins."""

    least: float = 0.02
    """Smallest play, in sides; chosen by hand: a lens bends the picture by as much."""
    moves: float = 2.0
    """Play in units of the median movement; white noise is beyond it in one sample of 3000."""
    taught: float = 0.9
    """Share of the joined samples that teach how faces lie; chosen by hand."""
    sure_s: float = 10.0
    """Time after which faces at rest are joined however they lie [s]; longer than each passing
    contact of 40 simulated recordings of 300 s (6 s at most)."""


PLAY_POLICY: Final = PlayPolicy()


class Contact(NamedTuple):
    """A pair from the begin of a join on, and beyond its end by the shortest duration."""

    join: Join
    samples: Integers
    time: Floats
    lie: Floats
    """How the second face lies to the first: ahead, aside, turned times the side [m], (3, n)."""
    inside: int
    """Number of samples until the end of the join."""

    @classmethod
    def of(cls, join: Join, poses: Poses, rules: JoinRules) -> Contact:
        """Return the contact of a join by the tolerances."""
        i, j = join.blocks
        last = poses.time[min(join.stop, poses.time.size - 1)] + rules.min_duration
        end = int(np.searchsorted(poses.time, last * (1 + ROUNDING), side="right"))
        at = join.start + np.flatnonzero((poses.seen[:, i] & poses.seen[:, j])[join.start : end])
        pair = poses.pair(join.blocks, at)
        lie = pair.lie(np.array(join.faces)[:, None], rules.side)
        lie[2] *= rules.side
        return cls(join, at, pair.time, lie, int(np.searchsorted(at, join.stop)))

    def later(self, rules: JoinRules) -> Integers:
        """Return the first sample that is the shortest duration later, for each sample."""
        return np.searchsorted(self.time, self.time + rules.min_duration * (1 - ROUNDING))

    def moves(self, rules: JoinRules) -> Floats:
        """Return how far the faces move within the shortest duration [m]."""
        later = self.later(rules)[: self.inside]
        now = np.flatnonzero(later < self.inside)
        return _size(self.lie[:, later[now]] - self.lie[:, now])


class Stretch(NamedTuple):
    """A part of a contact in which the faces do not move."""

    join: Join
    place: float
    """How far the faces are from fitting exactly [m]."""
    samples: int
    lasts: float
    """Its duration [s]."""


def rigid_joins(
    poses: Poses, joins: Sequence[Join], rules: JoinRules, play: float | None
) -> tuple[list[Join], float, int]:
    """Return the joins in which faces hold their place, and by how much they may move [m].

    The last number is that of the contacts at rest that are left out, as their faces lie otherwise.

    Parameters
    ----------
    poses : Poses
        The recorded poses.
    joins : sequence of Join
        Joins by the tolerances.
    rules : JoinRules
        The tolerances.
    play : float or None
        How far joined faces may move [m]; infinity: all joins hold; None: as far as noise does.
    """
    if play == math.inf:
        return list(joins), play, 0
    contacts = [Contact.of(join, poses, rules) for join in joins]
    if play is None:
        moves = np.concatenate([np.empty(0), *(contact.moves(rules) for contact in contacts)])
        usual = float(np.median(moves)) if moves.size else 0.0
        play = max(PLAY_POLICY.moves * usual, PLAY_POLICY.least * rules.side)
    found = [one for contact in contacts for one in _stretches(contact, rules, play)]
    kept = _alike(found, play)
    return [one.join for one in kept], play, len(found) - len(kept)


def _size(lie: Floats) -> Floats:
    size: Floats = np.sqrt((lie**2).sum(axis=0))
    return size


def _stretches(contact: Contact, rules: JoinRules, play: float) -> Iterator[Stretch]:
    """Give the parts of a contact in which the faces stay within the play of where they began."""
    join, time, lie = contact.join, contact.time, contact.lie
    later = contact.later(rules)
    begin = 0
    while begin < contact.inside and later[begin] < contact.inside:
        own = np.median(lie[:, begin : later[begin] + 1], axis=1)
        away = _size(lie - own[:, None]) > play
        fits = math.hypot(own[0], own[1]) <= rules.join_distance
        fits = fits and abs(own[2]) <= rules.join_angle * rules.side
        if not fits or away[begin : later[begin] + 1].any():
            begin += 1
            continue
        out = first_streak(time, np.where(away, 0, -1), begin, rules)
        stop = contact.inside if out is None else min(out, contact.inside)
        ends = join.stop if stop == contact.inside else int(contact.samples[stop])
        place = float(_size(np.median(lie[:, begin:stop], axis=1)))
        held = join._replace(start=int(contact.samples[begin]), stop=ends)
        yield Stretch(held, place, stop - begin, float(time[stop - 1] - time[begin]))
        begin = stop


def _alike(found: list[Stretch], play: float) -> list[Stretch]:
    """Return the stretches whose faces lie as those do that are joined most of the time.

    A block whose sure joins lie further off is badly marked: its other joins may lie as far off.
    """
    if not found:
        return []
    near = sorted(found, key=lambda one: one.place)
    seen = np.cumsum([one.samples for one in near])
    usual = near[int(np.searchsorted(seen, PLAY_POLICY.taught * seen[-1]))].place
    sure = [one for one in near if one.lasts >= PLAY_POLICY.sure_s]
    furthest = {block: one.place for one in sure for block in one.join.blocks}
    return [
        one
        for one in found
        if one.lasts >= PLAY_POLICY.sure_s
        or one.place - play / math.sqrt(one.samples)
        <= max(usual, *(furthest.get(block, 0.0) for block in one.join.blocks))
    ]


JOINING: Final = 0
"""Two assemblies became one: kinds of events, as the native core numbers them."""
PARTING: Final = 1
"""One assembly became two."""
OPENING: Final = 2
"""A bond of a loop broke; the loop holds its blocks together."""
CLOSING: Final = 3
"""A bond of a loop formed, of neighbours that a joining has brought together."""


class BondGraph:
    """Bonds between the blocks of runs, side by side.

    Parameters
    ----------
    runs, blocks : int
        At first there is no bond.
    """

    def __init__(self, runs: int, blocks: int) -> None:
        self.bonded: Bools = np.zeros((runs, blocks, blocks), dtype=bool)

    def put(self, run: Integers, block: Integers, bonded: bool) -> None:
        """Make or break the bonds of pairs of blocks (n, 2), one for each of some runs."""
        first, second = block.T
        self.bonded[run, first, second] = self.bonded[run, second, first] = bonded

    def reached(self, run: Integers, block: Integers) -> Bools:
        """Return which blocks bonds lead to from one block of each run, shape (n, blocks)."""
        bonded = self.bonded[run]
        found: Bools = np.arange(bonded.shape[1]) == block[:, None]
        while True:
            grown = found | (bonded & found[:, :, None]).any(axis=1)
            if (grown == found).all():
                return found
            found = grown
