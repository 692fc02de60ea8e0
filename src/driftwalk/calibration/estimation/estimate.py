"""The parameters of a model from a recording's summaries, and how well they are determined."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from typing import Final, NamedTuple, Protocol

import numpy as np

from driftwalk.calibration.estimation.bootstrap_correction import bootstrap_estimates
from driftwalk.calibration.estimation.gauss_newton import (
    GAUSS_NEWTON,
    LocalOptimum,
    Simulate,
    minimise_discrepancy,
    simulations_of,
)
from driftwalk.calibration.estimation.identifiability import Profiles, discrepancy_profiles
from driftwalk.calibration.estimation.posterior import (
    POSTERIOR,
    Posterior,
    find_modes,
    sample_posterior,
)
from driftwalk.calibration.estimation.regression_abc import REGRESSION, Order, sequential_regression
from driftwalk.calibration.evolution import distinct
from driftwalk.calibration.held_out.law_findings import Discrepancy
from driftwalk.core.arrays import Bools, Floats

Starts = Callable[[], Floats]


class MatchingPolicy(NamedTuple):
    """Which answers of the summaries count: the true model has a discrepancy of 0.7 to 1.2 each."""

    most_starts: int = 2
    """Other starts that are tried. Chosen by hand, a bound on the time."""
    matches: float = 1.25
    """Discrepancy per summary up to which no other start is tried; chosen by hand."""
    apart: float = 0.04
    """Least root-mean-square distance of two starts, in parts of the ranges. Chosen by hand."""
    no_restart_above: float = 100.0
    """Discrepancy per summary from which on another start is no use: it is another model; chosen by
    hand."""
    unsettled: float = 1.0
    """Last move of a mean, in standard deviations, above which it is not determined; chosen by
    hand."""
    undetermined_above: float = 4.0
    """Discrepancy, in medians of the model's own, above which nothing is determined: intervals
    would be more than twice as wide. Measured: a wrong model on a recorded mouse had 30."""
    as_close: float = 1.25
    """Factor by which the summaries' answer may be farther in the six distances. Chosen by hand."""


MATCHING: Final = MatchingPolicy()


class Summaries(Simulate, Protocol):
    """Simulates settings, and knows the recording.

    Attributes
    ----------
    recorded : ndarray, shape (parts, summaries)
        Summaries of the recording and of its parts.
    """

    recorded: Floats


class Matched(NamedTuple):
    """The setting whose summaries match the recording."""

    point: Floats
    """In the unit cube."""
    sample: Floats
    """Settings that could have given the recording, shape (draws, parameters)."""
    discrepancy: Discrepancy
    """How far the summaries are from the model's own recordings."""
    stretch: float
    """Factor by which the draws are spread for what the model leaves unexplained, from 1 on."""
    even_point: Floats
    """The setting that matches the even blocks of time."""
    profiles: Profiles | None
    """How the discrepancy rises along each parameter, over the square of the factor by which the
    draws are spread; None where states of the model have changed places."""
    ambiguous: Bools
    """Parameters for which another place, which fits as well, has other values,"""
    unsettled: Bools
    """and those whose draws still moved when the last simulations were made."""

    @property
    def undetermined(self) -> bool:
        """Whether the summaries are so far from the model's that it can determine nothing."""
        far = self.discrepancy.value > MATCHING.undetermined_above * self.discrepancy.median
        return far and not self.discrepancy.usual


def most_simulations(parameters: int, replicates: int) -> int:
    """Return how many settings `match_summaries` simulates at most."""
    each, last = simulations_of(parameters)
    narrow = each * GAUSS_NEWTON.most_rounds
    regions = POSTERIOR.most_rounds * last // 2
    return (
        REGRESSION.most_simulations + (1 + MATCHING.most_starts) * (narrow + regions) + replicates
    )


