"""Which faces latch, and what becomes of their assemblies: for the self-assembly kernel's twin."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from twin.body import NEIGHBOURS, Assembly, Floats, Ints, cross, turned
from twin.contacts import Pair, close_pairs, overlap, overlapping_pairs
from twin.faces import Faces
from twin.wall import Wall, push_inside

Latching = Literal["none", "collision", "connector"]

MERGE_CORNERS = 64
MERGE_OVERLAP = 1e-4


@dataclass(frozen=True)
class Latch:
    """When two free faces join.

    "collision": when their blocks overlap and the faces look at each other; "connector": when their
    centres are within `distance` [m] and they oppose each other within the angle `axis` [rad].
    """

    latching: Latching
    distance: float
    axis: float
    faces: Faces | None = None


class Candidate(NamedTuple):
    """Two free faces that may join; faces as their assemblies number them.

    In the order of their distance [m], then of block, face, other block, other face. Off the
    lattice it is that of the centres, and faces are 0.
    """

    distance: float
    block: int
    face: int
    other_block: int
    other_face: int


class Joined(NamedTuple):
    """Two assemblies became one: the faces of side 0, which stayed, and of side 1, which moved."""

    blocks: tuple[int, int]
    faces: tuple[int, int]
    removed: tuple[Assembly, Assembly]
    made: Assembly


def latch_once(
    latch: Latch,
    wall: Wall,
    assemblies: list[Assembly],
    bars: Callable[[Assembly, Assembly], bool] | None = None,
) -> Joined | None:
    """Return the merge of the first admissible candidate, None when there is none.

    `bars` says of two assemblies whether they must not latch.
    """
    home = {block: body for body in assemblies for block in body.blocks}
    for candidate in sorted(candidates(latch, assemblies)):
        ends = [
            (home[candidate.block], candidate.block, candidate.face),
            (home[candidate.other_block], candidate.other_block, candidate.other_face),
        ]
        if bars is not None and bars(ends[0][0], ends[1][0]):
            continue
        # More blocks stay; of equal ones the one with the lowest block.
        stayed, moved = sorted(ends, key=lambda end: (-end[0].size, end[0].blocks[0]))
        on_lattice = stayed[0].shape.on_lattice
        made = merged(stayed, moved) if on_lattice else laid_together(stayed, moved)
        if made is None or not push_inside(wall, made, corners=MERGE_CORNERS):
            continue
        # What then overlaps a third one off the lattice latches to it next.
        others = [body for body in assemblies if on_lattice and body not in (stayed[0], moved[0])]
        if not any(_overlap_deeply(made, place) for other in others for place in _places(other)):
            if latch.faces is not None and latch.faces.refused(made, stayed[0].blocks):
                continue
            made.before = made.pose.copy()
            if latch.faces is not None:
                latch.faces.become((stayed[1], moved[1]), (_own_face(*stayed), _own_face(*moved)))
            return Joined(
                (stayed[1], moved[1]),
                (_own_face(*stayed), _own_face(*moved)),
                (stayed[0], moved[0]),
                made,
            )
    return None


def _places(body: Assembly) -> tuple[Assembly, Assembly]:
    """Return an assembly where it is and where it was: a jam takes it back there."""
    return body, Assembly(body.shape, body.blocks, body.cells, body.quarters, body.before)


def _overlap_deeply(made: Assembly, other: Assembly) -> bool:
    return any(overlap(pair).depth > MERGE_OVERLAP for pair in overlapping_pairs([made, other]))


def candidates(latch: Latch, assemblies: list[Assembly]) -> Iterator[Candidate]:
    """Yield the pairs of free faces that may join, in the order of blocks and faces."""
    if latch.latching == "none":
        return
    if latch.latching == "collision":
        pairs = overlapping_pairs(assemblies)
    else:
        pairs = close_pairs(assemblies, assemblies[0].shape.side + latch.distance + 1e-9)
    for pair in pairs:
        if not pair.bodies[0].shape.on_lattice:
            distance = float(np.hypot(*(pair.centre(1) - pair.centre(0))))
            yield Candidate(distance, pair.blocks[0], 0, pair.blocks[1], 0)
            continue
        for face, normal, centre in _free_faces(pair, 0):
            for other_face, other_normal, other_centre in _free_faces(pair, 1):
                distance = float(np.hypot(*(other_centre - centre)))
                if latch.latching == "collision":
                    fits = _facing(pair, normal, other_normal)
                else:
                    opposed = np.arccos(np.clip(-normal @ other_normal, -1, 1))
                    fits = distance <= latch.distance and bool(opposed <= latch.axis)
                if latch.faces is not None:
                    own = _own_face(pair.bodies[0], pair.blocks[0], face)
                    other_own = _own_face(pair.bodies[1], pair.blocks[1], other_face)
                    fits = fits and latch.faces.latch(
                        pair.blocks[0], own, pair.blocks[1], other_own
                    )
                if fits:
                    yield Candidate(distance, pair.blocks[0], face, pair.blocks[1], other_face)


def _free_faces(pair: Pair, side: int) -> Iterator[tuple[int, Floats, Floats]]:
    """Yield number, normal and centre of the free faces of one block of a pair."""
    body, block = pair.bodies[side], pair.blocks[side]
    hidden = body.hidden[body.blocks.index(block)]
    for face in range(4):
        if not hidden[face]:
            normal = pair.normal(side, face)
            yield face, normal, pair.centre(side) + body.shape.side / 2 * normal


def _facing(pair: Pair, normal: Floats, other_normal: Floats) -> bool:
    apart = pair.centre(1) - pair.centre(0)
    return bool(normal @ apart > 0 and other_normal @ apart < 0 and normal @ other_normal < 0)


def merged(stayed: tuple[Assembly, int, int], moved: tuple[Assembly, int, int]) -> Assembly | None:
    """Return the rigid body of two assemblies joined at a face of each, None when cells collide.

    The first assembly stays where it is, the second is turned and shifted. Momentum and angular
    momentum about the joint centre of mass are those before the shift.
    """
    body, block, face = stayed
    other, other_block, other_face = moved
    quarters = (face + 2 - other_face) % 4
    steps = other.cells - other.cells[other.blocks.index(other_block)]
    corner = body.cells[body.blocks.index(block)] + NEIGHBOURS[face]
    cells = corner + quarter_turned(steps, quarters)
    if {tuple(cell) for cell in body.cells} & {tuple(cell) for cell in cells}:
        return None
    blocks = body.blocks + other.blocks
    order = np.argsort(blocks)
    joint_cells = np.concatenate([body.cells, cells])
    shift = body.shape.side * (joint_cells.mean(axis=0) - body.cells.mean(axis=0))
    made = Assembly(
        body.shape,
        [blocks[k] for k in order],
        joint_cells[order],
        np.concatenate([body.quarters, (other.quarters + quarters) % 4])[order],
        np.array([*(body.pose[:2] + turned(shift, body.pose[2])), body.pose[2]]),
    )
    made.motion = _joint_motion(body, other, made.inertia)
    return made


def laid_together(stayed: tuple[Assembly, int, int], moved: tuple[Assembly, int, int]) -> Assembly:
    """Return the rigid body of two assemblies as they lie, apart by so much that both blocks touch.

    Both are shifted along the axis of least depth, about their joint centre of mass. The frame is
    the first one's.
    """
    (body, block, _), (other, other_block, _) = stayed, moved
    depth, normal, _ = overlap(Pair((body, other), (block, other_block)))
    way = depth / (body.size + other.size) * normal
    centres = np.concatenate([body.centres() - other.size * way, other.centres() + body.size * way])
    turns = np.concatenate([body.turns, other.turns + other.pose[2] - body.pose[2]])
    middle = centres.mean(axis=0)
    offsets = turned(centres - middle, -body.pose[2])
    order = np.argsort(body.blocks + other.blocks)
    made = Assembly(
        body.shape,
        sorted(body.blocks + other.blocks),
        np.concatenate([body.cells, other.cells]),
        np.concatenate([body.quarters, other.quarters]),
        np.array([*middle, body.pose[2]]),
        laid=np.column_stack([offsets, turns])[order],
    )
    made.motion = _joint_motion(body, other, made.inertia)
    return made


def quarter_turned(cells: Ints, quarters: int) -> Ints:
    """Return cells turned by quarter turns about the origin."""
    for _ in range(quarters % 4):
        cells = np.stack([-cells[:, 1], cells[:, 0]], axis=1)
    return cells


def _joint_motion(body: Assembly, other: Assembly, inertia: float) -> Floats:
    mass = body.mass + other.mass
    centre = (body.mass * body.pose[:2] + other.mass * other.pose[:2]) / mass
    velocity = (body.mass * body.motion[:2] + other.mass * other.motion[:2]) / mass
    spin = sum(
        part.inertia * part.motion[2]
        + part.mass * float(cross(part.pose[:2] - centre, part.motion[:2]))
        for part in (body, other)
    )
    return np.array([*velocity, spin / inertia])


def _own_face(body: Assembly, block: int, face: int) -> int:
    """Return a face's number in its block's own frame."""
    return int(face - body.quarters[body.blocks.index(block)]) % 4
