"""Flows in a round tank as sums of modes: velocities at the nodes of a lattice, and their weights.

A velocity is a complex number, u + iv, and so is a place. Eddies and jets are stream functions that
vanish at a wall a little outside the tank's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from ranges import (
    CHANGING_SHARE,
    EDDY_PERIOD_S,
    FLOW_RMS_M_S,
    JET_PERIOD_S,
    RADIUS_M,
    SINK_PER_S,
    SOURCE_PER_S,
    Range,
)

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]

AXIS: Final = np.linspace(-0.165, 0.165, 133)
X, Y = np.meshgrid(AXIS, AXIS)
INSIDE: Final = np.hypot(X, Y) < RADIUS_M
CLOSED: Final = np.clip(1.0 - (np.hypot(X, Y) / AXIS[-1]) ** 4, 0.0, None)
"""Makes any stream function vanish outside the tank."""


class Flow(NamedTuple):
    """Modes, shape (modes, y, x) [m/s], and how the weights of all but the first one turn."""

    modes: Complexes
    period_s: float = np.inf
    """The second mode has the weight sin(2 pi t / period), the third one the cosine."""


def uniform(rng: np.random.Generator, span: Range) -> float:
    """Draw a number of a range."""
    return float(rng.uniform(*span))


def from_stream(stream: Floats) -> Complexes:
    """Return the velocity of a stream function, closed by the tank."""
    along_y, along_x = np.gradient(stream * CLOSED, AXIS, AXIS)
    return along_y - 1j * along_x


def scaled(water: Complexes, rms: float) -> Complexes:
    """Return a flow whose speed has a root mean square over the tank [m/s]."""
    return water * (rms / np.sqrt(np.mean(np.abs(water[INSIDE]) ** 2)))


def place(rng: np.random.Generator, farthest: float) -> tuple[float, float]:
    """Draw a place within a distance of the middle [m]."""
    away, angle = farthest * np.sqrt(rng.uniform()), rng.uniform(0.0, 2.0 * np.pi)
    return float(away * np.cos(angle)), float(away * np.sin(angle))


def eddy(x: float, y: float, size: float) -> Floats:
    """Return the stream function of an eddy."""
    return np.exp(-0.5 * ((X - x) ** 2 + (Y - y) ** 2) / size**2)


def jet(x: float, y: float, size: float, direction: float) -> Floats:
    """Return the stream function of a jet in a direction: linear in its cosine and sine."""
    across = (Y - y) * np.cos(direction) - (X - x) * np.sin(direction)
    return across * eddy(x, y, size) / size


def swirl_and_jets(rng: np.random.Generator) -> Complexes:
    """Draw one swirl that fills the tank, and three to five jets."""
    stream = rng.choice([-1.0, 1.0]) * 2.0 * eddy(*place(rng, 0.03), rng.uniform(0.06, 0.1))
    for _ in range(rng.integers(3, 6)):
        stream += rng.uniform(0.3, 1.0) * jet(
            *place(rng, 0.12), rng.uniform(0.02, 0.04), rng.uniform(0.0, 2.0 * np.pi)
        )
    return from_stream(stream)


def eddies(rng: np.random.Generator) -> Complexes:
    """Draw six to twelve eddies of either sense, 2 to 5 cm wide."""
    stream = np.zeros_like(X)
    for _ in range(rng.integers(6, 13)):
        stream += rng.normal() * eddy(*place(rng, 0.13), rng.uniform(0.02, 0.05))
    return from_stream(stream)


def two_eddies(rng: np.random.Generator) -> Complexes:
    """Draw two large eddies of opposite sense, and some small ones."""
    one, other = _pair(rng)
    return from_stream(one - other) + 0.2 * scaled(eddies(rng), _rms(from_stream(one - other)))


def vortex(rng: np.random.Generator) -> Complexes:
    """Draw a vortex in the middle with weak eddies: a block stays near its core."""
    core = from_stream(rng.choice([-1.0, 1.0]) * eddy(*place(rng, 0.03), rng.uniform(0.04, 0.06)))
    return core + 0.1 * scaled(eddies(rng), _rms(core))


FAMILIES: Final[tuple[Callable[[np.random.Generator], Complexes], ...]] = (
    swirl_and_jets,
    eddies,
    two_eddies,
)


def steady(rng: np.random.Generator, *, sinks: float = 0.5, swirls: float = 0.33) -> Flow:
    """Draw a steady flow; a share is a swirl with jets, and a share has a sink in the middle."""
    swirl = rng.uniform() < swirls
    family = swirl_and_jets if swirl else FAMILIES[rng.integers(1, len(FAMILIES))]
    water = scaled(family(rng), uniform(rng, FLOW_RMS_M_S))
    if rng.uniform() < sinks:
        water = water - uniform(rng, SINK_PER_S) * (X + 1j * Y)
    return Flow(water[np.newaxis])


def outward(rng: np.random.Generator) -> Flow:
    """Draw a flow that carries a block to the wall often."""
    water = scaled(FAMILIES[rng.integers(len(FAMILIES))](rng), uniform(rng, FLOW_RMS_M_S))
    return Flow((water + uniform(rng, SOURCE_PER_S) * (X + 1j * Y))[np.newaxis])


def slow_orbit(rng: np.random.Generator) -> Flow:
    """Draw a flow in which a block goes round slowly, and sees little of the tank."""
    water = scaled(vortex(rng), rng.uniform(0.015, 0.035))
    return Flow((water - rng.uniform(0.02, 0.1) * (X + 1j * Y))[np.newaxis])


def alternating(rng: np.random.Generator) -> Flow:
    """Draw two eddies that are strong in turn, on a steady flow."""
    mean = steady(rng, sinks=0.5).modes[0]
    one, other = _pair(rng)
    rms = np.sqrt(2.0) * uniform(rng, CHANGING_SHARE) * _rms(mean)
    return Flow(
        np.stack([mean, scaled(from_stream(one - other), rms)]), uniform(rng, EDDY_PERIOD_S)
    )


def turning(rng: np.random.Generator) -> Flow:
    """Draw a jet that turns, on a steady flow."""
    mean = steady(rng, sinks=0.5).modes[0]
    at, size = place(rng, 0.06), rng.uniform(0.03, 0.05)
    rms = uniform(rng, CHANGING_SHARE) * _rms(mean)
    parts = [scaled(from_stream(jet(*at, size, way)), rms) for way in (0.5 * np.pi, 0.0)]
    return Flow(np.stack([mean, *parts]), uniform(rng, JET_PERIOD_S))


def _pair(rng: np.random.Generator) -> tuple[Floats, Floats]:
    angle, size = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.035, 0.05)
    x, y = 0.065 * np.cos(angle), 0.065 * np.sin(angle)
    return eddy(x, y, size), eddy(-x, -y, size)


def _rms(water: Complexes) -> float:
    return float(np.sqrt(np.mean(np.abs(water[INSIDE]) ** 2)))
