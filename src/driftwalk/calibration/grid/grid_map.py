"""Maps of a calibration: distances over a grid, and more replicates where they matter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.problem import Axes, Floats, Problem, score_settings
from driftwalk.comparison import StepTable
from driftwalk.core.processors import map_in_threads
from driftwalk.motion import Details
from driftwalk.motion.score import broken_worlds
from driftwalk.sweep import Design, Store, WorkUnit, grid, run_sweep, settings_per_unit

Progress = Callable[[int, int], None]
Integers = npt.NDArray[np.int64]


class Map(NamedTuple):
    """Distances over a grid of settings."""

    axes: Axes
    """Coordinates of the grid, one array per parameter."""
    distance: Floats
    """Shape (*grid, replicate); NaN where a replicate was not simulated, or lost its numbers."""
    arrays: dict[str, npt.NDArray[Any]]
    """Everything else that the worlds gave, (*grid, ...)."""
    replicates: Integers
    """Replicates that were simulated of each setting, shape (*grid,): the first ones."""

    @property
    def simulated(self) -> npt.NDArray[np.bool_]:
        """Which replicates were simulated, (*grid, replicate)."""
        return np.asarray(np.arange(self.distance.shape[-1]) < self.replicates[..., None])

    @property
    def mean(self) -> Floats:
        """Mean distance over the replicates; a world without a number is as far as can be."""
        known = np.where(self.simulated, np.nan_to_num(self.distance, nan=1.0), 0.0)
        return np.asarray(known.sum(axis=-1) / self.replicates)

    @property
    def standard_error(self) -> Floats:
        """Standard error of the mean; NaN with one replicate, or with a broken one."""
        away = np.where(self.simulated, self.distance - self.mean[..., None], 0.0)
        count = np.where(self.replicates > 1, self.replicates, np.nan)
        return np.asarray(np.sqrt((away**2).sum(axis=-1) / (count - 1) / count))

    @property
    def apart(self) -> Floats:
        """Mean distance between two replicates of the same setting, (*grid,): its own floor."""
        return np.asarray(self.arrays["apart"])

    def cell_of_minimum(self) -> tuple[int, ...]:
        """Return the indices of the smallest mean distance."""
        lowest = np.unravel_index(int(np.argmin(self.mean)), self.mean.shape)
        return tuple(int(index) for index in lowest)

    def point(self, cell: Sequence[int]) -> tuple[float, ...]:
        """Return the coordinates of a cell."""
        return tuple(float(axis[at]) for axis, at in zip(self.axes, cell, strict=True))


def full_map(axes: Axes, distance: Floats, arrays: dict[str, npt.NDArray[Any]]) -> Map:
    """Return a map with every replicate of every setting.

    Examples
    --------
    >>> found = full_map((np.array([1.0, 2.0]),), np.array([[0.1, 0.2], [0.3, 0.4]]), {})
    >>> found.replicates.tolist()
    [2, 2]
    """
    return Map(axes, distance, arrays, np.full(distance.shape[:-1], distance.shape[-1]))


def run_map(
    problem: Problem,
    axes: Sequence[npt.ArrayLike],
    *,
    stage: str,
    replicates: int,
    details: Details = "none",
    apart: bool = False,
    only: npt.NDArray[np.bool_] | None = None,
    store: Store | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Map:
    """Simulate the settings of a grid and compare each with the recording.

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
    apart : bool
        Whether to measure how far the replicates of a setting are from each other.
    only : ndarray of bool, shape of the grid, optional
        Settings to simulate; the others count as being as far as can be. Default: all.
    store : Store, optional
        Where finished work units are kept.
    executor : concurrent.futures.Executor, optional
        Computes the work units elsewhere, with one thread each.
    progress : callable, optional
        Called with the number of finished settings and the total.
    """
    design = _design(problem, axes)
    cells = np.arange(design.size) if only is None else np.flatnonzero(only)
    function = _Cells(_for_units(problem, executor), stage, cells, 0, replicates, details, apart)
    units = _units(design, cells, _per_unit(problem, cells, replicates))
    rows = run_sweep(function, units, store=store, executor=executor, progress=progress)
    arrays = design.unstack({name: _spread(values, cells, design) for name, values in rows.items()})
    distance = arrays.pop("ks_distance")
    if only is not None:
        distance[~only] = 1.0
    return full_map(tuple(design.axes.values()), distance, arrays)


def add_replicates(
    problem: Problem,
    found: Map,
    chosen: npt.NDArray[np.bool_],
    *,
    stage: str,
    replicates: int,
    details: Details = "none",
    apart: bool = False,
    store: Store | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Map:
    """Simulate more replicates of some settings of a map; see `run_map`.

    Parameters
    ----------
    problem : Problem
        The recording and the model.
    found : Map
        The map, with equally many replicates of every setting.
    chosen : ndarray of bool, shape of the grid
        The settings.
    stage : str
        Name of the map's stage.
    replicates : int
        Simulations that the chosen settings will have. Their numbers are those that a map with as
        many replicates of every setting has.
    details : {"none", "all"}
        As of the map.
    apart : bool
        As of the map.
    store, executor
        As of `run_map`.
    progress : callable, optional
        Called with the number of chosen settings that are finished, and of all of them.
    """
    before = found.distance.shape[-1]
    cells = np.flatnonzero(chosen)
    if replicates <= before or not cells.size:
        return found
    design = _design(problem, found.axes)
    shared = _for_units(problem, executor)
    # A single new replicate has none to be apart from.
    among = apart and replicates - before > 1
    function = _Cells(shared, stage, cells, before, replicates - before, details, among)
    units = _units(design, cells, _per_unit(problem, cells, replicates - before))
    new = run_sweep(function, units, store=store, executor=executor, progress=progress)
    old = {**found.arrays, "ks_distance": found.distance}
    joined = {
        name: _joined(name, values, new[name], cells, before / replicates, replicates)
        if name in new
        else values
        for name, values in old.items()
    }
    distance = joined.pop("ks_distance")
    count = found.replicates.copy()
    count.reshape(-1)[cells] = replicates
    return Map(found.axes, distance, joined, count)


OF_A_REPLICATE: Final[dict[str, float]] = {
    "ks_distance": np.nan,
    "ks_step_length": np.nan,
    "ks_turning_angle": np.nan,
    "ks_quadrant": -1,
    "status": 0,
}
"""Arrays with an entry per replicate, and the value of one that was not simulated."""
OF_THE_FIRST: Final = ("excerpt_x", "excerpt_y")


def _joined(
    name: str,
    old: npt.NDArray[Any],
    new: npt.NDArray[Any],
    cells: Integers,
    share: float,
    replicates: int,
) -> npt.NDArray[Any]:
    """Return an array of a map with the new replicates of some cells put in."""
    if name in OF_A_REPLICATE:
        before = old.shape[-1]
        joined = np.full((*old.shape[:-1], replicates), OF_A_REPLICATE[name], dtype=old.dtype)
        joined[..., :before] = old
        joined.reshape(-1, replicates)[cells, before:] = new
        return joined
    joined = old.copy()
    rows = joined.reshape(-1, *new.shape[1:])
    if name == "pairs":
        rows[cells] = np.minimum(rows[cells], new)
    elif name not in OF_THE_FIRST:
        # Means over the replicates: of the densities, of the distances between replicates.
        rows[cells] = share * rows[cells] + (1.0 - share) * new
    return joined


@dataclass(frozen=True)
class _Cells:
    """The function of the sweep: the settings of a unit, simulated wherever it is sent."""

    problem: Problem
    stage: str
    cells: Integers
    """Number within the grid of every setting of the sweep: part of the address."""
    first_replicate: int
    replicates: int
    details: Details
    apart: bool

    def __call__(self, unit: WorkUnit) -> dict[str, npt.NDArray[Any]]:
        worlds = score_settings(
            self.problem,
            [unit.settings[one.name] for one in self.problem.parameters],
            stage=self.stage,
            numbers=self.cells[unit.start : unit.stop],
            replicates=range(self.first_replicate, self.first_replicate + self.replicates),
            details="steps" if self.apart else self.details,
        )
        if self.apart:
            worlds["apart"] = self._apart(worlds)
        return _by_setting(worlds, self.replicates)

    def _apart(self, worlds: dict[str, npt.NDArray[Any]]) -> Floats:
        """Return how far every setting's replicates are from each other, once per world.

        The first half of the replicates meets the second. A setting with a world that does not
        move, or lost its numbers, gets 0: no allowance is made for it.
        """
        count = self.replicates
        steps = StepTable(worlds.pop("step_length"), worlds.pop("turning_angle"), worlds["pairs"])
        sound = (worlds["status"].reshape(-1, count) == 0).all(axis=1)

        def one(setting: int) -> float:
            if not sound[setting]:
                return 0.0
            first, middle = setting * count, setting * count + count // 2
            halves = steps.rows(slice(first, middle)), steps.rows(slice(middle, first + count))
            return float(self.problem.statistic.matrix(*halves, threads=1).mean())

        apart = map_in_threads(one, range(sound.size), self.problem.like.threads)
        return np.repeat(apart, count)


def _design(problem: Problem, axes: Sequence[npt.ArrayLike]) -> Design:
    names = [parameter.name for parameter in problem.parameters]
    return grid(**dict(zip(names, axes, strict=True)))


def _units(design: Design, cells: Integers, count: int) -> list[WorkUnit]:
    """Cut some settings of a design into work units of so many."""
    settings = design.settings()
    return [
        WorkUnit(
            start,
            min(start + count, cells.size),
            {name: values[cells[start : start + count]] for name, values in settings.items()},
        )
        for start in range(0, cells.size, count)
    ]


def _spread(values: npt.NDArray[Any], cells: Integers, design: Design) -> npt.NDArray[Any]:
    """Return the rows of some settings as rows of all; those of the others are 0."""
    if cells.size == design.size:
        return values
    spread = np.zeros((design.size, *values.shape[1:]), dtype=values.dtype)
    spread[cells] = values
    return spread


def _per_unit(problem: Problem, cells: Integers, replicates: int) -> int:
    """Return how many settings make a work unit: by their worlds, as long as the recording."""
    time_steps = problem.duration / problem.study.time_step_s
    # Fewer than 64 worlds leave lanes empty, and each then takes longer.
    together = max(64 // replicates, 1)
    return settings_per_unit(cells.size, replicates * time_steps, multiple=together)


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
    if "apart" in rows:
        rows["apart"] = rows["apart"][:, 0]
    if "step_density" in rows:
        rows["step_density"] = rows["step_density"].mean(axis=1)
        rows["excerpt_x"] = rows["excerpt_x"][:, 0]
        rows["excerpt_y"] = rows["excerpt_y"][:, 0]
    return rows
