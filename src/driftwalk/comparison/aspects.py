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

The noise floor of an aspect is the distance of the recording from itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.comparison.ks import KsReference
from driftwalk.comparison.plan import StepPlan, apply_steps, plan_steps
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.processors import map_in_threads


class AspectPolicy(NamedTuple):
    """Which further steps the aspects of a motion compare, and how far chance takes them apart."""

    longer: tuple[int, ...] = (3, 9)
    """Longer steps, in step intervals; chosen by hand."""
    later: int = 3
    """Step intervals between the two steps whose lengths are compared; chosen by hand."""
    fewest_points: int = 30
    """Points without which an aspect is left out, as pairs of steps; chosen by hand."""
    blocks: int = 20
    """Blocks of time into which a recording is cut; an even number, chosen by hand."""
    halvings: int = 16
    """Random halves of the blocks from which the floor is taken; chosen by hand."""


ASPECT_POLICY: Final = AspectPolicy()


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
        if plan.pairs >= ASPECT_POLICY.fewest_points:
            longer.append(plan)
    # A step is there where it is the first or the second one of a pair.
    follows = np.zeros(short.points, dtype=bool)
    follows[short.triple] = follows[short.triple + 1] = True
    count = max(follows.size - ASPECT_POLICY.later, 0)
    unbroken = np.ones(count, dtype=bool)
    for k in range(ASPECT_POLICY.later + 1):
        unbroken &= follows[k : k + count]
    point_time = resampled(short, stamps)
    return AspectPlan(
        short, tuple(longer), np.flatnonzero(follows), np.flatnonzero(unbroken), point_time
    )


WallDistance = Callable[[Floats, Floats], Floats]
"""Distance from the wall [m] of points x, y [m]; positive inside."""


@dataclass(frozen=True, eq=False)
class Aspect:
    """One aspect of one motion: points in a plane.

    Attributes
    ----------
    name : str
        Its name: "steps", "steps_3", "steps_9", "frame", "wall" or "memory".
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
    x, y : array_like, shape (plan.short.samples,)
        Positions [m]; NaN where a sample is missing: points that need it are left out.
    wall : callable, optional
        Distance from the wall; without it the aspect "wall" is left out.

    Examples
    --------
    >>> from driftwalk.comparison.aspects import plan_aspects
    >>> plan = plan_aspects(np.arange(400) / 10.0)
    >>> x = np.cumsum(np.ones(400))
    >>> [one.name for one in form_aspects(plan, x, 0 * x)]
    ['steps', 'steps_3', 'steps_9', 'frame', 'memory']
    """
    x, y = np.asarray(x), np.asarray(y)
    # The recording may be too short for the longest steps.
    names = [f"steps_{factor}" for factor in ASPECT_POLICY.longer]
    plans = {"steps": plan.short, **dict(zip(names, plan.longer, strict=False))}
    found = [_steps(name, one, x, y) for name, one in plans.items()]
    px, py = (resampled(plan.short, values) for values in (x, y))
    dx, dy = np.diff(px), np.diff(py)
    length = np.hypot(dx, dy)
    found.append(_frame(plan, dx, dy, length))
    if wall is not None:
        at = plan.step
        middle = 0.5 * (px[at] + px[at + 1]), 0.5 * (py[at] + py[at + 1])
        found.append(_aspect("wall", wall(*middle), length[at], plan.time[at]))
    now, later = length[plan.later], length[plan.later + ASPECT_POLICY.later]
    found.append(_aspect("memory", now, later, plan.time[plan.later]))
    return tuple(found)


def _steps(name: str, plan: StepPlan, x: Floats, y: Floats) -> Aspect:
    found = apply_steps(plan, x, y)
    return _aspect(name, found.step_length, found.turning_angle, plan.time[found.pair])


def resampled(plan: StepPlan, values: npt.ArrayLike) -> Floats:
    """Return what a series has at the points of a plan, such as positions [m]."""
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


@dataclass(frozen=True, eq=False)
class AspectReference:
    """The aspects of a recording, ready for comparison.

    Attributes
    ----------
    names : tuple of str
        Names of the aspects.
    floor : ndarray, shape (aspects,)
        Distance of the recording from itself: between random halves of its blocks of time, over
        the square root of 2, for a half has half the points.
    """

    names: tuple[str, ...]
    floor: Floats
    _native: tuple[KsReference, ...]

    def distances(self, motions: Sequence[Sequence[Aspect]], *, threads: int = 1) -> Floats:
        """Return the KS distance of each motion in each aspect, shape (motions, aspects).

        1 where a motion has no point.

        Parameters
        ----------
        motions : sequence of sequences of Aspect
            Each with the aspects of the reference, in its order.
        threads : int
            Threads; the result does not depend on it.
        """

        def one(aspects: Sequence[Aspect]) -> list[float]:
            by_name = {aspect.name: aspect.points for aspect in aspects}
            return [
                points_distance(reference, by_name[name])
                for name, reference in zip(self.names, self._native, strict=True)
            ]

        found = map_in_threads(one, motions, threads)
        return np.array(found, dtype=np.float64).reshape(len(motions), len(self.names))

    def overall(self, distances: Floats) -> Floats:
        """Return the mean over the aspects of distance over floor, shape (motions,)."""
        return np.asarray((distances / self.floor).mean(axis=-1))


