"""Uncertainty of the parameters: a parametric bootstrap on a stored surface.

Recordings are simulated at the optimum, with the length, gaps and camera noise of the real one, and
each is estimated again with the same smooth surface, against steps that were simulated once around
the optimum. (It meets one of their four replicates, in turn, so that the noise of the surface is
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

from driftwalk.calibration.grid.energy_score import (
    EnergyScore,
    Smoother,
    at_settings,
    lattice_of,
    lowest_between,
    make_smoother,
    nearest_point,
)
from driftwalk.calibration.grid.grid_refinement import RefinedMap
from driftwalk.calibration.problem import Axes, Problem, score_settings
from driftwalk.comparison import Statistic, StepTable
from driftwalk.comparison.statistic import distances_among
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.processors import map_in_threads
from driftwalk.core.progress import Progress
from driftwalk.sweep import Store, WorkUnit, grid, run_sweep


class BootstrapPolicy(NamedTuple):
    """The stored surface on which bootstrap recordings are estimated.

    Sizes are a compromise of time and noise, chosen by hand. The coverage of the region is
    counted by `studies/coverage`.
    """

    surface_intervals: tuple[int, int] = (32, 10)
    """Intervals along an axis, with one and with two parameters; chosen by hand."""
    least_bandwidth_steps: float = 1.5
    """Least bandwidth in steps: a quadratic needs three settings along each axis; chosen by
    hand."""
    retained_floors: float = 1.5
    """Height above the minimum, in floors, below which places are retained; chosen by hand."""
    surface_replicates: int = 4
    """Simulations of every setting; a recording meets one of them, in turn; chosen by hand."""
    recordings_per_unit: int = 10
    """Recordings of a work unit; all of a unit meet the same replicate; chosen by hand."""
    floor_references: int = 8
    """Recordings whose distances to the others give the noise floor; chosen by hand."""
    supported: float = 0.99
    """Sum of the weights of a place above which its settings say what the surface is there: it is 1
    but for rounding where they do; the tolerance by hand."""


BOOTSTRAP: Final = BootstrapPolicy()


@dataclass(frozen=True, eq=False)
class StoredSurface:
    """Simulated steps of the settings around an optimum, to estimate any recording against."""

    axes: Axes
    """Axes of its lattice."""
    retained: Bools
    """Points of the lattice where a recording's estimate may lie."""
    matrix: Floats
    """Weights of the settings in the value at each of them, (points, settings)."""
    replicates: StepTable
    """Simulations of the settings, replicates slowest."""
    apart: Floats
    """Distance between replicates of each setting."""
    floor: Floats
    """Floor at each of the points."""
    statistic: Statistic
    threads: int

    def heights_in_floors(self, recordings: StepTable, replicate: int) -> Floats:
        """Return each recording's surface above its minimum, in floors, (recording, *lattice).

        It is infinite where nothing is kept.
        """
        settings, number = self.apart.size, replicate % BOOTSTRAP.surface_replicates
        met = self.replicates.rows(slice(number * settings, (number + 1) * settings))
        distance = self.statistic.matrix(recordings, met, threads=self.threads)
        score = (distance - 0.5 * self.apart) @ self.matrix.T
        surface = np.full((len(distance), *self.retained.shape), np.inf)
        surface[:, self.retained] = (score - score.min(axis=1, keepdims=True)) / self.floor
        return surface


def build_surface(problem: Problem, refined: RefinedMap) -> StoredSurface:
    """Simulate settings of the refined window again, to estimate recordings against them."""
    from scipy.ndimage import binary_dilation

    intervals = BOOTSTRAP.surface_intervals[len(refined.map.axes) - 1]
    axes = tuple(
        np.linspace(axis[0], axis[-1], min(intervals + 1, axis.size)) for axis in refined.map.axes
    )
    bandwidth = [
        max(width, BOOTSTRAP.least_bandwidth_steps * float(np.ptp(axis)) / max(axis.size - 1, 1))
        for axis, width in zip(axes, refined.bandwidth, strict=True)
    ]
    lattice = lattice_of(axes)
    height, floor = (
        _between(refined.energy_score.smoother.axes, values, lattice)
        for values in (refined.energy_score.height, refined.energy_score.floor)
    )
    # Settings around them, too: a quadratic needs three along each axis, however narrow the valley.
    low = at_settings(height) <= BOOTSTRAP.retained_floors
    low[nearest_point(axes, refined.energy_score.optimum.point)] = True
    simulated = binary_dilation(low, structure=np.ones((3,) * low.ndim, dtype=np.bool_))
    smoother = make_smoother(axes, bandwidth=bandwidth, weights=simulated.astype(float))
    # Weights add up to 1 wherever there are settings to say what the surface is.
    supported = smoother.matrix.sum(axis=1).reshape(height.shape) > BOOTSTRAP.supported
    retained = (height <= BOOTSTRAP.retained_floors) & supported
    cells = np.flatnonzero(simulated)
    settings = [values.ravel()[cells] for values in np.meshgrid(*axes, indexing="ij")]
    repeated = [np.tile(values, BOOTSTRAP.surface_replicates) for values in settings]
    replicates, _ = simulated_steps(problem, repeated, stage="surface", replicates=1)
    return StoredSurface(
        lattice,
        retained,
        smoother.matrix[retained.ravel()][:, cells],
        replicates,
        _apart(problem, replicates, cells.size),
        floor[retained],
        problem.statistic,
        problem.like.threads,
    )


