"""Noisy local search over continuous settings: a compass search on shared random numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from driftwalk.assembly.yields.selection import Tally
from driftwalk.core.arrays import Floats


class SearchPolicy(NamedTuple):
    """Steps and runs of the local search."""

    points: int = 16
    """Settings that begin, of Sobol's sequence, a power of two; chosen by hand."""
    first_step: float = 0.25
    """First step, of the range: about the distance of 16 points in two dimensions."""
    last_step: float = 0.03
    """Steps below this share of the range are not taken; chosen by hand, three halvings."""
    runs: int = 250
    """Runs of a setting at the first step; doubled with every halving, for smaller gains."""
    digits: int = 4
    """Digits of a setting: more than anyone can set."""


SEARCH: Final = SearchPolicy()


def starting_points(dimensions: int) -> Floats:
    """Return the points that begin a search, in the unit cube, shape (point, dimension)."""
    from scipy.stats import qmc

    drawn: Floats = qmc.Sobol(dimensions, scramble=False).random(2 * SEARCH.points)
    # The first half has the corner at zero and few other levels.
    return drawn[SEARCH.points :]


def compass_search(
    tally: Tally, begin: Floats, arm_at: Callable[[Floats], int], *, budget: int
) -> int:
    """Move to the best neighbour while one is better, and halve the step where none is.

    A neighbour lies one step along one axis (Kolda, Lewis and Torczon 2003). It is better when the
    mean difference of the shared runs exceeds its standard error.

    Parameters
    ----------
    tally : Tally
        Receives the runs.
    begin : ndarray, shape (dimension,)
        Where the search begins, in the unit cube.
    arm_at : callable
        Returns the arm at a place; the same one at the same place.
    budget : int
        Runs of the search, at most.

    Returns
    -------
    int
        The arm where it ended.
    """
    at, here = begin, arm_at(begin)
    step, runs, end = SEARCH.first_step, SEARCH.runs, tally.runs + budget
    while step >= SEARCH.last_step:
        moves = [sign * step * axis for axis in np.eye(at.size) for sign in (1.0, -1.0)]
        places = {arm_at(place): place for place in (np.clip(at + one, 0.0, 1.0) for one in moves)}
        places.pop(here, None)
        if not places:  # the step is finer than the digits of a setting
            break
        arms = [here, *places]
        if tally.cost(arms, runs) > end - tally.runs:
            break
        tally.extend(arms, runs)
        gain = {arm: tally.difference(arm, here) for arm in places}
        better = max(gain, key=lambda arm: gain[arm].mean)
        if gain[better].mean > math.sqrt(gain[better].variance / gain[better].runs):
            here, at = better, places[better]
        else:
            step, runs = step / 2, 2 * runs
    return here
