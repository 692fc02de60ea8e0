"""Rigid bodies in plain NumPy: strips of drag, motion and walls; shares no code with driftwalk.

Places, velocities and forces are complex numbers. A side is a polygon's edge with the outside to
its right, in the body's frame about its centre of mass; a disc is a polygon of many sides whose
normals do not turn and whose spin is not in the force.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]
Water = Callable[[Complexes], Complexes]

DENSITY, TURN = 1000.0, 2.0 * np.pi


class Plain(NamedTuple):
    """Strips (middle, outward normal, wetted width), corners, mean square radius, disc's radius."""

    middle: Complexes
    normal: Complexes
    width: Floats
    corners: Complexes
    square_radius: float
    radius: float = 0.0


def strips_of(edges: list[tuple[complex, complex, float]], count: int) -> list[Complexes]:
    """Cut edges (from, to, share) of a counter-clockwise outline into strips."""
    rows = []
    for begin, end, share in edges:
        for k in range(count):
            outward = -1j * (end - begin) / abs(end - begin)
            rows.append((
                begin + (end - begin) * (k + 0.5) / count, outward, share * abs(end - begin) / count
            ))  # fmt: skip
    middle, normal, width = zip(*rows, strict=True)
    return [np.array(middle), np.array(normal), np.array(width)]


def rectangle(length: float, width: float, count: int = 8) -> Plain:
    corners = [complex(x * length, y * width) / 2 for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    edges = [(corners[k], corners[(k + 1) % 4], 1.0) for k in range(4)]
    square = (length**2 + width**2) / 12.0
    return Plain(*strips_of(edges, count), np.array(corners), square)


def glued(rows: str, side: float, hidden: float, count: int = 8) -> Plain:
    """Blocks by their rows, the first on top; the mean square radius by a sum over a fine grid."""
    picture = rows.split("/")
    cells = [
        complex(x, -y) for y, row in enumerate(picture) for x, mark in enumerate(row) if mark == "x"
    ]
    middle = sum(cells) / len(cells)
    edges, corners = [], set()
    for cell in cells:
        for quarter in range(4):
            out = 1j**quarter
            first, last = (cell + 0.5 * out * (1 + turn * 1j) for turn in (-1, 1))
            inside = any(abs(cell + out - other) < 1e-9 for other in cells)
            edges.append(((first - middle) * side, (last - middle) * side, hidden if inside else 1))
            corners.add((round(first.real, 3), round(first.imag, 3)))
    points = (np.arange(200) + 0.5) / 200 - 0.5
    grid = points + 1j * points[:, None]
    square = np.mean([np.mean(np.abs(cell + grid - middle) ** 2) for cell in cells])
    # The mean over a grid of n points a side lacks 1 / (6 n^2) of a side squared.
    square += 1.0 / (6 * 200**2)
    places = np.array([complex(*corner) - middle for corner in sorted(corners)]) * side
    return Plain(*strips_of(edges, count), places, float(square) * side**2)


def disc(diameter: float, count: int = 721) -> Plain:
    out = np.exp(1j * TURN * (np.arange(count) + 0.5) / count)
    radius = diameter / 2
    width = np.full(count, TURN * radius / count)
    return Plain(radius * out, out, width, np.zeros(0, complex), radius**2 / 2, radius)


def drag(
    body: Plain, water: Water, scale: float, place: complex, angle: float, velocity: complex,
    spin: float,
) -> tuple[complex, float]:  # fmt: skip
    """Force and torque; scale is 1/2 rho C_d times the wetted depth."""
    turn = 1.0 if body.radius else np.exp(1j * angle)
    arm, normal = body.middle * turn, body.normal * turn
    slip = water(place + arm) - velocity - (0.0 if body.radius else 1j * spin * arm)
    closing = -(slip * normal.conj()).real
    push = scale * body.width * np.maximum(closing, 0.0) * slip
    torque = (arm.conj() * push).imag.sum()
    if body.radius:
        torque -= (scale * body.width * np.maximum(closing, 0.0)).sum() * spin * body.radius**2
    return complex(push.sum()), float(torque)


def moved(
    body: Plain, water: Water, scale: float, mass: float, times: Floats, *, place: complex,
    angle: float = 0.0, velocity: complex = 0j, spin: float = 0.0, step: float = 5e-3,
) -> tuple[Complexes, Floats]:  # fmt: skip
    """Integrate by the classical Runge-Kutta rule from rest or a given motion; no wall."""
    inertia = mass * body.square_radius

    def rate(state: Complexes) -> Complexes:
        force, torque = drag(
            body, water, scale, state[0], state[1].real, state[2], state[3].real
        )  # fmt: skip
        return np.array([state[2], state[3], force / mass, torque / inertia])

    state = np.array([place, angle, velocity, spin], dtype=complex)
    kept = [state]
    for span in np.diff(times):
        count = round(span / step)
        h = span / count
        for _ in range(count):
            k1 = rate(state)
            k2 = rate(state + 0.5 * h * k1)
            k3 = rate(state + 0.5 * h * k2)
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(state + h * k3))
        kept.append(state)
    found = np.array(kept)
    return found[:, 0], found[:, 1].real
