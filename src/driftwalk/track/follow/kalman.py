"""Constant-velocity Kalman filter on (x, y, theta), many bodies side by side.

The state is (x, y, theta, vx, vy, omega); arrays have the bodies in front, (n, 6) and (n, 6, 6).
Velocities wander as white acceleration, so uncertainty grows with the time that has passed and not
with the number of frames. The angle lives on the circle: innovations are wrapped, theta itself
stays in (-pi, pi].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from driftwalk.schema.trajectory import wrap_angle

Floats = npt.NDArray[np.float64]

STATES = 6


@dataclass(frozen=True)
class Motion:
    """How fast velocities wander: spectral densities of the white accelerations."""

    acceleration_density: float
    """Of both directions [m^2/s^3]."""
    angular_acceleration_density: float
    """Of the turning [rad^2/s^3]."""


def start_state(
    measured: Floats, covariance: Floats, *, speed_std: float, turn_rate_std: float
) -> tuple[Floats, Floats]:
    """Return mean and covariance of bodies that were measured once.

    Parameters
    ----------
    measured : ndarray, shape (n, 3)
        x, y [m], theta [rad]; theta NaN where there is none: then it is anywhere on the circle.
    covariance : ndarray, shape (n, 3, 3)
        Of the measurement [m, m, rad].
    speed_std, turn_rate_std : float
        Standard deviation of each velocity [m/s] and of the turn rate [rad/s].
    """
    count = len(measured)
    mean = np.zeros((count, STATES))
    spread = np.zeros((count, STATES, STATES))
    mean[:, :3], spread[:, :3, :3] = measured, covariance
    blind = ~np.isfinite(measured[:, 2])
    mean[blind, 2] = 0.0
    spread[blind, 2, :] = spread[blind, :, 2] = 0.0
    # Variance of an angle that is uniform on the circle.
    spread[blind, 2, 2] = math.pi**2 / 3.0
    spread[:, 3, 3] = spread[:, 4, 4] = speed_std**2
    spread[:, 5, 5] = turn_rate_std**2
    return mean, spread


def predict(
    mean: Floats, covariance: Floats, elapsed: Floats, motion: Motion
) -> tuple[Floats, Floats]:
    """Return mean and covariance after some time without a measurement.

    Parameters
    ----------
    mean, covariance : ndarray, shapes (n, 6) and (n, 6, 6)
        Before.
    elapsed : ndarray, shape (n,)
        Time that passed for each body [s].
    motion : Motion
        How velocities wander.
    """
    move = np.zeros((len(mean), STATES, STATES))
    move[:] = np.eye(STATES)
    for axis in range(3):
        move[:, axis, axis + 3] = elapsed
    after = np.einsum("nij,nj->ni", move, mean)
    after[:, 2] = wrap_angle(after[:, 2])
    spread = move @ covariance @ move.transpose(0, 2, 1)
    straight, turning = motion.acceleration_density, motion.angular_acceleration_density
    for axis, density in enumerate((straight, straight, turning)):
        spread[:, axis, axis] += density * elapsed**3 / 3.0
        spread[:, axis, axis + 3] += density * elapsed**2 / 2.0
        spread[:, axis + 3, axis] += density * elapsed**2 / 2.0
        spread[:, axis + 3, axis + 3] += density * elapsed
    return after, spread


def innovation(mean: Floats, measured: Floats) -> Floats:
    """Return measured minus predicted (x, y, theta), the angle the short way round; any shape."""
    difference = measured - mean[..., :3]
    difference[..., 2] = wrap_angle(difference[..., 2])
    return difference


def update(
    mean: Floats, covariance: Floats, measured: Floats, noise: Floats
) -> tuple[Floats, Floats]:
    """Return mean and covariance after a measurement.

    Parameters
    ----------
    mean, covariance : ndarray, shapes (n, 6) and (n, 6, 6)
        Predicted.
    measured, noise : ndarray, shapes (n, 3) and (n, 3, 3)
        x, y [m], theta [rad] and their covariance; where theta is NaN, x and y alone count.
    """
    after, spread = mean.copy(), covariance.copy()
    seen = np.isfinite(measured[:, 2])
    for rows, size in ((seen, 3), (~seen, 2)):
        if not rows.any():
            continue
        known = covariance[rows]
        total = known[:, :size, :size] + noise[rows][:, :size, :size]
        # K = P H' S^-1, solved as S K' = H P.
        gain = np.linalg.solve(total, known[:, :size, :]).transpose(0, 2, 1)
        difference = innovation(mean[rows], measured[rows])[:, :size]
        after[rows] = mean[rows] + np.einsum("nij,nj->ni", gain, difference)
        kept = known - gain @ known[:, :size, :]
        spread[rows] = 0.5 * (kept + kept.transpose(0, 2, 1))
    after[:, 2] = wrap_angle(after[:, 2])
    return after, spread
