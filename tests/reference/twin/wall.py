"""The wall of the tank against rigid assemblies, for the NumPy twin of the self-assembly kernel.

The rules of `physics/wall.hpp`, block by block in the order of their numbers: each block brings the
two corners that can touch, impulses and shifts act on its whole assembly, and the next block sees
them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.block import resolve_contacts
from twin.body import Assembly, Floats, cross, turned

INSIDE_TOLERANCE = 1e-6
JAM_TOLERANCE = 1e-4
ROUNDS_AFTER_STEP = 16
ROUNDS_OF_POLYGON = 16


@dataclass(frozen=True)
class Wall:
    """A circle of positive radius about the origin, or edges (normal x, normal y, distance)."""

    radius: float
    edges: Floats
    restitution: float
    friction: float
    bounce_speed: float


def meet_wall(wall: Wall, body: Assembly) -> bool:
    """Resolve the impacts of an assembly on the wall; say whether there was one."""
    touched = False
    for member in range(body.size):
        if wall.radius > 0:
            touched = _meet_circle(wall, body, member) or touched
        else:
            touched = _meet_edges(wall, body, member) or touched
    if body.size > 1:
        for _ in range(ROUNDS_AFTER_STEP):
            if not _push_members(wall, body):
                break
        take_back_outside(wall, body)
    return touched


def push_inside(wall: Wall, body: Assembly, *, corners: int) -> bool:
    """Shift an assembly inward by the corner that is farthest outside, and again, so many times.

    Returns whether it is inside, to the tolerance.
    """
    for _ in range(corners):
        normal, depth = outermost_corner(wall, body)
        if depth <= INSIDE_TOLERANCE:
            return True
        body.pose[:2] -= normal * depth
    return outermost_corner(wall, body)[1] <= INSIDE_TOLERANCE


def take_back_outside(wall: Wall, body: Assembly) -> bool:
    """Take an assembly back that nothing could push inside; say whether it was one.

    It is longer than the tank is wide where it stands: it cannot have turned so far.
    """
    jammed = outermost_corner(wall, body)[1] > JAM_TOLERANCE
    if jammed:
        body.take_back()
    return jammed


def outermost_corner(wall: Wall, body: Assembly) -> tuple[Floats, float]:
    """Return the outward normal at the corner farthest outside, and its depth [m]."""
    measured = [
        _measure(wall, body, direction, _leading_corners(body, member, direction)[0])
        for member in range(body.size)
        for direction in _directions(wall, body, member)
    ]
    return max(measured, key=lambda entry: entry[1])


def _push_members(wall: Wall, body: Assembly) -> bool:
    """Shift an assembly inward by every block's corners in turn; say whether any was outside."""
    moved = False
    for member in range(body.size):
        for direction in _directions(wall, body, member):
            corners = _leading_corners(body, member, direction)
            for corner in corners if wall.radius > 0 else corners[:1]:
                if _measure(wall, body, direction, corner)[1] > INSIDE_TOLERANCE:
                    _push_out(wall, body, direction, corner)
                    moved = True
    return moved


def _meet_circle(wall: Wall, body: Assembly, member: int) -> bool:
    direction = _directions(wall, body, member)[0]
    corners = _leading_corners(body, member, direction)
    if not _measure(wall, body, direction, corners[0])[1] > 0:
        return False
    _impact(wall, body, direction, corners)
    for corner in corners:
        _push_out(wall, body, direction, corner)
    return True


def _meet_edges(wall: Wall, body: Assembly, member: int) -> bool:
    touched = False
    for edge in wall.edges:
        corners = _leading_corners(body, member, edge)
        if not _measure(wall, body, edge, corners[0])[1] > 0:
            continue
        touched = True
        _impact(wall, body, edge, corners)
        _push_out(wall, body, edge, corners[0])
    if touched:
        # Leaving one edge can mean entering the next: round until this block is clear of all.
        for _ in range(ROUNDS_OF_POLYGON):
            if not _push_from_edges(wall, body, member):
                break
    return touched


def _push_from_edges(wall: Wall, body: Assembly, member: int) -> bool:
    moved = False
    for edge in wall.edges:
        corner = _leading_corners(body, member, edge)[0]
        moved = moved or _measure(wall, body, edge, corner)[1] > 0
        _push_out(wall, body, edge, corner)
    return moved


def _directions(wall: Wall, body: Assembly, member: int) -> Floats:
    """Return the directions of the wall seen from a block: outward for a circle, or the edges."""
    return body.centres()[member][None] if wall.radius > 0 else wall.edges


def _leading_corners(body: Assembly, member: int, direction: Floats) -> Floats:
    """Return the two corners that can touch, deepest first, from the assembly's centre of mass."""
    angle = body.pose[2] + body.turns[member]
    toward = turned(direction[:2], -angle)
    first = np.copysign(body.shape.half, toward)
    ahead, aside = first * toward
    flip = np.array([-1, 1]) if ahead < aside else np.array([1, -1])
    corners = turned(np.stack([first, first * flip]), angle)
    return np.asarray(body.arms()[member] + corners)


def _measure(wall: Wall, body: Assembly, direction: Floats, arm: Floats) -> tuple[Floats, float]:
    """Return the outward normal at a corner and how far it is outside [m]."""
    corner = body.pose[:2] + arm
    if wall.radius > 0:
        distance = float(np.hypot(*corner))
        return corner / max(distance, 1e-9), distance - wall.radius
    return direction[:2], float(corner @ direction[:2] - direction[2])


def _push_out(wall: Wall, body: Assembly, direction: Floats, arm: Floats) -> None:
    normal, depth = _measure(wall, body, direction, arm)
    body.pose[:2] -= normal * max(depth, 0.0)


def _impact(wall: Wall, body: Assembly, direction: Floats, arms: Floats) -> None:
    measured = [_measure(wall, body, direction, arm) for arm in arms]
    normals = np.array([normal for normal, _ in measured])
    tangents = np.column_stack([-normals[:, 1], normals[:, 0]])
    body.motion = resolve_contacts(
        normals=np.column_stack([normals, cross(arms, normals)]),
        tangents=np.column_stack([tangents, cross(arms, tangents)]),
        depths=np.array([depth for _, depth in measured]),
        inverse_mass=np.array([1.0, 1.0, body.mass / body.inertia]),
        motion=body.motion,
        restitution=wall.restitution,
        friction=wall.friction,
        bounce_speed=wall.bounce_speed,
    )
