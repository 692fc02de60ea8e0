"""How far a recorded point is from the wall where the body touches it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.evolution import wall_distance
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.motion import MotionModel, ParticleModel

Floats = npt.NDArray[np.float64]


def contact_distance(from_wall: Floats, noise: float) -> float:
    """Return the distance from the wall at contact [m], 0 or more.

    The nearest samples are there by the noise of the camera. Of a body that is often at the wall,
    the 1 % quantile lies two standard deviations too near; with a share s of the samples at the
    wall it is the 0.01 / s quantile of the noise about the contact.

    Parameters
    ----------
    from_wall : ndarray, shape (samples,)
        Recorded distances from the wall [m].
    noise : float
        Standard deviation of a recorded coordinate [m].

    Examples
    --------
    >>> recorded = 0.015 + 3e-4 * np.random.default_rng(1).normal(size=10_000)
    >>> round(contact_distance(recorded, 3e-4), 4)
    0.015
    """
    from scipy.stats import norm

    # A few of the nearest samples may be tracking errors: the nearest 1 % are not trusted.
    nearest_share = 0.01
    nearest = float(np.quantile(from_wall, nearest_share))
    at_wall = float(np.mean(from_wall < nearest + 4.0 * noise))
    deep = -float(norm.ppf(min(nearest_share / max(at_wall, nearest_share), 0.5)))
    return max(nearest + noise * deep, 0.0)


def with_contact_clearance(model: MotionModel, motion: RecordedMotion) -> MotionModel:
    """Return the model with the recording's distance from the wall at contact, if it has no own.

    A comparison gives its models the least recorded distance but for one sample in a hundred, and
    that one counts as no own.
    """
    if not isinstance(model, ParticleModel):
        return model
    if model.states_clearance and model.clearance != motion.clearance:
        return model
    from_wall = wall_distance(motion.like)(motion.track.x, motion.track.y)
    noise = motion.like.camera.position_noise
    return model.with_clearance(contact_distance(from_wall, noise))
