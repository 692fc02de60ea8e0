"""The two passes of a calibration: the whole grid, then a finer one around its minimum."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.problem import Floats, Problem, score_worlds, worlds_of
from driftwalk.calibration.surface import Optimum, Smoother, make_smoother
from driftwalk.simulation.backend import BROKEN
from driftwalk.sweep import Design, Store, WorkUnit, grid, run_sweep

Progress = Callable[[int, int], None]

SETTINGS_PER_UNIT = 64
"""Settings of a work unit: about a second's work, so that a kill or Ctrl-C loses no more."""
WINDOW_STEPS = 10
"""Refined steps on each side of the coarse minimum, at least."""
MOST_REFINED_WORLDS = 7056
BANDWIDTH_STEPS = 2.0
"""Bandwidth of the surface in refined steps."""


class Map(NamedTuple):
    """Distances over a grid of settings."""

    drag_coefficient: Floats
    force_std: Floats
    """[N]"""
    distance: Floats
    """Shape (drag_coefficient, force_std, replicate)."""
    arrays: dict[str, npt.NDArray[Any]]
    """Everything else that the worlds gave, (drag_coefficient, force_std, ...)."""

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

    def cell_of_minimum(self) -> tuple[int, int]:
        """Return the indices of the smallest mean distance."""
        row, column = np.unravel_index(int(np.argmin(self.mean)), self.mean.shape)
        return int(row), int(column)


def run_map(
    problem: Problem,
    drag_coefficient: npt.ArrayLike,
    force_std: npt.ArrayLike,
    *,
    stage: str,
    replicates: int,
    details: str,
    store: Store | None = None,
    progress: Progress | None = None,
) -> Map:
    """Simulate every setting of a grid and compare it with the recording.

    Parameters
    ----------
    problem : Problem
        The recording.
    drag_coefficient, force_std : array_like
        Axes of the grid; force_std in N.
    stage : str
        Name of the stage; its random streams are its own.
    replicates : int
        Simulations per setting.
    details : {"none", "all"}
        Whether to keep densities and excerpts.
    store : Store, optional
        Where finished work units are kept.
    progress : callable, optional
        Told the number of settings done and in all.
    """
    design: Design = grid(drag_coefficient=drag_coefficient, force_std=force_std)
    model = problem.model()

    def compute(unit: WorkUnit) -> dict[str, npt.NDArray[Any]]:
        worlds = worlds_of(
            problem,
            unit.settings["drag_coefficient"],
            unit.settings["force_std"],
            stage=stage,
            first=unit.start,
            replicates=replicates,
        )
        return _by_setting(score_worlds(problem, model, worlds, details=details), replicates)

    arrays = design.unstack(
        run_sweep(compute, design.units(SETTINGS_PER_UNIT), store=store, progress=progress)
    )
    distance = arrays.pop("ks_distance")
    axes = design.axes
    return Map(axes["drag_coefficient"], axes["force_std"], distance, arrays)


def _by_setting(
    worlds: dict[str, npt.NDArray[Any]], replicates: int
) -> dict[str, npt.NDArray[Any]]:
    """Give the worlds' arrays one row per setting: density averaged, excerpt of the first."""
    rows = {
        name: values.reshape(-1, replicates, *values.shape[1:]) for name, values in worlds.items()
    }
    # A world that lost its numbers has no distance; one that does not move is as far as can be.
    broken = (rows["status"] & BROKEN) != 0
    rows["ks_distance"] = np.where(broken, np.nan, rows["ks_distance"])
    rows["pairs"] = rows["pairs"].min(axis=1)
    if "step_density" in rows:
        rows["step_density"] = rows["step_density"].mean(axis=1)
        rows["excerpt_x"] = rows["excerpt_x"][:, 0]
        rows["excerpt_y"] = rows["excerpt_y"][:, 0]
    return rows


class Window(NamedTuple):
    """A refined grid: its axes."""

    drag_coefficient: Floats
    force_std: Floats


def refined_window(coarse: Map, steps: tuple[float, float], margin: float) -> Window:
    """Choose the refined grid: the coarse cells that could hold the optimum, and some around.

    Parameters
    ----------
    coarse : Map
        The first pass.
    steps : tuple of float
        Steps of the refined grid along both axes.
    margin : float
        Cells connected with the minimum whose distance is within `margin` of it are covered; it is
        the noise floor of the distance.

    Returns
    -------
    Window
        At least 10 steps on each side of the minimum, within the coarse grid, and no more cells
        than `MOST_REFINED_WORLDS` allows at two replicates.
    """
    from scipy.ndimage import label

    cell = coarse.cell_of_minimum()
    labels, _ = label(coarse.mean <= coarse.mean[cell] + margin)
    plausible = np.argwhere(labels == labels[cell])
    ranges = []
    for axis, step, low, high, at in zip(
        (coarse.drag_coefficient, coarse.force_std),
        steps,
        plausible.min(axis=0),
        plausible.max(axis=0),
        cell,
        strict=True,
    ):
        first = axis[max(low - 1, 0)]
        last = axis[min(high + 1, axis.size - 1)]
        down = max(int(np.ceil((axis[at] - first) / step - 1e-9)), WINDOW_STEPS)
        up = max(int(np.ceil((last - axis[at]) / step - 1e-9)), WINDOW_STEPS)
        ranges.append((down, up))
    most = int(np.sqrt(MOST_REFINED_WORLDS / 2)) // 2
    axes = [
        _refined_axis(axis, axis[at], step, min(down, most), min(up, most))
        for axis, at, step, (down, up) in zip(
            (coarse.drag_coefficient, coarse.force_std), cell, steps, ranges, strict=True
        )
    ]
    return Window(*axes)


def _refined_axis(axis: Floats, centre: float, step: float, down: int, up: int) -> Floats:
    values = np.round(centre + step * np.arange(-down, up + 1), 12)
    inside = (values >= axis[0] - 1e-12) & (values <= axis[-1] + 1e-12)
    return np.asarray(values[inside])


def refined_replicates(window: Window, wanted: int) -> int:
    """Return how many replicates a window can have without outgrowing the coarse map's cost."""
    cells = window.drag_coefficient.size * window.force_std.size
    return max(min(wanted, MOST_REFINED_WORLDS // cells), 2)


def recentre(window: Window, optimum: Optimum, coarse: Map, steps: tuple[float, float]) -> Window:
    """Return the window moved so that an optimum near its edge comes to its middle."""
    axes = []
    for axis, limits, value, step in zip(
        window,
        (coarse.drag_coefficient, coarse.force_std),
        (optimum.drag_coefficient, optimum.force_std),
        steps,
        strict=True,
    ):
        half = max((axis.size - 1) // 2, WINDOW_STEPS)
        at_low = value - axis[0] < 2.5 * step and axis[0] > limits[0] + 1e-12
        at_high = axis[-1] - value < 2.5 * step and axis[-1] < limits[-1] - 1e-12
        if at_low or at_high:
            nearest = axis[int(np.argmin(np.abs(axis - value)))]
            axis = _refined_axis(limits, nearest, step, half, half)
        axes.append(axis)
    return Window(*axes)


def window_smoother(window: Window, steps: tuple[float, float]) -> Smoother:
    """Return the smoother of a refined grid, with the bandwidth that all stages share."""
    bandwidth = (BANDWIDTH_STEPS * steps[0], BANDWIDTH_STEPS * steps[1])
    return make_smoother(window.drag_coefficient, window.force_std, bandwidth=bandwidth)
