"""The strip law for a block of uncertain pose and motion, written out strip by strip.

Shares nothing with the core: the flow by scipy's B-splines, how closing speed and slip move with
the state by differences of where the strips are and how they move.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.special
from scipy.interpolate import BSpline

Floats = npt.NDArray[np.float64]


class SplineFlow:
    """Bicubic B-splines on a uniform grid; basis number k reaches from node k - 3 to k + 1."""

    def __init__(self, coefficients: Floats, origin: Floats, spacing: float) -> None:
        self.coefficients = coefficients
        rows, columns = coefficients.shape[1:]
        self.along_x, self.along_y = (
            BSpline(start + spacing * (np.arange(count + 4) - 3), np.eye(count), 3)
            for start, count in zip(origin, (columns, rows), strict=True)
        )

    def __call__(self, places: Floats) -> Floats:
        """Velocity (n, 2) at places (n, 2) in the tank."""
        by_x, by_y = self.along_x(places[:, 0]), self.along_y(places[:, 1])
        return np.einsum("kj,ki,cji->kc", by_y, by_x, self.coefficients, optimize=True)


class Block(NamedTuple):
    side: float
    mass: float
    depth: float
    strips: int
    water_density: float


class Strips(NamedTuple):
    """All strips of a block at one angle, shapes (n, 2)."""

    arm: Floats
    normal: Floats
    tangent: Floats


def strips_at(block: Block, theta: float) -> Strips:
    across = (np.arange(block.strips) + 0.5) / block.strips * block.side - block.side / 2
    angle = np.repeat(theta + np.pi / 2 * np.arange(4), block.strips)
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    return Strips(block.side / 2 * normal + np.tile(across, 4)[:, None] * tangent, normal, tangent)


def closing_and_slip(block: Block, flow: SplineFlow, state: Floats) -> Floats:
    """Of each strip (n, 2), in the block's own frame, state (x, y, theta, vx, vy, omega)."""
    strips = strips_at(block, state[2])
    turning = state[5] * np.stack([-strips.arm[:, 1], strips.arm[:, 0]], axis=1)
    w = flow(state[:2] + strips.arm) - state[3:5] - turning
    return np.stack([-(strips.normal * w).sum(1), (strips.tangent * w).sum(1)], axis=1)


def spreads(block: Block, flow: SplineFlow, state: Floats, covariance: Floats) -> Floats:
    """Covariance (n, 2, 2) of closing speed and slip, to first order."""
    step = 1e-6
    columns = [
        (
            closing_and_slip(block, flow, state + step * unit)
            - closing_and_slip(block, flow, state - step * unit)
        )
        / (2 * step)
        for unit in np.eye(6)
    ]
    moves = np.stack(columns, axis=-1)
    return np.einsum("kas,st,kbt->kab", moves, covariance, moves, optimize=True)


def acceleration(
    block: Block, strips: Strips, along: Floats, across: Floats, drag_coefficient: float
) -> Floats:
    """Of the block (..., 3), from E[s+ s] and E[s+ w_t] of each strip (..., n)."""
    scale = 0.5 * block.water_density * drag_coefficient * block.side / block.strips * block.depth
    force = scale * (across[..., None] * strips.tangent - along[..., None] * strips.normal)
    torque = strips.arm[:, 0] * force[..., 1] - strips.arm[:, 1] * force[..., 0]
    total = np.concatenate([force.sum(-2), torque.sum(-1)[..., None]], axis=-1)
    return total / (block.mass * np.array([1.0, 1.0, block.side**2 / 6]))


def moments(mean: Floats, spread: Floats) -> tuple[Floats, Floats]:
    """E[s+ s] and E[s+ w_t] for means (..., n, 2) and covariances (n, 2, 2)."""
    s, slip = mean[..., 0], mean[..., 1]
    variance, cross = spread[:, 0, 0], spread[:, 0, 1]
    tau = np.sqrt(variance)
    share = scipy.special.ndtr(s / tau)
    density = np.exp(-0.5 * (s / tau) ** 2) / np.sqrt(2 * np.pi)
    square = (s**2 + variance) * share + s * tau * density
    return square, slip * (s * share + tau * density) + cross * share


def bend(
    block: Block, flow: SplineFlow, state: Floats, covariance: Floats, drag_coefficient: float
) -> Floats:
    """Second derivatives (3, 3, 3) of the mean acceleration by velocities, the spreads held."""
    strips = strips_at(block, state[2])
    mean = closing_and_slip(block, flow, state)
    spread = spreads(block, flow, state, covariance)
    # Closing speed and slip are linear in the velocities.
    by_velocity = np.stack(
        [closing_and_slip(block, flow, state + unit) - mean for unit in np.eye(6)[3:]], axis=-1
    )
    # Differences of five points, twice.
    steps = 0.03 * np.sqrt(np.diag(covariance)[3:])
    points = np.array([-2.0, -1.0, 1.0, 2.0])
    weights = np.array([1.0, -8.0, 8.0, -1.0]) / 12
    found = np.empty((3, 3, 3))
    for b in range(3):
        for c in range(3):
            moved = mean + (
                points[:, None, None, None] * steps[b] * by_velocity[:, :, b]
                + points[None, :, None, None] * steps[c] * by_velocity[:, :, c]
            )
            values = acceleration(block, strips, *moments(moved, spread), drag_coefficient)
            found[:, b, c] = np.einsum("i,j,ija->a", weights, weights, values)
            found[:, b, c] /= steps[b] * steps[c]
    return found
