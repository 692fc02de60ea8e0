"""How well earlier samples tell the state of a block, before it meets the wall."""

from __future__ import annotations

from typing import Final

import numpy as np

from driftwalk.likelihood.spline import Floats

SAMPLES: Final = 200
"""Earlier samples that count."""


def known_covariance(noise: float, intensity: float, interval: float) -> Floats:
    """Return the covariance of a coordinate and its rate after many samples, without drag.

    Parameters
    ----------
    noise : float
        Of the camera [m] or [rad].
    intensity : float
        Of the white noise of the acceleration [m²/s³] or [rad²/s³].
    interval : float
        Between samples [s].

    Returns
    -------
    ndarray, shape (2, 2)
        Of the coordinate and its rate, just after a sample.
    """
    moved = np.array([[1.0, interval], [0.0, 1.0]])
    added = intensity * np.array(
        [[interval**3 / 3.0, interval**2 / 2.0], [interval**2 / 2.0, interval]]
    )
    known = np.diag([noise**2, (noise / interval) ** 2])
    # Sample by sample, and not the steady state from scipy's `solve_discrete_are`: the less noise
    # the turning has, the more samples the steady state takes, and where it has next to none the
    # pencil has its eigenvalues at the unit circle and scipy finds no stabilising solution.
    for _ in range(SAMPLES):
        known = moved @ known @ moved.T + added
        gain = known[:, 0] / (known[0, 0] + noise**2)
        known = known - np.outer(gain, known[0])
    return known + np.diag([1e-18, 1e-12])
