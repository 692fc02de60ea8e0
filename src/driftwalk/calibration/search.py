"""The two passes of a calibration: the whole grid, then a finer one around its minimum."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.problem import Axes, Floats, Problem, score_settings
from driftwalk.calibration.surface import Optimum, Smoother, make_smoother
from driftwalk.motion import Details
from driftwalk.motion.score import broken_worlds
from driftwalk.sweep import Design, Store, WorkUnit, grid, run_sweep, settings_per_unit

Progress = Callable[[int, int], None]

WINDOW_STEPS = 10
"""Refined steps on each side of the coarse minimum, at least."""
MOST_REFINED_WORLDS = 7056
BANDWIDTH_STEPS = 2.0
"""Bandwidth of the surface in refined steps."""
ROUNDING = 1e-12
"""Largest difference that rounding leaves between two coordinates that are the same."""


class Map(NamedTuple):
    """Distances over a grid of settings."""

    axes: Axes
    """Coordinates of the grid, one array per parameter."""
    distance: Floats
    """Shape (*grid, replicate)."""
    arrays: dict[str, npt.NDArray[Any]]
    """Everything else that the worlds gave, (*grid, ...)."""

    @property
    def mean(self) -> Floats:
        """Mean distance over the replicates; a setting without a number is as far as can be."""
        return np.asarray(np.nan_to_num(self.distance, nan=1.0).mean(axis=-1))

    @property
    def standard_error(self) -> Floats:
        """Standard error of the mean; NaN with one replicate."""
        count = self.distance.shape[-1]
        if count < 2:
            return np.full(self.distance.shape[:-1], np.nan)
        return np.asarray(self.distance.std(axis=-1, ddof=1) / np.sqrt(count))

    def cell_of_minimum(self) -> tuple[int, ...]:
        """Return the indices of the smallest mean distance."""
        lowest = np.unravel_index(int(np.argmin(self.mean)), self.mean.shape)
        return tuple(int(index) for index in lowest)

    def point(self, cell: Sequence[int]) -> tuple[float, ...]:
        """Return the coordinates of a cell."""
        return tuple(float(axis[at]) for axis, at in zip(self.axes, cell, strict=True))


def run_map(
    problem: Problem,
    axes: Sequence[npt.ArrayLike],
    *,
    stage: str,
    replicates: int,
    details: Details = "none",
    store: Store | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Map:
    """Simulate every setting of a grid and compare it with the recording.

    Parameters
    ----------
    problem : Problem
        The recording and the model.
    axes : sequence of array_like
        Coordinates of the grid, one array per parameter.
    stage : str
        Name of the stage; its random streams are its own.
    replicates : int
        Simulations per setting.
    details : {"none", "all"}
        Whether to keep densities and excerpts.
    store : Store, optional
        Where finished work units are kept.
    executor : concurrent.futures.Executor, optional
        Computes the work units elsewhere, with one thread each.
    progress : callable, optional
        Called with the number of finished settings and the total.
    """
    names = [parameter.name for parameter in problem.parameters]
    design: Design = grid(**dict(zip(names, axes, strict=True)))
    function = _Settings(_for_units(problem, executor), stage, replicates, details)
    units = design.units(settings_per_unit(design.size, replicates * _time_steps(problem)))
    arrays = design.unstack(
        run_sweep(function, units, store=store, executor=executor, progress=progress)
    )
    distance = arrays.pop("ks_distance")
    return Map(tuple(design.axes[name] for name in names), distance, arrays)


@dataclass(frozen=True)
class _Settings:
    """The function of the sweep: the settings of a unit, simulated wherever it is sent."""

    problem: Problem
    stage: str
    replicates: int
    details: Details

    def __call__(self, unit: WorkUnit) -> dict[str, npt.NDArray[Any]]:
        worlds = score_settings(
            self.problem,
            [unit.settings[one.name] for one in self.problem.parameters],
            stage=self.stage,
            first=unit.start,
            replicates=self.replicates,
            details=self.details,
        )
        return _by_setting(worlds, self.replicates)


def _time_steps(problem: Problem) -> float:
    """Return the time steps of a world as long as the recording."""
    return problem.duration / problem.study.time_step_s


def _for_units(problem: Problem, executor: Executor | None) -> Problem:
    """Return the problem as units get it: with one thread where an executor has many units."""
    if executor is None:
        return problem
    return replace(problem, like=replace(problem.like, threads=1))


def _by_setting(
    worlds: dict[str, npt.NDArray[Any]], replicates: int
) -> dict[str, npt.NDArray[Any]]:
    """Give the worlds' arrays one row per setting: density averaged, excerpt of the first."""
    rows = {
        name: values.reshape(-1, replicates, *values.shape[1:]) for name, values in worlds.items()
    }
    # A world that lost its numbers has no distance; one that does not move is as far as can be.
    rows["ks_distance"] = np.where(broken_worlds(rows["status"]), np.nan, rows["ks_distance"])
    rows["pairs"] = rows["pairs"].min(axis=1)
    if "step_density" in rows:
        rows["step_density"] = rows["step_density"].mean(axis=1)
        rows["excerpt_x"] = rows["excerpt_x"][:, 0]
        rows["excerpt_y"] = rows["excerpt_y"][:, 0]
    return rows


