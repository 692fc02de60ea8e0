"""Blocks against blocks: overlap, impulses and shifts, for the twin of the self-assembly kernel."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from twin.block import resolve_contacts
from twin.body import Assembly, Floats, cross
from twin.wall import JAM_TOLERANCE, Wall, push_inside, take_back_outside

SHIFT_ROUNDS = 10
SEPARATION_ROUNDS = 40
SEPARATION_TOLERANCE = 1e-5
LARGEST_TURN = 0.02
CORNERS_PER_PUSH = 4


@dataclass(frozen=True)
class Pair:
    """Two blocks of different assemblies, the lower number first."""

    bodies: tuple[Assembly, Assembly]
    blocks: tuple[int, int]

    def centre(self, side: int) -> Floats:
        """Return the position of one of the two blocks [m]."""
        return self.bodies[side].centre_of(self.blocks[side])

    def normal(self, side: int, face: int) -> Floats:
        """Return the outward normal of a face of one of them."""
        return self.bodies[side].face_normal(self.blocks[side], face)

    def reach(self, side: int, direction: Floats) -> float:
        """Return how far one of them reaches from its centre in a direction [m]."""
        axes = np.array([self.normal(side, face) for face in (0, 1)])
        return float(self.bodies[side].shape.half @ np.abs(axes @ direction))


class Overlap(NamedTuple):
    """How deep two blocks overlap [m], negative when apart, and along what.

    `normal` points from the first block to the second; it is a face axis of block `owner` (0, 1).
    """

    depth: float
    normal: Floats
    owner: int


def close_pairs(assemblies: list[Assembly], distance: float) -> list[Pair]:
    """Return the pairs of blocks with centres nearer than a distance [m], in order of numbers."""
    home = {block: body for body in assemblies for block in body.blocks}
    centre = {
        block: centre
        for body in assemblies
        for block, centre in zip(body.blocks, body.centres(), strict=True)
    }
    return [
        Pair((home[i], home[j]), (i, j))
        for i, j in combinations(sorted(home), 2)
        if home[i] is not home[j] and np.hypot(*(centre[j] - centre[i])) < distance
    ]


def overlapping_pairs(assemblies: list[Assembly]) -> list[Pair]:
    """Return the pairs of blocks that overlap, in order of numbers."""
    diagonal = 2 * float(np.hypot(*assemblies[0].shape.half))
    return [pair for pair in close_pairs(assemblies, diagonal) if overlap(pair).depth > 0]


def overlap(pair: Pair) -> Overlap:
    """Return how two blocks overlap, by the face axis of least depth.

    Among equal axes it is the first of: the first block's x, y, the second block's x, y, as their
    assemblies have them.
    """
    axes = np.array([pair.normal(side, face) for side in (0, 1) for face in (0, 1)])
    apart = (axes * (pair.centre(1) - pair.centre(0))).sum(axis=1)
    half = np.concatenate([body.shape.half for body in pair.bodies])
    reach = (half * np.abs((axes[:, None] * axes).sum(axis=2))).sum(axis=1)
    best = int(np.argmin(reach - np.abs(apart)))
    normal = axes[best] if apart[best] >= 0 else -axes[best]
    return Overlap(float(reach[best] - abs(apart[best])), normal, best // 2)


def contact_points(pair: Pair) -> list[tuple[Floats, float]]:
    """Return the contact points of overlapping blocks, one or two, with their depths [m].

    The owner of the normal has the reference face. The incident face is the other block's most
    opposed one (of equal ones the first); it is clipped to the width of the reference face, and its
    ends below that face are the points, counter-clockwise the later one first. An overlap of
    rounding errors can have none.
    """
    _, normal, owner = overlap(pair)
    outward = normal if owner == 0 else -normal
    centre, other = pair.centre(owner), pair.centre(1 - owner)
    normals = [pair.normal(1 - owner, face) for face in range(4)]
    facing = min(normals, key=lambda direction: float(direction @ outward))
    along = np.array([-facing[1], facing[0]])
    middle, side = other + pair.reach(1 - owner, facing) * facing, pair.reach(1 - owner, along)
    across = np.array([-outward[1], outward[0]])
    ends = _clip(
        middle + side * along, middle - side * along, centre, across, pair.reach(owner, across)
    )
    height = pair.reach(owner, outward)
    measured = [(point, height - float((point - centre) @ outward)) for point in ends]
    return [(point, depth) for point, depth in measured if depth > 0]


def _clip(start: Floats, end: Floats, centre: Floats, along: Floats, half: float) -> list[Floats]:
    """Return the ends of the part of a segment within `half` of a centre, measured `along`."""
    low, high = 0.0, 1.0
    begin, rate = float((start - centre) @ along), float((end - start) @ along)
    for sign in (1.0, -1.0):
        # The part s of the segment, 0 .. 1, where sign (begin + s rate) <= half.
        room, speed = half - sign * begin, sign * rate
        if speed > 0:
            high = min(high, room / speed)
        elif speed < 0:
            low = max(low, room / speed)
        elif room < 0:
            return []
    return [start + s * (end - start) for s in (low, high)] if low <= high else []


def collide(pair: Pair, *, restitution: float, friction: float, bounce_speed: float) -> None:
    """Give the impulses of one collision to both assemblies, by the rules of a wall contact."""
    normal, points = overlap(pair).normal, contact_points(pair)
    if not points:
        return
    tangent = np.array([-normal[1], normal[0]])
    first, second = pair.bodies
    motion = resolve_contacts(
        normals=np.array([_row(pair, normal, point) for point, _ in points]),
        tangents=np.array([_row(pair, tangent, point) for point, _ in points]),
        depths=np.array([depth for _, depth in points]),
        inverse_mass=np.concatenate([first.inverse_mass, second.inverse_mass]),
        motion=np.concatenate([first.motion, second.motion]),
        restitution=restitution,
        friction=friction,
        bounce_speed=bounce_speed,
    )
    first.motion, second.motion = motion[:3], motion[3:]


def _row(pair: Pair, direction: Floats, point: Floats) -> Floats:
    """Return what, times both motions, is the speed of the first block's point to the second's."""
    first, second = (cross(point - body.pose[:2], direction) for body in pair.bodies)
    return np.array([*direction, first, *-direction, -second])


def separate(wall: Wall, assemblies: list[Assembly]) -> None:
    """Push assemblies apart until none overlap by more than the tolerance, and keep them inside.

    A round takes the pairs in order, each as the last one left it; what was pushed is put back
    inside the wall at once, by its outermost corners. Later rounds turn what they push: a wedged
    block has no other way out. Assemblies that are still jammed do not move in this step.
    """
    pairs = close_pairs(assemblies, np.inf)
    pushed: list[Assembly] = []
    inside = True
    for done in range(SEPARATION_ROUNDS):
        moved = False
        for pair in pairs:
            depth, normal, _ = overlap(pair)
            if depth > SEPARATION_TOLERANCE:
                if done < SHIFT_ROUNDS:
                    _shift_apart(pair, depth * normal)
                else:
                    _turn_apart(pair)
                for body in pair.bodies:
                    inside = push_inside(wall, body, corners=CORNERS_PER_PUSH) and inside
                pushed += pair.bodies
                moved = True
        if not moved:
            break
    if moved or not inside:
        pushed = [body for body in assemblies if body in pushed]
        _undo_jams(wall, assemblies, pushed, pairs)


def _shift_apart(pair: Pair, way: Floats) -> None:
    """Move two assemblies apart, the lighter one farther."""
    first, second = pair.bodies
    share = second.mass / (first.mass + second.mass)
    first.pose[:2] -= share * way
    second.pose[:2] += (1 - share) * way


def _turn_apart(pair: Pair) -> None:
    """Move two assemblies apart by impulses of position at their contact points, which turn too."""
    first, second = pair.bodies
    normal, points = overlap(pair).normal, contact_points(pair)
    rows = [_row(pair, normal, point) for point, _ in points]
    inverse_mass = np.concatenate([first.inverse_mass, second.inverse_mass])
    for row, (_, depth) in zip(rows, points, strict=True):
        push = depth / float(row @ (inverse_mass * row)) / len(points)
        way = -inverse_mass * row * push
        way[[2, 5]] = np.clip(way[[2, 5]], -LARGEST_TURN, LARGEST_TURN)
        first.pose += way[:3]
        second.pose += way[3:]


def _undo_jams(
    wall: Wall, assemblies: list[Assembly], pushed: list[Assembly], pairs: list[Pair]
) -> None:
    """Take back what still overlaps or stands outside, and then what overlaps with that."""
    for _ in range(sum(body.size for body in assemblies)):
        taken = [take_back_outside(wall, body) for body in pushed]
        for pair in pairs:
            if overlap(pair).depth > JAM_TOLERANCE:
                taken.append(True)
                for body in pair.bodies:
                    body.take_back()
        if not any(taken):
            return