def aspect_reference(
    aspects: Sequence[Aspect], *, duration: float, seed: int = 0
) -> AspectReference:
    """Return the aspects of a recording, ready for comparison.

    Parameters
    ----------
    aspects : sequence of Aspect
        Of the recording, from `form_aspects`; those with fewer than 30 points are left out.
    duration : float
        From the first to the last sample [s].
    seed : int
        Seed of the random halves.

    Raises
    ------
    InputError
        When no aspect has 30 points.

    Examples
    --------
    >>> from driftwalk.comparison.aspects import form_aspects
    >>> from driftwalk.comparison.aspects import plan_aspects
    >>> x, y = np.cumsum(np.random.default_rng(1).normal(size=(2, 2000)), axis=1)
    >>> aspects = form_aspects(plan_aspects(np.arange(2000.0)), x, y)
    >>> reference = aspect_reference(aspects, duration=1999.0)
    >>> float(reference.distances([aspects]).max())
    0.0
    """
    kept = [one for one in aspects if len(one.points) >= ASPECT_POLICY.fewest_points]
    if not kept:
        raise InputError(
            f"no aspect of the motion has {ASPECT_POLICY.fewest_points} points: the recording "
            "hardly moves, or is too short for the step interval (`step_interval`)"
        )
    random = np.random.default_rng(seed)
    blocks = ASPECT_POLICY.blocks
    halves = [random.permutation(blocks) < blocks // 2 for _ in range(ASPECT_POLICY.halvings)]
    floor = [_between_halves(one, duration, halves, over=np.sqrt(2.0)) for one in kept]
    references = tuple(KsReference(one.points) for one in kept)
    return AspectReference(tuple(one.name for one in kept), np.array(floor), references)


def block_of(time: npt.ArrayLike, duration: float) -> Integers:
    """Return the block of time of each instant, 0 to 19.

    Examples
    --------
    >>> block_of([0.0, 4.9, 5.1, 100.0], 100.0).tolist()
    [0, 0, 1, 19]
    """
    share = np.asarray(time, dtype=np.float64) / duration
    return np.clip((share * ASPECT_POLICY.blocks).astype(np.int64), 0, ASPECT_POLICY.blocks - 1)


def interleaved(aspects: Sequence[Aspect], *, duration: float) -> tuple[list[Aspect], list[Aspect]]:
    """Return the aspects in the even and in the odd blocks of a recording."""
    even, odd = (
        [one.within(block_of(one.time, duration) % 2 == which) for one in aspects]
        for which in (0, 1)
    )
    return even, odd


def points_distance(reference: KsReference, points: Floats) -> float:
    """Return the KS distance, without a word on ties; 1 where there is no point."""
    if not len(points):
        return 1.0
    d1, d2, *_ = reference.native.compare(points, False)
    return (d1 + d2) / (2 * len(reference) * len(points))


def own_distance(aspect: Aspect, *, duration: float, seed: int = 0) -> float:
    """Return how far the parts of a recording are from each other, when they are interleaved.

    The mean over random choices of one block of each two that follow each other: what changes
    slowly is in either part.

    Parameters
    ----------
    aspect : Aspect
        Of the recording.
    duration : float
        From the first to the last sample [s].
    seed : int
        Seed of the choices.
    """
    random = np.random.default_rng(seed)
    halvings, blocks = ASPECT_POLICY.halvings, ASPECT_POLICY.blocks
    first = random.integers(0, 2, size=(halvings, blocks // 2))
    halves = np.stack([first == 0, first == 1], axis=2).reshape(halvings, blocks)
    return _between_halves(aspect, duration, list(halves))


def _between_halves(
    aspect: Aspect, duration: float, halves: Sequence[Bools], *, over: float = 1.0
) -> float:
    """Return the mean distance between halves of the blocks and the rest, over a number."""
    block = block_of(aspect.time, duration)
    found = []
    for half in halves:
        chosen = half[block]
        if chosen.any() and not chosen.all():
            first, second = aspect.within(chosen), aspect.within(~chosen)
            found.append(points_distance(KsReference(first.points), second.points))
    # A recording that does not differ from itself: as many steps as it takes to see a difference.
    least = 1.0 / len(aspect.points)
    return max(float(np.mean(found)) / over, least) if found else 1.0
