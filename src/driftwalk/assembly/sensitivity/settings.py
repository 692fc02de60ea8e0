"""Settings of a sensitivity analysis, from its axes, and the outcomes of their runs.

Every setting has its own random numbers, by its trial: what comes out depends neither on the
order of the settings nor on how they are cut into work units.
"""

from __future__ import annotations

import json
import math
from abc import abstractmethod
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.runs.dataset import completion_step, replay_of, times_of
from driftwalk.assembly.runs.plan import Plan, make_plan, simulate_rows, stream_keys
from driftwalk.assembly.runs.start import place_blocks
from driftwalk.assembly.sensitivity.times import Courses, added, courses_of, courses_to_text
from driftwalk.core.arrays import Floats, Integers, Keys
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.core.study_keys import ASSEMBLY_KEYS
from driftwalk.model.sensitivity import AXES
from driftwalk.simulation.backend import BROKEN
from driftwalk.simulation.series import flow_starts
from driftwalk.sweep import Design, SweepStudy, WorkUnit, grid, settings_per_unit

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class TrialPolicy(NamedTuple):
    """First trials, so far apart that these runs and those of `assemble` share no random number."""

    map: int = 1 << 32
    """Of the map; chosen by hand."""
    reference: int = 2 << 32
    """Of the reference; chosen by hand."""
    sobol: int = 3 << 32
    """Of the Sobol indices; chosen by hand."""
    emulator: int = 4 << 32
    """Of the nodes of an emulator of the outcomes; chosen by hand."""
    self_check: int = 5 << 32
    """Of the data sets of its self-check; chosen by hand."""
    choice: int = 6 << 32
    """Of the runs that choose the setting of the largest yield; chosen by hand."""
    fresh: int = 7 << 32
    """Of the fresh runs that report its yield; chosen by hand."""


FIRST_TRIALS: Final = TrialPolicy()
BLOCKS_AT_ONCE: Final = 1_000_000
"""Blocks of one call of the native core: about 100 MB."""


@dataclass(frozen=True, eq=False)
class Settings:
    """Settings to simulate, one entry per setting in every array.

    Attributes
    ----------
    worlds : sequence of Plan
        Everything but drag coefficient, force and random numbers; each with one entry per run.
    world : ndarray of int
        Which of the worlds a setting has.
    drag_coefficient, force_std : ndarray
        C_d and sigma_F [N].
    trial : ndarray of int
        Address of the random numbers.
    """

    worlds: Sequence[Plan]
    world: Integers
    drag_coefficient: Floats
    force_std: Floats
    trial: Integers

    @property
    def size(self) -> int:
        """Number of settings."""
        return self.trial.size


def make_settings(
    worlds: Sequence[Plan],
    world: Integers,
    *,
    first_trial: int,
    drag_coefficient: Floats | None = None,
    force_std: Floats | None = None,
) -> Settings:
    """Return settings with trials in a row; C_d and sigma_F are those of the study if left out."""
    forces = worlds[0].study.forces
    if drag_coefficient is None:
        drag_coefficient = np.full(world.size, forces.drag_coefficient)
    if force_std is None:
        force_std = np.full(world.size, forces.force_std_N)
    trial = first_trial + np.arange(world.size)
    return Settings(worlds, world, drag_coefficient, force_std, trial)


@dataclass(frozen=True, eq=False)
class Outcomes:
    """Results, one entry per setting.

    Attributes
    ----------
    count : list of dict
        Number of runs by class name.
    left_out : ndarray of int
        Runs without an outcome.
    first_contact_median, completion_median : ndarray
        Time at which it has happened in half of the runs [s], NaN when not reached.
    courses : list of str
        Numbers of runs by class over time, see `driftwalk.assembly.sensitivity.times`.
    """

    count: list[dict[str, int]]
    left_out: Integers
    first_contact_median: Floats
    completion_median: Floats
    courses: list[str]

    def occurred(self) -> set[str]:
        """Return the classes that occurred in any setting."""
        return {name for count in self.count for name in count}

    def table(self, names: Sequence[str]) -> Integers:
        """Return the numbers of runs by setting and class, shape (setting, class)."""
        rows = [[count.get(name, 0) for name in names] for count in self.count]
        return np.array(rows, dtype=np.int64)


