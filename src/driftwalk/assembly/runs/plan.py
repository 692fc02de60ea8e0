"""Plan of a simulation: the study with its options, and every run's address and parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.assembly.lattice.joined_faces import ROUNDING, face_table
from driftwalk.assembly.pull.force_tables import block_pull, table_of
from driftwalk.assembly.runs.start import (
    given_start,
    glued_cells,
    place_blocks,
    require_bonds,
    require_room,
    with_glue_events,
)
from driftwalk.core.arrays import Floats, Integers, Keys
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.core.processors import default_threads
from driftwalk.core.random_streams import trial_in, world_keys
from driftwalk.model import Study, apply_overrides
from driftwalk.simulation.backend import Camera, native_model, require_cover, require_steps
from driftwalk.simulation.series import continued_flow, flow_starts

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.lattice.polyomino import Chirality
    from driftwalk.assembly.pull.measured import MeasuredAttraction

Backend = Literal["cpu", "reference"]

MOST_STEPS: Final = 2**31 - 1
"""The native core counts steps in 32 bits."""


@dataclass(frozen=True, eq=False)
class Plan:
    """Runs to be simulated; one entry per run in every array."""

    study: Study
    flow: xr.Dataset
    steps: int
    trial: int
    index: Integers
    keys: Keys
    drag_coefficient: Floats
    force_std: Floats
    threads: int
    backend: Backend
    flow_start: Floats | None
    """When each run begins in a flow that changes [s]; None: the flow is steady."""
    flow_draw: Integers | None = None
    """Which drawn flow a run has; None: the flow as it is."""
    flow_correlated_over: float | None = None
    """Distance over which the errors of a drawn flow go together [m]; None: each node alone."""
    attraction: MeasuredAttraction | None = None
    """The study's table of the force between two faces, as it was at the start."""
    law: Mapping[str, Floats] = field(default_factory=dict)
    """Drawn numbers of the law by their keys in the study, which has the others."""

    @property
    def has_lattice(self) -> bool:
        """Whether the blocks are squares; others have contacts, no faces and no lattice."""
        return self.study.block.has_lattice

    @property
    def duration(self) -> float:
        """How long a run is simulated [s]."""
        return self.steps * self.study.time_step_s

    @property
    def event_rows(self) -> int:
        """For how many events a run has room at first: a run with more is simulated again.

        It is what bonds without load make if all blocks are always in one assembly, and half as
        much.
        """
        rules = self.study.assembly
        least = max(rules.blocks - 1, 1)
        if not rules.bonds_break:
            return least
        return least + 16 + int(6.0 * rules.blocks * rules.bond_rate_per_s * self.duration)

    @property
    def chirality(self) -> Chirality | None:
        """Whether mirror images are one class or two; None without a lattice."""
        return chirality_of(self.study)

    def model(self) -> _core.Model:
        """Return the native core's form of the model in this flow."""
        return native_model(self.study, self.flow, np.zeros(1), Camera())

    def rules(self) -> dict[str, Any]:
        """Return how blocks collide and latch, by the names of the native core."""
        rules = self.study.assembly
        return {
            "latching": rules.latching,
            "connector_distance": rules.connector_distance_m,
            "connector_axis": rules.connector_axis_rad,
            "hidden_share": rules.hidden_share,
            "stirring_length": self.study.forces.stirring_length_m,
            "incompressible": self.study.forces.stirring == "incompressible",
            "block_restitution": rules.block_restitution,
            "block_friction": rules.block_friction,
            "bonds": (
                *(rules.bond_rate_per_s, rules.bond_force_N, rules.bond_strength_N),
                rules.relatch_clearance,
            ),
            "faces": None if (table := face_table(rules)) is None else table.native(),
        }


def chirality_of(study: Study) -> Chirality | None:
    """Return whether mirror images are one class or two; None without a lattice."""
    return None if not study.block.has_lattice else study.assembly.chirality


