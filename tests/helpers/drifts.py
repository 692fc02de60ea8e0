"""Tracks of a body that drifts, made of random numbers alone: an oracle without the simulation."""

from __future__ import annotations

from typing import Final

import numpy as np

from driftwalk.schema import Track

RATE_HZ: Final = 10.0
NOISE_M: Final = 3e-4
SPEED_M_S: Final = 0.04
KICKS_M2_S3: Final = 5e-5
SECONDS: Final = 300.0


def drift(seed: int, *, seconds: float = SECONDS, noise_m: float = NOISE_M) -> Track:
    """Return a body that goes round in a swirl under white accelerations, with tracking noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    turn = SPEED_M_S / 0.08 * time
    # Two integrals of the kicks; the second forgets, so that the body stays in the tank.
    kicks = np.sqrt(KICKS_M2_S3 / RATE_HZ) * rng.normal(size=(2, time.size))
    velocity, place = np.zeros((2, time.size)), np.zeros((2, time.size))
    for n in range(1, time.size):
        velocity[:, n] = 0.9 * velocity[:, n - 1] + kicks[:, n]
        place[:, n] = 0.99 * place[:, n - 1] + velocity[:, n] / RATE_HZ
    x, y = place + 0.08 * np.array([np.cos(turn), np.sin(turn)])
    noise = rng.normal(0.0, 1.0, (3, time.size))
    theta = np.angle(np.exp(1j * (turn + 0.3 * np.sin(0.7 * time)))) + np.deg2rad(0.5) * noise[2]
    return Track(time, x + noise_m * noise[0], y + noise_m * noise[1], theta)
