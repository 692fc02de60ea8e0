"""Blocks in water that changes, by Euler and Maruyama's scheme in plain NumPy.

Each strip of the four faces feels the square law where the water comes towards it. Force and noise
are added in fine steps; there is no wall, so the flow has to keep the block away from it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from driftwalk.schema import build_trajectory

SIDE_M, MASS_KG, DEPTH_M, DENSITY = 0.03, 0.0116, 0.03, 1000.0
STRIPS = 5
STEP_S = 0.01
DRAG, FORCE_N, FORCE_INTERVAL_S = 0.45, 0.55e-3, 0.01
CONTACT_M = 0.036
"""Distance of two blocks at which they bounce: between that of faces and that of corners."""
POSITION_NOISE_M, ORIENTATION_NOISE_RAD = 3e-4, 0.009

_CORNERS = SIDE_M / np.sqrt(12.0) * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
POINTS_X, POINTS_Y = _CORNERS[:, :1], _CORNERS[:, 1:]
"""Where the water's acceleration is taken within the block."""

Velocity = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]


def euler_recordings(
    velocity: Velocity,
    *,
    worlds: int,
    seconds: float,
    seed: int,
    start: tuple[float, float] = (0.06, 0.0),
    drag: float = DRAG,
    force_N: float = FORCE_N,
    added_mass: float | None = None,
    stirring_length: float | None = None,
) -> list[Any]:
    """Return recordings at 10 Hz of `worlds` blocks, after 20 s of running in at time 0.

    With an added mass, a share of the block's, the body floats: the water's acceleration pushes it.
    With a length of the stirring [m], 0 for none, two blocks share each world and bounce off each
    other as discs; the second one starts across the middle.
    """
    paired = stirring_length is not None
    worlds *= 2 if paired else 1
    random = np.random.default_rng(seed)
    face = np.repeat(np.arange(4) * np.pi / 2.0, STRIPS)[:, None]
    along = np.tile(((np.arange(STRIPS) + 0.5) / STRIPS - 0.5) * SIDE_M, 4)[:, None]
    scale = 0.5 * DENSITY * drag * SIDE_M / STRIPS * DEPTH_M
    moved = MASS_KG * (1.0 + (added_mass or 0.0))
    inertia = moved * SIDE_M**2 / 6.0
    kick = force_N * np.sqrt(FORCE_INTERVAL_S / STEP_S)
    x, y = (np.full(worlds, value) for value in start)
    if paired:
        x[1::2] *= -1.0
    theta, vx, vy, omega = np.zeros((4, worlds))
    every, warm = round(0.1 / STEP_S), round(20.0 / STEP_S)
    poses = []
    for step in range(warm + round(seconds / STEP_S) + 1):
        if step >= warm and (step - warm) % every == 0:
            poses.append((x, y, theta))
        cosine, sine = np.cos(theta + face), np.sin(theta + face)
        arm_x = 0.5 * SIDE_M * cosine - along * sine
        arm_y = 0.5 * SIDE_M * sine + along * cosine
        u, v = velocity(x + arm_x, y + arm_y, max(step - warm, 0) * STEP_S)
        slip_x, slip_y = u - vx + omega * arm_y, v - vy - omega * arm_x
        push = scale * np.maximum(0.0, -(cosine * slip_x + sine * slip_y))
        push_x, push_y = push * slip_x, push * slip_y
        noise = kick * random.standard_normal((2, worlds))
        if paired:
            apart = np.array([x[::2] - x[1::2], y[::2] - y[1::2]])
            square = (apart**2).sum(axis=0)
            rho = np.exp(-0.5 * square / stirring_length**2) if stirring_length else 0.0 * square
            noise[:, 1::2] = rho * noise[:, ::2] + np.sqrt(1.0 - rho**2) * noise[:, 1::2]
        vx = vx + STEP_S / moved * (push_x.sum(axis=0) + noise[0])
        vy = vy + STEP_S / moved * (push_y.sum(axis=0) + noise[1])
        omega = omega + STEP_S / inertia * (arm_x * push_y - arm_y * push_x).sum(axis=0)
        if added_mass is not None:
            ax, ay = _acceleration(velocity, x + POINTS_X, y + POINTS_Y, step * STEP_S)
            vx, vy = vx + STEP_S * ax.mean(axis=0), vy + STEP_S * ay.mean(axis=0)
            turn = 6.0 / SIDE_M**2 * (POINTS_X * ay - POINTS_Y * ax).mean(axis=0)
            omega = omega + STEP_S * turn
        if paired:
            ahead = np.array([vx[::2] - vx[1::2], vy[::2] - vy[1::2]])
            closing = np.minimum((ahead * apart).sum(axis=0) / square, 0.0)
            bounce = np.where(square < CONTACT_M**2, closing, 0.0) * apart
            vx[::2], vy[::2] = vx[::2] - bounce[0], vy[::2] - bounce[1]
            vx[1::2], vy[1::2] = vx[1::2] + bounce[0], vy[1::2] + bounce[1]
        x, y, theta = x + STEP_S * vx, y + STEP_S * vy, theta + STEP_S * omega
    seen = np.array(poses)
    seen[:, :2] += POSITION_NOISE_M * random.standard_normal(seen[:, :2].shape)
    seen[:, 2] += ORIENTATION_NOISE_RAD * random.standard_normal(seen[:, 2].shape)
    time = 0.1 * np.arange(len(seen))
    members = 2 if paired else 1
    return [
        build_trajectory(time, *seen[:, :, k : k + members].transpose(1, 0, 2))
        for k in range(0, worlds, members)
    ]


def _acceleration(
    velocity: Velocity, x: np.ndarray, y: np.ndarray, time: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return (u . grad) u of the water, by central differences over 2 mm."""
    u, v = velocity(x, y, time)
    east, west = velocity(x + 1e-3, y, time), velocity(x - 1e-3, y, time)
    north, south = velocity(x, y + 1e-3, time), velocity(x, y - 1e-3, time)
    ax, ay = ((u * (east[k] - west[k]) + v * (north[k] - south[k])) / 2e-3 for k in range(2))
    return ax, ay


def stirred(x: np.ndarray, y: np.ndarray, strength: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return a swirl with a jet and a drift inwards that keeps blocks away from the wall."""
    radius = np.hypot(x, y)
    swirl = 0.5 * np.exp(-((radius / 0.13) ** 4))
    jet = 0.05 * np.exp(-0.5 * (np.hypot(x - 0.06, y + 0.03) / 0.03) ** 2)
    inwards = 0.15 + 4.0 * np.maximum(radius - 0.1, 0.0)
    u, v = -swirl * y - inwards * x - jet, swirl * x - inwards * y + 0.6 * jet
    return strength * u, strength * v
