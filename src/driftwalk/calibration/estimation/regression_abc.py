"""Sequential regression ABC: the part of the ranges in which a recording's parameters lie.

Settings are drawn from a trust region and simulated, and their parameters are regressed on their
summaries, the simulations near the recording counting most. The parameters that the regression
gives the recording, and its errors on simulations that it has not used, make the next trust region.
Nothing is minimised, so there is no local minimum to end in.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.estimation.synthetic_likelihood import SYNTHETIC
from driftwalk.calibration.evolution import rounded
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError

Order = Callable[[Floats], Floats]
Simulate = Callable[[Floats], Floats]
"""Settings in the unit cube (n, parameters) to summaries (n, summaries)."""


class RegressionPolicy(NamedTuple):
    """Sequential regression from the whole ranges to a trust region. Chosen by hand."""

    simulations: int = 256
    """Simulations of a round: some two for each of a hundred summaries, a power of two; chosen by
    hand."""
    most_rounds: int = 6
    """A bound on the time; chosen by hand."""
    wide_errors: float = 2.5
    """Half-width of the next trust region in standard errors: chance goes beyond it once in a
    hundred."""
    narrow: float = 0.05
    """Errors, in parts of the ranges, at which a quadratic holds in the trust region; chosen by
    hand."""
    lost: float = 0.2
    """Larger errors say next to nothing: a uniform distribution has 0.29 in closed form."""
    ridges: tuple[float, ...] = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
    """Ridge penalties that are tried; each parameter takes the one of the least error; chosen by
    hand."""
    bounded: float = 2.0
    """Summaries count as at most this many standard deviations from the usual; chosen by hand."""
    as_large: float = 0.9
    """Part of the last errors above which errors no longer shrink, and the rounds end; chosen by
    hand."""

    @property
    def most_simulations(self) -> int:
        """Simulations of all rounds."""
        return self.simulations * self.most_rounds


REGRESSION: Final = RegressionPolicy()


class RegressionEstimate(NamedTuple):
    """Where the parameters lie."""

    centre: Floats
    """In the unit cube, shape (parameters,)."""
    error: Floats
    """Standard error of the centre, in parts of the ranges."""

    @property
    def found(self) -> bool:
        """Whether the summaries say where, for most parameters."""
        return bool(np.median(self.error) < REGRESSION.lost)


def sequential_regression(
    simulate: Simulate, recorded: Floats, parameters: int, *, order: Order, seed: int
) -> RegressionEstimate:
    """Return the trust region in which the parameters of a recording lie.

    Examples
    --------
    >>> def simulate(settings):
    ...     return np.column_stack([settings[:, 0] ** 2, settings[:, 0] + settings[:, 1]])
    >>> recorded = np.array([0.25, 1.2])
    >>> found = sequential_regression(simulate, recorded, 2, order=np.asarray, seed=1)
    >>> found.centre.round(2).tolist()
    [0.5, 0.7]
    """
    from scipy.stats import qmc

    low, high = np.zeros(parameters), np.ones(parameters)
    regression = RegressionEstimate(0.5 * (low + high), np.full(parameters, np.sqrt(1.0 / 12.0)))
    for number in range(REGRESSION.most_rounds):
        drawn = qmc.Sobol(parameters, seed=seed + number).random(REGRESSION.simulations)
        settings = order(rounded(low + (high - low) * drawn))
        summaries = simulate(settings)
        _require_change(summaries)
        before, regression = regression, _ridge_regression(settings, summaries, recorded)
        if regression.error.max() < REGRESSION.narrow or (number and not regression.found):
            break
        if number and (regression.error > REGRESSION.as_large * before.error).all():
            break
        reach = REGRESSION.wide_errors * regression.error
        low = np.clip(regression.centre - reach, 0.0, 1.0 - REGRESSION.narrow)
        high = np.clip(regression.centre + reach, low + 0.2 * REGRESSION.narrow, 1.0)
    return regression


def _require_change(summaries: Floats) -> None:
    """Refuse a model that moves in the same way whatever its parameters and random numbers are."""
    varies = np.ptp(summaries, axis=0) > SYNTHETIC.constant * (
        np.abs(summaries).max(axis=0) + SYNTHETIC.constant
    )
    if not varies.any():
        raise InputError(
            "the model moves in the same way at all settings of its parameters: check that it uses "
            "them, and its ranges"
        )


def _ridge_regression(settings: Floats, summaries: Floats, recorded: Floats) -> RegressionEstimate:
    """Return the parameters that a regression on summaries gives a recording, and its errors.

    Each parameter takes the ridge of the smallest leave-one-out error.
    """
    spread = summaries.std(axis=0)
    used = spread > 0.0
    middle, scale = np.median(summaries, axis=0)[used], spread[used]
    known, asked = (
        REGRESSION.bounded * np.tanh((one[..., used] - middle) / (REGRESSION.bounded * scale))
        for one in (summaries, recorded)
    )
    apart = ((known - asked) ** 2).mean(axis=1)
    weight = np.exp(-apart / max(float(np.median(apart)), 1e-300))
    table = np.column_stack([np.ones(len(known)), known])
    row = np.concatenate([[1.0], asked])
    gram, target = (table.T * weight) @ table, (table.T * weight) @ settings
    errors, answers = [], []
    for ridge in REGRESSION.ridges:
        penalty = np.full(row.size, ridge)
        penalty[0] = 1e-9
        inverse = np.linalg.inv(gram + np.diag(penalty))
        coefficients = inverse @ target
        own = np.einsum("ij,jk,ik->i", table, inverse, table) * weight
        left = (settings - table @ coefficients) / (1.0 - np.minimum(own, 0.95))[:, None]
        errors.append((weight[:, None] * left**2).sum(axis=0) / weight.sum())
        answers.append(row @ coefficients)
    best = np.argmin(errors, axis=0)
    each = np.arange(settings.shape[1])
    centre = np.clip(np.array(answers)[best, each], 0.0, 1.0)
    return RegressionEstimate(centre, np.sqrt(np.array(errors)[best, each]))
