"""How far settings of a motion model are from a recording, in all aspects of its motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from driftwalk.comparison.aspects import (
    Aspect,
    AspectPlan,
    AspectReference,
    WallDistance,
    form_aspects,
)
from driftwalk.conditions import Conditions
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.processors import map_in_threads
from driftwalk.core.random_streams import trial_in
from driftwalk.core.seeds import world_keys
from driftwalk.motion import MotionModel, Worlds
from driftwalk.motion.score import broken_worlds
from driftwalk.schema import Parameter
from driftwalk.simulation.backend import wall_edges


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
        worlds, broken = self.worlds(settings, replicates, stage=stage, first=first)
        found = self.reference.distances(worlds, threads=self.like.threads)
        found[broken] = 1.0
        return found.reshape(len(settings), replicates, -1)

    def worlds(
        self, settings: Floats, replicates: int, *, stage: str, first: int = 0
    ) -> tuple[list[Sequence[Aspect]], Bools]:
        """Return the aspects of simulated worlds, replicates fastest, and which are broken."""
        seen = self.simulated(settings, replicates, stage=stage, first=first)
        return self.aspects(seen), broken_worlds(seen.status)

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
    radius = like.tank.radius_m
    if radius is not None:
        return partial(_from_circle, radius)
    return partial(_from_edges, wall_edges(like.tank))


def _from_circle(radius: float, x: Floats, y: Floats) -> Floats:
    return np.asarray(radius - np.hypot(x, y))


def _from_edges(edges: Floats, x: Floats, y: Floats) -> Floats:
    return np.asarray(np.min([far - nx * x - ny * y for nx, ny, far in edges], axis=0))