def world_plan(study: Study, flow: xr.Dataset, *, threads: int | None) -> Plan:
    """Return everything about some settings but drag coefficient, force and random numbers.

    As many runs as [sensitivity] says, with its seed.

    Raises
    ------
    InputError
        When the blocks have no room, or the flow does not cover the tank.
    """
    chosen = study.sensitivity
    return make_plan(
        study, flow, settings={"runs": chosen.runs, "seed": chosen.seed}, threads=threads
    )


@dataclass(frozen=True, eq=False)
class OutcomeStudy(SweepStudy["xr.Dataset"]):
    """The outcomes of settings of self-assembly, and a dataset of them."""

    settings: Settings

    names_units: ClassVar = False

    def check(self) -> None:
        """Refuse blocks that find no place in the tank."""
        place_first(self.settings)

    def design(self) -> Design:
        """Return the numbers of the settings."""
        return grid(setting=np.arange(self.settings.size))

    @property
    def unit_size(self) -> int:
        """Number of settings that are simulated and stored at once."""
        worlds = self.settings.worlds
        longest = max(w.index.size * w.steps * w.study.assembly.blocks for w in worlds)
        return settings_per_unit(self.settings.size, longest)

    def __call__(self, unit: WorkUnit) -> Arrays:
        """Simulate the settings of a unit, with those of one world side by side."""
        rows = np.arange(unit.start, unit.stop)
        tally = {int(row): _Tally() for row in rows}
        for world in dict.fromkeys(self.settings.world[rows].tolist()):
            plan = self.settings.worlds[world]
            same = rows[self.settings.world[rows] == world].tolist()
            most = BLOCKS_AT_ONCE // plan.study.assembly.blocks
            for pieces in _calls(same, plan.index.size, most):
                found, classes = simulate_pieces(plan, self.settings, pieces)
                begin = 0
                for piece in pieces:
                    part = slice(begin, begin + len(piece.runs))
                    mine = {name: values[part] for name, values in found.items()}
                    tally[piece.setting].add(mine, classes, plan)
                    begin = part.stop
        step, tallies = self.settings.worlds[0].study.time_step_s, tally.values()
        texts = [courses_to_text(added(one.courses)) for one in tallies]
        return {
            "count": np.array([json.dumps(one.count) for one in tallies], dtype=object),
            "left_out": np.array([one.left_out for one in tallies]),
            "first_contact_median": np.array([_median(t.first_contact, step) for t in tallies]),
            "completion_median": np.array([_median(t.completion, step) for t in tallies]),
            "courses": np.array(texts, dtype=object),
        }

    def result(self, found: Arrays) -> xr.Dataset:
        """Return the dataset of what the work units gave."""
        return self.dataset(
            Outcomes(
                [json.loads(text) for text in found["count"]],
                found["left_out"],
                found["first_contact_median"],
                found["completion_median"],
                found["courses"].tolist(),
            )
        )

    @abstractmethod
    def dataset(self, outcomes: Outcomes) -> xr.Dataset:
        """Return the dataset of the study."""


def place_first(settings: Settings) -> None:
    """Place the blocks of the first setting of each world, to find out whether they fit.

    Raises
    ------
    InputError
        When the blocks of a run find no place in the tank.
    """
    for world, plan in enumerate(settings.worlds):
        first = int(settings.trial[np.flatnonzero(settings.world == world)[0]])
        keys = _keys(plan, first, range(plan.index.size))
        place_blocks(plan.study, plan.model(), keys, threads=plan.threads)