def match_summaries(
    objective: Summaries,
    parameters: int,
    starts: Starts,
    *,
    order: Order,
    replicates: int,
    seed: int,
) -> Matched:
    """Find the setting whose summaries match a recording."""
    recorded = objective.recorded
    optima = find_optima(objective, parameters, starts, order=order, seed=seed)
    modes = find_modes(
        optima,
        lambda optimum, number: sample_posterior(
            objective, recorded, optimum, seed=seed + 10_000 * (1 + number)
        ),
    )
    bootstrap = bootstrap_estimates(
        lambda one: objective(one, parts=1)[:, 0], modes.best, replicates
    )
    best = modes.best
    discrepancy = Discrepancy.of(best.solution.discrepancy, bootstrap.discrepancies)
    # What the model leaves unexplained widens the draws, as a reduced chi-square above one does.
    stretch = 1.0 if discrepancy.usual else float(np.sqrt(discrepancy.value / discrepancy.median))
    wider = stretch * bootstrap.spread
    each = [order(_corrected(one.sample, bootstrap.bias, wider)) for one in modes.places]
    return Matched(
        point=np.median(each[0], axis=0),
        sample=modes.mixed(each),
        discrepancy=discrepancy,
        stretch=stretch,
        even_point=np.clip(best.others[0].setting, 0.0, 1.0),
        profiles=_profiles(order, best, recorded[0], bootstrap.bias, wider),
        ambiguous=modes.apart(each),
        unsettled=np.abs(best.moved) > MATCHING.unsettled,
    )


def find_optima(
    objective: Summaries,
    parameters: int,
    starts: Starts,
    *,
    order: Order,
    seed: int,
    give_up: float = np.inf,
) -> list[LocalOptimum]:
    """Return the ends of the searches that are worth a posterior, the most likely first.

    The arguments are as of `match_summaries`, with a limit on the discrepancy in summaries: above
    it a search is given up (see `minimise_discrepancy`), and above it, or above
    `MATCHING.no_restart_above`, no other start is tried. The first search begins where a regression
    puts the parameters. Even where its errors are large, its centre is closer to the truth than
    they say: they come mostly from settings that move unlike the recording. Where the end does not
    match, the model has more than one place to look, and an end that matches may not be the best
    that does.
    """
    recorded = objective.recorded[0]
    regression = sequential_regression(
        lambda one: objective(one, parts=1)[:, 0], recorded, parameters, order=order, seed=seed
    )
    width = REGRESSION.wide_errors * regression.error

    def search(number: int, start: Floats, width: Floats) -> LocalOptimum:
        return minimise_discrepancy(
            objective, recorded, start, width, seed=seed + 1000 * number, give_up=give_up
        )

    found = [search(1, regression.centre, width)]
    hopeless = min(give_up, MATCHING.no_restart_above)
    if found[0].discrepancy < MATCHING.matches or found[0].discrepancy > hopeless:
        return found
    wide = np.full(parameters, GAUSS_NEWTON.widest)
    further = islice(distinct(order(starts()), MATCHING.apart), MATCHING.most_starts)
    for number, start in enumerate(further, 2):
        found.append(search(number, start, wide))
    found.sort(key=lambda optimum: optimum.deviance)
    return found[:1] + [one for one in found[1:] if one.discrepancy < MATCHING.matches]


def _corrected(sample: Floats, bias: Floats, wider: Floats) -> Floats:
    """Return draws less the bias of the estimate, spread about their median."""
    middle = np.median(sample, axis=0)
    apart = sample - middle
    # Where nothing is known of the spread it is infinite, and the median stays where it is.
    spread = np.multiply(wider, apart, out=np.zeros_like(apart), where=apart != 0.0)
    return np.clip(middle - bias + spread, 0.0, 1.0)


def _profiles(
    order: Order, posterior: Posterior, recorded: Floats, bias: Floats, wider: Floats
) -> Profiles | None:
    """Return how the discrepancy rises along each parameter, in the measure of the intervals."""
    setting = posterior.solution.setting
    if not np.array_equal(order(setting[None])[0], setting):
        return None
    std = wider * posterior.sample.std(axis=0)
    found = discrepancy_profiles(
        posterior.emulator, recorded, posterior.solution, std, reach=GAUSS_NEWTON.reach
    )
    place = np.clip(found.place - bias[:, None], 0.0, 1.0)
    return Profiles(place, found.rise / wider[:, None] ** 2)
