"""Interactive simulation of a tank of blocks, advanced and changed step by step."""

from __future__ import annotations

import math
from functools import cached_property
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.assembly.lattice.joined_faces import (
    CLOSING,
    JOINING,
    PARTING,
    FaceTable,
    face_table,
)
from driftwalk.assembly.lattice.replayed_worlds import DiscWorld, SquareWorld
from driftwalk.assembly.outcomes.outcome_classes import state_class
from driftwalk.assembly.pull.force_tables import block_pull
from driftwalk.assembly.runs.dataset import times_of
from driftwalk.assembly.runs.plan import make_plan, start_poses, steps_of
from driftwalk.assembly.runs.start import glued_cells, require_bonds, require_room
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.model import Study, apply_overrides
from driftwalk.simulation.backend import BROKEN

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model.assembly import HiddenFaceDrag, Latching


class LiveEvent(NamedTuple):
    """Two blocks have joined."""

    time: float
    """End of the time step [s]."""
    blocks: tuple[int, int]
    """First that of the assembly that stayed, then of the one that was moved into line."""
    outcome: str
    """Outcome class of the whole world from then on."""
    is_parting: bool = False
    """Whether two blocks parted, whose bond broke, instead of joining."""


class _Moment:
    """The state of a world at one time; what is not read of it costs nothing."""

    def __init__(self, world: _core.LiveWorld, study: Study) -> None:
        self.state: dict[str, npt.NDArray[Any]] = world.state()
        self._step = world.step
        self._study = study

    @cached_property
    def time(self) -> float:
        return float(times_of(np.array(self._step), time_step=self._study.time_step_s))

    @cached_property
    def table(self) -> FaceTable | None:
        return face_table(self._study.assembly)

    @cached_property
    def outcome(self) -> str:
        return state_class(self.state, self._study)


class _NextSettings(NamedTuple):
    """Settings of a world from its next force interval on."""

    study: Study
    flow_scale: float
    part: bool = False
    """Whether what is joined then is to be parted."""


