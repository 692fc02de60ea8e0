"""Joined faces of recorded blocks, joins that hold, and typed faces as tables of numbers.

Two faces fit when their centres are near each other and they look at each other. A join begins
where they fit without a break for the shortest duration that counts, and it ends where they are
beyond a looser pair of tolerances for as long; both are dated back to the first such sample. So one
noisy sample neither makes a join nor ends one.

Blocks that drift past each other also fit for a while. Joined ones are one rigid body, so their
faces keep their place to each other, and all joins of a recording lie alike.

The tables of typed faces are for the native core, and to follow the kinds of blocks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.errors import ConfigurationError
from driftwalk.model import Assembly

QUARTER: Final = math.pi / 2
"""A turn from one face of a square block to the next [rad]."""
# Time stamps are decimal numbers: 0.8 - 0.3 must count as half a second.
ROUNDING: Final = 1e-9


class JoinPolicy(NamedTuple):
    """When blocks of a recording are joined, unless stated otherwise."""

    join_distance: float = 0.1
    """Distance of faces that are joined, in sides; chosen by hand."""
    looser: float = 2.0
    """Tolerances to let go, in units of those to join; chosen by hand."""
    min_duration_s: float = 0.5
    """Shortest duration that counts [s]; chosen by hand."""
    hold_s: float = 1.0
    """Time for which a block that is not seen keeps its joins [s]; chosen by hand."""
    frames_held: float = 3.0
    """The same in frames, where they are so rare that it is longer; chosen by hand."""


JOIN_POLICY: Final = JoinPolicy()

JOIN_ANGLE: Final = math.radians(10.0)
"""Default angle between faces that are joined [rad]; chosen by hand."""


@dataclass(frozen=True)
class JoinRules:
    """Criteria of a join: lengths [m], angles [rad], times [s]."""

    side: float
    join_distance: float
    join_angle: float
    release_distance: float
    release_angle: float
    min_duration: float
    hold: float

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if name == "min_duration" and value == 0:
                continue
            if not (math.isfinite(value) and value > 0):
                raise ConfigurationError(f"{name} must be more than 0, got {value:g}")
        if not self.join_distance <= self.release_distance < self.side:
            raise ConfigurationError(
                f"join_distance {self.join_distance:g} m, release_distance "
                f"{self.release_distance:g} m and the side {self.side:g} m must come in this order"
            )
        if not self.join_angle <= self.release_angle < QUARTER / 2:
            raise ConfigurationError(
                f"join_angle {math.degrees(self.join_angle):g} deg and release_angle "
                f"{math.degrees(self.release_angle):g} deg must come in this order, below 45 deg"
            )

    @classmethod
    def completed(
        cls,
        side: float,
        join_distance: float | None,
        join_angle: float,
        release_distance: float | None,
        release_angle: float | None,
        min_duration: float,
        hold: float,
    ) -> JoinRules:
        """Return criteria of which some are left out: those of `JOIN_POLICY` stand in for them."""
        if join_distance is None:
            join_distance = JOIN_POLICY.join_distance * side
        if release_distance is None:
            release_distance = JOIN_POLICY.looser * join_distance
        if release_angle is None:
            release_angle = JOIN_POLICY.looser * join_angle
        return cls(
            side, join_distance, join_angle, release_distance, release_angle, min_duration, hold
        )


class Join(NamedTuple):
    """Two faces that were joined for a while."""

    blocks: tuple[int, int]
    """The blocks, the lower first."""
    faces: tuple[int, int]
    """Their faces, each in its block's own frame."""
    start: int
    """First sample at which they are joined."""
    stop: int
    """First sample at which they are not joined any more; the number of samples when to the end."""
    looseness: float
    """How badly they fit while joined: the median of the larger of distance and angle, each in
    units of the tolerance at which a join begins."""


class Poses(NamedTuple):
    """The recorded poses, shapes (time, block), and their time stamps."""

    time: Floats
    x: Floats
    y: Floats
    theta: Floats

    @property
    def seen(self) -> Bools:
        """Where the pose of a block is known."""
        return np.isfinite(self.x) & np.isfinite(self.y) & np.isfinite(self.theta)

    def pair(self, blocks: tuple[int, int], at: Integers) -> PairPoses:
        """Return two blocks at samples that show both."""
        i, j = blocks
        apart = np.stack([values[at, j] - values[at, i] for values in (self.x, self.y)])
        return PairPoses(self.time[at], apart, self.theta[at][:, blocks].T)


def find_joins(poses: Poses, rules: JoinRules) -> list[Join]:
    """Find all joins of a recording, in order of the blocks and of time."""
    seen = poses.seen
    return [
        join
        for blocks in combinations(range(seen.shape[1]), 2)
        for join in _joins_of_pair(poses, blocks, seen[:, blocks[0]] & seen[:, blocks[1]], rules)
    ]