def make_plan(
    study: Study,
    flow: xr.Dataset,
    *,
    settings: dict[str, Any],
    index: Integers | None = None,
    drag_coefficient: npt.ArrayLike | None = None,
    force_std: npt.ArrayLike | None = None,
    trial: int = 0,
    threads: int | None = None,
    backend: Backend = "cpu",
    ends: bool = True,
) -> Plan:
    """Put options over the study, and check everything but the start.

    Parameters
    ----------
    study, flow, drag_coefficient, force_std, trial, threads, backend
        As in `driftwalk.assembly.assemble`.
    settings : dict
        Values by the keys of [assembly]; None leaves the study's.
    index : ndarray of int, optional
        The runs, by index; default: all of the study's.
    ends : bool
        Whether the runs end after the study's duration.

    Raises
    ------
    InputError
        When an option is out of range, the blocks have no room or are not as many as their kinds
        count, the flow does not cover the tank, or is over before the runs.
    """
    if backend not in get_args(Backend):
        raise InputError(f"backend must be one of {', '.join(get_args(Backend))}, got {backend!r}")
    if not 0 <= trial < 2**40:
        raise InputError(f"trial: expected a whole number from 0 to 2**40 - 1, got {trial}")
    given = {f"assembly.{key}": value for key, value in settings.items() if value is not None}
    for key, value in (("drag_coefficient", drag_coefficient), ("force_std_N", force_std)):
        if value is not None and np.ndim(value) == 0:
            given[f"forces.{key}"] = float(np.asarray(value))
    chosen = apply_overrides(study, given)
    require_room(chosen)
    require_bonds(chosen)
    if ends:  # the kinds of a live tank repeat
        _require_kinds(chosen)
    require_cover(flow, chosen.tank)
    table = table_of(chosen)
    block_pull(chosen, table)  # its errors come before any run
    runs = np.arange(chosen.assembly.runs) if index is None else index
    forces, steps = chosen.forces, whole_steps(chosen)
    keys = stream_keys("run", seed=chosen.assembly.seed, trial=trial, index=runs)
    lasts = steps * chosen.time_step_s if ends else math.inf
    flow = continued_flow(flow, chosen, duration=lasts)
    return Plan(
        study=chosen,
        flow=flow,
        steps=steps,
        trial=trial,
        index=runs,
        keys=keys,
        drag_coefficient=_of_each(
            "drag_coefficient", drag_coefficient, forces.drag_coefficient, runs.size
        ),
        force_std=_of_each("force_std", force_std, forces.force_std_N, runs.size),
        threads=threads or default_threads(),
        backend=backend,
        flow_start=flow_starts(flow, chosen, keys, duration=lasts),
        attraction=table,
    )


def _require_kinds(study: Study) -> None:
    """Refuse kinds that count other than the blocks of the study."""
    rules = study.assembly
    if rules.binding is not None and rules.binding.blocks != rules.blocks:
        raise InputError(
            f"binding: the kinds count {rules.binding.blocks} blocks, and there are "
            f"{rules.blocks} (blocks): make them the same"
        )


def whole_steps(study: Study) -> int:
    """Return the whole time steps of a run: those that end within its duration, at least one."""
    duration, step = study.assembly.duration_s, study.time_step_s
    require_steps(max(duration, study.forces.force_interval_s), step)
    return max(int(np.floor(duration / step + 1e-9)), 1)


