"""Online observer of self-assembly: joins and the outcome class, frame by frame.

The rules, the lattice and the events are those of `driftwalk.classify`: an observer that has taken
every frame of a recording holds the joins and events that `classify` finds in it. Live, a join or a
parting is known when it has lasted for the shortest duration that counts, and is dated back.

**While some blocks are hidden** several classes are possible. Visible blocks constrain the classes:
blocks that are joined are one shape, and two shapes of seen blocks that do not fit on a common
lattice are not one. Hidden blocks may be anywhere: alone, joined to each other, on any free cell
next to a shape, or between two shapes that do fit. The set holds every class that can be, so the
true one is always in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from driftwalk.assembly import class_name, classify, outcome_classes
from driftwalk.assembly.lattice.join_history import Event, JoinHistory, LatticeWorld
from driftwalk.assembly.lattice.joined_faces import (
    JOIN_ANGLE,
    JOIN_POLICY,
    QUARTER,
    ROUNDING,
    Join,
    JoinRules,
    PairPoses,
)
from driftwalk.assembly.lattice.polyomino import Chirality, name_of, neighbours, require_chirality
from driftwalk.assembly.outcomes.outcome_classes import MOST_BLOCKS
from driftwalk.core.errors import InputError
from driftwalk.schema.check import described
from driftwalk.schema.shapes import Cell, moved_to_origin

if TYPE_CHECKING:
    import xarray as xr

Pose = tuple[float, float, float]


class SeenEvent(NamedTuple):
    """Two assemblies that became one, or one that became two."""

    time: float
    """When it began [s]; it was known only later."""
    kind: str
    """"join" or "split"."""
    bodies: tuple[str, str]
    """The blocks whose faces joined or came apart."""
    faces: tuple[int, int]
    """Those faces, 0 to 3, in the blocks' own frames."""
    outcome: str
    """Outcome class afterwards."""


class AssemblySeen(NamedTuple):
    """State of knowledge at a frame."""

    time: float
    """Time [s]."""
    joined: list[tuple[str, int, str, int]]
    """Faces that are joined: block, face, block, face."""
    outcome: str
    """Outcome class; empty while a block is hidden."""
    possible: frozenset[str]
    """Classes that are possible: one, or several while a block is hidden. Empty: nothing is known,
    as of more than eight blocks with more than three hidden."""
    hidden: list[str]
    """Blocks that have not been seen for longer than a gap is bridged."""
    events: list[SeenEvent]
    """Events that became known with this frame."""


class _Look(NamedTuple):
    """One frame that shows both blocks."""

    sample: int
    time: float
    pair: PairPoses
    kind: int
    """4 times the face of the first block plus that of the second, -1 when they do not fit."""


