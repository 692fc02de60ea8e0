"""Where a posterior is simulated: an ellipsoid about its draws, along their own axes.

Parameters that make up for each other lie on a narrow ridge. A box about it is mostly empty of
draws, and a quadratic that has to hold in all of the box holds less well on the ridge.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.estimation.gauss_newton import rounded
from driftwalk.core.arrays import Floats


class RegionPolicy(NamedTuple):
    """How large the region is that is simulated for a posterior sample. Chosen by hand."""

    spread: float = 1.5
    """Standard deviation of the settings along every axis, in those of the sample."""
    widest: float = 0.3
    """Largest half-width, in parts of the ranges: an emulator does not hold in more."""
    narrowest: float = 0.003
    """Smallest standard deviation, in parts of the ranges: keeps the covariance regular."""


REGION: Final = RegionPolicy()


class Region(NamedTuple):
    """An ellipsoid in the unit cube."""

    centre: Floats
    """Shape (parameters,)."""
    root: Floats
    """Lower triangle whose product with its transpose is the covariance of the draws."""

    @property
    def std(self) -> Floats:
        """Standard deviations of the draws that it is made for."""
        return np.asarray(np.sqrt((self.root**2).sum(axis=1)))

    @property
    def radius(self) -> float:
        """How far it reaches along every axis, in standard deviations of the draws."""
        return radius_of(self.centre.size)

    @property
    def width(self) -> Floats:
        """Half-widths of the box about it."""
        return self.radius * self.std

    def distances(self, settings: Floats) -> Floats:
        """Return how far settings are from the centre: 1 is the end, shape (settings,)."""
        axes = np.linalg.solve(self.root, (settings - self.centre).T)
        return np.asarray(np.sqrt((axes**2).sum(axis=0)) / self.radius)

    def filled(self, count: int, seed: int) -> Floats:
        """Return settings that fill the region evenly; those beyond an end are mirrored at it."""
        from scipy.special import ndtri
        from scipy.stats import qmc

        parameters = self.centre.size
        drawn = qmc.Sobol(parameters + 1, seed=seed).random(count)
        way = ndtri(np.clip(drawn[:, :-1], 1e-12, 1.0 - 1e-12))
        way /= np.maximum(np.sqrt((way**2).sum(axis=1, keepdims=True)), 1e-12)
        place = self.radius * drawn[:, -1:] ** (1.0 / parameters) * way
        settings = self.centre + place @ self.root.T
        return rounded(np.clip(1.0 - np.abs(1.0 - np.abs(settings)), 0.0, 1.0))


def radius_of(parameters: int) -> float:
    """Return the radius of an even ball with the standard deviation 1.5 along every axis.

    Examples
    --------
    >>> round(radius_of(2), 3)
    3.0
    """
    return REGION.spread * float(np.sqrt(parameters + 2.0))


def region_about(sample: Floats) -> Region:
    """Return the region of draws."""
    parameters = sample.shape[1]
    covariance = np.atleast_2d(np.cov(sample.T))
    covariance += REGION.narrowest**2 * np.eye(parameters)
    most = REGION.widest / radius_of(parameters)
    shrink = np.minimum(1.0, most / np.sqrt(np.diag(covariance)))
    covariance *= np.outer(shrink, shrink)
    root = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    return Region(rounded(np.clip(sample.mean(axis=0), 0.0, 1.0)), root)
