"""Places of a model's parameters that fit a recording equally well.

A chain that begins at one of them does not find the others. So every search that ends at a match
has a posterior of its own, and they are weighed by their evidence: the likelihood there times the
volume that the draws fill.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from driftwalk.calibration.estimation.gauss_newton import LocalOptimum
from driftwalk.calibration.estimation.posterior import POSTERIOR, Posterior
from driftwalk.core.arrays import Bools, Floats


class Modes(NamedTuple):
    """Posteriors at different places."""

    places: tuple[Posterior, ...]
    """The likeliest first."""
    weights: Floats
    """Shares of the evidence, shape (places,)."""

    @property
    def best(self) -> Posterior:
        """The likeliest."""
        return self.places[0]

    def mixed(self, sample: Sequence[Floats]) -> Floats:
        """Return 512 draws of all places, each with as many as its share of the evidence."""
        upper = np.round(POSTERIOR.size * np.cumsum(self.weights)).astype(np.int64)
        counts = np.diff(upper, prepend=0)
        taken = [
            one[np.linspace(0, len(one) - 1, count).round().astype(np.int64)]
            for one, count in zip(sample, counts, strict=True)
        ]
        return np.concatenate(taken)

    def apart(self, sample: Sequence[Floats]) -> Bools:
        """Return for which parameters a place has an interval that does not meet the first's."""
        low, high = np.quantile(np.array(sample), (0.05, 0.95), axis=1)
        return np.asarray(((low > high[0]) | (high < low[0])).any(axis=0))


def find_modes(
    optima: Sequence[LocalOptimum], sample_about: Callable[[LocalOptimum, int], Posterior]
) -> Modes:
    """Return the posteriors at the ends of searches, those alone that the recording allows."""
    found: list[Posterior] = []
    for number, optimum in enumerate(optima):
        if any(_reaches(one, optimum.solution.setting) for one in found):
            continue
        posterior = sample_about(optimum, number)
        if not any(_reaches(one, posterior.sample.mean(axis=0)) for one in found):
            found.append(posterior)
    deviance = np.array([_deviance(one) for one in found])
    # The covariances come from simulations: a discrepancy of a hundred has an error of some 5. So
    # a place is ruled out only where it is behind by 10.
    order = [k for k in np.argsort(deviance, kind="stable") if deviance[k] - deviance.min() < 10.0]
    weights = np.exp(-0.5 * (deviance[order] - deviance.min()))
    return Modes(tuple(found[place] for place in order), weights / weights.sum())


def _reaches(posterior: Posterior, setting: Floats) -> bool:
    """Return whether a setting lies where a posterior has been simulated."""
    return bool(posterior.region.distances(setting[None])[0] < 1.0)


def _deviance(posterior: Posterior) -> float:
    """Return -2 log of the evidence, but for a constant: of a normal law as wide as the draws."""
    volume = np.linalg.slogdet(np.atleast_2d(np.cov(posterior.sample.T)))[1]
    return posterior.solution.discrepancy + posterior.emulator.log_variance - float(volume)
