"""From a start to the setting of least misfit, box by box."""

from __future__ import annotations

from typing import Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.estimation.emulator import LocalEmulator, Solved, fit_emulator
from driftwalk.calibration.evolution.search import RESOLUTION

Floats = npt.NDArray[np.float64]

COEFFICIENTS: Final = (4, 16)
"""Simulations of a box for each coefficient of its emulator, and of the last box."""
FEWEST_SIMULATIONS: Final = (256, 512)
"""However few the coefficients are: there is a covariance of some hundred summaries, too."""
FEWEST_ROUNDS: Final = 3
"""A search neither settles nor is given up before. A true model comes close to the recording in
two, as a rule."""
MOST_ROUNDS: Final = 12
MOST_IN_VAIN: Final = 4
"""Rounds without a better fit after which the search ends."""
REACH: Final = 1.25
"""A solution may lie outside the box by a quarter of it: the quadratic holds a little farther."""
INSIDE: Final = 0.8
"""A solution is inside where it lies within this part of the box."""
WIDEST: Final = 0.15
NARROWEST: Final = 0.01
"""Half-widths of boxes, in parts of the ranges."""
WIDE_STDS: Final = 4.0
"""A box ends so many standard deviations from its centre."""
SHRINKS: Final = (0.35, 0.8)
"""A box becomes smaller by no more than the first, or the second where the solution lay outside."""
GROWS: Final = 1.5
SETTLED: Final = 0.7
"""The search has settled where the next box is no smaller than this part of the last,"""
USUAL: Final = 1.4
"""and the misfit no larger than so many times the number of summaries."""


class Simulate(Protocol):
    """Simulates settings."""

    def __call__(self, settings: Floats, *, parts: int) -> Floats:
        """Return summaries of the first parts of a recording, shape (n, parts, summaries)."""


class Descended(NamedTuple):
    """Where a search has ended."""

    emulator: LocalEmulator
    solved: Solved
    rounds: int

    @property
    def unlikely(self) -> float:
        """-2 log of the likelihood, but for a constant: ends of other searches compare by it."""
        return self.solved.misfit + self.emulator.log_variance


def descend(
    simulate: Simulate,
    recorded: Floats,
    start: Floats,
    width: Floats,
    *,
    seed: int,
    give_up: float = np.inf,
) -> Descended:
    """Go from a start to the setting that fits the summaries of a recording best.

    Every round draws settings from a box, simulates them, and solves for the recording by the
    emulator that they give (Gauss and Newton's way, with derivatives from a regression). The next
    box lies about the solution, a few standard deviations wide; where the model is far from the
    recording the deviations are enlarged by the misfit.

    Parameters
    ----------
    simulate : callable
        Summaries of settings in the unit cube.
    recorded : ndarray, shape (summaries,)
        Of the recording.
    start, width : ndarray, shape (parameters,)
        The first box.
    seed : int
        Of the settings that are drawn.
    give_up : float
        Misfit, in summaries, that the search has to reach in `FEWEST_ROUNDS`, or it ends.
    """
    centre, width = start, np.clip(width, NARROWEST, WIDEST)
    lowest, since, least = np.inf, 0, np.inf
    for number in range(MOST_ROUNDS):
        count = simulations_of(centre.size)[0]
        settings = drawn_settings(centre, width, count, seed + number)
        summaries = simulate(settings, parts=1)[:, 0]
        emulator = fit_emulator(settings, summaries, centre=centre, width=width)
        solved = emulator.solve(recorded, reach=REACH)
        misfit = solved.misfit / max(emulator.summaries, 1)
        least = min(least, misfit)
        excess = np.sqrt(max(1.0, misfit))
        far = np.abs(solved.place).max()
        wanted = np.clip(WIDE_STDS * excess * solved.std, NARROWEST, WIDEST)
        following = np.clip(wanted, SHRINKS[int(far > 1.0)] * width, GROWS * width)
        settled = bool(
            number + 1 >= FEWEST_ROUNDS
            and far < INSIDE
            and (following >= SETTLED * width).all()
            and (wanted <= GROWS * width).all()
            and solved.misfit < USUAL * emulator.summaries
        )
        # A quadratic that holds badly leaves much, and then a large misfit looks small.
        unlikely = solved.misfit + emulator.log_variance
        lowest, since = min(lowest, unlikely), 0 if unlikely < lowest else since + 1
        hopeless = number + 1 >= FEWEST_ROUNDS and least > give_up
        if settled or hopeless or since == MOST_IN_VAIN:
            break
        centre, width = rounded(np.clip(solved.setting, 0.0, 1.0)), rounded(following)
    return Descended(emulator, solved, number + 1)


def simulations_of(parameters: int) -> tuple[int, int]:
    """Return how many settings are simulated in a box, and in the last one: powers of two.

    Examples
    --------
    >>> simulations_of(3), simulations_of(9)
    ((256, 512), (256, 1024))
    """
    coefficients = 1 + 2 * parameters + parameters * (parameters - 1) // 2
    least = (
        max(each * coefficients, fewest)
        for each, fewest in zip(COEFFICIENTS, FEWEST_SIMULATIONS, strict=True)
    )
    first, last = (2 ** int(np.ceil(np.log2(one))) for one in least)
    return first, last


def drawn_settings(centre: Floats, width: Floats, count: int, seed: int) -> Floats:
    """Return settings that fill the box, or its part in the unit cube."""
    from scipy.stats import qmc

    low, high = np.maximum(centre - width, 0.0), np.minimum(centre + width, 1.0)
    return rounded(low + (high - low) * qmc.Sobol(centre.size, seed=seed).random(count))


def rounded(values: Floats) -> Floats:
    """Return multiples of a small number: last bits of linear algebra differ between machines."""
    return np.asarray(np.round(values / RESOLUTION) * RESOLUTION)
