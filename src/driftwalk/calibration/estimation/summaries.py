"""A motion in some hundred numbers: the summaries that the second stage of an estimation matches.

Two-dimensional distances find the neighbourhood of a model's parameters and leave most of them
open. The summaries tell more: quantiles of step lengths, turns over several times, memory of the
speed and of the velocity, displacement, place, and how bouts above and below a speed follow each
other. Each is a smooth function of the parameters, whatever the model. They are taken of whole
recordings, and of the blocks of time that are searched.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import ClassVar, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.evolution import AspectObjective, wall_distance
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.comparison import StepPlan, apply_steps
from driftwalk.comparison.aspects import AspectPlan, WallDistance, block_of, resampled
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.processors import map_in_threads, one_blas_thread
from driftwalk.core.progress import Progress
from driftwalk.motion.score import broken_worlds
from driftwalk.sweep import Store, WorkUnit, run_sweep, work_units

Instants = Callable[[Floats], Bools]
"""Which instants [s] count."""

SMALLEST: Final = 0.02
"""Logarithms of step lengths begin at this part of the usual step: a rest has one, too; chosen by
hand."""


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


Numbers = Iterator[float]


class SummaryPolicy(NamedTuple):
    """Which statistics summarise a motion.

    Chosen by hand. The errors of the estimates that follow from them are counted by
    `studies/motion_models/recover.py`.
    """

    step_quantiles: tuple[float, ...] = (0.02, 0.1, 0.25, 0.5, 0.75, 0.9, 0.98)
    """Of the logarithm of step lengths; chosen by hand."""
    longer_quantiles: tuple[float, ...] = (0.05, 0.25, 0.5, 0.75, 0.95)
    """Of steps over longer intervals, and of changes of speed; chosen by hand."""
    memory_lags: tuple[int, ...] = (1, 2, 3, 5, 10, 20, 50)
    """Of autocorrelations, in step intervals; chosen by hand."""
    displacement_lags: tuple[int, ...] = (1, 3, 10, 30, 100)
    """Of mean squared displacements, in step intervals; chosen by hand."""
    wall_quantiles: tuple[float, ...] = (0.05, 0.25, 0.5, 0.75)
    """Of the distance from the wall; chosen by hand."""
    wall_edges: tuple[float, ...] = (0.05, 0.15, 0.4)
    """Ends of zones from the wall inwards, in parts of the largest distance; chosen by hand."""
    speed_levels: tuple[float, ...] = (0.3, 0.7, 1.2)
    """Speeds that separate fast bouts from slow ones, in usual steps; chosen by hand."""
    faster: float = 0.4
    """Rise of the logarithm of the speed that counts as faster; slower likewise; chosen by hand."""
    steady: float = 0.1
    """Change of the logarithm of the speed below which it is steady; chosen by hand."""
    straight: float = 0.3
    """Turns [rad] above this count alike: the mean is of small turns; chosen by hand."""
    fewest: int = 4
    """Fewest values of a mean; of fewer it would be chance and counts as 0."""


SUMMARIES: Final = SummaryPolicy()


def summarise(plan: SummaryPlan, x: npt.ArrayLike, y: npt.ArrayLike) -> Floats:
    """Return the summaries of a motion, shape (summaries,).

    Examples
    --------
    >>> from driftwalk.comparison.aspects import plan_aspects
    >>> from driftwalk.calibration.estimation.summaries import plan_summaries
    >>> aspects = plan_aspects(np.arange(400) / 10.0)
    >>> plan = plan_summaries(
    ...     aspects, wall=lambda x, y: 100 - np.hypot(x, y), unit=1.0, depth=100.0,
    ...     counts=lambda time: np.ones(time.shape, dtype=bool),
    ... )
    >>> x, y = np.cumsum(np.random.default_rng(1).normal(size=(2, 400)), axis=1)
    >>> bool(np.isfinite(summarise(plan, x, y)).all())
    True
    """
    one = series_of(plan, x, y)
    if np.count_nonzero(one.there) < SUMMARIES.fewest:
        return np.zeros(count_summaries(plan))
    numbers = [
        # Of the logarithm of the step lengths.
        *np.quantile(one.log_length[one.there], SUMMARIES.step_quantiles),
        *_turns(plan, x, y),
        *_changes(one),
        *_memory(one),
        *_displacement(one),
        *_place(one),
        *_peaks(one),
        *(number for level in SUMMARIES.speed_levels for number in _bouts(one, level)),
    ]
    return np.array(numbers, dtype=np.float64)


def count_summaries(plan: SummaryPlan) -> int:
    """Return how many summaries a motion has."""
    return (
        len(SUMMARIES.step_quantiles)
        + 6 * len(plan.intervals)
        + len(SUMMARIES.longer_quantiles) * (len(plan.intervals) - 1)
        + 6 + len(SUMMARIES.longer_quantiles)
        + 2 * len(SUMMARIES.memory_lags) + len(SUMMARIES.displacement_lags)
        + len(SUMMARIES.wall_quantiles) + len(SUMMARIES.wall_edges)
        + 3
        + 9 * len(SUMMARIES.speed_levels)
    )  # fmt: skip


def _mean(values: Floats, chosen: Bools) -> float:
    """Return the mean over those that are chosen, 0 where they are too few."""
    return float(values[chosen].mean()) if np.count_nonzero(chosen) >= SUMMARIES.fewest else 0.0


def _turns(plan: SummaryPlan, x: npt.ArrayLike, y: npt.ArrayLike) -> Numbers:
    """Yield how bodies turn over each interval, and how far they get over the longer ones."""
    for index, (one, counts) in enumerate(zip(plan.intervals, plan.pair_counts, strict=True)):
        steps = apply_steps(one, x, y)
        chosen = counts[steps.pair]
        length, angle = steps.step_length[chosen], steps.turning_angle[chosen]
        cos = np.cos(angle)
        all_of = np.ones(angle.size, dtype=bool)
        fast = length > np.median(length) if length.size else all_of
        yield _mean(cos, all_of)
        yield _mean(np.sin(angle), all_of)
        yield _mean(np.cos(2.0 * angle), all_of)
        yield _mean((cos < 0.0).astype(np.float64), all_of)
        yield _mean(cos, fast)
        yield float(np.log(_mean(np.minimum(np.abs(angle), SUMMARIES.straight), fast) + 1e-3))
        if index:
            enough = length.size >= SUMMARIES.fewest
            far = np.quantile(length, SUMMARIES.longer_quantiles) if enough else np.zeros(5)
            yield from np.log(far / plan.unit + SMALLEST)


def _changes(one: Series) -> Numbers:
    """Yield how often the speed rises and falls, how the body turns then, and how much it does."""
    pair = one.there[1:] & one.there[:-1]
    change = np.where(pair, one.log_length[1:] - one.log_length[:-1], 0.0)
    product = np.maximum(one.length[1:] * one.length[:-1], 1e-300)
    cos = (one.dx[1:] * one.dx[:-1] + one.dy[1:] * one.dy[:-1]) / product
    faster = SUMMARIES.faster
    for kind in (change > faster, change < -faster, np.abs(change) < SUMMARIES.steady):
        yield float((kind & pair).sum()) / max(float(pair.sum()), 1.0)
        yield _mean(cos, kind & pair)
    enough = np.count_nonzero(pair) >= SUMMARIES.fewest
    yield from np.quantile(change[pair], SUMMARIES.longer_quantiles) if enough else np.zeros(5)


def _memory(one: Series) -> Numbers:
    """Yield autocorrelations of the logarithm of the speed, and of the velocity."""
    there = one.there
    speed = np.where(there, one.log_length - one.log_length[there].mean(), 0.0)
    dx, dy = (np.where(there, part, 0.0) for part in (one.dx, one.dy))
    variance = float((speed**2).sum()) / np.count_nonzero(there)
    square = float((dx**2 + dy**2).sum()) / np.count_nonzero(there)
    for lag in SUMMARIES.memory_lags:
        pairs = np.count_nonzero(there[lag:] & there[:-lag])
        if pairs < SUMMARIES.fewest or not variance > 0.0 or not square > 0.0:
            yield from (0.0, 0.0)
            continue
        yield float((speed[lag:] * speed[:-lag]).sum()) / pairs / variance
        yield float((dx[lag:] * dx[:-lag] + dy[lag:] * dy[:-lag]).sum()) / pairs / square


def _displacement(one: Series) -> Numbers:
    """Yield logarithms of mean squared displacements over unbroken stretches."""
    broken = np.concatenate([[0], np.cumsum(~one.there)])
    for lag in SUMMARIES.displacement_lags:
        whole = broken[lag:] == broken[:-lag]
        if np.count_nonzero(whole) < SUMMARIES.fewest:
            yield 0.0
            continue
        square = (one.x[lag:] - one.x[:-lag]) ** 2 + (one.y[lag:] - one.y[:-lag]) ** 2
        yield float(np.log(square[whole].mean() / one.unit**2 + 1e-12))


def _place(one: Series) -> Numbers:
    """Yield quantiles of the distance from the wall, and how much slower the body is near it."""
    yield from np.quantile(one.from_wall[one.there], SUMMARIES.wall_quantiles)
    middle = one.there & (one.from_wall > SUMMARIES.wall_edges[-1])
    usual = _mean(one.log_length, middle)
    inner = -np.inf
    for edge in SUMMARIES.wall_edges:
        zone = one.there & (one.from_wall > inner) & (one.from_wall <= edge)
        few = min(np.count_nonzero(zone), np.count_nonzero(middle)) < SUMMARIES.fewest
        yield 0.0 if few else _mean(one.log_length, zone) - usual
        inner = edge


def _peaks(one: Series) -> Numbers:
    """Yield how often the speed peaks, and mean and spread of the peaks."""
    length, there = one.length, one.there
    peak = there[1:-1] & there[:-2] & there[2:]
    peak &= (length[1:-1] > length[:-2]) & (length[1:-1] >= length[2:])
    height = one.log_length[1:-1][peak]
    yield float(np.log1p(height.size))
    yield float(height.mean()) if height.size else 0.0
    yield float(np.log(height.std() + 1e-3)) if height.size else 0.0


def _bouts(one: Series, level: float) -> Numbers:
    """Yield how bouts above and below a speed last, and how the body turns over slow ones."""
    fast = one.there & (one.log_length > np.log(level + SMALLEST))
    changes = np.flatnonzero(np.diff(fast.astype(np.int8))) + 1
    begins = np.concatenate([[0], changes])
    lasts = np.diff(np.concatenate([begins, [fast.size]])).astype(np.float64)
    is_fast = fast[begins]
    yield float(fast[one.there].mean())
    for kind in (is_fast, ~is_fast):
        time = lasts[kind] if kind.any() else np.ones(1)
        yield float(np.log(time).mean())
        yield float(np.log(time).std())
        yield float(np.log((time**2).sum() / time.sum()))
    slow = np.flatnonzero(~is_fast)
    inside = slow[(slow > 0) & (slow < is_fast.size - 1)]
    before, after = begins[inside] - 1, begins[inside + 1]
    product = np.maximum(one.length[before] * one.length[after], 1e-300)
    cos = (one.dx[after] * one.dx[before] + one.dy[after] * one.dy[before]) / product
    short = after - before <= 2
    for kind in (short, ~short):
        yield _mean(cos, kind)


ALIKE: Final = 16
"""Settings in a row that are seen by one camera. So many points of a Sobol' sequence fill a box;
chosen by hand."""
POINT: Final = "point"
"""Settings of a unit, in the unit cube; they travel with it."""


class SummaryObjective:
    """Simulates settings of a model and summarises what the camera saw.

    Where the noise of the camera is not known but estimated, simulated cameras have the noises that
    it may have. Their effect on the summaries becomes part of their covariance, as if the noise
    were one more parameter, with the estimate for its prior.

    Parameters
    ----------
    worlds : AspectObjective
        The model, its ranges and its conditions.
    motion : RecordedMotion
        The recording.
    store : Store or None
        Where finished work is kept; None keeps nothing.
    executor : concurrent.futures.Executor, optional
        Computes the work units elsewhere, with one thread each.
    tell : callable
        Called with the settings done and the largest number of them.
    most : int
        That number.

    Attributes
    ----------
    recorded : ndarray, shape (2, summaries)
        Summaries of the whole recording, and of its even blocks of time.
    """

    def __init__(
        self,
        worlds: AspectObjective,
        motion: RecordedMotion,
        *,
        store: Store | None,
        executor: Executor | None = None,
        tell: Progress,
        most: int,
    ) -> None:
        self.worlds, self.store, self.tell, self.most = worlds, store, tell, most
        self._executor = executor
        # Units of an executor have one thread each.
        like = worlds.like if executor is None else replace(worlds.like, threads=1)
        self._cameras = [
            replace(worlds, like=replace(like, camera=replace(like.camera, position_noise=noise)))
            for noise in motion.noises
        ]
        self.done = 0

        def all_of(time: Floats) -> Bools:
            return np.ones(time.shape, dtype=bool)

        def even(time: Floats) -> Bools:
            return np.asarray(block_of(time, motion.duration) % 2 == 0)

        wall, scale = wall_distance(worlds.like), {"unit": motion.usual_step, "depth": motion.depth}
        recorded, simulated = (
            [plan_summaries(plan, wall=wall, counts=counts, **scale) for counts in (all_of, even)]
            for plan in (motion.own_plan, motion.plan)
        )
        self.plans = simulated
        self.recorded = np.array([summarise(one, *motion.track[1:3]) for one in recorded])

    def __call__(self, settings: Floats, *, parts: int = 1) -> Floats:
        """Return the summaries of settings in the unit cube, shape (settings, parts, summaries)."""
        first = self.done
        units = work_units({POINT: settings}, ALIKE, first=first)
        function = _Summaries(self._cameras, self.plans[:parts])

        def say(done: int, _: int) -> None:
            self.tell(first + done, self.most)

        found = run_sweep(function, units, store=self.store, executor=self._executor, progress=say)[
            "summaries"
        ]
        self.done += len(settings)
        return np.asarray(found)


@dataclass(frozen=True)
class _Summaries:
    """The function of the sweep: the settings of a unit, summarised wherever it is sent."""

    cameras: Sequence[AspectObjective]
    plans: Sequence[SummaryPlan]
    linear_algebra: ClassVar[bool] = True
    """Its results depend on numpy and scipy."""

    def __call__(self, unit: WorkUnit) -> dict[str, Floats]:
        camera = self.cameras[unit.start // ALIKE % len(self.cameras)]
        seen = camera.simulated(unit.settings[POINT], 1, stage="estimation", first=unit.start)

        def one(world: tuple[Floats, Floats]) -> list[Floats]:
            return [summarise(plan, *world) for plan in self.plans]

        with one_blas_thread():
            found = np.array(
                map_in_threads(one, zip(seen.x, seen.y, strict=True), camera.like.threads)
            )
        # A world that lost its numbers is like none.
        found[broken_worlds(seen.status)] = 0.0
        return {"summaries": found}
