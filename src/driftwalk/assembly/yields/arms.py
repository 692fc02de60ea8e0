"""The settings that are compared, as arms, and their runs on shared random numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.assembly.outcomes.distribution import at_times
from driftwalk.assembly.outcomes.outcome_classes import class_shapes
from driftwalk.assembly.runs.dataset import times_of
from driftwalk.assembly.runs.plan import Plan
from driftwalk.assembly.sensitivity.settings import (
    OF_EACH_RUN,
    Axes,
    Piece,
    Settings,
    simulate_pieces,
)
from driftwalk.assembly.sensitivity.times import kept_times
from driftwalk.assembly.yields.selection import COMPASS, Tally, starting_points
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.files.shards import Arrays
from driftwalk.schema.shapes import all_single
from driftwalk.simulation.backend import BROKEN
from driftwalk.sweep import Store, WorkUnit, grid, run_sweep, settings_per_unit

if TYPE_CHECKING:
    import xarray as xr

RUNS_OF_UNIT: Final = 64
"""Runs that a work unit has at least: fewer leave lanes of the native core empty; chosen by
hand."""
Stores = Callable[[str, Mapping[str, Any]], Store]
Ranges = Mapping[str, tuple[float, float]]


@dataclass
class Arms:
    """Settings, each with a number; a search adds some.

    Attributes
    ----------
    axes : Axes
        The axes with listed values, and the study.
    ranges : mapping of str to tuple
        Lowest and highest value of the axes that are searched.
    flow : xarray.Dataset
        The flow of settings without one of their own.
    threads : int or None
        Of a work unit.
    points : list of dict
        The values of each arm by the names of the axes.
    """

    axes: Axes
    ranges: Ranges
    flow: xr.Dataset
    threads: int | None
    points: list[dict[str, Any]] = field(default_factory=list)
    _worlds: dict[tuple[Any, ...], Plan] = field(default_factory=dict)

    def begin(self) -> None:
        """Add every combination of the listed values, with points of the ranges."""
        rows = starting_points(len(self.ranges)) if self.ranges else np.zeros((1, 0))
        for listed in product(*self.axes.values.values()):
            for row in rows:
                self.at(dict(zip(self.axes.values, listed, strict=True)), row)

    def at(self, listed: Mapping[str, Any], place: Floats) -> int:
        """Return the arm with listed values, and at a place of the unit cube of the ranges."""
        point = dict(listed)
        for share, (name, (low, high)) in zip(place, self.ranges.items(), strict=True):
            rounded = float(f"{low + share * (high - low):.{COMPASS.digits}g}")
            point[name] = min(max(rounded, low), high)
        if point not in self.points:
            self.points.append(point)
        return self.points.index(point)

    def place(self, arm: int) -> Floats:
        """Return where an arm lies in the unit cube of the ranges."""
        point = self.points[arm]
        return np.array([(point[n] - low) / (high - low) for n, (low, high) in self.ranges.items()])

    def world(self, arm: int) -> Plan:
        """Return everything about an arm but drag coefficient, force and random numbers.

        Raises
        ------
        InputError
            When a value is out of range, or the blocks or the flow do not fit the tank.
        """
        apart = {k: v for k, v in self.points[arm].items() if k not in OF_EACH_RUN}
        key = tuple(apart.values())
        if key not in self._worlds:
            self._worlds[key] = self.axes.world(apart, self.flow, self.threads)
        return self._worlds[key]

    def settings(self, arms: Sequence[int], trial: int) -> Settings:
        """Return some arms as settings of one trial: they share their random numbers."""
        forces = self.axes.study.forces
        usual = {"drag_coefficient": forces.drag_coefficient, "force_std": forces.force_std_N}
        points = [usual | self.points[arm] for arm in arms]
        drag, force = (np.array([float(one[name]) for one in points]) for name in OF_EACH_RUN)
        worlds = list({id(one): one for one in map(self.world, arms)}.values())
        return Settings(
            worlds,
            np.array([[one is self.world(arm) for one in worlds].index(True) for arm in arms]),
            drag,
            force,
            np.full(len(arms), trial),
        )


def reaches(name: str, target: str) -> bool:
    """Return whether a class has the assemblies of the target among its own.

    Examples
    --------
    >>> [reaches(name, "T") for name in ("T", "T+1", "2+2")]
    [True, True, False]
    """
    return Counter(class_shapes(target)) <= Counter(class_shapes(name))


@dataclass(frozen=True, eq=False)
class _Simulation:
    """Simulates the runs of a work unit."""

    settings: Settings
    target: str
    times: Floats

    def __call__(self, unit: WorkUnit) -> Arrays:
        """Return whether each run has the target at each time, and whether it broke down."""
        arm, run = (unit.settings[name].astype(int) for name in ("arm", "run"))
        reached, broken = [], []
        for one in dict.fromkeys(arm.tolist()):
            mine = run[arm == one]
            piece = Piece(one, range(int(mine[0]), int(mine[-1]) + 1))
            plan = self.settings.worlds[int(self.settings.world[one])]
            found, classes = simulate_pieces(plan, self.settings, [piece])
            lost = (found["status"].astype(np.int64) & BROKEN) != 0
            reached.append(self._reached(found, classes, plan) & ~lost[:, None])
            broken.append(lost)
        return {"reached": np.concatenate(reached), "broken": np.concatenate(broken)}

    def _reached(self, found: Arrays, classes: Sequence[str], plan: Plan) -> Bools:
        hit = np.array([reaches(name, self.target) for name in classes])
        start = hit[list(classes).index(all_single(plan.study.assembly.blocks))]
        became = hit[found["event_class"].astype(np.int64)]
        time = times_of(found["event_step"], time_step=plan.study.time_step_s)
        return at_times(time, became, start, self.times)


class Runs:
    """Runs of arms on the random numbers of one trial, and what they gave over time.

    Parameters
    ----------
    arms : Arms
        The settings.
    target : str
        The target as the runs name it.
    by : float
        When it is to be reached [s].
    trial : int
        Address of the random numbers.
    store : callable or None
        Returns the store of a sweep by its name and settings.
    name : str
        First part of these names.
    executor : concurrent.futures.Executor or None
        Computes work units elsewhere.
    progress : callable
        Called with the number of runs that have finished.
    """

    def __init__(
        self, arms: Arms, target: str, by: float, *, trial: int, name: str,
        store: Stores | None, executor: Executor | None,
        progress: Callable[[int], None],
    ) -> None:  # fmt: skip
        self.arms, self.target, self.by, self._trial, self._name = arms, target, by, trial, name
        self._store, self._executor, self._progress = store, executor, progress
        self.times = kept_times(arms.axes.study)
        self._all_times = np.append(self.times, by)
        self._counts: dict[int, Any] = {}
        self.broken = self._calls = 0
        self.tally = Tally(self.sample)

    def sample(self, arms: Sequence[int], runs: range) -> Bools:
        """Simulate, and return whether each run reached the target in time, shape (arm, run)."""
        settings = self.arms.settings(arms, self._trial)
        longest = max(w.steps * w.study.assembly.blocks for w in settings.worlds)
        size = settings_per_unit(len(arms) * len(runs), longest, multiple=RUNS_OF_UNIT)
        self._calls += 1
        store = None
        if self._store is not None:
            points = [self.arms.points[arm] for arm in arms]
            name = f"{self._name}_{self._calls:03d}"
            store = self._store(name, {"settings": points, "runs": len(runs)})
        found = run_sweep(
            _Simulation(settings, self.target, self._all_times),
            grid(arm=np.arange(len(arms)), run=np.array(runs)).units(size),
            store=store,
            progress=lambda done, _: self._progress(self.tally.runs + done),
            executor=self._executor,
        )  # fmt: skip
        reached: Bools = found["reached"].reshape(len(arms), len(runs), -1)
        self.broken += int(found["broken"].sum())
        for arm, one in zip(arms, reached, strict=True):
            self._counts[arm] = self._counts.get(arm, 0) + one[:, :-1].sum(axis=0)
        return reached[:, :, -1]

    def share(self, arm: int) -> Floats:
        """Return the share of the runs of an arm that have the target, over time."""
        return np.asarray(self._counts[arm] / self.tally.size(arm))

    def cautious(self, arm: int) -> Floats:
        """Return the share less its standard error, over time: few runs are no merit."""
        share, runs = self.share(arm), self.tally.size(arm)
        return share - np.sqrt((share * (1.0 - share) + 1.0 / runs) / runs)
