"""Bootstrap correction: bias and scatter of the estimates of recordings simulated at the sample.

The draws take the emulator for exact, its covariance for the same everywhere, and the summaries for
normal. Estimates of simulated recordings show what these leave out: a bias, and a scatter that is
larger than the draws say (a parametric bootstrap; Efron and Tibshirani, An Introduction to the
Bootstrap (1993), chapter 10).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from driftwalk.calibration.estimation.posterior import POSTERIOR, Posterior
from driftwalk.calibration.evolution import rounded
from driftwalk.core.arrays import Floats


class BootstrapEstimates(NamedTuple):
    """Estimates of simulated recordings of the model."""

    discrepancies: Floats
    """Of each at the setting that fits it best, shape (recordings,)."""
    bias: Floats
    """Mean of estimate less truth, shape (parameters,)."""
    spread: Floats
    """Factor by which the draws are too narrow, from 1 on, shape (parameters,)."""


def bootstrap_estimates(
    simulate: Callable[[Floats], Floats], posterior: Posterior, count: int
) -> BootstrapEstimates:
    """Simulate recordings at draws and estimate each as the recording was."""
    sample, emulator = posterior.sample, posterior.emulator
    every = np.linspace(0, len(sample) - 1, min(count, len(sample))).round().astype(np.int64)
    chosen = rounded(sample[every])
    found = [
        emulator.solve(one, reach=POSTERIOR.reach, start=setting)
        for one, setting in zip(simulate(chosen), chosen, strict=True)
    ]
    discrepancies = np.array([one.discrepancy for one in found])
    # Of fewer, a bias and a scatter would be chance; the covariance's own error stands in.
    if len(found) < POSTERIOR.fewest_estimates:
        none = np.zeros(sample.shape[1])
        return BootstrapEstimates(discrepancies, none, none + emulator.error_inflation)
    errors = np.array([one.setting for one in found]) - chosen
    spread = errors.std(axis=0) / sample.std(axis=0)
    return BootstrapEstimates(discrepancies, errors.mean(axis=0), np.maximum(spread, 1.0))
