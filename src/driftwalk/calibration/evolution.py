"""Evolutionary search for the smallest mean of a noisy score over several parameters.

A Sobol' design finds the neighbourhoods, CMA-ES (covariance matrix adaptation; Hansen and
Ostermeier, Evol. Comput. 9 (2001) 159) goes down from the best few, and once more, longer, from the
best end. Each evaluation has fresh random numbers, so the luckiest one says little: the best means
are evaluated again with numbers of their own, and the answer is the best of these.

The score of a motion model is its mean distance from a recording, in all aspects of its motion,
over the recording's own floors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Final, NamedTuple

import numpy as np

from driftwalk.comparison.aspects import (
    Aspect,
    AspectPlan,
    AspectReference,
    WallDistance,
    form_aspects,
)
from driftwalk.conditions import Conditions
from driftwalk.core.arrays import Floats
from driftwalk.core.processors import map_in_threads
from driftwalk.core.progress import Progress, ignore_progress
from driftwalk.core.random_streams import trial_in, world_keys
from driftwalk.motion import MotionModel, Worlds
from driftwalk.motion.score import broken_worlds
from driftwalk.schema import Parameter
from driftwalk.simulation.backend import wall_depth
from driftwalk.sweep import Store, WorkUnit, run_sweep


@dataclass(frozen=True, eq=False)
class AspectObjective:
    """The mean of distance over floor, as `search_minimum` wants it.

    Attributes
    ----------
    model : MotionModel
        What is simulated.
    ranges : tuple of Parameter
        Its parameters with the ranges of the search; the unit cube is their coordinates.
    like : Conditions
        The conditions of the recording.
    plan : AspectPlan
        How a world shows its aspects.
    reference : AspectReference
        The recording's.
    seed : int
        Seed of the worlds.
    """

    model: MotionModel
    ranges: tuple[Parameter, ...]
    like: Conditions
    plan: AspectPlan
    reference: AspectReference
    seed: int

    def __call__(self, settings: Floats, first: int, replicates: int) -> Floats:
        """Return the mean score of each setting, shape (settings,)."""
        distances = self.distances(settings, replicates, stage="evolution", first=first)
        return np.asarray(self.reference.overall(distances).mean(axis=1))

    def distances(self, settings: Floats, replicates: int, *, stage: str, first: int = 0) -> Floats:
        """Return the distance of every world, shape (settings, replicates, aspects).

        A world that lost its numbers is as far as can be, 1.
        """
        seen = self.simulated(settings, replicates, stage=stage, first=first)
        found = self.reference.distances(self.aspects(seen), threads=self.like.threads)
        found[broken_worlds(seen.status)] = 1.0
        return found.reshape(len(settings), replicates, -1)

    def simulated(self, settings: Floats, replicates: int, *, stage: str, first: int = 0) -> Worlds:
        """Return simulated worlds, replicates fastest."""
        trial = trial_in(stage, np.arange(first, first + len(settings)))
        keys = world_keys(
            self.seed, trial=trial[:, None], replicate=np.arange(replicates)[None, :]
        ).ravel()
        values = {
            name: np.repeat(column, replicates) for name, column in self.values(settings).items()
        }
        return self.model.simulate(values, self.like, keys)

    def aspects(self, seen: Worlds) -> list[Sequence[Aspect]]:
        """Return the aspects of worlds."""
        wall = wall_distance(self.like)

        def one(world: tuple[Floats, Floats]) -> Sequence[Aspect]:
            return form_aspects(self.plan, *world, wall=wall)

        return map_in_threads(one, zip(seen.x, seen.y, strict=True), self.like.threads)

    def values(self, settings: Floats) -> dict[str, Floats]:
        """Return the values of the parameters at points of the unit cube."""
        columns = np.atleast_2d(settings).T
        return {
            one.name: one.value_at(column) for column, one in zip(columns, self.ranges, strict=True)
        }


def wall_distance(like: Conditions) -> WallDistance:
    """Return the function that gives a point's distance from the wall of a recording [m].

    It pickles.
    """
    return partial(wall_depth, like.tank)


Objective = Callable[[Floats, int, int], Floats]
"""Settings in the unit cube (n, parameters), number of the first evaluation, replicates: (n,)."""

RESOLUTION: Final = 2.0**-20
"""Settings are multiples of this part of a range: the last bits of linear algebra, which differ
between machines, then rarely reach a simulation."""


@dataclass(frozen=True)
class Budget:
    """How much a search may simulate.

    The default spends its worlds on many starts and generations, one world per setting: a setting
    that was lucky is forgotten in the next generation, and a start in the wrong valley is not.

    Attributes
    ----------
    design : int
        Settings of the Sobol' design, a power of two.
    starts : int
        Short searches.
    short, long : int
        Generations of a short search, and of the long one.
    replicates : int
        Worlds per setting.
    retest : int
        Worlds for each mean that is evaluated again.
    """

    design: int = 512
    starts: int = 6
    short: int = 25
    long: int = 140
    replicates: int = 1
    retest: int = 8

    def evaluations(self, parameters: int) -> int:
        """Return how many settings are simulated at most, those that are tested again included."""
        generations = self.starts * self.short + self.long
        return self.design + generations * population(parameters) + self.starts + 1


class SearchResult(NamedTuple):
    """The answer of a search."""

    best: Floats
    """Best setting, in the unit cube."""
    score: float
    """Its mean score, from worlds that the search has not seen."""
    optimum_scores: Floats
    """Scores at the ends of the short searches and of the long one: how much they differ says how
    far the search is to be trusted."""
    evaluations: int
    settings: Floats
    """The settings at these ends, shape (ends, parameters)."""


@dataclass(frozen=True, eq=False)
class CachedObjective:
    """An objective that computes nothing twice.

    A search asks for the same settings in the same order whenever it is run, so a call is known by
    the numbers of its evaluations.

    Attributes
    ----------
    objective : callable
        Scores of settings, see `search_minimum`.
    store : Store or None
        Where they are kept; None keeps nothing.

    Examples
    --------
    >>> from driftwalk.sweep import MemoryStore
    >>> retained = CachedObjective(lambda settings, *_: settings.sum(axis=1), MemoryStore())
    >>> retained(np.array([[0.25, 0.5]]), 0, 2).tolist()
    [0.75]
    """

    objective: Objective
    store: Store | None

    def __call__(self, settings: Floats, first: int, replicates: int) -> Floats:
        """Return the scores of settings, shape (settings,)."""
        unit = WorkUnit(first, first + len(settings), {})

        def compute(_: WorkUnit) -> dict[str, Floats]:
            return {"score": np.asarray(self.objective(settings, first, replicates))}

        return np.asarray(run_sweep(compute, [unit], store=self.store)["score"])


def population(parameters: int) -> int:
    """Return the settings of a generation.

    Examples
    --------
    >>> population(8)
    12
    """
    usual = 4 + int(3 * np.log(max(parameters, 1)))
    return 2 * ((usual + 2) // 2)


def search_minimum(
    objective: Objective,
    parameters: int,
    *,
    budget: Budget | None = None,
    seed: int = 0,
    tell: Progress | None = None,
) -> SearchResult:
    """Search the unit cube for the smallest mean score.

    Parameters
    ----------
    objective : callable
        Scores of settings; random numbers follow from the numbers of the evaluations.
    parameters : int
        Dimensions of the cube.
    budget : Budget, optional
        How much to simulate.
    seed : int
        Of the design and of the evolution.
    tell : callable, optional
        Called with the settings done and the largest number of them.

    Examples
    --------
    >>> def bowl(settings, first, replicates):
    ...     return ((settings - 0.3) ** 2).sum(axis=1)
    >>> found = search_minimum(bowl, 3)
    >>> bool(np.abs(found.best - 0.3).max() < 0.01)
    True
    """
    return _Search(objective, parameters, budget or Budget(), seed, tell or ignore_progress).run()


@dataclass
class _Search:
    objective: Objective
    parameters: int
    budget: Budget
    seed: int
    tell: Progress
    done: int = 0
    """Settings evaluated so far: they are the addresses of the next random numbers."""

    def run(self) -> SearchResult:
        """Search, and test again."""
        from scipy.stats import qmc

        design = rounded(qmc.Sobol(self.parameters, seed=self.seed).random(self.budget.design))
        scores = self._scores(design, self.budget.replicates)
        # Closer starts would end in the same valley.
        best_first = design[np.argsort(scores, kind="stable")]
        starts = islice(distinct(best_first, 0.15), self.budget.starts)
        optima = [
            self._evolve(start, 0.12, self.budget.short, number)
            for number, start in enumerate(starts, 1)
        ]
        first = self._scores(np.array(optima), self.budget.retest)
        long = self._evolve(optima[int(first.argmin())], 0.06, self.budget.long, 0)
        last = self._scores(long[None], self.budget.retest)
        means = np.array([*optima, long])
        found = np.array([*first, *last])
        best = int(found.argmin())
        return SearchResult(means[best], float(found[best]), found, self.done, means)

    def _evolve(self, start: Floats, sigma: float, generations: int, number: int) -> Floats:
        """Return the mean of the last generation's distribution."""
        from cmaes import CMA

        size = population(self.parameters)
        bounds = np.tile([0.0, 1.0], (self.parameters, 1))
        evolution = CMA(
            mean=np.clip(start, 0.01, 0.99),
            sigma=sigma,
            bounds=bounds,
            # The generator of the older kind that it takes has seeds of 32 bits.
            seed=(self.seed * 1009 + number) % 2**32,
            population_size=size,
        )
        settings = np.empty((0, self.parameters))
        for _ in range(generations):
            if evolution.should_stop():
                break
            settings = rounded(np.array([evolution.ask() for _ in range(size)]))
            scores = self._scores(settings, self.budget.replicates)
            evolution.tell(
                [(one, float(score)) for one, score in zip(settings, scores, strict=True)]
            )
        return rounded(np.clip(evolution.mean, 0.0, 1.0))

    def _scores(self, settings: Floats, replicates: int) -> Floats:
        scores = self.objective(settings, self.done, replicates)
        self.done += len(settings)
        self.tell(self.done, self.budget.evaluations(self.parameters))
        return np.asarray(scores)


def rounded(values: Floats) -> Floats:
    """Return multiples of a small number: last bits of linear algebra differ between machines."""
    return np.asarray(np.round(values / RESOLUTION) * RESOLUTION)


def distinct(settings: Floats, apart: float) -> Iterator[Floats]:
    """Yield the settings that are not closer than `apart`, a part of a range, to one before."""
    found: list[Floats] = []
    for setting in settings:
        if all(np.sqrt(np.mean((setting - one) ** 2)) >= apart for one in found):
            found.append(setting)
            yield setting