class PairState:
    """Two blocks from frame to frame, by the rules of `driftwalk.classify`.

    Faces join when they have fitted for the shortest duration, they part when they have been beyond
    the looser tolerances for as long, and both are dated back to where that began.

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
        if self.faces is not None:
            self._look_for_parting(look)
            return
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


class AssemblyObserver:
    """Watches blocks assemble, frame by frame.

    Parameters
    ----------
    bodies : sequence of str or int
        Names of all blocks, seen or not; or how many there are: then they are named as they come.
    side : float
        Side of a block [m].
    chirality : {"merged", "distinct"}
        Whether mirror images are one shape or two.
    join_distance, join_angle, release_distance, release_angle, min_duration, hold : float, optional
        As in `driftwalk.classify` [m, rad, s].

    Raises
    ------
    InputError
        When there is no block, or chirality is another word.

    Examples
    --------
    >>> observer = AssemblyObserver(["0", "1"], side=0.03)
    >>> for frame in range(10):
    ...     seen = observer.step(0.1 * frame, {"0": (0.0, 0.0, 0.0), "1": (0.03, 0.0, 0.0)})
    >>> seen.outcome, seen.joined
    ('2', [('0', 0, '1', 2)])
    """

    def __init__(
        self,
        bodies: Sequence[str] | int,
        *,
        side: float,
        chirality: Chirality = "merged",
        join_distance: float | None = None,
        join_angle: float = JOIN_ANGLE,
        release_distance: float | None = None,
        release_angle: float | None = None,
        min_duration: float = JOIN_POLICY.min_duration_s,
        hold: float = JOIN_POLICY.hold_s,
    ) -> None:
        require_chirality(chirality)
        names = [f"unseen {i}" for i in range(bodies)] if isinstance(bodies, int) else list(bodies)
        if not names:
            raise InputError("there is no block to observe")
        self.rules = JoinRules.completed(
            side, join_distance, join_angle, release_distance, release_angle, min_duration, hold
        )
        self.bodies = names
        self._unnamed = list(range(bodies)) if isinstance(bodies, int) else []
        self.chirality = chirality
        self._times: list[float] = []
        self._pose: dict[int, Pose] = {}
        self._seen: dict[int, float] = {}
        self._pairs = [PairState(pair, self.rules) for pair in combinations(range(len(names)), 2)]
        self._history = self._replayed([])
        self._state: list[tuple[tuple[int, int], tuple[int, int], int, int]] = []
        self._told: set[tuple[str, int, tuple[int, int]]] = set()

    def step(self, time: float, poses: Mapping[str, Pose]) -> AssemblySeen:
        """Take the poses of a frame.

        Parameters
        ----------
        time : float
            Time [s], later than before.
        poses : mapping
            From the name of each block that is seen to x, y [m] and theta [rad]; one without an
            angle is not seen.

        Returns
        -------
        AssemblySeen
            Who is joined now, the classes that are possible, and what has become known.

        Raises
        ------
        InputError
            When a block is seen that is none of the bodies.
        """
        sample = len(self._times)
        self._times.append(time)
        self._name(poses)
        place = {name: index for index, name in enumerate(self.bodies)}
        now = {place[name]: pose for name, pose in poses.items() if all(map(math.isfinite, pose))}
        self._pose.update(now)
        self._seen.update(dict.fromkeys(now, time))
        for pair in self._pairs:
            one, other = pair.blocks
            if one in now and other in now:
                pose = np.array([now[one], now[other]]).T
                apart = pose[:2, 1:] - pose[:2, :1]
                pair.step(sample, PairPoses(np.array([time]), apart, pose[2][:, None]))
        joins = self._joins()
        # Joins that hold end with the last sample, which tells nothing new.
        state = [
            (join.blocks, join.faces, join.start, join.stop if join.stop <= sample else -1)
            for join in joins
        ]
        if state != self._state or sample == 0:
            self._state, self._history = state, self._replayed(joins)
        events = self._news()
        active = [join for join in joins if join.stop > sample]
        limit, every = self.rules.hold * (1.0 + ROUNDING), range(len(self.bodies))
        hidden = [at for at in every if not time - self._seen.get(at, -math.inf) <= limit]
        outcome = "" if hidden else self._history.outcome[-1]
        names = self.bodies
        return AssemblySeen(
            time,
            [(names[j.blocks[0]], j.faces[0], names[j.blocks[1]], j.faces[1]) for j in active],
            outcome,
            frozenset({outcome}) if not hidden else self._possible(active, hidden),
            [names[block] for block in hidden],
            events,
        )

    def _name(self, poses: Mapping[str, Pose]) -> None:
        """Name blocks that are seen for the first time."""
        for name in sorted(poses.keys() - set(self.bodies)):
            if not self._unnamed:
                raise InputError(
                    f"block '{name}' is seen, but there are {len(self.bodies)} others already"
                )
            self.bodies[self._unnamed.pop(0)] = name

    def _replayed(self, joins: Sequence[Join]) -> JoinHistory:
        shape = (max(1, len(self._times)), len(self.bodies))
        return JoinHistory(shape, joins, chirality=self.chirality)

    def events(self) -> list[SeenEvent]:
        """Return all events up to now, in order of time, as `driftwalk.classify` finds them.

        Where two pairs of faces join at once, this may name the other pair than `step` did at the
        time: the one that fits best counts, and that takes a while to tell.
        """
        self._history = self._replayed(self._joins())
        return [self._seen_event(kind, event) for kind, event in self._found()]

    def _joins(self) -> list[Join]:
        return [join for pair in self._pairs for join in pair.joins(len(self._times))]

    def _found(self) -> list[tuple[str, Event]]:
        found = [("split", event) for event in self._history.split]
        found += [("join", event) for event in self._history.joined]
        return sorted(found, key=lambda item: item[1].sample)

    def _seen_event(self, kind: str, event: Event) -> SeenEvent:
        one, other = (self.bodies[block] for block in event.blocks)
        return SeenEvent(self._times[event.sample], kind, (one, other), event.faces, event.outcome)

    def _news(self) -> list[SeenEvent]:
        """Return the events that were not reported before, in order of time."""
        new = [item for item in self._found() if _identity(*item) not in self._told]
        self._told.update(_identity(*item) for item in new)
        return [self._seen_event(*item) for item in new]

    def _possible(self, active: Sequence[Join], hidden: Sequence[int]) -> frozenset[str]:
        seen = [join for join in active if not set(join.blocks) & set(hidden)]
        lattices = self._common_lattices(LatticeWorld(len(self.bodies), seen), hidden)
        return possible_classes(lattices, len(hidden), chirality=self.chirality)

    def _common_lattices(self, world: LatticeWorld, hidden: Sequence[int]) -> list[Lattice]:
        """Return the assemblies of seen blocks, those that fit on a common lattice together."""
        slack = len(hidden) + 1
        found: list[tuple[int, Lattice]] = []
        for label in sorted(set(world.partition.labels) - set(hidden)):
            members = world.partition.members(label)
            for root, lattice in found:
                cells = self._on_lattice(world, root, members, slack)
                if cells is not None and not set(cells) & lattice.keys():
                    lattice.update(dict.fromkeys(cells, label))
                    break
            else:
                found.append((label, {world.cell[block]: label for block in members}))
        return [lattice for _, lattice in found]

    def _on_lattice(
        self, world: LatticeWorld, root: int, members: Sequence[int], slack: int
    ) -> list[tuple[int, int]] | None:
        """Return the cells of some blocks on the lattice of another one; None if they fit none."""
        x, y, theta = self._pose[root]
        axis = theta - world.quarter[root] * QUARTER
        cells = []
        for block in members:
            turned = (self._pose[block][2] - axis) / QUARTER
            if abs(turned - round(turned)) * QUARTER > slack * self.rules.release_angle:
                return None
            dx, dy = self._pose[block][0] - x, self._pose[block][1] - y
            along = (math.cos(axis) * dx + math.sin(axis) * dy) / self.rules.side
            across = (math.cos(axis) * dy - math.sin(axis) * dx) / self.rules.side
            cell = round(along), round(across)
            off = math.hypot(along - cell[0], across - cell[1]) * self.rules.side
            if off > slack * self.rules.release_distance:
                return None
            cells.append((cell[0] + world.cell[root][0], cell[1] + world.cell[root][1]))
        return cells


def observe(recording: xr.Dataset, *, side: float, **rules: Any) -> xr.Dataset:
    """Classify a recording, and say which classes are possible where a block is hidden.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory` of all blocks, with orientation.
    side : float
        Side of a block [m].
    **rules
        As in `driftwalk.classify`.

    Returns
    -------
    xarray.Dataset
        As from `classify`, with the same classes and events as a simulated run, and
        ``possible`` (time, class): whether the class is possible, and ``hidden`` (time): how many
        blocks are hidden. With more than three no class is excluded; of more than eight blocks
        the classes are not listed then, none is marked, and that means that nothing is known.

    Raises
    ------
    InputError
        As in `driftwalk.classify`.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> time = 0.1 * np.arange(30)
    >>> x = np.tile([0.0, 0.06], (30, 1))
    >>> x[12:, 1] = np.nan
    >>> recording = build_trajectory(time, x, 0 * x, 0 * x)
    >>> found = observe(recording, side=0.03)
    >>> found["class"].values.tolist(), found["possible"].values[[0, -1]].tolist()
    (['2', '1+1'], [[False, True], [True, True]])
    """
    found = classify(recording, side=side, **rules)
    names = [str(name) for name in found["body"].values]
    # How long joins are held may depend on the recording; the other rules have one default.
    observer = AssemblyObserver(names, side=side, **{**rules, "hold": found.attrs["hold_s"]})
    poses = np.stack([recording[name].values for name in ("x", "y", "theta")], axis=-1)
    seen = [
        observer.step(
            float(time), {name: tuple(pose) for name, pose in zip(names, row, strict=True)}
        )
        for time, row in zip(recording["time"].values, poses, strict=True)
    ]
    sets = [one.possible for one in seen]
    hidden = np.array([len(one.hidden) for one in seen])
    outcome = found["outcome"].values
    classes = [str(name) for name in found["class"].values]
    # Beyond eight blocks `classify` lists what occurred; what is merely possible is added.
    if further := sorted(set().union(*sets) - set(classes)):
        classes += further
        # Of a class in which the world was not for certain, no rate is known.
        unseen = {"proportion": 0.0}
        for name in ("joining", "parting"):
            unseen |= {f"{name}_count": 0, f"{name}_rate_low": 0.0, f"{name}_rate_high": np.inf}
        found = found.reindex({"class": list(classes)}, fill_value=unseen)
    possible = np.array([[name in one for name in classes] for one in sets])
    known = outcome >= 0
    possible[known] = np.arange(len(classes)) == outcome[known, None]
    return described(found.assign(possible=(("time", "class"), possible), hidden=("time", hidden)))


def _identity(kind: str, event: Event) -> tuple[str, int, tuple[int, int]]:
    """Return what stays the same of an event when later frames show which faces fit best."""
    return kind, event.sample, event.assemblies if kind == "join" else event.blocks


Lattice = dict[Cell, int]
"""From a cell to the assembly whose block stands there."""


def possible_classes(
    lattices: Sequence[Lattice], hidden: int, *, chirality: Chirality
) -> frozenset[str]:
    """Return the outcome classes that are possible.

    Parameters
    ----------
    lattices : sequence of dict
        For each set of assemblies that fit on a common lattice, their cells there.
    hidden : int
        Number of blocks that are not seen.
    chirality : {"merged", "distinct"}
        Whether mirror images are one shape or two.

    Returns
    -------
    frozenset of str
        Names of the classes. Empty: nothing is known, which is said of more than eight blocks with
        more than three hidden.

    Examples
    --------
    >>> pair = {(0, 0): 0, (1, 0): 0}
    >>> sorted(possible_classes([pair], 1, chirality="merged"))
    ['2+1', 'I3', 'L3']
    """
    blocks = hidden + sum(len(lattice) for lattice in lattices)
    # With more than three hidden blocks, no class is excluded.
    if hidden > 3:
        listed = blocks <= MOST_BLOCKS
        return frozenset(outcome_classes(blocks, chirality=chirality) if listed else ())
    frozen = tuple(tuple(sorted(lattice.items())) for lattice in lattices)
    return _enumerated(frozen, hidden, chirality)


@lru_cache(maxsize=256)
def _enumerated(
    frozen: tuple[tuple[tuple[Cell, int], ...], ...], hidden: int, chirality: Chirality
) -> frozenset[str]:
    lattices = [dict(items) for items in frozen]
    found = set()
    for placed in range(hidden + 1):
        apart = hidden - placed
        others = outcome_classes(apart, chirality=chirality) if apart else ("",)
        for cells in _placements(lattices, placed):
            shapes = list(_shapes(lattices, cells, chirality))
            for other in others:
                found.add(class_name([*shapes, *filter(None, other.split("+"))]))
    return frozenset(found)


def _placements(lattices: Sequence[Lattice], number: int) -> Iterable[frozenset[tuple[int, Cell]]]:
    """Return all sets of free cells that hidden blocks may occupy, each next to another block."""
    found: set[frozenset[tuple[int, Cell]]] = {frozenset()}
    for _ in range(number):
        found = {cells | {new} for cells in found for new in _free_cells(lattices, cells)}
    return found


def _free_cells(
    lattices: Sequence[Lattice], cells: frozenset[tuple[int, Cell]]
) -> set[tuple[int, Cell]]:
    return {
        (place, next_to)
        for place, lattice in enumerate(lattices)
        for cell in [*lattice, *(cell for at, cell in cells if at == place)]
        for next_to in neighbours((cell,))
        if next_to not in lattice and (place, next_to) not in cells
    }


def _shapes(
    lattices: Sequence[Lattice], cells: frozenset[tuple[int, Cell]], chirality: Chirality
) -> Iterator[str]:
    """Give the shape of each assembly, hidden blocks at the cells given."""
    for place, lattice in enumerate(lattices):
        left = {**lattice, **{cell: -1 for at, cell in cells if at == place}}
        while left:
            yield name_of(moved_to_origin(tuple(_connected(left))), chirality)


def _connected(left: Lattice) -> list[Cell]:
    """Take one connected assembly out of the cells that are left."""
    first = next(iter(left))
    found = [(first, left.pop(first))]
    for cell, assembly in found:  # it grows
        beside = neighbours((cell,))
        for other, label in list(left.items()):
            # Seen blocks of two assemblies side by side are not joined: that would have been seen.
            if label == assembly >= 0 or (other in beside and -1 in (assembly, label)):
                found.append((other, left.pop(other)))
    return [cell for cell, _ in found]
