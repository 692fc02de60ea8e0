"""The aspects of a motion: what two-dimensional distances compare beyond one kind of step.

One kind of step does not determine a model of more than three parameters. Each aspect is a cloud of
points in a plane, compared by its own two-dimensional Kolmogorov-Smirnov distance:

========  ============================================================================
steps     step length [m] and turning angle [rad] at the step interval: the paper's
steps_3   the same over 3 intervals
steps_9   the same over 9 intervals
frame     the next displacement [m] along and across the last step; defined at rest too
wall      distance from the wall [m] and step length [m]
memory    step lengths [m] now and three intervals later
========  ============================================================================
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from driftwalk.comparison.aspects.plan import ASPECT_POLICY, AspectPlan
from driftwalk.comparison.plan import StepPlan, apply_steps

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
WallDistance = Callable[[Floats, Floats], Floats]
"""Distance from the wall [m] of points x, y [m]; positive inside."""

ASPECTS: Final = (
    "steps",
    *(f"steps_{factor}" for factor in ASPECT_POLICY.longer),
    "frame",
    "wall",
    "memory",
)
"""All aspects, the paper's first."""


@dataclass(frozen=True, eq=False)
class Aspect:
    """One aspect of one motion: points in a plane.

    Attributes
    ----------
    name : str
        One of `ASPECTS`.
    points : ndarray, shape (n, 2)
        The points.
    time : ndarray, shape (n,)
        When each was [s].
    """

    name: str
    points: Floats
    time: Floats

    def within(self, chosen: Bools) -> Aspect:
        """Return some of the points."""
        return Aspect(self.name, np.ascontiguousarray(self.points[chosen]), self.time[chosen])


def form_aspects(
    plan: AspectPlan, x: npt.ArrayLike, y: npt.ArrayLike, *, wall: WallDistance | None = None
) -> tuple[Aspect, ...]:
    """Return the aspects of a trajectory with samples at the plan's time stamps.

    Parameters
    ----------
    plan : AspectPlan
        From `plan_aspects`.
    x, y : array_like, shape (plan.samples,)
        Positions [m]; NaN where a sample is missing: points that need it are left out.
    wall : callable, optional
        Distance from the wall; without it the aspect "wall" is left out.

    Examples
    --------
    >>> from driftwalk.comparison.aspects.plan import plan_aspects
    >>> plan = plan_aspects(np.arange(400) / 10.0)
    >>> x = np.cumsum(np.ones(400))
    >>> [one.name for one in form_aspects(plan, x, 0 * x)]
    ['steps', 'steps_3', 'steps_9', 'frame', 'memory']
    """
    x, y = np.asarray(x), np.asarray(y)
    names = ["steps"]
    plans = [plan.short]
    for factor, longer in zip(ASPECT_POLICY.longer, plan.longer, strict=False):
        names.append(f"steps_{factor}")
        plans.append(longer)
    found = [_steps(name, one, x, y) for name, one in zip(names, plans, strict=True)]
    px, py = (resampled(plan.short, values) for values in (x, y))
    dx, dy = np.diff(px), np.diff(py)
    length = np.hypot(dx, dy)
    found.append(_frame(plan, dx, dy, length))
    if wall is not None:
        at = plan.step
        middle = 0.5 * (px[at] + px[at + 1]), 0.5 * (py[at] + py[at + 1])
        found.append(_aspect("wall", wall(*middle), length[at], plan.time[at]))
    later = plan.later
    found.append(
        _aspect("memory", length[later], length[later + ASPECT_POLICY.later], plan.time[later])
    )
    return tuple(found)


def _steps(name: str, plan: StepPlan, x: Floats, y: Floats) -> Aspect:
    found = apply_steps(plan, x, y)
    points = np.column_stack([found.step_length, found.turning_angle])
    return Aspect(name, np.ascontiguousarray(points), plan.time[found.pair])


def resampled(plan: StepPlan, values: npt.ArrayLike) -> Floats:
    """Return the resampled positions [m]."""
    taken = np.asarray(values, dtype=np.float64)
    right = np.where(plan.weight > 0.0, plan.left + 1, plan.left)
    return np.asarray((1.0 - plan.weight) * taken[plan.left] + plan.weight * taken[right])


def _frame(plan: AspectPlan, dx: Floats, dy: Floats, length: Floats) -> Aspect:
    """Return the displacement along and across the latest step that was one.

    A body at rest keeps the direction of its last step, back to the last gap.
    """
    triple = np.asarray(plan.short.triple, dtype=np.int64)
    index = np.arange(length.size)
    latest = np.maximum.accumulate(np.where(length > 0.0, index, -1))
    # Where an unbroken row of steps begins: at a step whose predecessor is none.
    follows = np.zeros(length.size, dtype=bool)
    follows[plan.step] = True
    begins = follows & ~np.concatenate([[False], follows[:-1]])
    first = np.maximum.accumulate(np.where(begins, index, 0))
    known = (latest[triple] >= first[triple]) & (latest[triple] >= 0)
    now, before = triple[known] + 1, latest[triple[known]]
    ahead_x, ahead_y = dx[before] / length[before], dy[before] / length[before]
    along = dx[now] * ahead_x + dy[now] * ahead_y
    across = dy[now] * ahead_x - dx[now] * ahead_y
    return _aspect("frame", along, across, plan.time[now])


def _aspect(name: str, first: Floats, second: Floats, time: Floats) -> Aspect:
    sound = np.isfinite(first) & np.isfinite(second)
    points = np.column_stack([first[sound], second[sound]])
    return Aspect(name, np.ascontiguousarray(points), time[sound])