def steps_of(
    duration_s: float, due: float, *, step: float, had: int, otherwise: str = ""
) -> tuple[int, float]:
    """Return the whole steps of a duration and of what was due before it, and what is due then [s].

    Parameters
    ----------
    duration_s, due : float
        The duration, and what was left of the ones before it [s].
    step : float
        Time step [s].
    had : int
        Steps that the world has had.
    otherwise : str
        What else helps where they are too many.

    Raises
    ------
    InputError
        When the duration is negative or not finite, or the steps would be too many.
    """
    if not 0.0 <= duration_s < math.inf:
        raise InputError(f"duration_s must be a finite number from 0 s on, got {duration_s}")
    due += duration_s
    # Time stamps are decimal numbers: 0.3 s are three steps of 0.1 s.
    steps = math.floor(min(due / step, 2.0 * MOST_STEPS) + ROUNDING)
    if had + steps >= MOST_STEPS:
        raise InputError(
            f"a world has at most {MOST_STEPS - 1} time steps of {step:g} s and has had {had}: "
            f"advance by less than {duration_s:g} s{otherwise}"
        )
    return steps, due - steps * step


def _of_each(name: str, given: npt.ArrayLike | None, default: float, runs: int) -> Floats:
    values = np.asarray(default if given is None else given, dtype=np.float64)
    if values.shape not in ((), (runs,)):
        raise InputError(
            f"{name}: expected one number, or one for each of {runs} runs, got shape {values.shape}"
        )
    if not (np.isfinite(values) & (values >= 0)).all():
        raise InputError(f"{name}: expected finite numbers from 0 on")
    return np.ascontiguousarray(np.broadcast_to(values, (runs,)))


def start_poses(plan: Plan, start: npt.ArrayLike | None = None) -> Floats:
    """Return the start poses of all runs: the given ones, or random ones that do not overlap."""
    if start is not None:
        return given_start(plan.study, start, runs=plan.index.size)
    return place_blocks(plan.study, plan.model(), plan.keys, threads=plan.threads)


def simulate_rows(
    plan: Plan, start: Floats, rows: slice = slice(None), *, sample_every: int = 0
) -> Arrays:
    """Simulate some of the runs; one entry per run in every array, and room for all events."""
    found = _simulate(plan, start, rows, sample_every, plan.event_rows)
    most = int(found["event_count"].max(initial=0))
    if most > found["event_step"].shape[1]:
        found = _simulate(plan, start, rows, sample_every, most)
    return found


def _simulate(plan: Plan, start: Floats, rows: slice, every: int, event_rows: int) -> Arrays:
    """Return what the native core gives for some runs; events beyond `event_rows` are counted."""
    pull = block_pull(plan.study, plan.attraction)
    found = _core.assemble(
        plan.model(),
        start=np.ascontiguousarray(start[rows]),
        key=np.ascontiguousarray(plan.keys[rows]),
        drag_coefficient=np.ascontiguousarray(plan.drag_coefficient[rows]),
        force_std=np.ascontiguousarray(plan.force_std[rows]),
        steps=plan.steps,
        **plan.rules(),
        pull=None if pull is None else pull.native,
        sample_every=every,
        event_rows=event_rows,
        threads=plan.threads,
        precision="double" if plan.backend == "reference" else "single",
        flow_start=None if plan.flow_start is None else np.ascontiguousarray(plan.flow_start[rows]),
        glued=(cells := glued_cells(plan.study.assembly)),
    )
    arrays = {name: values for name, values in found.items() if isinstance(values, np.ndarray)}
    return with_glue_events(arrays, cells, plan.study.assembly.blocks)


Stream = Literal["run", "parameters", "flow", "glued"]


def stream_keys(stream: Stream, *, seed: int, trial: int, index: npt.ArrayLike) -> Keys:
    """Return the keys of random streams, one per index.

    Parameters
    ----------
    stream : {"run", "parameters", "flow", "glued"}
        Purpose of the numbers; streams of two kinds never meet.
    seed : int
        Seed of the whole work.
    trial : int
        Index of the parameter set within the work, 0 <= trial < 2**40.
    index : array_like of int
        Index of the run or of the draw.

    Examples
    --------
    >>> keys = stream_keys("run", seed=1, trial=0, index=[0, 1])
    >>> bool((keys == stream_keys("run", seed=1, trial=0, index=[1, 0])[::-1]).all())
    True
    """
    return world_keys(seed, trial=trial_in(stream, trial), replicate=index)
