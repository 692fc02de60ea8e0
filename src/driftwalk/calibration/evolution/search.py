"""Search for the smallest mean of a noisy score over several parameters.

A Sobol' design finds the neighbourhoods, CMA-ES (covariance matrix adaptation; Hansen and
Ostermeier, Evol. Comput. 9 (2001) 159) goes down from the best few, and once more, longer, from the
best end. Each evaluation has fresh random numbers, so the luckiest one says little: the best means
are evaluated again with numbers of their own, and the answer is the best of these.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.run_stages import tell_nobody
from driftwalk.sweep import Store, WorkUnit, run_sweep

Objective = Callable[[Floats, int, int], Floats]
"""Settings in the unit cube (n, parameters), number of the first evaluation, replicates: (n,)."""
Tell = Callable[[int, int], None]

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
    tell: Tell | None = None,
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
    return _Search(objective, parameters, budget or Budget(), seed, tell or tell_nobody).run()


class _Search:
    def __init__(
        self, objective: Objective, parameters: int, budget: Budget, seed: int, tell: Tell
    ) -> None:
        self.objective, self.parameters, self.budget = objective, parameters, budget
        self.seed, self.tell = seed, tell
        self.done = 0
        self.most = budget.evaluations(parameters)

    def run(self) -> SearchResult:
        """Search, and test again."""
        design = self._design()
        scores = self._scores(design, self.budget.replicates)
        starts = self._apart(design, scores)
        optima = [
            self._evolve(start, 0.12, self.budget.short, number)
            for number, start in enumerate(starts, 1)
        ]
        first = self._retest(np.array(optima))
        long = self._evolve(optima[int(first.argmin())], 0.06, self.budget.long, 0)
        last = self._retest(long[None])
        means = np.array([*optima, long])
        found = np.array([*first, *last])
        best = int(found.argmin())
        return SearchResult(means[best], float(found[best]), found, self.done, means)

    def _design(self) -> Floats:
        from scipy.stats import qmc

        engine = qmc.Sobol(self.parameters, seed=self.seed)
        return _rounded(engine.random(self.budget.design))

    def _apart(self, design: Floats, scores: Floats) -> list[Floats]:
        """Return the best settings of the design that are not close to each other."""
        chosen: list[Floats] = []
        for index in np.argsort(scores, kind="stable"):
            # Closer starts would end in the same valley.
            near = [np.sqrt(np.mean((design[index] - one) ** 2)) < 0.15 for one in chosen]
            if not any(near):
                chosen.append(design[index])
            if len(chosen) == self.budget.starts:
                break
        return chosen

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
            settings = _rounded(np.array([evolution.ask() for _ in range(size)]))
            scores = self._scores(settings, self.budget.replicates)
            evolution.tell(
                [(one, float(score)) for one, score in zip(settings, scores, strict=True)]
            )
        return _rounded(np.clip(evolution.mean, 0.0, 1.0))

    def _retest(self, means: Floats) -> Floats:
        return self._scores(means, self.budget.retest)

    def _scores(self, settings: Floats, replicates: int) -> Floats:
        scores = self.objective(settings, self.done, replicates)
        self.done += len(settings)
        self.tell(self.done, self.most)
        return np.asarray(scores)


def _rounded(settings: Floats) -> Floats:
    return np.asarray(np.round(settings / RESOLUTION) * RESOLUTION)
