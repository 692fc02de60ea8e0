"""How likely the summaries of a recording are at one setting, from simulations of that setting.

An emulator's covariance holds what its quadratic misses, and differs from box to box. Models are
compared without one: by simulations of one setting each, all with the same number of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.estimation.emulator import shrunk_correlation

Floats = npt.NDArray[np.float64]

SIMULATIONS: Final = 512
"""That give mean and covariance: some four for each summary."""


class Likeness(NamedTuple):
    """Summaries of a recording, compared with those of simulations of one setting."""

    misfit: float
    """Sum of squares of the deviations of the recording's summaries, in standard deviations."""
    own_misfits: Floats
    """The same of simulated recordings that gave neither mean nor covariance."""
    log_variance: float
    """Logarithm of the determinant of the covariance."""


def likeness(
    simulate: Callable[[Floats], Floats], recorded: Floats, setting: Floats, worlds: int
) -> Likeness:
    """Compare a recording's summaries with those of simulations of one setting.

    Parameters
    ----------
    simulate : callable
        Settings in the unit cube (n, parameters) to summaries (n, summaries).
    recorded : ndarray, shape (summaries,)
        Summaries of the recording.
    setting : ndarray, shape (parameters,)
        In the unit cube.
    worlds : int
        Simulated recordings by which a misfit is judged.

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> def simulate(settings):
    ...     return settings + random.normal(size=settings.shape)
    >>> found = likeness(simulate, np.array([0.5, 3.5]), np.array([0.5, 0.5]), 100)
    >>> round(found.misfit), bool(found.misfit > np.quantile(found.own_misfits, 0.95))
    (9, True)
    """
    seen = simulate(np.tile(setting, (SIMULATIONS + worlds, 1)))
    known, others = seen[:SIMULATIONS], seen[SIMULATIONS:]
    mean = known.mean(axis=0)
    spread = np.sqrt(known.var(axis=0, ddof=1))
    root = np.linalg.cholesky(shrunk_correlation((known - mean) / spread, SIMULATIONS - 1))
    apart = np.linalg.solve(root, ((np.vstack([recorded, others]) - mean) / spread).T)
    misfits = (apart**2).sum(axis=0)
    return Likeness(
        misfit=float(misfits[0]),
        own_misfits=misfits[1:],
        log_variance=2.0 * float(np.log(np.diag(root)).sum() + np.log(spread).sum()),
    )