def smallest_distance(poses: Poses) -> float:
    """Return the smallest distance that two centres ever had [m]; NaN when never seen together."""
    seen = poses.seen
    x, y = (np.where(seen, values, np.nan) for values in (poses.x, poses.y))
    smallest = math.inf
    for i, j in combinations(range(seen.shape[1]), 2):
        distance = np.hypot(x[:, j] - x[:, i], y[:, j] - y[:, i])
        smallest = min(smallest, float(np.fmin.reduce(distance, initial=math.inf)))
    return smallest if math.isfinite(smallest) else math.nan


class PairPoses(NamedTuple):
    """Two blocks at the samples (n,) that show both; the faces are (2, n) or (2, 1)."""

    time: Floats
    apart: Floats
    """From the centre of the first to the centre of the second, (2, n)."""
    theta: Floats
    """Orientations, (2, n)."""

    def nearest_faces(self) -> Integers:
        """Return the face of each block that looks most towards the other."""
        bearing = np.arctan2(self.apart[1], self.apart[0])
        towards = np.stack([bearing, bearing + np.pi]) - self.theta
        return np.rint(towards / QUARTER).astype(np.int64) % 4

    def lie(self, faces: Integers, side: float) -> Floats:
        """Return how the second face lies to the first: ahead, aside [m], turned [rad], (3, n)."""
        normal = self.theta + faces * QUARTER
        arms = 0.5 * side * np.stack([np.cos(normal), np.sin(normal)])
        x, y = self.apart + arms[:, 1] - arms[:, 0]
        cos, sin = np.cos(normal[0]), np.sin(normal[0])
        turned = np.remainder(normal[1] - normal[0], 2.0 * np.pi) - np.pi
        return np.stack([cos * x + sin * y, cos * y - sin * x, turned])

    def misfit(self, faces: Integers, side: float) -> tuple[Floats, Floats]:
        """Return distance [m] and angle [rad] between two faces."""
        ahead, aside, turned = self.lie(faces, side)
        return np.hypot(ahead, aside), np.abs(turned)


def _joins_of_pair(
    poses: Poses, blocks: tuple[int, int], both: Bools, rules: JoinRules
) -> Iterator[Join]:
    at = np.flatnonzero(both)
    pair = poses.pair(blocks, at)
    # The centres of blocks that fit are hardly farther apart than a side.
    if not (np.hypot(*pair.apart) <= rules.side + rules.join_distance).any():
        return
    nearest = pair.nearest_faces()
    distance, angle = pair.misfit(nearest, rules.side)
    fits = (distance <= rules.join_distance) & (angle <= rules.join_angle)
    kind = np.where(fits, 4 * nearest[0] + nearest[1], -1)
    start = first_streak(pair.time, kind, 0, rules)
    while start is not None:
        faces = nearest[:, start]
        distance, angle = pair.misfit(faces[:, None], rules.side)
        beyond = (distance > rules.release_distance) | (angle > rules.release_angle)
        stop = first_streak(pair.time, np.where(beyond, 0, -1), start, rules)
        looseness = np.maximum(distance / rules.join_distance, angle / rules.join_angle)
        yield Join(
            blocks,
            (int(faces[0]), int(faces[1])),
            int(at[start]),
            int(at[stop]) if stop is not None else len(poses.time),
            float(np.median(looseness[start:stop])),
        )
        start = None if stop is None else first_streak(pair.time, kind, stop, rules)


def first_streak(time: Floats, kind: Integers, begin: int, rules: JoinRules) -> int | None:
    """Return where the first streak of one kind (>= 0) begins that lasts for `min_duration`.

    A streak does not go on across a gap that is longer than `hold`.
    """
    if begin >= time.size:
        return None
    clock, value = time[begin:], kind[begin:]
    breaks = (np.diff(value) != 0) | (np.diff(clock) > rules.hold * (1 + ROUNDING))
    first = np.concatenate([[0], np.flatnonzero(breaks) + 1])
    last = np.append(first[1:] - 1, value.size - 1)
    enough = clock[last] - clock[first] >= rules.min_duration * (1 - ROUNDING)
    found = np.flatnonzero(enough & (value[first] >= 0))
    return begin + int(first[found[0]]) if found.size else None


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


class PlayPolicy(NamedTuple):
    """Which contacts of a recording are joins."""

    least: float = 0.02
    """Smallest play, in sides; chosen by hand: a lens bends the picture by as much."""
    moves: float = 2.0
    """Play in units of the median movement; chance, as white noise, is beyond it in one sample of
    3000."""
    taught: float = 0.9
    """Share of the joined samples that teach how faces lie; chosen by hand."""
    sure_s: float = 10.0
    """Time after which faces at rest are joined however they lie [s]; measured: longer than each
    passing contact of 40 simulated recordings of 300 s (6 s at most)."""


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
    return np.asarray(np.sqrt((lie**2).sum(axis=0)))


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
