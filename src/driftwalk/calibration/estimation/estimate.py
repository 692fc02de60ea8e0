"""The parameters of a model from a recording's summaries, and how well they are determined."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.estimation import approach as approaching, descend as descending
from driftwalk.calibration.estimation.approach import WIDE_ERRORS, Order, approach
from driftwalk.calibration.estimation.descend import WIDEST, Descended, descend, rounded
from driftwalk.calibration.estimation.objective import SummaryObjective
from driftwalk.calibration.estimation.posterior import (
    MOST_ROUNDS as MOST_BOXES,
    REACH,
    Posterior,
    sample_posterior,
)
from driftwalk.calibration.estimation.profile import Profiles, misfit_profiles

Floats = npt.NDArray[np.float64]

Starts = Callable[[], Floats]

MOST_STARTS: Final = 2
MATCHES: Final = 1.25
"""Misfit, in summaries, up to which no other start is tried: recordings of the model itself have
0.7 to 1.2 of it."""
APART: Final = 0.04
"""Two starts are at least so far from each other, in parts of the ranges (root mean square)."""
HOPELESS: Final = 100.0
"""Misfit, in summaries, from which on another start is no use: the model is another one."""
MISFIT_QUANTILE: Final = 0.95
UNLIKE: Final = 4.0
"""Misfit, in usual ones, from which on the recording is that of another model: intervals would have
to be more than twice as wide."""


class Matched(NamedTuple):
    """The setting whose summaries match those of the recording."""

    point: Floats
    """In the unit cube."""
    draws: Floats
    """Settings that could have given the recording, shape (draws, parameters)."""
    misfit: float
    """Sum of squares of the summaries' deviations, in standard deviations."""
    usual_misfit: float
    """Its median over simulated recordings of the model,"""
    most_misfit: float
    """and their 95 % quantile."""
    stretch: float
    """Factor by which the draws are spread for what the model leaves unexplained, from 1 on."""
    even_point: Floats
    """The setting that matches the even blocks of time."""
    profiles: Profiles | None
    """How the misfit rises along each parameter, over the square of the factor by which the draws
    are spread; None where states of the model have changed places."""
    rounds: int

    @property
    def usual(self) -> bool:
        """Whether the summaries are like those of the model's own recordings."""
        return self.misfit <= self.most_misfit

    @property
    def unlike(self) -> bool:
        """Whether the summaries are so far from the model's that it can determine nothing."""
        return not self.usual and self.misfit > UNLIKE * self.usual_misfit


def most_simulations(parameters: int, worlds: int) -> int:
    """Return how many settings `match_summaries` simulates at most."""
    wide = approaching.SIMULATIONS * approaching.MOST_ROUNDS
    each, last = descending.simulations_of(parameters)
    narrow = each * descending.MOST_ROUNDS
    return wide + (1 + MOST_STARTS) * narrow + (MOST_BOXES - 1) * last + worlds


def match_summaries(
    objective: SummaryObjective,
    parameters: int,
    starts: Starts,
    *,
    order: Order,
    worlds: int,
    seed: int,
) -> Matched:
    """Find the setting whose summaries match those of a recording.

    Parameters
    ----------
    objective : SummaryObjective
        Simulates settings and summarises them.
    parameters : int
        Dimensions of the unit cube.
    starts : callable
        Returns settings to begin at, shape (starts, parameters), the best first; called where the
        summaries alone do not find a match.
    order : callable
        Puts states of the model that could change places in order.
    worlds : int
        Recordings of the model by which the misfit is judged.
    seed : int
        Of the settings that are simulated.
    """
    recorded = objective.recorded
    box = approach(
        lambda one: objective(one)[:, 0], recorded[0], parameters, order=order, seed=seed
    )
    best: Descended | None = None
    if box.found:
        best = descend(
            objective, recorded[0], box.centre, WIDE_ERRORS * box.error, seed=seed + 1000
        )
    if best is None or not (_matches(best) or _hopeless(best)):
        wide = np.full(parameters, WIDEST)
        for number, start in enumerate(_distinct(order(starts()))[:MOST_STARTS], 2):
            found = descend(objective, recorded[0], start, wide, seed=seed + 1000 * number)
            if best is None or found.solved.misfit < best.solved.misfit:
                best = found
            if _matches(best):
                break
    assert best is not None
    posterior = sample_posterior(
        objective, recorded, best.emulator, best.solved, seed=seed + 10_000
    )
    usual = _usual_misfits(objective, posterior, worlds)
    return _matched(order, posterior, recorded[0], usual, best.rounds)


def _matches(found: Descended) -> bool:
    return found.solved.misfit < MATCHES * found.emulator.summaries


def _hopeless(found: Descended) -> bool:
    return found.solved.misfit > HOPELESS * found.emulator.summaries


def _usual_misfits(objective: SummaryObjective, posterior: Posterior, worlds: int) -> Floats:
    """Return the misfits of recordings of the model, each at the setting that fits it best."""
    count = len(posterior.draws)
    every = np.linspace(0, count - 1, min(worlds, count)).round().astype(np.int64)
    chosen = posterior.draws[every]
    seen = objective(rounded(chosen))[:, 0]
    return np.array(
        [
            posterior.emulator.solve(one, reach=REACH, start=setting).misfit
            for one, setting in zip(seen, chosen, strict=True)
        ]
    )


def _matched(
    order: Order, posterior: Posterior, recorded: Floats, usual: Floats, rounds: int
) -> Matched:
    middle, most = float(np.median(usual)), float(np.quantile(usual, MISFIT_QUANTILE))
    misfit = posterior.solved.misfit
    stretch = float(np.sqrt(misfit / middle)) if misfit > most else 1.0
    draws = order(posterior.draws)
    point = np.median(draws, axis=0)
    wider = stretch * posterior.emulator.widening
    return Matched(
        point=point,
        draws=order(np.clip(point + wider * (draws - point), 0.0, 1.0)),
        misfit=misfit,
        usual_misfit=middle,
        most_misfit=most,
        stretch=stretch,
        even_point=np.clip(posterior.others[0].setting, 0.0, 1.0),
        profiles=_profiles(order, posterior, recorded, wider),
        rounds=rounds,
    )


def _profiles(
    order: Order, posterior: Posterior, recorded: Floats, wider: float
) -> Profiles | None:
    """Return how the misfit rises along each parameter, in the measure of the intervals."""
    setting = posterior.solved.setting
    if not np.array_equal(order(setting[None])[0], setting):
        return None
    found = misfit_profiles(
        posterior.emulator,
        recorded,
        posterior.solved,
        wider * posterior.draws.std(axis=0),
        reach=REACH,
    )
    return found._replace(rise=found.rise / wider**2)


def _distinct(starts: Floats) -> list[Floats]:
    """Return starts that are not close to one before."""
    kept: list[Floats] = []
    for start in starts:
        if all(np.sqrt(np.mean((start - one) ** 2)) > APART for one in kept):
            kept.append(start)
    return kept
