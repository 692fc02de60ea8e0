"""Constant-velocity Kalman filter on (x, y, theta) with its gate, many bodies side by side.

The state is (x, y, theta, vx, vy, omega); arrays have the bodies in front, (n, 6) and (n, 6, 6).
Velocities wander as white acceleration, so uncertainty grows with the time that has passed and not
with the number of frames. The angle lives on the circle: innovations are wrapped, theta itself
stays in (-pi, pi].
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats
from driftwalk.schema.trajectory import wrap_angle
from driftwalk.track.follow.settings import Motion, TrackerSettings

STATES = 6
"""Position, angle, and their rates."""


def start_state(
    measured: Floats, covariance: Floats, settings: TrackerSettings
) -> tuple[Floats, Floats]:
    """Return mean and covariance of bodies that were measured once.

    Parameters
    ----------
    measured : ndarray, shape (n, 3)
        x, y [m], theta [rad]; theta NaN where there is none: then it is anywhere on the circle.
    covariance : ndarray, shape (n, 3, 3)
        Of the measurement [m, m, rad].
    settings : TrackerSettings
        How fast bodies may be.
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
    spread[:, 3, 3] = spread[:, 4, 4] = settings.speed_std**2
    spread[:, 5, 5] = settings.turn_rate_std**2
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
    straight, turning = motion
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


class Predicted(NamedTuple):
    """Where tracks are expected, and where they were last seen."""

    mean: Floats
    """States, shape (n, 6)."""
    covariance: Floats
    """Their covariances, shape (n, 6, 6)."""
    seen_at: Floats
    """Positions last measured [m], shape (n, 2)."""
    unseen_for: Floats
    """Time since then [s], shape (n,)."""
    missed: Bools
    """Whether they were not seen in the frame before this one, shape (n,)."""


class Measured(NamedTuple):
    """The detections of a frame."""

    pose: Floats
    """x, y [m], theta [rad] or NaN, shape (m, 3)."""
    covariance: Floats
    """Their covariances, shape (m, 3, 3)."""


def reach(unseen_for: Floats, noise_std: Floats, settings: TrackerSettings) -> Floats:
    """Return how far from where it was last seen a body may be measured [m]."""
    return settings.max_speed * unseen_for + settings.gate * noise_std


def edge_costs(predicted: Predicted, measured: Measured, settings: TrackerSettings) -> Floats:
    """Return the cost of each pair for `assign`, infinite outside the gate; (tracks, detections).

    A pair is inside when the detection is within `gate` standard deviations of the predicted
    position, which widens with the time since the body was seen, and when no speed above
    `max_speed` was needed to get there. The angle counts where it is known, but does not close the
    gate: a marker that was read the wrong way round is still that marker.
    """
    cost = np.full((len(predicted.mean), len(measured.pose)), np.inf)
    noise_std = np.sqrt(np.trace(measured.covariance[:, :2, :2], axis1=1, axis2=2))
    apart = measured.pose[None, :, :2] - predicted.seen_at[:, None]
    limit = reach(predicted.unseen_for[:, None], noise_std[None, :], settings)
    track, detection = np.nonzero(np.hypot(apart[..., 0], apart[..., 1]) <= limit)
    if not track.size:
        return cost
    difference = innovation(predicted.mean[track], measured.pose[detection])
    total = predicted.covariance[track, :3, :3] + measured.covariance[detection]
    smooth = _position_terms(difference, total)
    # A collision just after the last sight gives a body any velocity.
    bounce = np.zeros_like(total)
    bounce[:, 0, 0] = bounce[:, 1, 1] = (settings.speed_std * predicted.unseen_for[track]) ** 2
    pushed = _position_terms(difference, total + bounce)
    square = np.minimum(smooth[0], pushed[0])
    share = settings.bounce_probability
    log_density = np.logaddexp(
        math.log(1.0 - share) + smooth[1] - 0.5 * smooth[0],
        math.log(share) + pushed[1] - 0.5 * pushed[0],
    )
    log_turned = _angle_term(difference[:, 2], total[:, 2, 2], settings.bounce_probability)
    seen = np.where(
        predicted.missed[track], settings.return_probability, settings.detection_probability
    )
    alone = math.log(settings.clutter_density) + np.log(1.0 - seen) - np.log(seen)
    inside = square <= settings.gate**2
    value = alone - log_density - log_turned
    cost[track[inside], detection[inside]] = value[inside]
    return cost


def _position_terms(difference: Floats, total: Floats) -> tuple[Floats, Floats]:
    """Return squared distance in standard deviations, and the logarithm of the density there."""
    a, b, d = total[:, 0, 0], total[:, 0, 1], total[:, 1, 1]
    determinant = a * d - b * b
    x, y = difference[:, 0], difference[:, 1]
    square = (d * x * x - 2.0 * b * x * y + a * y * y) / determinant
    return square, -0.5 * np.log((2.0 * math.pi) ** 2 * determinant)


def _angle_term(difference: Floats, variance: Floats, pushed: float) -> Floats:
    """Return the logarithm of the angle's density over that of any angle; 0 where not known.

    After a collision, or where a marker was read the wrong way round, any angle is possible.
    """
    known = np.isfinite(difference) & np.isfinite(variance)
    # Beyond one radian a Gaussian on the line is none on the circle: then the angle says nothing.
    known &= np.where(known, variance, 2.0) < 1.0
    safe = np.where(known, variance, 1.0)
    square = np.where(known, difference, 0.0) ** 2 / safe
    smooth = 0.5 * np.log(2.0 * math.pi / safe) - 0.5 * square
    mixed = np.logaddexp(math.log(1.0 - pushed) + smooth, math.log(pushed))
    return np.where(known, mixed, 0.0)
