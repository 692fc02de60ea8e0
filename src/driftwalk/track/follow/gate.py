"""Gating: the detections that a track may have, and their likelihoods."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.track.follow.kalman import innovation
from driftwalk.track.follow.settings import TrackerSettings

Floats = npt.NDArray[np.float64]
Booleans = npt.NDArray[np.bool_]


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
    missed: Booleans
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
    pushed = _position_terms(difference, total + bounce(predicted.unseen_for[track], settings))
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


def bounce(unseen_for: Floats, settings: TrackerSettings) -> Floats:
    """Return the covariance that a collision just after the last sight adds, (n, 3, 3)."""
    added = np.zeros((len(unseen_for), 3, 3))
    added[:, 0, 0] = added[:, 1, 1] = (settings.speed_std * unseen_for) ** 2
    return added


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
