"""By how much the intervals of a fit are wider than theory says.

Theory takes the filter's innovations for independent normals and the smoothness of the flow for
known. Theory leaves out some effects (the filter is a Gaussian one, flows are not drawn from the
prior, a contact with the wall may go unseen) has been measured: the factors are those with which
nine in ten of the 90 % intervals hold the truth, in 64 recordings of known truth with the angle in
the state, and 32 without (`studies/likelihood`, sets synthetic and ode; another set, coverage, is
the test).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from driftwalk.likelihood.filter_pass import Point
from driftwalk.likelihood.spline import Floats

WITH_ANGLE: Final = (1.3, 1.3, 1.4, 1.0, 1.4)
"""Factors of the standard deviations of ln C_d, ln q, ln r, of the lever (known from its prior) and
of the noise of the angle."""
WITHOUT_ANGLE: Final = (1.4, 1.4, 1.1)
"""The same with the angle as an input or not used."""
NUMBER: Final = 1.3
"""Factor of the numbers of departures."""

MENDED_FORCE: Final = 0.7
"""Error that mended frames add to ln sigma_F, over their share of all: 3.5 % (rms) where 5 % of the
frames were dropped, in eight worlds (`studies/misfit`)."""


def widened(covariance: Floats, point: Point) -> Floats:
    """Return the covariance of ln C_d and the noises with the measured factors.

    Parameters
    ----------
    covariance : ndarray, shape (k, k)
        By theory, k = 5 with the angle in the state, else 3, and one more for each opened number.
    point : Point
        The estimate; tells whether the angle is in the state.

    Examples
    --------
    >>> widened(np.eye(3), Point(np.zeros((2, 4, 4)), -0.7, -9.0, -8.0)).diagonal().round(2)
    array([1.96, 1.96, 1.21])
    """
    noises = WITHOUT_ANGLE if point.log_lever is None else WITH_ANGLE
    factors = np.array([*noises, *[NUMBER] * len(point.opened)])
    return np.asarray(covariance * np.outer(factors, factors))


def with_mended_frames(covariance: Floats, share: float) -> Floats:
    """Return the covariance with the error of frames whose time was put in.

    A frame that is put in at a wrong place makes the block leap, which the fit takes for force.

    Parameters
    ----------
    covariance : ndarray, shape (k, k)
        Of ln C_d, ln q and others.
    share : float
        Mended frames over all samples.

    Examples
    --------
    >>> with_mended_frames(np.zeros((2, 2)), 0.05).diagonal() ** 0.5 / 2.0  # of ln sigma_F
    array([0.   , 0.035])
    """
    more = np.zeros_like(covariance)
    more[1, 1] = (2.0 * MENDED_FORCE * share) ** 2
    return covariance + more
