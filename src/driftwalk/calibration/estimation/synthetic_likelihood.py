"""Synthetic likelihood of the summaries of a recording at one setting, from simulations of it.

An emulator's covariance holds what its quadratic misses, and differs from box to box. Models are
compared without one: by simulations of one setting each, all with the same number of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.estimation.emulator import shrunk_correlation
from driftwalk.core.arrays import Floats

SIMULATIONS: Final = 512
"""That give mean and covariance: some four for each summary."""


class SyntheticLikelihood(NamedTuple):
    """Summaries of a recording, compared with those of simulations of one setting."""

    discrepancy: float
    """Sum of squares of the deviations of the recording's summaries, in standard deviations."""
    own_discrepancies: Floats
    """The same of simulated recordings that gave neither mean nor covariance."""
    log_variance: float
    """Logarithm of the determinant of the covariance."""


def synthetic_likelihood_at(
    simulate: Callable[[Floats], Floats], recorded: Floats, setting: Floats, replicates: int
) -> SyntheticLikelihood:
    """Compare a recording's summaries with those of simulations of one setting.

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> def simulate(settings):
    ...     return settings + random.normal(size=settings.shape)
    >>> found = synthetic_likelihood_at(simulate, np.array([0.5, 3.5]), np.array([0.5, 0.5]), 100)
    >>> usual = np.quantile(found.own_discrepancies, 0.95)
    >>> round(found.discrepancy), bool(found.discrepancy > usual)
    (9, True)
    """
    seen = simulate(np.tile(setting, (SIMULATIONS + replicates, 1)))
    known, others = seen[:SIMULATIONS], seen[SIMULATIONS:]
    mean = known.mean(axis=0)
    spread = np.sqrt(known.var(axis=0, ddof=1))
    root = np.linalg.cholesky(shrunk_correlation((known - mean) / spread, SIMULATIONS - 1))
    apart = np.linalg.solve(root, ((np.vstack([recorded, others]) - mean) / spread).T)
    discrepancies = (apart**2).sum(axis=0)
    return SyntheticLikelihood(
        discrepancy=float(discrepancies[0]),
        own_discrepancies=discrepancies[1:],
        log_variance=2.0 * float(np.log(np.diag(root)).sum() + np.log(spread).sum()),
    )
