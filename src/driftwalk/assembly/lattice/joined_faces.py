"""Joined faces of recorded blocks, with start and end, and typed faces as tables of numbers.

Two faces fit when their centres are near each other and they look at each other. A join begins
where they fit without a break for the shortest duration that counts, and it ends where they are
beyond a looser pair of tolerances for as long; both are dated back to the first such sample. So one
noisy sample neither makes a join nor ends one.

The tables of typed faces are for the native core, and to follow the kinds of blocks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.errors import ConfigurationError

if TYPE_CHECKING:
    from driftwalk.model import Assembly


QUARTER: Final = math.pi / 2
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
    """From the centre of the first to that of the second, (2, n)."""
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
) -> list[Join]:
    at = np.flatnonzero(both)
    pair = poses.pair(blocks, at)
    # The centres of blocks that fit are hardly farther apart than a side.
    if not (np.hypot(*pair.apart) <= rules.side + rules.join_distance).any():
        return []
    nearest = pair.nearest_faces()
    distance, angle = pair.misfit(nearest, rules.side)
    fits = (distance <= rules.join_distance) & (angle <= rules.join_angle)
    kind = np.where(fits, 4 * nearest[0] + nearest[1], -1)
    joins = []
    start = first_streak(pair.time, kind, 0, rules)
    while start is not None:
        faces = nearest[:, start]
        distance, angle = pair.misfit(faces[:, None], rules.side)
        beyond = (distance > rules.release_distance) | (angle > rules.release_angle)
        stop = first_streak(pair.time, np.where(beyond, 0, -1), start, rules)
        looseness = np.maximum(distance / rules.join_distance, angle / rules.join_angle)
        joins.append(
            Join(
                blocks,
                (int(faces[0]), int(faces[1])),
                int(at[start]),
                int(at[stop]) if stop is not None else len(poses.time),
                float(np.median(looseness[start:stop])),
            )
        )
        start = None if stop is None else first_streak(pair.time, kind, stop, rules)
    return joins


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
