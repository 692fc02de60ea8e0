"""A motion as a row of displacements, of which some are missing or not to be counted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from driftwalk.comparison import StepPlan, apply_steps
from driftwalk.comparison.aspects import AspectPlan, WallDistance, resampled
from driftwalk.core.arrays import Bools, Floats

Instants = Callable[[Floats], Bools]
"""Which instants [s] count."""

SMALLEST: Final = 0.02
"""Logarithms of step lengths begin at this part of the usual step: a rest has one, too."""


@dataclass(frozen=True, eq=False)
class SummaryPlan:
    """How a motion is summarised; the same for a recording and for all its simulations.

    Attributes
    ----------
    aspects : AspectPlan
        Of the time stamps.
    wall : callable
        Distance of points from the wall [m].
    unit : float
        The recording's median step [m]: the scale of lengths.
    depth : float
        The recording's largest distance from the wall [m].
    step_counts : ndarray of bool, shape (steps,)
        Which displacements of one step interval count.
    pair_counts : tuple of ndarray of bool
        Which pairs of steps count, for each step interval.
    """

    aspects: AspectPlan
    wall: WallDistance
    unit: float
    depth: float
    step_counts: Bools
    pair_counts: tuple[Bools, ...]

    @property
    def intervals(self) -> tuple[StepPlan, ...]:
        """Plans of the short steps, and of the longer ones that there are."""
        return (self.aspects.short, *self.aspects.longer)


def plan_summaries(
    aspects: AspectPlan, *, wall: WallDistance, unit: float, depth: float, counts: Instants
) -> SummaryPlan:
    """Decide which displacements are summarised."""
    there = np.zeros(aspects.time.size - 1, dtype=bool)
    there[aspects.step] = True
    there &= counts(aspects.time[:-1])
    pairs = tuple(counts(one.time) for one in (aspects.short, *aspects.longer))
    return SummaryPlan(aspects, wall, unit, depth, there, pairs)


@dataclass(frozen=True, eq=False)
class Series:
    """Displacements of one motion over the step interval.

    Attributes
    ----------
    x, y : ndarray, shape (steps + 1,)
        Positions [m].
    dx, dy, length : ndarray, shape (steps,)
        Displacements and their lengths [m].
    log_length : ndarray, shape (steps,)
        Logarithm of the length over the usual step.
    there : ndarray of bool, shape (steps,)
        Which of them count.
    from_wall : ndarray, shape (steps,)
        Distance from the wall where they begin, over the largest recorded one.
    unit : float
        The usual step [m].
    """

    x: Floats
    y: Floats
    dx: Floats
    dy: Floats
    length: Floats
    log_length: Floats
    there: Bools
    from_wall: Floats
    unit: float


def series_of(plan: SummaryPlan, x: npt.ArrayLike, y: npt.ArrayLike) -> Series:
    """Return the displacements of a motion with samples at the plan's time stamps."""
    px, py = (resampled(plan.aspects.short, values) for values in (x, y))
    dx, dy = np.diff(px), np.diff(py)
    length = np.hypot(dx, dy)
    return Series(
        px, py, dx, dy, length,
        np.log(length / plan.unit + SMALLEST),
        plan.step_counts & np.isfinite(length),
        plan.wall(px, py)[:-1] / plan.depth,
        plan.unit,
    )  # fmt: skip


def turns_of(plan: SummaryPlan, x: npt.ArrayLike, y: npt.ArrayLike) -> list[tuple[Floats, Floats]]:
    """Return step lengths [m] and turning angles [rad] at each interval."""
    found = []
    for one, counts in zip(plan.intervals, plan.pair_counts, strict=True):
        steps = apply_steps(one, np.asarray(x), np.asarray(y))
        chosen = counts[steps.pair]
        found.append((steps.step_length[chosen], steps.turning_angle[chosen]))
    return found
