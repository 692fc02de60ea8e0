"""Replay the events of simulated runs on the lattice, and refuse those that cannot be.

The native core gives, for each event, the two blocks and the faces that joined. Everything else
follows: which assemblies they were, what shapes these had, and the outcome class of the world.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.joined_faces import CLOSING, JOINING, OPENING, FaceTable
from driftwalk.assembly.lattice.polyomino import Chirality, require_chirality
from driftwalk.assembly.lattice.replayed_worlds import DiscWorld, SquareWorld
from driftwalk.assembly.outcomes.outcome_classes import (
    class_name,
    contact_pairs,
    listed_classes,
    listed_shapes,
)
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.schema.shapes import MOST_NAMED, all_single, counted_class


class ReplayedEvents(NamedTuple):
    """Results of the events of some runs; -1 where a run had no such event."""

    event_assembly: npt.NDArray[np.int32]
    """Lowest block of the assembly that stayed and of the one that moved, (run, event, side); of a
    parting of the two parts."""
    event_shape: npt.NDArray[np.int32]
    """Shapes of the two and of what they became, (run, event, part): indices into `shapes`. Of a
    parting those of the two parts and of what they were; -1 where only a bond of a loop changed."""
    event_class: npt.NDArray[np.int32]
    """Outcome class of the world after the event, (run, event): an index into `classes`."""
    outcome: npt.NDArray[np.int32]
    """Outcome class at the end, (run,): an index into `classes`."""
    classes: tuple[str, ...]
    """Names of the classes: all for up to 8 blocks, beyond that those that occurred."""
    shapes: tuple[str, ...]
    """Names of the shapes, by the same rule."""
    kind: Integers | None = None
    """Kinds of the blocks at the end, (run, block); None where faces have no types."""


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
    found = _replayed(events, end, chirality, lambda _: SquareWorld(blocks, chirality))
    return found._replace(kind=kind)


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

    return _replayed(events, end, None, world_of)


def _replayed(
    events: _Events,
    end: _Lattice,
    chirality: Chirality | None,
    world_of: Callable[[int], SquareWorld],
) -> ReplayedEvents:
    """Return what the events did, run after run; each begins in its own world."""
    runs, slots = events.block.shape[:2]
    blocks = end.assembly.shape[1]
    cell = np.zeros((runs, blocks, 2), dtype=np.int64)
    quarter, assembly = (np.zeros((runs, blocks), dtype=np.int64) for _ in range(2))
    shapes, classes = _Names("1"), _Names(all_single(blocks))
    kinds = np.full((runs, slots), JOINING) if events.kind is None else events.kind
    outcome = np.zeros(runs, dtype=np.int64)
    # Of each event its place, two assemblies, three shapes and the class after it.
    rows: list[tuple[int, ...]] = []
    for run in range(runs):
        world, now = world_of(run), 0
        shape_of = ["1"] * blocks
        pairs, faces, told = (one[run].tolist() for one in (events.block, events.face, kinds))
        for event in range(int(events.number[run])):
            pair, what = pairs[event], told[event]
            lowest = [world.lowest[world.body[one]] for one in pair]
            if what in (OPENING, CLOSING):
                world.bond(pair, whole=what == CLOSING)
                rows.append((run, event, *lowest, -1, -1, -1, now))
                continue
            try:
                if what == JOINING:
                    parts = [shape_of[world.body[one]] for one in pair]
                    if events.kind is not None:
                        _touch_all(world, pairs, told, event, int(events.number[run]))
                    stays, moves = world.join(pair, faces[event])
                    world.bond(pair, whole=True)
                    became = shape_of[stays] = world.shape(stays)
                    shape_of[moves] = ""
                else:
                    became = shape_of[world.body[pair[0]]]
                    two = world.part(pair)
                    lowest = [world.lowest[body] for body in two]
                    parts = [world.shape(body) for body in two]
                    shape_of[two[0]], shape_of[two[1]] = parts
            except InputError as error:
                raise InputError(f"run {run}, event {event}: {error}") from None
            there = [name for name in shape_of if name]
            named = blocks <= MOST_NAMED
            name = _class_of(tuple(sorted(there))) if named else counted_class(len(there))
            now = classes.number(name)
            rows.append((run, event, *lowest, *map(shapes.number, (*parts, became)), now))
        cell[run], quarter[run], outcome[run] = world.cell, world.quarter, now
        assembly[run] = [world.lowest[body] for body in world.body]
    table = np.full((runs, slots, 6), -1)
    filled = np.array(rows, dtype=np.int64).reshape(-1, 8)
    table[filled[:, 0], filled[:, 1]] = filled[:, 2:]
    shape_names = listed_shapes(shapes.known, blocks, chirality=chirality)
    class_names = listed_classes(classes.known, blocks, chirality=chirality)
    class_index = classes.index_into(class_names)
    _check_end(_Lattice(cell, quarter, assembly), end)
    return ReplayedEvents(
        table[..., :2].astype(np.int32),
        shapes.index_into(shape_names)[table[..., 2:5]],
        class_index[table[..., 5]],
        class_index[outcome],
        class_names,
        shape_names,
    )


# Many runs meet in the same worlds.
_class_of = lru_cache(maxsize=1 << 14)(class_name)


def _touch_all(
    world: SquareWorld, pairs: list[list[int]], kinds: list[int], event: int, last: int
) -> None:
    """Note what touches by a joining: its two blocks, and contacts that come right after it."""
    world.touch(pairs[event])
    event += 1
    while event < last and kinds[event] == CLOSING:
        world.touch(pairs[event])
        event += 1


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


class _Names:
    """Names by number, in the order in which they came."""

    def __init__(self, *names: str) -> None:
        self.known = {name: number for number, name in enumerate(names)}

    def number(self, name: str) -> int:
        return self.known.setdefault(name, len(self.known))

    def index_into(self, listed: tuple[str, ...]) -> npt.NDArray[np.int32]:
        """Return from number to place in a list; at its end -1, so that -1 stays what it is."""
        place = {name: index for index, name in enumerate(listed)}
        return np.array([*(place[name] for name in self.known), -1], dtype=np.int32)


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
        differs = (cell != end_cell) | (quarter != end_quarter)
    if differs.any():
        run, block = map(int, np.argwhere(differs)[0])
        raise InputError(f"run {run}: the events do not lead block {block} to where it is")


def _from_lowest(lattice: _Lattice) -> tuple[npt.NDArray[np.complex128], Integers]:
    """Return cells, as x + iy, and quarters as seen from the lowest block of each assembly."""
    cell = lattice.cell[..., 0] + 1j * lattice.cell[..., 1]
    origin, turned = (
        np.take_along_axis(one, lattice.assembly, axis=1) for one in (cell, lattice.quarter)
    )
    back = np.array([1, -1j, -1, 1j])[turned % 4]
    return (cell - origin) * back, (lattice.quarter - turned) % 4


def _refuse(wrong: Bools, at: Integers, event: int, what: str) -> None:
    if wrong.any():
        raise InputError(f"run {at[int(np.argmax(wrong))]}, event {event}: {what}")
