"""Modes of the likelihood, as the search over laws asks for them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from driftwalk.likelihood.excerpt import pieces
from driftwalk.likelihood.filter_pass import Passes, Point, Series
from driftwalk.likelihood.law.score_tests import Trial, try_numbers
from driftwalk.likelihood.newton import (
    CLOSE,
    CLOSE_ENOUGH,
    CLOSE_NATS,
    FROM_AFAR,
    FROM_ANOTHER,
    Held,
    Mode,
    Passed,
    Prior,
    Weights,
    find_mode,
    work_of_pass,
)
from driftwalk.likelihood.solution import BREAKDOWN

TRIAL_ITERATIONS: Final = 12
"""Most steps of such a search."""
TRIAL_PASSES: Final = 2.5
"""Passes of a search that take as long as the score tests."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Finds modes for the recordings of one fit."""

    passes: Passes
    prior: Prior
    iterations: int
    """Most steps of a search."""
    passed: Passed
    """Hears of the work that is done."""
    close: float = CLOSE
    """A search ends when its steps are below this part of the standard deviations,"""
    close_nats: float = CLOSE_NATS
    """and when a whole step would gain less than this [nat]."""

    def of(self, series: Sequence[Series]) -> Modes:
        """Return the same for other series."""
        return replace(self, passes=replace(self.passes, series=series))

    def soon(self) -> Modes:
        """Return the same with fewer steps, to see whether a search comes to an end."""
        few = min(self.iterations, TRIAL_ITERATIONS)
        return replace(self, iterations=few, close_nats=math.inf)

    def roughly(self) -> Modes:
        """Return the same with searches that end a little earlier, where another one follows."""
        return replace(self, close=CLOSE_ENOUGH, close_nats=math.inf)

    def find(self, start: Point, weights: Weights, *, held: Held = FROM_AFAR) -> Mode:
        """Return the mode."""
        return find_mode(
            self.passes,
            start,
            weights,
            self.prior,
            iterations=self.iterations,
            passed=self.passed,
            held=held,
            close=self.close,
            close_nats=self.close_nats,
        )

    def find_from_afar(self, start: Point, weights: Weights) -> Mode:
        """Return the mode, of long recordings by way of that of pieces of them."""
        few = pieces(self.passes)
        if few is not None:
            rough = self.of(few).roughly()
            near = unless_broken(lambda: rough.find(start, weights))
            if near is not None and near.converged:
                mode = unless_broken(lambda: self.find(near.point, near.weights, held=FROM_ANOTHER))
                if mode is not None and mode.converged:
                    return mode
        return self.find(start, weights)

    def tested(self, mode: Mode, names: Sequence[str]) -> Trial | None:
        """Return the score tests of numbers; nothing where they break down."""
        try:
            return try_numbers(self.passes, mode, self.prior, names)
        except BREAKDOWN:
            return None
        finally:
            self.passed(TRIAL_PASSES * work_of_pass(self.passes))


def unless_broken(search: Callable[[], Mode]) -> Mode | None:
    """Return the mode; nothing where the search breaks down, as under a wrong law it may."""
    try:
        with np.errstate(all="ignore"):
            return search()
    except BREAKDOWN:
        return None
