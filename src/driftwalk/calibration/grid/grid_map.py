"""Grid maps: distances of all settings of a grid, and more replicates where they matter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.problem import Axes, Problem, Stores, in_memory, score_settings
from driftwalk.comparison import StepTable
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.calibration_stages import MORE
from driftwalk.core.processors import map_in_threads
from driftwalk.core.progress import Progress
from driftwalk.motion import Details
from driftwalk.motion.score import broken_worlds
from driftwalk.sweep import Design, Store, WorkUnit, grid, run_sweep, settings_per_unit, work_units


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
    def simulated(self) -> Bools:
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


@dataclass(frozen=True)
class MapSimulator:
    """Simulates the maps of one stage and compares each setting with the recording.

    Attributes
    ----------
    problem : Problem
        The recording and the model.
    stage : str
        Name of the stage; its random streams are its own.
    details : {"none", "all"}
        Whether densities and excerpts are retained.
    apart : bool
        Whether the distance between replicates of a setting is measured.
    stores : callable, optional
        Where finished work units are kept; memory when left out.
    executor : concurrent.futures.Executor, optional
        Computes the work units elsewhere, with one thread each.
    progress : callable, optional
        Called with the number of finished settings and the total.
    """

    problem: Problem
    stage: str
    details: Details = "none"
    apart: bool = True
    stores: Stores = in_memory
    executor: Executor | None = None
    progress: Progress | None = None

    def full(self, axes: Axes, replicates: int, only: Bools | None = None) -> Map:
        """Simulate every setting of a grid; those not in `only` count as far as can be."""
        store = self._store(self.stage, axes, {"replicates": replicates})
        design = self._design(axes)
        cells = np.arange(design.size) if only is None else np.flatnonzero(only)
        rows = self._sweep(design, cells, range(replicates), store)
        arrays = design.unstack(
            {name: _spread(values, cells, design) for name, values in rows.items()}
        )
        distance = arrays.pop("ks_distance")
        if only is not None:
            distance[~only] = 1.0
        return full_map(tuple(design.axes.values()), distance, arrays)

    def more(self, found: Map, chosen: Bools, replicates: int) -> Map:
        """Give some settings of a map more replicates, with the numbers of a map that has them."""
        cells, before = np.flatnonzero(chosen), found.distance.shape[-1]
        facts = {"replicates": replicates, "chosen": cells.tolist()}
        store = self._store(f"{MORE}{self.stage}", found.axes, facts)
        if replicates <= before or not cells.size:
            return found
        new = self._sweep(self._design(found.axes), cells, range(before, replicates), store)
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

    def _sweep(
        self, design: Design, cells: Integers, replicates: range, store: Store | None
    ) -> dict[str, npt.NDArray[Any]]:
        """Simulate some settings of a design in work units of equal work."""
        problem = self.problem
        count = len(replicates)
        work = count * problem.duration / problem.study.time_step_s
        # Fewer than 64 worlds leave lanes empty, and each then takes longer.
        size = settings_per_unit(cells.size, work, multiple=max(64 // count, 1))
        settings = {name: values[cells] for name, values in design.settings().items()}
        if self.executor is not None:
            problem = replace(problem, like=replace(problem.like, threads=1))
        # A single replicate has none to be apart from.
        apart = self.apart and count > 1
        function = _Cells(problem, self.stage, cells, replicates, self.details, apart)
        units = work_units(settings, size)
        return run_sweep(
            function, units, store=store, executor=self.executor, progress=self.progress
        )

    def _design(self, axes: Sequence[npt.ArrayLike]) -> Design:
        names = [parameter.name for parameter in self.problem.parameters]
        return grid(**dict(zip(names, axes, strict=True)))

    def _store(self, name: str, axes: Axes, facts: dict[str, object]) -> Store | None:
        fingerprint = {"axes": [axis.tolist() for axis in axes], **facts}
        return self.stores(f"{name}-{window_id(axes)}", fingerprint)


OF_A_REPLICATE: Final[dict[str, float]] = {
    "ks_distance": np.nan,
    "ks_step_length": np.nan,
    "ks_turning_angle": np.nan,
    "ks_quadrant": -1,
    "status": 0,
}
"""Arrays with an entry per replicate, and the value of one that was not simulated."""


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
    elif name not in ("excerpt_x", "excerpt_y"):
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
    replicates: range
    details: Details
    apart: bool

    def __call__(self, unit: WorkUnit) -> dict[str, npt.NDArray[Any]]:
        worlds = score_settings(
            self.problem,
            [unit.settings[one.name] for one in self.problem.parameters],
            stage=self.stage,
            numbers=self.cells[unit.start : unit.stop],
            replicates=self.replicates,
            details="steps" if self.apart else self.details,
        )
        if self.apart:
            worlds["apart"] = self._apart(worlds)
        return _by_setting(worlds, len(self.replicates))

    def _apart(self, worlds: dict[str, npt.NDArray[Any]]) -> Floats:
        """Return how far every setting's replicates are from each other, once per world.

        The first half of the replicates meets the second. A setting with a world that does not
        move, or lost its numbers, gets 0: no allowance is made for it.
        """
        count = len(self.replicates)
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


def _spread(values: npt.NDArray[Any], cells: Integers, design: Design) -> npt.NDArray[Any]:
    """Return the rows of some settings as rows of all; those of the others are 0."""
    spread = np.zeros((design.size, *values.shape[1:]), dtype=values.dtype)
    spread[cells] = values
    return spread


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


class SweepProgress:
    """Progress through sweeps that follow each other.

    Parameters
    ----------
    say : callable
        Called with how much is done, of 1000.
    share_of : callable
        Returns how much of all is done, from the share of each sweep that has begun: `share_of_map`
        or `share_of_windows`.

    Examples
    --------
    >>> from driftwalk.core.calibration_stages import share_of_windows
    >>> shares = []
    >>> narrowing = SweepProgress(lambda done, total: shares.append(done / total), share_of_windows)
    >>> for done in (5, 10, 5, 10):
    ...     narrowing(done, 10)
    >>> shares
    [0.25, 0.5, 0.625, 0.75]
    """

    def __init__(self, say: Progress, share_of: Callable[[Sequence[float]], float]) -> None:
        self._say, self._share_of, self._finished = say, share_of, 0

    def __call__(self, done: int, total: int) -> None:
        """Report progress by the settings of a sweep that are done."""
        share = self._share_of([*[1.0] * self._finished, done / max(total, 1)])
        self._finished += done >= total
        self._say(round(1000 * share), 1000)


def window_id(window: Axes) -> str:
    """Name a grid by its ends and sizes, so that a moved window has its own store."""
    ends = [f"{axis[0]:.6g}-{axis[-1]:.6g}-{axis.size}" for axis in window]
    return "x".join(ends).replace(".", "p").replace("+", "")
