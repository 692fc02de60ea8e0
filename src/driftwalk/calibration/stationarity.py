"""Whether a recording moves in its second half as in its first, before a model is rejected."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.calibration.problem import Problem
from driftwalk.comparison import KsReference, block_permutation_test
from driftwalk.comparison.aspects import points_distance
from driftwalk.core.arrays import Floats


class StationarityPolicy(NamedTuple):
    """The permutation test of the two halves of a recording."""

    parts: int = 20
    """Parts that are permuted; a change shorter than a part counts as chance. Chosen by hand."""
    fewest_pairs: int = 200
    """Fewest pairs of steps: ten in each part. Chosen by hand."""
    permutations: int = 199
    """Permutations; with the observed halves they resolve a p-value of 0.005; in closed form."""
    level: float = 0.005
    """False-alarm rate: a steady recording is called unsteady by chance once in 200."""
    seed: int = 20
    """Seed of the permutations: chosen by hand; the same recording gives the same p-value."""


STATIONARITY: Final = StationarityPolicy()


class Stationarity(NamedTuple):
    """How far the two halves of a recording are from each other."""

    distance: float
    """KS distance between the steps of the first half and those of the second."""
    expected: float
    """Median KS distance between halves that are made of parts drawn at random."""
    p_value: float
    """Share of such halves that differ as much."""

    @property
    def warning(self) -> str | None:
        """Return a warning where the motion is not steady."""
        if self.p_value > STATIONARITY.level:
            return None
        return (
            f"the motion is not steady: D = {self.distance:.3f} between the recording's own two "
            f"halves, {self.expected:.3f} between halves of parts drawn at random; no steady model "
            "can predict one half from the other, whatever its parameters"
        )


def stationarity_of(problem: Problem) -> Stationarity | None:
    """Compare the halves of a recording with each other, by the statistic of its calibration.

    See `stationarity_of_steps`.
    """

    def distance(first: Floats, second: Floats) -> float:
        tables = [replace(problem.reference, steps=half).table for half in (first, second)]
        return float(problem.statistic.matrix(*tables)[0, 0])

    return stationarity_of_steps(problem.steps, distance)


def stationarity_of_steps(
    steps: Floats, distance: Callable[[Floats, Floats], float]
) -> Stationarity | None:
    """Compare the halves of a series of steps with each other.

    The steps, in their order in time, are cut into 20 parts of equal numbers. Ten of them drawn at
    random, and the other ten, differ by chance and by what lasts less than a part. The first ten
    and the last ten differ by more where the motion changes with time.
    """
    count = len(steps)
    if count < STATIONARITY.fewest_pairs:
        return None
    middle = (count + 1) // 2
    first, second = steps[:middle], steps[middle:]
    drawn = block_permutation_test(
        first,
        second,
        block_length=count // STATIONARITY.parts,
        permutations=STATIONARITY.permutations,
        seed=STATIONARITY.seed,
    )
    return Stationarity(distance(first, second), drawn.noise_floor, drawn.p_value)


def stationarity_of_motion(motion: RecordedMotion) -> Stationarity | None:
    """Compare the halves of a recording with each other, by the distance of its comparison."""
    steps = motion.steps.points
    return stationarity_of_steps(steps, lambda one, other: points_distance(KsReference(one), other))


def unsteady_motion(motion: RecordedMotion) -> list[str]:
    """Return a sentence where the halves of a recording differ, and when the speed changed."""
    stationarity = stationarity_of_motion(motion)
    if stationarity is None or stationarity.warning is None:
        return []
    return [stationarity.warning + _change(motion)]


def _change(motion: RecordedMotion) -> str:
    """Return when the mean speed changed most, and from what to what."""
    steps = motion.steps
    speed = steps.points[:, 0] / motion.plan.short.step_interval
    share = steps.time / motion.duration
    splits = np.arange(0.05, 0.96, 0.05)
    early = np.array([speed[share < split].mean() for split in splits])
    late = np.array([speed[share >= split].mean() for split in splits])
    # Of two means with equal variances: their difference in standard errors goes with this weight.
    weight = np.sqrt(splits * (1.0 - splits))
    best = int(np.nanargmax(np.abs(late - early) * weight))
    return (
        f"; the mean speed changed most at {splits[best] * motion.duration:.0f} s, from "
        f"{1e3 * early[best]:.3g} to {1e3 * late[best]:.3g} mm/s"
    )
