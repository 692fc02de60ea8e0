"""How long a bout lasts: the Weibull law with a mean and a spread."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


class DwellLaw(NamedTuple):
    """The law ``scale * (-ln U)**power`` of a bout's time, U uniform."""

    scale: Floats
    """[s]"""
    power: Floats
    """1 / shape: 1 is exponential, 0 a clock."""


def dwell_law(mean: npt.ArrayLike, cv: npt.ArrayLike) -> DwellLaw:
    """Return the Weibull law with these means and spreads.

    Its moments are ``E[T^n] = scale^n Gamma(1 + n power)``, so the power solves
    ``Gamma(1 + 2 power) / Gamma(1 + power)^2 = 1 + cv^2``.

    Parameters
    ----------
    mean : array_like
        Mean time [s], > 0; infinite where a bout never ends.
    cv : array_like
        Standard deviation over the mean, from 0 to 10.

    Examples
    --------
    >>> law = dwell_law([2.0, 2.0], [1.0, 0.0])
    >>> law.scale.round(9).tolist(), law.power.round(9).tolist()
    ([2.0, 2.0], [1.0, 0.0])
    """
    from scipy.special import gammaln, psi

    mean, cv = np.broadcast_arrays(np.asarray(mean, float), np.asarray(cv, float))
    wanted = np.log1p(cv**2)
    # The logarithm of the left side is convex in the power, and pi^2 / 6 power^2 at its beginning.
    power = np.sqrt(6.0 * wanted) / np.pi
    for _ in range(30):
        excess = gammaln(1.0 + 2.0 * power) - 2.0 * gammaln(1.0 + power) - wanted
        slope = 2.0 * (psi(1.0 + 2.0 * power) - psi(1.0 + power))
        power = np.where(slope > 0.0, power - excess / np.where(slope > 0.0, slope, 1.0), power)
    scale = mean / np.exp(gammaln(1.0 + power))
    return DwellLaw(np.asarray(scale), np.asarray(power))
