"""Replay the events of simulated runs on the lattice, all runs side by side.

The native core gives, for each event, the two blocks and the faces that joined. Everything else
follows: which assemblies they were, what shapes these had, and the outcome class of the world.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.joined_faces import (
    CLOSING,
    JOINING,
    OPENING,
    PARTING,
    BondGraph,
    FaceTable,
)
from driftwalk.assembly.lattice.many_blocks import (
    DiscWorld,
    Names,
    ReplayedEvents,
    SquareWorld,
    replay_many,
)
from driftwalk.assembly.lattice.polyomino import Chirality, name_of, require_chirality
from driftwalk.assembly.outcomes.outcome_classes import (
    class_name,
    contact_pairs,
    listed_classes,
    listed_shapes,
)
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.schema.shapes import MOST_NAMED, STEPS, all_single, moved_to_origin


def replay_events(
    event_count: npt.ArrayLike,
    event_block: npt.ArrayLike,
    event_face: npt.ArrayLike,
    *,
    cell: npt.ArrayLike,
    quarter: npt.ArrayLike,
    assembly: npt.ArrayLike,
    event_kind: npt.ArrayLike | None = None,
    chirality: Chirality = "merged",
    faces: FaceTable | None = None,
) -> ReplayedEvents:
    """Replay the events of simulated runs on the lattice.

    Parameters
    ----------
    event_count : array_like of int, shape (runs,)
        Number of events of each run.
    event_block : array_like of int, shape (runs, events, 2)
        The blocks whose faces joined, first that of the assembly that stayed.
    event_face : array_like of int, shape (runs, events, 2)
        The faces, 0 to 3, in the blocks' own frames.
    cell : array_like of int, shape (runs, blocks, 2)
        Cells at the end, on any lattice of their assembly.
    quarter : array_like of int, shape (runs, blocks)
        Quarter turns of the blocks at the end, on the same lattice.
    assembly : array_like of int, shape (runs, blocks)
        Lowest block of the assembly of each block at the end.
    event_kind : array_like of int, shape (runs, events), optional
        0 joining; 1 parting, of the two blocks whose bond broke; 2 a bond of a loop broke; 3 one
        formed. Default: all are joinings.
    chirality : {"merged", "distinct"}
        Whether mirror images are one shape or two.
    faces : FaceTable, optional
        Rules of typed faces; default: every face latches with every other.

    Returns
    -------
    ReplayedEvents
        Assemblies, shapes and classes.

    Raises
    ------
    InputError
        When shapes disagree, an event cannot be (a face of no block, two blocks of one assembly, a
        cell taken twice, faces whose types do not latch), or the events do not lead to the state at
        the end; names the run.

    Examples
    --------
    >>> made = replay_events(
    ...     [1], [[[0, 1]]], [[[0, 2]]],
    ...     cell=[[(0, 0), (1, 0)]], quarter=[[0, 0]], assembly=[[0, 0]],
    ... )
    >>> made.classes[made.outcome[0]]
    '2'
    """
    require_chirality(chirality)
    events = _Events(
        _whole(event_count), _whole(event_block), _whole(event_face), _kinds(event_kind)
    )
    end = _Lattice(*map(_whole, (cell, quarter, assembly)))
    _check_arrays(events, end)
    blocks = end.assembly.shape[1]
    kind = None if faces is None else _follow_kinds(events, faces, end.assembly.shape)
    if blocks > MOST_NAMED:
        many = _replay_many(events, end, lambda _: SquareWorld(blocks, chirality))
        return many._replace(kind=kind)
    replay = _Replay(end.assembly.shape, events, chirality)
    return replay.result(events, end)._replace(kind=kind)


def replay_contacts(
    event_count: npt.ArrayLike,
    event_block: npt.ArrayLike,
    *,
    pose: Floats,
    assembly: npt.ArrayLike,
    diameter: float,
    width: float | None = None,
    event_kind: npt.ArrayLike | None = None,
) -> ReplayedEvents:
    """Replay the events of simulated runs of discs or rectangles, which have no lattice.

    Parameters
    ----------
    event_count, event_block, assembly, event_kind
        As in `replay_events`. Without kinds the contacts are those of the poses at the end, with
        them those that the events tell.
    pose : ndarray, shape (runs, blocks, 2 or more)
        Columns x and y at the end [m]; of rectangles the third is theta [rad].
    diameter, width
        As in `driftwalk.assembly.outcomes.outcome_classes.contact_pairs`.

    Raises
    ------
    InputError
        As `replay_events`.

    Examples
    --------
    >>> row = np.array([[[0.0, 0.0], [0.04, 0.0], [0.08, 0.0]]])
    >>> made = replay_contacts([2], [[[0, 1], [0, 2]]], pose=row, assembly=[[0] * 3], diameter=0.04)
    >>> made.classes[made.outcome[0]], [made.shapes[part] for part in made.event_shape[0, 1]]
    ('chain3', ['2', '1', 'chain3'])
    """
    block, labels = _whole(event_block), _whole(assembly)
    events = _Events(_whole(event_count), block, np.zeros_like(block), _kinds(event_kind))
    end = _Lattice(np.zeros((*labels.shape, 2), np.int64), np.zeros_like(labels), labels)
    _check_arrays(events, end)
    noun = "discs" if width is None else "rectangles"

    def world_of(run: int) -> DiscWorld:
        told = events.kind is not None
        pairs = [] if told else contact_pairs(pose[run], diameter=diameter, width=width)
        return DiscWorld(pose.shape[1], pairs, noun=noun)

    return _replay_many(events, end, world_of)


def _replay_many(
    events: _Events, end: _Lattice, world_of: Callable[[int], SquareWorld]
) -> ReplayedEvents:
    found, state = replay_many(*events, blocks=end.assembly.shape[1], world_of=world_of)
    _check_end(_Lattice(*state), end)
    return found


def _follow_kinds(events: _Events, faces: FaceTable, shape: tuple[int, ...]) -> Integers:
    """Return the kinds of the blocks at the end, and refuse faces that may not latch."""
    kind = np.broadcast_to(faces.first_kinds(shape[1]), shape).copy()
    for event in range(int(events.number.max(initial=0))):
        at = np.flatnonzero(events.number > event)
        if events.kind is not None:
            at = at[events.kind[at, event] == JOINING]
        pair = at[:, None], events.block[at, event]
        holds, became = faces.latch(kind[pair], events.face[at, event])
        _refuse(~holds, at, event, "joins two faces whose types do not latch")
        kind[pair] = became
    return kind


class _Events(NamedTuple):
    number: Integers
    block: Integers
    face: Integers
    kind: Integers | None


class _Lattice(NamedTuple):
    """Where the blocks of many runs are: (run, block[, 2])."""

    cell: Integers
    quarter: Integers
    assembly: Integers


class _Replay:
    """The state of the squares of all runs while their events are applied."""

    def __init__(self, shape: tuple[int, ...], events: _Events, chirality: Chirality) -> None:
        runs, blocks = shape
        slots = events.block.shape[1]
        self.bonds = None if events.kind is None else BondGraph(runs, blocks)
        self.chirality = chirality
        self.blocks = blocks
        self.lattice = _Lattice(
            np.zeros((runs, blocks, 2), dtype=np.int64),
            np.zeros((runs, blocks), dtype=np.int64),
            np.tile(np.arange(blocks), (runs, 1)),
        )
        self.shapes, self.classes = Names("1"), Names(all_single(blocks))
        # The number of the shape at the lowest block of each assembly, -1 at the other blocks.
        self.shape_of = np.zeros((runs, blocks), dtype=np.int64)
        self.event_assembly = np.full((runs, slots, 2), -1, dtype=np.int32)
        self.event_shape = np.full((runs, slots, 3), -1, dtype=np.int32)
        self.event_class = np.full((runs, slots), -1, dtype=np.int32)
        self.outcome = np.zeros(runs, dtype=np.int32)

    def apply(self, event: int, at: Integers, events: _Events) -> None:
        """Apply the event of this number to the runs that have it."""
        if self.bonds is None or events.kind is None:
            self._join(event, at, events)
            return
        kind = events.kind[at, event]
        for number, change in ((JOINING, self._join), (PARTING, self._part)):
            if (kind == number).any():
                change(event, at[kind == number], events)
        for number in (JOINING, OPENING, CLOSING):
            own = at[kind == number]
            self.bonds.put(own, events.block[own, event], number != OPENING)
        loop = at[kind >= OPENING]
        labels = self.lattice.assembly[loop]
        self.event_assembly[loop, event] = np.take_along_axis(
            labels, events.block[loop, event], axis=1
        )
        self.event_class[loop, event] = self.outcome[loop]

    def _join(self, event: int, at: Integers, events: _Events) -> None:
        labels = self.lattice.assembly[at]
        own = np.take_along_axis(labels, events.block[at, event], axis=1)
        _refuse(own[:, 0] == own[:, 1], at, event, "joins two blocks of one assembly")
        self.event_assembly[at, event] = own
        self.event_shape[at, event, :2] = np.take_along_axis(self.shape_of[at], own, axis=1)
        self._align(at, events.block[at, event], events.face[at, event])
        low, high = own.min(axis=1), own.max(axis=1)
        member = (labels == low[:, None]) | (labels == high[:, None])
        self.lattice.assembly[at] = np.where(member, low[:, None], labels)
        became = self._shape_numbers(at, event, member)
        self.shape_of[at, high] = -1
        self.shape_of[at, low] = became
        self.event_shape[at, event, 2] = became
        self.outcome[at] = self.event_class[at, event] = self._class_numbers(at)

    def _part(self, event: int, at: Integers, events: _Events) -> None:
        """Cut an assembly of each run where a bond of it breaks."""
        if self.bonds is None:
            return
        block, labels = events.block[at, event], self.lattice.assembly[at]
        own = np.take_along_axis(labels, block, axis=1)
        self.bonds.put(at, block, False)
        first = self.bonds.reached(at, block[:, 0])
        whole = np.take_along_axis(first, block[:, 1:], axis=1)[:, 0] | (own[:, 0] != own[:, 1])
        _refuse(whole, at, event, "parts two blocks that are not held by that bond alone")
        self.event_shape[at, event, 2] = self.shape_of[at, own[:, 0]]
        for side, member in enumerate((first, (labels == own[:, :1]) & ~first)):
            lowest = member.argmax(axis=1)
            self.lattice.assembly[at] = np.where(member, lowest[:, None], self.lattice.assembly[at])
            shape = self._shape_numbers(at, event, member)
            self.shape_of[at, lowest] = shape
            self.event_assembly[at, event, side] = lowest
            self.event_shape[at, event, side] = shape
        self.outcome[at] = self.event_class[at, event] = self._class_numbers(at)

    def result(self, events: _Events, end: _Lattice) -> ReplayedEvents:
        """Apply all events, and return what they did; refuse those that lead elsewhere."""
        for event in range(int(events.number.max(initial=0))):
            self.apply(event, np.flatnonzero(events.number > event), events)
        _check_end(self.lattice, end)
        shapes = listed_shapes(self.shapes.known, self.blocks, chirality=self.chirality)
        classes = listed_classes(self.classes.known, self.blocks, chirality=self.chirality)
        shape_index, class_index = self.shapes.index_into(shapes), self.classes.index_into(classes)
        return ReplayedEvents(
            self.event_assembly,
            shape_index[self.event_shape],
            class_index[self.event_class],
            class_index[self.outcome],
            classes,
            shapes,
        )

    def _align(self, at: Integers, block: Integers, face: Integers) -> None:
        """Turn and shift the assemblies that move so that the two faces of each event coincide."""
        cell, quarter, labels = (array[at] for array in self.lattice)
        row = np.arange(at.size)
        stays, moves = block.T
        outward = (face[:, 0] + quarter[row, stays]) % 4
        turn = outward + 2 - face[:, 1] - quarter[row, moves]
        moved = labels == labels[row, moves][:, None]
        arm = rotate(cell - cell[row, moves][:, None], turn[:, None])
        there = arm + (cell[row, stays] + np.array(STEPS)[outward])[:, None]
        self.lattice.cell[at] = np.where(moved[..., None], there, cell)
        self.lattice.quarter[at] = np.where(moved, (quarter + turn[:, None]) % 4, quarter)

    def _shape_numbers(self, at: Integers, event: int, member: Bools) -> Integers:
        """Return the numbers of the shapes that the members of each run make up."""
        cell, far = self.lattice.cell[at], 2 * self.blocks
        lowest = np.where(member[..., None], cell, cell.max(initial=0) + 1).min(axis=1)
        place = cell - lowest[:, None]
        codes = np.where(member, place[..., 0] * far + place[..., 1], far * far)
        codes.sort(axis=1)
        twice = (np.diff(codes, axis=1) == 0) & (codes[:, 1:] < far * far)
        _refuse(twice.any(axis=1), at, event, "puts two blocks into one cell")
        codes, inverse = np.unique(codes, axis=0, return_inverse=True)
        numbers = []
        for row in codes:
            cells = tuple(divmod(code, far) for code in row[row < far * far].tolist())
            name = name_of(moved_to_origin(cells), self.chirality)
            numbers.append(self.shapes.number(name))
        return np.array(numbers, dtype=np.int64)[inverse.reshape(-1)]

    def _class_numbers(self, at: Integers) -> npt.NDArray[np.int32]:
        """Return the numbers of the outcome classes of the runs."""
        present = np.sort(self.shape_of[at], axis=1)
        worlds, inverse = np.unique(present, axis=0, return_inverse=True)
        names = list(self.shapes.known)
        numbers = [
            self.classes.number(class_name(names[shape] for shape in row[row >= 0].tolist()))
            for row in worlds
        ]
        return np.array(numbers, dtype=np.int32)[inverse.reshape(-1)]


def rotate(cell: Integers, turn: Integers) -> Integers:
    """Turn cells (..., 2) by quarters (...) about the origin."""
    x, y = cell[..., 0], cell[..., 1]
    turns = [(x, y), (-y, x), (-x, -y), (y, -x)]
    return np.stack([np.choose(turn % 4, [pair[axis] for pair in turns]) for axis in (0, 1)], -1)


def _whole(values: npt.ArrayLike) -> Integers:
    array = np.asarray(values)
    if array.dtype.kind not in "iu":
        raise InputError(f"events and cells are whole numbers, got {array.dtype}")
    return array.astype(np.int64)


def _kinds(values: npt.ArrayLike | None) -> Integers | None:
    return None if values is None else _whole(values)


def _check_arrays(events: _Events, end: _Lattice) -> None:
    runs, blocks = end.assembly.shape if end.assembly.ndim == 2 else (-1, -1)
    slots = events.block.shape[1] if events.block.ndim == 3 else -1
    wanted = [(runs,), (runs, slots, 2), (runs, slots, 2), (runs, blocks, 2), (runs, blocks)]
    found = [array.shape for array in (*events[:3], *end)]
    kinds = [] if events.kind is None else [events.kind.shape]
    if found[:-1] != wanted or blocks < 1 or kinds not in ([], [(runs, slots)]):
        raise InputError(f"the events and the cells of runs do not fit together: shapes {found}")
    most = min(slots, blocks - 1) if events.kind is None else slots
    wrong = (events.number < 0) | (events.number > most)
    if wrong.any():
        run = int(np.argmax(wrong))
        raise InputError(f"run {run}: {events.number[run]} events among {blocks} blocks")
    real = np.arange(slots) < events.number[:, None]
    numbers = [("block", events.block, blocks), ("face", events.face, 4)]
    if events.kind is not None:
        numbers.append(("kind", events.kind[..., None], CLOSING + 1))
    for what, values, limit in numbers:
        bad = real[..., None] & ((values < 0) | (values >= limit))
        if bad.any():
            run, event, side = map(int, np.argwhere(bad)[0])
            raise InputError(f"run {run}, event {event}: no {what} {values[run, event, side]}")


def _check_end(replayed: _Lattice, end: _Lattice) -> None:
    """Refuse a state at the end that differs by more than a motion of whole assemblies."""
    differs = replayed.assembly != end.assembly
    if not differs.any():
        (cell, quarter), (end_cell, end_quarter) = _from_lowest(replayed), _from_lowest(end)
        differs = (cell != end_cell).any(axis=2) | (quarter != end_quarter)
    if differs.any():
        run, block = map(int, np.argwhere(differs)[0])
        raise InputError(f"run {run}: the events do not lead block {block} to where it is")


def _from_lowest(lattice: _Lattice) -> tuple[Integers, Integers]:
    """Return cells and quarters as seen from the lowest block of each assembly."""
    lowest = lattice.assembly
    origin = np.take_along_axis(lattice.cell, lowest[..., None], axis=1)
    turned = np.take_along_axis(lattice.quarter, lowest, axis=1)
    return rotate(lattice.cell - origin, -turned), (lattice.quarter - turned) % 4


def _refuse(wrong: Bools, at: Integers, event: int, what: str) -> None:
    if wrong.any():
        raise InputError(f"run {at[int(np.argmax(wrong))]}, event {event}: {what}")
