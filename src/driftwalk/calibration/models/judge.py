"""One motion model on a recording: searched on the even blocks of time, judged on the odd ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.evolution import (
    AspectObjective,
    Budget,
    recorded_ranges,
    search_minimum,
)
from driftwalk.calibration.models.recorded import RecordedMotion
from driftwalk.comparison.aspects import AspectReference
from driftwalk.conditions import Conditions
from driftwalk.motion import MotionModel, ParticleModel
from driftwalk.motion.score import broken_worlds
from driftwalk.schema import Parameter

Floats = npt.NDArray[np.float64]
Tell = Callable[[int, int], None]

JUDGED: Final = 20
"""Worlds by which the answer of a search is judged."""


class Contestant(NamedTuple):
    """A model that takes part in a comparison."""

    model: MotionModel
    like: Conditions
    ranges: tuple[Parameter, ...]
    """Of the search; none for a walk that was fitted by other means."""
    numbers: int
    """That are fitted."""
    baseline: bool


class Judged(NamedTuple):
    """A model's answer and how far it is from the recording."""

    point: Floats
    """In the unit cube of the ranges."""
    trained: Floats
    """Median distance from the even blocks in each aspect, shape (aspects,)."""
    held: Floats
    """The same from the odd blocks."""
    score: float
    """Mean of distance over floor in the odd blocks."""
    without: Floats
    """The same without each of the odd blocks, shape (blocks / 2,)."""
    checks: Floats
    """Facts that are not fitted, of each world, shape (worlds, checks)."""
    ends: Floats
    """Scores at the ends of the searches."""
    evaluations: int


def contestant(model: MotionModel, motion: RecordedMotion, like: Conditions) -> Contestant:
    """Return a model with the ranges of its search: of the family those of the recording."""
    ranges = model.parameters
    if isinstance(model, ParticleModel):
        ranges = recorded_ranges(ranges, motion.scales)
    return Contestant(model, like, ranges, len(ranges), baseline=False)


def judge(
    entry: Contestant, motion: RecordedMotion, *, budget: Budget, seed: int, tell: Tell | None
) -> Judged:
    """Search a model on the even blocks of a recording, and judge it on the odd ones."""
    objective = AspectObjective(
        entry.model, entry.ranges, entry.like, motion.plan, motion.fitted, seed
    )
    if entry.ranges:
        found = search_minimum(objective, len(entry.ranges), budget=budget, seed=seed, tell=tell)
        point, ends, evaluations = found.best, found.ends, found.evaluations
    else:
        point, ends, evaluations = np.empty(0), np.empty(0), 0
    seen = objective.simulated(point[None], JUDGED, stage="judged")
    aspects, broken = objective.aspects(seen), broken_worlds(seen.status)

    def distances(reference: AspectReference) -> Floats:
        apart = reference.distances(aspects, threads=entry.like.threads)
        apart[broken] = 1.0
        return apart

    held = distances(motion.held)
    return Judged(
        point=point,
        trained=np.median(distances(motion.fitted), axis=0),
        held=np.median(held, axis=0),
        score=float(motion.held.overall(held).mean()),
        without=np.array(
            [float(part.overall(distances(part)).mean()) for part in motion.without_each_block]
        ),
        checks=np.array([motion.checks(x, y) for x, y in zip(seen.x, seen.y, strict=True)]),
        ends=ends,
        evaluations=evaluations,
    )
