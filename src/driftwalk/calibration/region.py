"""Uncertainty of the parameters: a parametric bootstrap on a stored surface.

Recordings are simulated at the optimum, with the length, gaps and camera noise of the real one, and
each is estimated again with the same smooth surface, against steps that were simulated once around
the optimum. (It meets two of their four replicates, in turn, so that the noise of the surface is
part of what chance does.) For each, the truth is known: it is the optimum. How far D at the truth
lies above the smallest D of its own surface, the excess, is what chance does; its 90 % quantile is
the level up to which the real recording's surface is plausible. So the region follows the valley,
whatever its shape, and holds the truth in 90 % of recordings if the model is true. Intervals come
from profiles, the smallest D over the other parameters, in the same way.

Where D at the optimum stays above the noise floor the model is not quite true; the level is then
raised by their ratio, as a reduced chi-square above one widens the errors of a least-squares fit
(Birge, Phys. Rev. 40, 207, 1932).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.problem import Axes, Floats, Problem, score_settings
from driftwalk.calibration.search import BANDWIDTH_STEPS, Map, Progress, window_smoother
from driftwalk.calibration.surface import FINENESS, Optimum, Smoother, make_smoother
from driftwalk.comparison import Statistic, StepTable
from driftwalk.sweep import Store, WorkUnit, grid, run_sweep

SURFACE_POINTS: Final[dict[int, tuple[int, ...]]] = {1: (101,), 2: (13, 15)}
"""Most settings along each axis of the stored surface, by the number of parameters."""
SURFACE_MARGIN = 3
"""Refined steps around the settings that could be the optimum."""
SURFACE_REPLICATES = 4
MET_BY_EACH = 2
"""Replicates of the surface that one recording is compared with."""
RECORDINGS_PER_UNIT = 10
FLOOR_REFERENCES = 8


@dataclass(frozen=True, eq=False)
class StoredSurface:
    """Simulated steps of the settings around an optimum, to estimate any recording against."""

    smoother: Smoother
    parts: tuple[StepTable, ...]
    """Each holds `MET_BY_EACH` replicates of every setting, replicates fastest."""
    statistic: Statistic
    threads: int

    def distances(self, recordings: StepTable, part: int) -> Floats:
        """Return the mean distance of each recording to each setting, (recording, setting)."""
        chosen = self.parts[part % len(self.parts)]
        matrix = self.statistic.matrix(recordings, chosen, threads=self.threads)
        return np.asarray(matrix.reshape(len(matrix), -1, MET_BY_EACH).mean(axis=2))


def build_surface(
    problem: Problem, refined: Map, optimum: Optimum, *, margin: float
) -> StoredSurface:
    """Simulate the settings that could be a recording's optimum.

    Parameters
    ----------
    problem : Problem
        The recording and the model.
    refined : Map
        The second pass of the search.
    optimum : Optimum
        Its minimum.
    margin : float
        Settings whose smooth distance is within `margin` of the minimum are covered: the noise
        floor.

    Returns
    -------
    StoredSurface
        On the refined grid, or on every k-th value of it where that has too many settings.
    """
    axes, bandwidth = [], []
    steps = problem.refined_steps
    ranges = _plausible_ranges(refined, optimum, steps, margin)
    for axis, (low, high), step, most in zip(
        refined.axes, ranges, steps, SURFACE_POINTS[len(steps)], strict=True
    ):
        stride = max(int(np.ceil((high - low) / (most - 1))), 1)
        axes.append(axis[low : high + 1 : stride])
        bandwidth.append((BANDWIDTH_STEPS if stride == 1 else 1.5 * stride) * step)
    settings = [values.ravel() for values in np.meshgrid(*axes, indexing="ij")]
    parts = tuple(
        simulated_steps(
            problem,
            settings,
            stage="surface",
            replicates=MET_BY_EACH,
            first=part * settings[0].size,
        )
        for part in range(SURFACE_REPLICATES // MET_BY_EACH)
    )
    smoother = make_smoother(axes, bandwidth=bandwidth)
    return StoredSurface(smoother, parts, problem.statistic, problem.like.threads)


def _plausible_ranges(
    refined: Map, optimum: Optimum, steps: Sequence[float], margin: float
) -> list[tuple[int, int]]:
    """Return the index ranges of the refined grid that hold what could be the optimum."""
    surface = window_smoother(refined.axes, steps).surface(refined.mean.ravel())
    inside = np.argwhere(at_settings(surface) <= optimum.distance + margin)
    return [
        (max(int(low) - SURFACE_MARGIN, 0), min(int(high) + SURFACE_MARGIN, axis.size - 1))
        for axis, low, high in zip(
            refined.axes, inside.min(axis=0), inside.max(axis=0), strict=True
        )
    ]


def at_settings(surface: Floats) -> Floats:
    """Return a surface at the settings of its grid: every `FINENESS`-th point of the lattice."""
    return np.asarray(surface[(slice(None, None, FINENESS),) * surface.ndim])


def simulated_steps(
    problem: Problem,
    settings: Sequence[npt.ArrayLike],
    *,
    stage: str,
    replicates: int,
    first: int = 0,
) -> StepTable:
    """Simulate settings and return the steps of every world, replicates fastest."""
    found = score_settings(
        problem, settings, stage=stage, first=first, replicates=replicates, details="steps"
    )
    return StepTable(found["step_length"], found["turning_angle"], found["pairs"])


def recordings_at(
    problem: Problem, optimum: Optimum, *, stage: str, count: int
) -> tuple[StepTable, Floats]:
    """Simulate recordings at an optimum; return their steps and distances to the real one."""
    found = score_settings(
        problem, optimum.point, stage=stage, first=0, replicates=count, details="steps"
    )
    steps = StepTable(found["step_length"], found["turning_angle"], found["pairs"])
    return steps, np.asarray(found["ks_distance"])


class Bootstrap(NamedTuple):
    """Recordings simulated at the optimum, and what is learnt from them."""

    estimates: Floats
    """Coordinates of their estimates, shape (recording, parameter)."""
    excess: Floats
    """D at the truth above the smallest D: jointly, and of the profile along each parameter;
    shape (recording, 1 + parameters)."""
    to_recording: Floats
    """KS distance of each to the real recording."""
    to_each_other: Floats
    """KS distance of the first few to each of the rest: two realisations of the same truth."""


def run_bootstrap(
    problem: Problem,
    optimum: Optimum,
    surface: StoredSurface,
    *,
    count: int,
    store: Store | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Bootstrap:
    """Simulate recordings at the optimum and estimate each again.

    Parameters
    ----------
    problem : Problem
        The recording and the model.
    optimum : Optimum
        Where to simulate.
    surface : StoredSurface
        Surface to estimate against.
    count : int
        Number of recordings, at least 2.
    store : Store, optional
        Where finished work units are kept.
    executor : concurrent.futures.Executor, optional
        Computes the work units elsewhere, with one thread each.
    progress : callable, optional
        Called with the number of finished recordings and the total.
    """
    recordings, to_recording = recordings_at(problem, optimum, stage="bootstrap", count=count)
    names = tuple(parameter.name for parameter in problem.parameters)
    alone = surface if executor is None else replace(surface, threads=1)
    function = _Estimates(recordings, alone, optimum, names)
    units = grid(recording=np.arange(count)).units(RECORDINGS_PER_UNIT)
    estimates = run_sweep(function, units, store=store, executor=executor, progress=progress)
    few = min(FLOOR_REFERENCES, count // 2)
    among = problem.statistic.matrix(
        recordings.rows(slice(0, few)),
        recordings.rows(slice(few, count)),
        threads=problem.like.threads,
    )
    return Bootstrap(
        np.column_stack([estimates[name] for name in names]),
        estimates["excess"],
        to_recording,
        among,
    )


@dataclass(frozen=True, eq=False)
class _Estimates:
    """The function of the sweep: recordings of a unit, estimated wherever it is sent."""

    recordings: StepTable
    surface: StoredSurface
    optimum: Optimum
    names: tuple[str, ...]
    linear_algebra: ClassVar[bool] = True
    """Its results depend on numpy and scipy."""

    def __call__(self, unit: WorkUnit) -> dict[str, npt.NDArray[Any]]:
        smoother = self.surface.smoother
        rows = self.recordings.rows(slice(unit.start, unit.stop))
        distances = self.surface.distances(rows, unit.start // RECORDINGS_PER_UNIT)
        estimates = [smoother.optimum(row).point for row in distances]
        columns = np.array(estimates).reshape(-1, len(self.names)).T
        return {
            **dict(zip(self.names, columns, strict=True)),
            "excess": np.array([_excess(smoother, row, self.optimum) for row in distances]),
        }


def _excess(smoother: Smoother, distance: Floats, truth: Optimum) -> tuple[float, ...]:
    """Return how far D at the truth lies above the minimum: jointly, and along each profile."""
    surface = smoother.surface(distance)
    at = smoother.nearest(truth.point)
    low = surface.min()
    profiles = [surface.take(index, axis=axis).min() for axis, index in enumerate(at)]
    return tuple(float(value - low) for value in (surface[at], *profiles))


class Region(NamedTuple):
    """Where the true parameters may be."""

    intervals: tuple[tuple[float, float], ...]
    """Coordinates of the ends, one pair per parameter."""
    border: Floats
    """Border of the joint region, shape (vertices, parameters): a closed line for two parameters,
    the two ends for one."""
    level: float
    """The smooth surface is below it in the region."""


def confidence_region(
    smoother: Smoother,
    surface: Floats,
    bootstrap: Bootstrap,
    *,
    confidence: float,
    stretch: float = 1.0,
) -> Region:
    """Return intervals and a joint region of the stated confidence.

    Parameters
    ----------
    smoother : Smoother
        Of the refined grid; its lattice is that of `surface`.
    surface : ndarray
        Smooth distances of the real recording on the lattice.
    bootstrap : Bootstrap
        Its excesses set the levels.
    confidence : float
        Such as 0.9.
    stretch : float
        Factor by which the levels are raised above the minimum, >= 1.

    Returns
    -------
    Region
        Where the region has several parts the border is that of the largest.
    """
    joint, *along = (
        float(surface.min() + max(stretch, 1.0) * value)
        for value in np.quantile(bootstrap.excess, confidence, axis=0)
    )
    profiles = [
        surface.min(axis=tuple(other for other in range(surface.ndim) if other != axis))
        for axis in range(surface.ndim)
    ]
    intervals = tuple(
        _interval(axis, profile, level)
        for axis, profile, level in zip(smoother.axes, profiles, along, strict=True)
    )
    if surface.ndim == 1:
        border = np.array(_interval(smoother.axes[0], surface, joint))[:, None]
    else:
        border = _largest_contour(smoother.axes, surface, joint)
    return Region(intervals, border, joint)


def _interval(axis: Floats, profile: Floats, level: float) -> tuple[float, float]:
    """Return the ends of what lies below the level, between lattice points by interpolation."""
    below = np.flatnonzero(profile <= level)
    ends = []
    for inner, step in ((below[0], -1), (below[-1], 1)):
        outer = inner + step
        if not 0 <= outer < axis.size:
            ends.append(float(axis[inner]))
            continue
        share = (level - profile[inner]) / (profile[outer] - profile[inner])
        ends.append(float(axis[inner] + share * (axis[outer] - axis[inner])))
    return ends[0], ends[1]


def _largest_contour(lattice: Axes, surface: Floats, level: float) -> Floats:
    """Return the longest closed border of the part below the level, shape (vertices, 2)."""
    from contourpy import contour_generator

    # A high rim closes a region that reaches the end of the lattice, along that end.
    high = level + 10.0 * max(float(np.ptp(surface)), 1e-6)
    rimmed = np.pad(surface, 1, constant_values=high)
    axes = [
        np.concatenate([[axis[0] - 1e-9 * step], axis, [axis[-1] + 1e-9 * step]])
        for axis in lattice
        for step in (axis[1] - axis[0] if axis.size > 1 else 1.0,)
    ]
    lines = contour_generator(x=axes[1], y=axes[0], z=rimmed).lines(level)
    longest = max((np.asarray(line) for line in lines), key=lambda line: line.shape[0])
    return np.ascontiguousarray(longest[:, ::-1])


def region_contains(
    smoother: Smoother, surface: Floats, region: Region, point: Sequence[float]
) -> bool:
    """Return whether the joint region holds a point: whether the surface there is low enough."""
    from scipy.interpolate import RegularGridInterpolator

    value = RegularGridInterpolator(smoother.axes, surface, bounds_error=False, fill_value=np.inf)
    return bool(value(np.asarray(point)[None])[0] <= region.level)
