"""Ranking, selection and local search of settings that share their random numbers.

Successive halving finds a good setting with few runs; further runs then distinguish the others from
it, or stop where they cannot be better by more than the indifference. Settings are arms: run k of
every arm has the same random numbers, so that arms are compared run by run. A noisy compass search
goes on from the best ones over settings that are continuous.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats

Sample = Callable[[Sequence[int], range], Bools]
"""Whether runs reached the target, shape (arm, run), of some arms and the runs of a range."""


class HalvingPolicy(NamedTuple):
    """How many runs an arm gets, and when arms are distinguished."""

    least_runs: int = 20
    """Runs of an arm in the first round at least; chosen by hand, for an error of 0.1."""
    growth: float = 1.3
    """Runs of a look over those of the one before, where all have as many; chosen by hand."""
    most: int = 4
    """Runs that distinguish at most, in budgets of halving: `studies/yield` needs 1 to 4."""
    tuned_runs: int = 2000
    """Runs at which the confidence sequence is narrowest: those of a last round of halving; chosen
    by hand."""


HALVING: Final = HalvingPolicy()


class Difference(NamedTuple):
    """How much more often one arm reached the target than another, over the runs they share."""

    mean: float
    variance: float
    """Of one run; two runs that differ are added, so that few runs do not make it zero."""
    runs: int

    def radius(self, level: float) -> float:
        """Return the half width of a confidence sequence, which holds at all looks at once.

        The normal mixture of Robbins (1970), with the estimated variance.
        """
        tuned = -2.0 * math.log(level)
        rho = (tuned + math.log(tuned + 1.0)) / HALVING.tuned_runs
        t = self.runs * rho + 1.0
        spread = 2.0 * self.variance * t / (self.runs**2 * rho)
        return math.sqrt(spread * math.log(math.sqrt(t) / level))


class Tally:
    """The runs of all arms so far.

    Parameters
    ----------
    sample : callable
        Simulates runs.
    """

    def __init__(self, sample: Sample) -> None:
        self._sample = sample
        self._reached: dict[int, Bools] = {}

    @property
    def runs(self) -> int:
        """Runs of all arms together."""
        return sum(one.size for one in self._reached.values())

    def size(self, arm: int) -> int:
        """Return the runs of an arm."""
        return self._reached[arm].size if arm in self._reached else 0

    def reached(self, arm: int) -> int:
        """Return how many of them reached the target."""
        return int(self._reached[arm].sum()) if arm in self._reached else 0

    def share(self, arm: int) -> float:
        """Return the share of them that reached the target."""
        return self.reached(arm) / max(self.size(arm), 1)

    def cost(self, arms: Sequence[int], runs: int) -> int:
        """Return how many runs `extend` would add."""
        return sum(max(runs - self.size(arm), 0) for arm in arms)

    def extend(self, arms: Sequence[int], runs: int) -> None:
        """Simulate until each of some arms has a number of runs at least."""
        for have in sorted({self.size(arm) for arm in arms if self.size(arm) < runs}):
            same = [arm for arm in arms if self.size(arm) == have]
            for arm, found in zip(same, self._sample(same, range(have, runs)), strict=True):
                before = self._reached.get(arm, np.zeros(0, dtype=bool))
                self._reached[arm] = np.concatenate([before, found])

    def difference(self, first: int, second: int) -> Difference:
        """Return the difference of two arms, over the runs that both have."""
        runs = min(self.size(first), self.size(second))
        a, b = (self._reached[arm][:runs].astype(np.int8) for arm in (first, second))
        apart = a - b
        mean = float(apart.mean())
        return Difference(mean, (float((apart != 0).sum()) + 2.0) / runs - mean**2, runs)


def halving(tally: Tally, arms: Sequence[int], budget: int) -> dict[int, int]:
    """Halve the arms round by round, the better ones get more runs (Karnin et al. 2013).

    All runs of an arm count, also those of earlier rounds.

    Parameters
    ----------
    tally : Tally
        Receives the runs.
    arms : sequence of int
        The arms.
    budget : int
        Runs of all rounds together, at most.

    Returns
    -------
    dict of int to int
        How many rounds each arm was in; the winner was in one more than there are.
    """
    rounds = max(math.ceil(math.log2(len(arms))), 1)
    kept, stayed = list(arms), dict.fromkeys(arms, 0)
    for _ in range(rounds):
        more = budget // (rounds * len(kept))
        tally.extend(kept, tally.size(kept[0]) + more)
        for arm in kept:
            stayed[arm] += 1
        kept = sorted(kept, key=lambda arm: -tally.share(arm))[: math.ceil(len(kept) / 2)]
    stayed[kept[0]] += 1
    return stayed


class Selection(NamedTuple):
    """Result of `tell_apart`."""

    best: int
    """The chosen arm."""
    alike: list[int]
    """Arms that cannot be distinguished from it."""
    within: float
    """None of them is better by more than this, with the stated confidence."""


def tell_apart(
    tally: Tally, arms: Sequence[int], *, indifference: float, confidence: float, budget: int
) -> Selection:
    """Simulate until all arms but one are worse, or none can be better by the indifference.

    An arm is worse when the confidence sequence of its difference to the leader excludes zero. The
    others stop at the sample size of Kim and Nelson's procedure, ``N = h² S² / δ²`` with the
    variance S² of a difference and ``h² = 2 ln((k - 1) / (2 α))``. Each error has half of α.

    Parameters
    ----------
    tally : Tally
        With runs of every arm; receives more.
    arms : sequence of int
        The arms, k of them.
    indifference : float
        A difference δ of yields that does not matter, in (0, 1).
    confidence : float
        1 - α, in (0, 1).
    budget : int
        Runs that are added, at most.
    """
    alpha = (1.0 - confidence) / 2
    others = max(len(arms) - 1, 1)
    h_squared = 2.0 * math.log(max(others / (2.0 * alpha), math.e))
    kept, end = list(arms), tally.runs + budget
    while True:
        best = leader(tally, kept)
        apart = {arm: tally.difference(best, arm) for arm in kept if arm != best}
        apart = {
            arm: one for arm, one in apart.items() if one.mean <= one.radius(alpha / others)
        }  # fmt: skip
        kept = [best, *apart]
        needed = {
            arm: math.ceil(h_squared * one.variance / indifference**2) for arm, one in apart.items()
        }
        unsettled = [arm for arm, one in apart.items() if one.runs < needed[arm]]
        if not unsettled:
            return Selection(best, _ranked(tally, apart), indifference)
        sizes = [tally.size(arm) for arm in (best, *unsettled)]
        fewest, most = min(sizes), max(sizes)
        target = min(2 * fewest, most) if fewest < most else math.ceil(HALVING.growth * most)
        target = min(target, max(needed[arm] for arm in unsettled))
        wanted = [arm for arm in (best, *unsettled) if tally.size(arm) < target]
        if tally.cost(wanted, target) > end - tally.runs:
            reached = max(one.variance * h_squared / one.runs for one in apart.values())
            within = max(math.sqrt(reached), indifference)
            return Selection(best, _ranked(tally, apart), within)
        tally.extend(wanted, target)


def _ranked(tally: Tally, arms: Iterable[int]) -> list[int]:
    return sorted(arms, key=lambda arm: -tally.share(arm))


def leader(tally: Tally, arms: Sequence[int]) -> int:
    """Return the arm with the largest share less its standard error: few runs are no merit."""

    def low(arm: int) -> float:
        share = (tally.reached(arm) + 1.0) / (tally.size(arm) + 2.0)
        return share - math.sqrt(share * (1.0 - share) / tally.size(arm))

    return max(arms, key=low)


class CompassPolicy(NamedTuple):
    """Steps and runs of the local search."""

    points: int = 16
    """Settings that begin, of Sobol's sequence, a power of two; chosen by hand."""
    first_step: float = 0.25
    """First step, of the range: about the distance of 16 points in two dimensions; chosen by
    hand."""
    last_step: float = 0.03
    """Steps below this share of the range are not taken; chosen by hand, three halvings."""
    runs: int = 250
    """Runs of a setting at the first step; doubled with every halving, for smaller gains; chosen by
    hand."""
    digits: int = 4
    """Digits of a setting: more than anyone can set; chosen by hand."""


COMPASS: Final = CompassPolicy()


def starting_points(dimensions: int) -> Floats:
    """Return the points that begin a search, in the unit cube, shape (point, dimension)."""
    from scipy.stats import qmc

    drawn: Floats = qmc.Sobol(dimensions, scramble=False).random(2 * COMPASS.points)
    # The first half has the corner at zero and few other levels.
    return drawn[COMPASS.points :]


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
    step, runs, end = COMPASS.first_step, COMPASS.runs, tally.runs + budget
    while step >= COMPASS.last_step:
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
