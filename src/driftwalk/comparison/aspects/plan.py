"""Samples that form each aspect of a motion, decided once from the time stamps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.comparison.plan import StepPlan, plan_steps
from driftwalk.core.errors import InputError

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class AspectPolicy(NamedTuple):
    """Which further steps the aspects of a motion compare."""

    longer: tuple[int, ...] = (3, 9)
    """Longer steps, in step intervals; chosen by hand."""
    later: int = 3
    """Step intervals between the two steps whose lengths are compared; chosen by hand."""


ASPECT_POLICY: Final = AspectPolicy()

FEWEST_POINTS: Final = 30


@dataclass(frozen=True, eq=False)
class AspectPlan:
    """How the aspects of a motion are formed from a series of positions.

    Attributes
    ----------
    short : StepPlan
        Steps of one interval.
    longer : tuple of StepPlan
        Steps of 3 and 9 intervals, where the recording has them.
    step : ndarray of int, shape (steps,)
        First point of every short step.
    later : ndarray of int, shape (pairs,)
        First point of every short step that has another one three intervals later.
    time : ndarray, shape (points,)
        When the points of `short` are [s].
    """

    short: StepPlan
    longer: tuple[StepPlan, ...]
    step: Integers
    later: Integers
    time: Floats

    @property
    def samples(self) -> int:
        """Samples of the series that the plan was made for."""
        return self.short.samples


def plan_aspects(time: npt.ArrayLike, *, step_interval: float | None = None) -> AspectPlan:
    """Decide from time stamps which positions show which aspect.

    Parameters
    ----------
    time : array_like, shape (n,)
        Time stamps of the samples that are present [s], increasing.
    step_interval : float, optional
        Time between the positions of a short step [s]; default: the median sampling interval.

    Raises
    ------
    InputError
        As `plan_steps`.

    Examples
    --------
    >>> plan = plan_aspects(np.arange(400) / 10.0)
    >>> plan.short.pairs, [one.pairs for one in plan.longer], plan.later.size
    (398, [132, 43], 396)
    """
    stamps = np.asarray(time, dtype=np.float64)
    short = plan_steps(stamps, step_interval=step_interval)
    longer = []
    for factor in ASPECT_POLICY.longer:
        try:
            plan = plan_steps(stamps, step_interval=factor * short.step_interval)
        except InputError:
            continue
        if plan.pairs >= FEWEST_POINTS:
            longer.append(plan)
    # A step is there where it is the first or the second one of a pair.
    follows = np.zeros(short.points, dtype=bool)
    follows[short.triple] = follows[short.triple + 1] = True
    count = max(follows.size - ASPECT_POLICY.later, 0)
    unbroken = np.ones(count, dtype=bool)
    for k in range(ASPECT_POLICY.later + 1):
        unbroken &= follows[k : k + count]
    weight = short.weight
    right = np.minimum(short.left + (weight > 0.0), stamps.size - 1)
    point_time = (1.0 - weight) * stamps[short.left] + weight * stamps[right]
    return AspectPlan(
        short, tuple(longer), np.flatnonzero(follows), np.flatnonzero(unbroken), point_time
    )