class _Tally:
    """Results of the runs of one setting, gathered piece by piece."""

    def __init__(self) -> None:
        self.count: Counter[str] = Counter()
        self.left_out = 0
        self.first_contact: list[Integers] = []
        self.completion: list[Integers] = []
        self.courses: list[Courses] = []

    def add(self, found: Arrays, classes: Sequence[str], plan: Plan) -> None:
        """Add runs, as `simulate_pieces` returns them."""
        sound = (found["status"].astype(np.int64) & BROKEN) == 0
        self.left_out += int((~sound).sum())
        occurred, number = np.unique(found["outcome"][sound], return_counts=True)
        names = [classes[place] for place in occurred.tolist()]
        self.count.update(dict(zip(names, number.tolist(), strict=True)))
        step, became = (found[f"event_{what}"][sound] for what in ("step", "class"))
        self.courses.append(courses_of(step, became, classes, plan))
        self.first_contact.append(found["first_contact_step"][sound])
        self.completion.append(completion_step(found)[sound])


class Piece(NamedTuple):
    """Some runs of a setting."""

    setting: int
    runs: range


def _calls(settings: list[int], runs: int, most: int) -> Iterator[list[Piece]]:
    """Yield groups of runs of settings, each for one call of the core."""
    group: list[Piece] = []
    room = most
    for setting in settings:
        for first in range(0, runs, most):
            piece = Piece(setting, range(first, min(first + most, runs)))
            if len(piece.runs) > room:
                yield group
                group, room = [], most
            group.append(piece)
            room -= len(piece.runs)
    yield group


def simulate_pieces(
    plan: Plan, settings: Settings, pieces: list[Piece]
) -> tuple[Arrays, tuple[str, ...]]:
    """Simulate the runs of some settings in one call.

    Returns
    -------
    found : dict of ndarray
        Result of the native core, and ``event_class`` and ``outcome`` of every run.
    classes : tuple of str
        Names of the classes, into which these are indices.
    """
    model = plan.model()
    keys = [_keys(plan, int(settings.trial[piece.setting]), piece.runs) for piece in pieces]
    start = [place_blocks(plan.study, model, own, threads=plan.threads) for own in keys]
    length = [len(piece.runs) for piece in pieces]
    chosen = [piece.setting for piece in pieces]
    together = np.concatenate(keys)
    filled = replace(
        plan,
        keys=together,
        flow_start=flow_starts(plan.flow, plan.study, together, duration=plan.duration),
        drag_coefficient=np.repeat(settings.drag_coefficient[chosen], length),
        force_std=np.repeat(settings.force_std[chosen], length),
    )
    found = simulate_rows(filled, np.concatenate(start))
    replayed = replay_of(plan, found)
    made = {"event_class": replayed.event_class, "outcome": replayed.outcome}
    return found | made, replayed.classes


def _keys(plan: Plan, trial: int, runs: range) -> Keys:
    return stream_keys("run", seed=plan.study.assembly.seed, trial=trial, index=runs)


