"""Gauss-Newton search in a trust region for the setting of least discrepancy."""

from __future__ import annotations

from typing import Final, NamedTuple, Protocol

import numpy as np

from driftwalk.calibration.estimation.synthetic_likelihood import (
    LocalEmulator,
    Solution,
    fit_emulator,
)
from driftwalk.calibration.evolution import rounded
from driftwalk.core.arrays import Floats


class GaussNewtonPolicy(NamedTuple):
    """How a trust region moves, shrinks and settles.

    Chosen by hand on simulated recordings; the errors and coverage that come of it are counted by
    `studies/motion_models/recover.py`.
    """

    per_coefficient: tuple[int, int] = (4, 16)
    """Simulations for each coefficient of an emulator: in a trust region, and for the posterior;
    chosen by hand."""
    fewest_simulations: tuple[int, int] = (256, 512)
    """Fewest simulations: they also give the covariance of a hundred summaries; chosen by hand."""
    fewest_rounds: int = 3
    """Rounds before a search settles or is given up. A true model is close after two or three;
    chosen by hand."""
    most_rounds: int = 12
    """A bound on the time; chosen by hand."""
    patience: int = 4
    """Rounds without a better fit after which the search ends; chosen by hand."""
    reach: float = 1.25
    """A solution may lie this far from the centre, in half-widths of the trust region; chosen by
    hand."""
    inside: float = 0.8
    """A search settles on solutions within this part of the trust region; chosen by hand."""
    widest: float = 0.15
    """Largest half-width, in parts of the ranges: a quadratic does not hold in more; chosen by
    hand."""
    narrowest: float = 0.01
    """Smallest half-width, in parts of the ranges; chosen by hand."""
    wide_stds: float = 4.0
    """Half-width in standard deviations of the solution; chosen by hand."""
    shrinks: tuple[float, float] = (0.35, 0.8)
    """Strongest shrinkage per round: of a solution inside, and outside; chosen by hand."""
    grows: float = 1.5
    """Strongest growth per round; chosen by hand."""
    settled: float = 0.7
    """A search has settled when the next trust region is at least this part of the last; chosen by
    hand."""
    typical: float = 1.4
    """Discrepancy per summary below which a search may settle; the true model has 0.7 to 1.2;
    chosen by hand."""


GAUSS_NEWTON: Final = GaussNewtonPolicy()


class Simulate(Protocol):
    """Simulates settings."""

    def __call__(self, settings: Floats, *, parts: int) -> Floats:
        """Return summaries of the first parts of a recording, shape (n, parts, summaries)."""


class LocalOptimum(NamedTuple):
    """Where a search has ended."""

    emulator: LocalEmulator
    solution: Solution
    rounds: int

    @property
    def discrepancy(self) -> float:
        """Discrepancy in summaries; there may be none that vary."""
        return self.solution.discrepancy / max(self.emulator.summaries, 1)

    @property
    def deviance(self) -> float:
        """-2 log of the likelihood, but for a constant: ends of other searches compare by it."""
        return self.solution.discrepancy + self.emulator.log_variance


def minimise_discrepancy(
    simulate: Simulate,
    recorded: Floats,
    start: Floats,
    width: Floats,
    *,
    seed: int,
    give_up: float = np.inf,
) -> LocalOptimum:
    """Go from a start to the setting that fits the summaries of a recording best.

    Every round draws settings from a trust region, simulates them, and solves for the recording by
    the emulator that they give (Gauss and Newton's way, with derivatives from a regression). The
    next trust region lies about the solution, a few standard deviations wide; where the model is
    far from the recording the deviations are enlarged by the discrepancy.
    """
    policy = GAUSS_NEWTON
    centre, width = start, np.clip(width, policy.narrowest, policy.widest)
    lowest, since, least = np.inf, 0, np.inf
    for number in range(policy.most_rounds):
        count = simulations_of(centre.size)[0]
        settings = drawn_settings(centre, width, count, seed + number)
        summaries = simulate(settings, parts=1)[:, 0]
        emulator = fit_emulator(settings, summaries, centre=centre, width=width)
        solution = emulator.solve(recorded, reach=policy.reach)
        optimum = LocalOptimum(emulator, solution, number + 1)
        least = min(least, optimum.discrepancy)
        excess = np.sqrt(max(1.0, optimum.discrepancy))
        far = np.abs(solution.place).max()
        wanted = np.clip(policy.wide_stds * excess * solution.std, policy.narrowest, policy.widest)
        following = np.clip(wanted, policy.shrinks[int(far > 1.0)] * width, policy.grows * width)
        settled = bool(
            number + 1 >= policy.fewest_rounds
            and far < policy.inside
            and (following >= policy.settled * width).all()
            and (wanted <= policy.grows * width).all()
            and solution.discrepancy < policy.typical * emulator.summaries
        )
        # A quadratic that holds badly leaves much, and then a large discrepancy looks small.
        since = 0 if optimum.deviance < lowest else since + 1
        lowest = min(lowest, optimum.deviance)
        given_up = number + 1 >= policy.fewest_rounds and least > give_up
        if settled or given_up or since == policy.patience:
            break
        centre, width = rounded(np.clip(solution.setting, 0.0, 1.0)), rounded(following)
    return optimum


def simulations_of(parameters: int) -> tuple[int, int]:
    """Return how many settings are simulated in a trust region, and in the last one: powers of two.

    Examples
    --------
    >>> simulations_of(3), simulations_of(9)
    ((256, 512), (256, 1024))
    """
    coefficients = 1 + 2 * parameters + parameters * (parameters - 1) // 2
    each = coefficients * np.array(GAUSS_NEWTON.per_coefficient)
    least = np.maximum(each, GAUSS_NEWTON.fewest_simulations)
    first, last = (2 ** int(power) for power in np.ceil(np.log2(least)))
    return first, last


def drawn_settings(centre: Floats, width: Floats, count: int, seed: int) -> Floats:
    """Return settings that fill the trust region, or its part in the unit cube."""
    from scipy.stats import qmc

    low, high = np.maximum(centre - width, 0.0), np.minimum(centre + width, 1.0)
    return rounded(low + (high - low) * qmc.Sobol(centre.size, seed=seed).random(count))