class LiveTank:
    """One tank of blocks that advances by a duration and whose parameters change while it runs.

    The world is that of `assemble` with ``backend="reference"``: while nothing is changed, it is
    run 0 of `assembly_path` with the same seed, bit for bit, however it is advanced. It
    goes on when all blocks have become one assembly, and has no end.

    Everything may be called from several threads at once. `advance`, `part`, `events` and `restart`
    wait for each other. `set` and the properties do not wait for them, except `set` for a
    `restart`, and `advance` does not hold the interpreter lock: while it runs, other threads see
    the state before it. No change is lost
    when several threads call `set` at once. Each property is read on its own, though: when another
    thread advances in between, `x` and `y` are those of two moments.

    Parameters
    ----------
    study : Study
        Block, tank, water, forces and assembly, to begin with.
    flow : xarray.Dataset
        The water's velocity, a `flow_field` that covers the tank. For one that
        changes in time, [flow] of the study says how it goes on after its last frame.
    blocks, seed : int, optional
        Over the study's values.
    start : array_like, shape (blocks, 3), optional
        Poses at the start [m, m, rad], at rest; default: random ones that do not overlap.

    Raises
    ------
    InputError
        When there are more blocks than fit the tank, the flow does not cover it, or an option is
        out of range.

    Examples
    --------
    >>> import driftwalk as dw
    >>> tank = dw.LiveTank(dw.Study(), dw.uniform_flow(0.0, 0.0), blocks=3)
    >>> tank.advance(0.5)
    >>> tank.set(force_std=2e-3, latching="none")
    >>> tank.advance(0.5)
    >>> tank.time, tank.x.shape, tank.outcome
    (1.0, (3,), '1+1+1')
    """

    def __init__(
        self,
        study: Study,
        flow: xr.Dataset,
        *,
        blocks: int | None = None,
        seed: int | None = None,
        start: npt.ArrayLike | None = None,
    ) -> None:
        plan = make_plan(
            study, flow, settings={"blocks": blocks, "seed": seed}, index=np.arange(1), ends=False
        )
        if glued_cells(plan.study.assembly) is not None:
            raise InputError(
                "a live tank starts with single blocks, not with glued ones (`assembly.glued`)"
            )
        self._flow = plan.flow
        self._lock = Lock()
        # Never held while the world advances. Where both are held, this one is taken second.
        self._next_lock = Lock()
        self._next_settings = _NextSettings(plan.study, 1.0)
        self._model = plan.model()
        self.restart(start=start)

    def restart(self, *, seed: int | None = None, start: npt.ArrayLike | None = None) -> None:
        """Begin again at time 0, with the parameters and the number of blocks wanted last.

        Parameters
        ----------
        seed : int, optional
            Of the start and of the forces; default: as before, so that it is the same run again.
        start : array_like, shape (blocks, 3), optional
            Poses at the start [m, m, rad], at rest; default: random ones that do not overlap.

        Raises
        ------
        InputError
            As the class.
        """
        with self._lock, self._next_lock:
            study, settings = self._next_settings.study, {"seed": seed}
            plan = make_plan(study, self._flow, settings=settings, index=np.arange(1), ends=False)
            forces = plan.study.forces
            self._world = _core.LiveWorld(
                self._model,
                start=np.ascontiguousarray(start_poses(plan, start)[0]),
                key=int(plan.keys[0]),
                drag_coefficient=forces.drag_coefficient,
                force_std=forces.force_std_N,
                **plan.rules(),
                flow_start=0.0 if plan.flow_start is None else float(plan.flow_start[0]),
            )
            self._next_settings = self._active = _NextSettings(
                plan.study, self._next_settings.flow_scale
            )
            self._set_forces()
            self._steps_per_interval = round(forces.force_interval_s / plan.study.time_step_s)
            self._due = 0.0
            self._events: list[LiveEvent] = []
            self._look()

    def advance(self, duration_s: float) -> None:
        """Let the world go on for a while.

        It goes by whole time steps; what is left of a duration counts for the next one.

        Parameters
        ----------
        duration_s : float
            How long [s], from 0.

        Raises
        ------
        InputError
            When the duration is negative or too long, or the forces have become so large that the
            numbers are lost: then only `restart` helps.
        """
        with self._lock:
            step, had = self._next_settings.study.time_step_s, self._world.step
            steps, self._due = steps_of(
                duration_s, self._due, step=step, had=had, otherwise=", or restart it"
            )
            self._go(steps)
            self._look()
            if self._world.status & BROKEN:
                raise InputError(
                    f"the blocks' positions were lost by {self.time:g} s: forces or flow are too "
                    f"strong for a time step of {step:g} s; weaken them and restart"
                )

    def set(
        self,
        *,
        drag_coefficient: float | None = None,
        force_std: float | None = None,
        flow_scale: float | None = None,
        latching: Latching | None = None,
        faces: str | None = None,
        hidden_face_drag: HiddenFaceDrag | str | None = None,
        stirring_length: float | None = None,
        bond_rate: float | None = None,
        magnets: str | None = None,
        blocks: int | None = None,
        part: bool = False,
    ) -> None:
        """Change parameters from the next force interval on; None leaves one as it is.

        Parameters
        ----------
        drag_coefficient : float
            C_d.
        force_std : float
            sigma_F [N].
        flow_scale : float
            Factor on the velocity of the water, from 0 (still water); 1 at first.
        latching : {"collision", "connector", "none"}
            How blocks latch from then on. Joined blocks stay joined, even with "none", unless they
            are parted.
        faces : str
            Types of the blocks' faces, such as "N,S,N,S", or "any"; what is joined stays so.
        hidden_face_drag : {"none", "full"} or float
            Drag on faces that are joined; a number is its share of a free face's, 0 to 1.
        stirring_length : float
            Distance over which blocks share the stochastic force [m]; 0: each has its own.
        bond_rate : float
            Rate at which each bond breaks [1/s]; 0: never.
        magnets : str
            Magnet at the centre of each face, such as ``"5x5x2mm,1.3T"``, or ``"none"``.
        blocks : int
            Number of blocks. The last ones are removed; what is left of their assemblies goes on as
            it was moving, as several where it no longer hangs together. New ones come to rest at
            random free places; those for which there is none yet wait (`waiting`).
        part : bool
            Whether all assemblies are parted into their blocks at that moment, as by `part`.

        Raises
        ------
        InputError
            When a value is out of range or the blocks cannot fit the tank. Nothing changes then.
        """
        given = {
            "forces.drag_coefficient": drag_coefficient,
            "forces.force_std_N": force_std,
            "assembly.latching": latching,
            "assembly.faces": faces,
            "assembly.hidden_face_drag": hidden_face_drag,
            "forces.stirring_length_m": stirring_length,
            "assembly.bond_rate_per_s": bond_rate,
            "interaction.magnets": magnets,
            "assembly.blocks": blocks,
        }
        overrides = {key: value for key, value in given.items() if value is not None}
        with self._next_lock:
            before = self._next_settings
            study = apply_overrides(before.study, overrides)
            require_room(study)
            require_bonds(study)
            block_pull(study)
            scale = before.flow_scale if flow_scale is None else flow_scale
            if not 0.0 <= scale < math.inf:
                raise InputError(f"flow_scale must be a finite number from 0 on, got {scale}")
            self._next_settings = _NextSettings(study, float(scale), part or before.part)

    def part(self) -> None:
        """Part all assemblies into their blocks, which move on as they did.

        They lie face to face then and latch again at once, unless latching is "none".
        """
        with self._lock:
            self._world.part()
            self._look()

    def events(self) -> list[LiveEvent]:
        """Return joinings and partings since the last call: time [s], blocks, class after it."""
        with self._lock:
            events, self._events = self._events, []
        return events

    @property
    def study(self) -> Study:
        """The study with the values wanted last."""
        return self._next_settings.study

    @property
    def has_lattice(self) -> bool:
        """Whether the blocks are squares, which latch face to face; others latch as they lie."""
        return self._next_settings.study.block.has_lattice

    @property
    def flow_scale(self) -> float:
        """The factor on the velocity of the water wanted last."""
        return self._next_settings.flow_scale

    @property
    def time(self) -> float:
        """Time of the state since the start [s]: the end of a time step."""
        return self._moment.time

    @property
    def blocks(self) -> int:
        """Number of blocks in the tank."""
        return int(self._moment.state["assembly"].size)

    @property
    def waiting(self) -> int:
        """Number of blocks that are wanted but not in the tank yet."""
        return max(self._next_settings.study.assembly.blocks - self.blocks, 0)

    @property
    def x(self) -> Floats:
        """Positions x of the blocks' centres [m]."""
        return self._column("pose", 0)

    @property
    def y(self) -> Floats:
        """Positions y [m]."""
        return self._column("pose", 1)

    @property
    def theta(self) -> Floats:
        """Orientations of the blocks [rad], within [-pi, pi], counter-clockwise from x."""
        return self._column("pose", 2)

    @property
    def vx(self) -> Floats:
        """Velocities x of the blocks' centres [m/s]."""
        return self._column("velocity", 0)

    @property
    def vy(self) -> Floats:
        """Velocities y [m/s]."""
        return self._column("velocity", 1)

    @property
    def omega(self) -> Floats:
        """Spins [rad/s]."""
        return self._column("velocity", 2)

    @property
    def assembly(self) -> npt.NDArray[np.int32]:
        """Lowest block of each block's assembly: blocks with equal numbers are joined."""
        return self._moment.state["assembly"].copy()

    @property
    def poles(self) -> npt.NDArray[np.int32]:
        """Poles of the blocks' faces +x, +y, -x, -y: 1 N, -1 S, 0 none, (block, face).

        No rows where faces have no types.
        """
        moment = self._moment
        if moment.table is None:
            return np.zeros((0, 4), dtype=np.int32)
        return np.asarray(moment.table.pole[moment.state["kind"]])

    @property
    def outcome(self) -> str:
        """Outcome class of the world, as `assemble` and `classify` name it."""
        return self._moment.outcome

    def _column(self, name: str, part: int) -> Floats:
        return np.array(self._moment.state[name][:, part])

    def _look(self) -> None:
        """Keep a copy of the state for those who read."""
        self._moment = _Moment(self._world, self._active.study)

    def _go(self, steps: int) -> None:
        """Take time steps, and what is wished at the beginning of force intervals."""
        end = self._world.step + steps
        while (left := end - self._world.step) > 0:
            into = self._world.step % self._steps_per_interval
            if into == 0:
                self._fulfil()
            waits = self._next_settings is not self._active or self.waiting > 0
            self._step(min(left, self._steps_per_interval - into) if waits else left)

    def _fulfil(self) -> None:
        """Give the world what is wished, at the beginning of a force interval."""
        with self._next_lock:
            following = self._next_settings
            changed = following is not self._active
            before = self._active.study.assembly
            self._next_settings = self._active = following._replace(part=False)
        if changed:
            self._set_forces()
            rules = self._active.study.assembly
            self._world.set_rules(
                latching=rules.latching,
                hidden_share=rules.hidden_share,
                stirring_length=self._active.study.forces.stirring_length_m,
            )
            self._world.set_bonds(
                rate=rules.bond_rate_per_s, relatch_clearance=rules.relatch_clearance
            )
            if (rules.faces, rules.binding) != (before.faces, before.binding):
                table = face_table(rules)
                self._world.set_faces(None if table is None else table.native())
        if following.part:
            self._world.part()
            self._look()
        if self._active.study.assembly.blocks != self.blocks:
            self._world.set_blocks(self._active.study.assembly.blocks)
            self._look()

    def _set_forces(self) -> None:
        forces, pull = self._active.study.forces, block_pull(self._active.study)
        self._world.set_forces(
            drag_coefficient=forces.drag_coefficient,
            force_std=forces.force_std_N,
            flow_scale=self._active.flow_scale,
        )
        self._world.set_pull(None if pull is None else pull.native)

    def _step(self, steps: int) -> None:
        """Take time steps, fewer where there are too many events, and note these."""
        study = self._active.study
        state = self._world.state()
        found = self._world.advance(steps)
        if not found["step"].size:
            return
        blocks, chirality = len(state["assembly"]), study.assembly.chirality
        world = SquareWorld(blocks, chirality) if self.has_lattice else DiscWorld(blocks)
        world.begin(state)
        pose = self._world.state()["pose"]
        times = times_of(found["step"], time_step=study.time_step_s).tolist()
        kinds, pairs, faces = (found[name].tolist() for name in ("kind", "block", "face"))
        for time, kind, pair, joined in zip(times, kinds, pairs, faces, strict=True):
            if kind == PARTING:
                world.part(pair)
            else:
                world.bond(pair, whole=kind in (JOINING, CLOSING))
            if kind == JOINING:
                world.join(pair, joined)
            elif kind != PARTING:
                continue
            now = {"pose": pose, "cell": np.array(world.cell), "assembly": np.array(world.body)}
            outcome = state_class(now, study)
            self._events.append(
                LiveEvent(time, (pair[0], pair[1]), outcome, is_parting=kind == PARTING)
            )