def refined_window(coarse: Map, steps: Sequence[float], margin: float) -> Axes:
    """Choose the refined grid: the coarse cells that could hold the optimum, and some around.

    Parameters
    ----------
    coarse : Map
        The first pass.
    steps : sequence of float
        Steps of the refined grid along each axis.
    margin : float
        Cells connected with the minimum whose distance is within `margin` of it are covered; it is
        the noise floor of the distance.

    Returns
    -------
    tuple of ndarray
        At least 10 steps on each side of the minimum, within the coarse grid, and no more cells
        than `MOST_REFINED_WORLDS` allows at two replicates.
    """
    from scipy.ndimage import label

    cell = coarse.cell_of_minimum()
    labels, _ = label(coarse.mean <= coarse.mean[cell] + margin)
    plausible = np.argwhere(labels == labels[cell])
    most = int((MOST_REFINED_WORLDS / 2) ** (1.0 / len(steps))) // 2
    axes = []
    for axis, step, low, high, at in zip(
        coarse.axes, steps, plausible.min(axis=0), plausible.max(axis=0), cell, strict=True
    ):
        first = axis[max(low - 1, 0)]
        last = axis[min(high + 1, axis.size - 1)]
        down = max(int(np.ceil((axis[at] - first) / step - 1e-9)), WINDOW_STEPS)
        up = max(int(np.ceil((last - axis[at]) / step - 1e-9)), WINDOW_STEPS)
        axes.append(_refined_axis(axis, axis[at], step, min(down, most), min(up, most)))
    return tuple(axes)


def _refined_axis(axis: Floats, centre: float, step: float, down: int, up: int) -> Floats:
    # Twelve digits make a value the decimal that it is; a small step has the digits it needs.
    digits = max(12, 3 - math.floor(math.log10(step)))
    values = np.round(centre + step * np.arange(-down, up + 1), digits)
    slack = min(ROUNDING, 1e-6 * step)
    inside = (values >= axis[0] - slack) & (values <= axis[-1] + slack)
    return np.asarray(values[inside])


def refined_replicates(window: Axes, wanted: int) -> int:
    """Return how many replicates a window can have without outgrowing the coarse map's cost."""
    cells = math.prod(axis.size for axis in window)
    return max(min(wanted, MOST_REFINED_WORLDS // cells), 2)


def recentre(window: Axes, optimum: Optimum, coarse: Map, steps: Sequence[float]) -> Axes:
    """Return the window moved so that an optimum near its edge comes to its middle."""
    axes = []
    for axis, limits, value, step in zip(window, coarse.axes, optimum.point, steps, strict=True):
        slack = min(ROUNDING, 1e-6 * step)
        half = max((axis.size - 1) // 2, WINDOW_STEPS)
        at_low = value - axis[0] < 2.5 * step and axis[0] > limits[0] + slack
        at_high = axis[-1] - value < 2.5 * step and axis[-1] < limits[-1] - slack
        if at_low or at_high:
            nearest = axis[int(np.argmin(np.abs(axis - value)))]
            axis = _refined_axis(limits, nearest, step, half, half)
        axes.append(axis)
    return tuple(axes)


def window_smoother(window: Axes, steps: Sequence[float]) -> Smoother:
    """Return the smoother of a refined grid, with the bandwidth that all stages share."""
    return make_smoother(window, bandwidth=[BANDWIDTH_STEPS * step for step in steps])