def _between(axes: Axes, values: Floats, lattice: Axes) -> Floats:
    """Return values on one lattice at the points of another within it."""
    from scipy.interpolate import RegularGridInterpolator

    # An axis of one point has nothing to be between.
    wide = [axis.size > 1 for axis in axes]
    if not any(wide):
        return values
    chosen = [axis for axis, has in zip(axes, wide, strict=True) if has]
    wanted = [
        np.clip(axis, own[0], own[-1])
        for axis, own, has in zip(lattice, axes, wide, strict=True)
        if has
    ]
    points = np.stack(np.meshgrid(*wanted, indexing="ij"), axis=-1)
    found = RegularGridInterpolator(chosen, values.squeeze())(points)
    return np.asarray(found.reshape([axis.size for axis in lattice]))


def _apart(problem: Problem, table: StepTable, settings: int) -> Floats:
    """Return the mean distance between the replicates of each setting."""

    def of(setting: int) -> float:
        own = table.rows(slice(setting, None, settings))
        return float(distances_among(problem.statistic, own).mean())

    return np.array(map_in_threads(of, range(settings), problem.like.threads))


def simulated_steps(
    problem: Problem, settings: Sequence[npt.ArrayLike], *, stage: str, replicates: int
) -> tuple[StepTable, Floats]:
    """Simulate settings; return the steps of every world and its distance to the recording."""
    found = score_settings(
        problem,
        settings,
        stage=stage,
        numbers=np.arange(np.size(settings[0])),
        replicates=range(replicates),
        details="steps",
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
    energy_score: EnergyScore,
    surface: StoredSurface,
    *,
    count: int,
    store: Store | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Bootstrap:
    """Simulate recordings at the optimum and estimate each again."""
    point = energy_score.optimum.point
    recordings, to_recording = simulated_steps(problem, point, stage="bootstrap", replicates=count)
    names = tuple(parameter.name for parameter in problem.parameters)
    alone = surface if executor is None else replace(surface, threads=1)
    truth = nearest_point(surface.axes, point)
    function = _Estimates(recordings, alone, names, truth, energy_score.floor_at_optimum)
    units = grid(recording=np.arange(count)).units(BOOTSTRAP.recordings_per_unit)
    estimates = run_sweep(function, units, store=store, executor=executor, progress=progress)
    few = min(BOOTSTRAP.floor_references, count // 2)
    first, rest = recordings.rows(slice(0, few)), recordings.rows(slice(few, count))
    among = problem.statistic.matrix(first, rest, threads=problem.like.threads)
    points = np.column_stack([estimates[name] for name in names])
    return Bootstrap(points, estimates["excess"], to_recording, among)


@dataclass(frozen=True, eq=False)
class _Estimates:
    """The function of the sweep: recordings of a unit, estimated wherever it is sent."""

    recordings: StepTable
    surface: StoredSurface
    names: tuple[str, ...]
    truth: tuple[int, ...]
    """Place of the optimum on the surface's lattice."""
    floor: float
    """Of the optimum."""
    linear_algebra: ClassVar[bool] = True
    """Its results depend on numpy and scipy."""

    def __call__(self, unit: WorkUnit) -> dict[str, npt.NDArray[Any]]:
        rows = self.recordings.rows(slice(unit.start, unit.stop))
        found = self.surface.heights_in_floors(rows, unit.start // BOOTSTRAP.recordings_per_unit)
        columns = np.array([lowest_between(self.surface.axes, one) for one in found]).T
        return {
            **dict(zip(self.names, columns, strict=True)),
            "excess": self.floor * np.array([_excess(one, self.truth) for one in found]),
        }


def _excess(height_in_floors: Floats, truth: tuple[int, ...]) -> tuple[float, ...]:
    """Return how far the truth lies above the minimum: jointly, and along each profile."""
    profiles = [height_in_floors.take(index, axis=axis).min() for axis, index in enumerate(truth)]
    return tuple(float(value) for value in (height_in_floors[truth], *profiles))


class Region(NamedTuple):
    """Where the true parameters may be."""

    intervals: tuple[tuple[float, float], ...]
    """Coordinates of the bounds, one pair per parameter."""
    border: Floats
    """Border of the joint region, shape (vertices, parameters): a closed line for two parameters,
    the two bounds for one."""
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
    """Return intervals and a joint region of the stated confidence."""
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
    """Return the bounds of what lies below the level, between lattice points by interpolation."""
    below = np.flatnonzero(profile <= level)
    bounds = []
    for inner, step in ((below[0], -1), (below[-1], 1)):
        outer = inner + step
        if not 0 <= outer < axis.size:
            bounds.append(float(axis[inner]))
            continue
        share = (level - profile[inner]) / (profile[outer] - profile[inner])
        bounds.append(float(axis[inner] + share * (axis[outer] - axis[inner])))
    return bounds[0], bounds[1]


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