def _median(steps: list[Integers], time_step: float) -> float:
    """Return the time at which it has happened in half of the runs, as `class_times` has it."""
    step = np.concatenate(steps)
    happened = np.sort(step[step >= 0])
    half = -(-step.size // 2)
    if not 0 < half <= happened.size:
        return float("nan")
    return float(times_of(happened[half - 1], time_step=time_step))


KEYS: Final = {name: ASSEMBLY_KEYS.get(name, "") for name in AXES}
"""From the name of an axis to the parameter of the study that it varies."""
OF_EACH_RUN: Final = ("drag_coefficient", "force_std")
"""The axes along which runs can be simulated side by side."""


@dataclass(frozen=True, eq=False)
class Axes:
    """The axes of a map, and what the settings along them are.

    Attributes
    ----------
    study : Study
        With the values of the axes in its [sensitivity].
    values : dict of str to tuple
        The values of each axis, in the order of the dimensions.
    flows : dict of str to xarray.Dataset
        The flow fields of the axis ``flow``.
    """

    study: Study
    values: dict[str, tuple[Any, ...]]
    flows: dict[str, xr.Dataset]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(len(values) for values in self.values.values())

    def coordinates(self) -> dict[str, tuple[str, npt.NDArray[Any]]]:
        """Return the coordinates of the axes for a dataset."""
        return {name: (name, _array(values)) for name, values in self.values.items()}

    def settings(self, flow: xr.Dataset, *, first_trial: int, threads: int | None) -> Settings:
        """Return every combination of the values, the last axis fastest.

        Raises
        ------
        InputError
            When the blocks of a setting have no room, or its flow does not cover its tank.
        """
        apart = [name for name in self.values if name not in OF_EACH_RUN]
        along = [name for name in self.values if name in OF_EACH_RUN]
        worlds = [
            self.world(dict(zip(apart, chosen, strict=True)), flow, threads)
            for chosen in product(*(self.values[name] for name in apart))
        ]
        size = math.prod(self.shape)
        inner = np.meshgrid(*(np.array(self.values[name]) for name in along), indexing="ij")
        return make_settings(
            worlds,
            np.repeat(np.arange(len(worlds)), size // len(worlds)),
            first_trial=first_trial,
            **{
                name: np.tile(values.ravel(), len(worlds))
                for name, values in zip(along, inner, strict=True)
            },
        )

    def world(self, chosen: Mapping[str, Any], flow: xr.Dataset, threads: int | None) -> Plan:
        """Return everything about a setting but drag coefficient, force and random numbers.

        Raises
        ------
        InputError
            When a value is out of range, the blocks have no room, or the flow does not cover the
            tank; names the setting.
        """
        from driftwalk.model import apply_overrides

        changes = {KEYS[name]: value for name, value in chosen.items() if KEYS[name]}
        field = self.flows[chosen["flow"]] if "flow" in chosen else flow
        field = _scaled(field, chosen.get("flow_scale", 1.0))
        try:
            return world_plan(apply_overrides(self.study, changes), field, threads=threads)
        except InputError as error:
            if not chosen:
                raise
            where = ", ".join(f"{name} = {value}" for name, value in chosen.items())
            raise InputError(f"at {where}: {error}") from error


def _scaled(field: xr.Dataset, scale: float) -> xr.Dataset:
    """Return a flow of another strength, with its standard errors."""
    names = ("u", "v", "u_standard_error", "v_standard_error")
    return field.assign({name: scale * field[name] for name in names if name in field})


def make_axes(study: Study, axes: Mapping[str, Any] | None) -> Axes:
    """Return the axes that a study names, or the given ones in their place.

    Parameters
    ----------
    study : Study
        Its [sensitivity] holds when `axes` is left out.
    axes : mapping, optional
        Values by the name of an axis; for ``flow`` the datasets by name, or files.

    Raises
    ------
    InputError
        When there is no such axis, or a value is out of range.
    """
    from driftwalk.model import apply_overrides
    from driftwalk.model.sensitivity import AXES

    flows: dict[str, xr.Dataset] = {}
    if axes is not None:
        unknown = [name for name in axes if name not in KEYS]
        if unknown or not axes:
            raise InputError(
                f"axes: there is no {', '.join(map(repr, unknown)) or '(none was named)'}; "
                f"choose from {', '.join(KEYS)}"
            )
        if isinstance(axes.get("flow"), Mapping):
            flows = dict(axes["flow"])
        given = {
            f"sensitivity.{key}": _plain(axes[name]) if name in axes else None
            for name, key in AXES.items()
        }
        try:
            study = apply_overrides(study, given)
        except ConfigurationError as error:
            raise InputError(f"axes: {error}") from error
    values = study.sensitivity.axes
    missing = [name for name in values.get("flow", ()) if name not in flows]
    return Axes(study, values, flows | {name: _load(name, study) for name in missing})


def _load(path: str, study: Study) -> xr.Dataset:
    from driftwalk.flow import load_flow

    return load_flow(path, arena=study.tank.to_arena(), own_flags="keep")


def _plain(values: Any) -> list[Any]:
    if isinstance(values, Mapping):
        return [str(name) for name in values]
    if isinstance(values, str):
        raise InputError(f"axes: expected a list of values, got '{values}'")
    return list(np.asarray(values).tolist())


def _array(values: tuple[Any, ...]) -> npt.NDArray[Any]:
    return np.array(values, dtype=object if isinstance(values[0], str) else None)
