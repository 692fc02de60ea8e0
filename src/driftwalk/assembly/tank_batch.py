"""Many tanks of blocks that keep their state, each changed on its own while all advance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.assembly.outcomes.outcome_classes import state_class
from driftwalk.assembly.pull.force_tables import block_pull
from driftwalk.assembly.runs.dataset import times_of
from driftwalk.assembly.runs.plan import (
    Backend,
    Plan,
    make_plan,
    start_poses,
    steps_of,
    stream_keys,
)
from driftwalk.assembly.runs.start import glued_cells, require_room
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError
from driftwalk.model import Study, apply_overrides
from driftwalk.simulation.backend import BROKEN

if TYPE_CHECKING:
    import xarray as xr


State = Mapping[str, npt.NDArray[Any]]
Complete = Literal["moves", "rests"]

_LATCHING: Final = ("none", "collision", "connector")
"""The ways of latching in the order of the native core's numbers."""


class StartAssemblyPolicy(NamedTuple):
    """Which assemblies are a start."""

    off_lattice: float = 0.05
    """How far a corner of a block may be from its place on the lattice of its assembly, in sides;
    chosen by hand: a tracked block is measured to a few hundredths of its side."""


START_ASSEMBLY: Final = StartAssemblyPolicy()


class _Settings(NamedTuple):
    """The settings of every world, one entry each."""

    flow: npt.NDArray[np.int32]
    latching: npt.NDArray[np.int32]
    flow_scale: Floats
    drag_coefficient: Floats
    force_std: Floats


class TankBatch:
    """Many tanks of blocks that keep their state, and whose parameters change one by one.

    Each world is a separate `LiveTank`: with ``backend="reference"`` it has the same bits as one
    that gets the same changes at the same times, with the default those of `assembly_path`, in
    single precision and three times faster. Neither the threads nor the other worlds change its
    numbers.

    Parameters
    ----------
    study : Study
        Block, tank, water, forces and assembly, to begin with.
    flow : xarray.Dataset or sequence of xarray.Dataset
        The water's velocity, a `flow_field` that covers the tank; of several, all worlds begin in
        the first, and `set` puts each into another by its index.
    worlds : int, optional
        Number of worlds; default: the study's number of runs.
    blocks, seed : int, optional
        Over the study's values.
    first : int
        World i is run ``first + i`` of `assemble` with the same seed.
    start : array_like, shape (blocks, 3) or (worlds, blocks, 3), or mapping, optional
        Poses at the start [m, m, rad], at rest; or what `state` of a batch has returned, with which
        joined assemblies go on as they move. Default: random poses that do not overlap.
    workers : int, optional
        Threads; default: all processors.
    backend : {"cpu", "reference"}
        As in `assemble`.
    complete : {"moves", "rests"}
        What a world does whose blocks have become one assembly that cannot come apart: it moves on,
        or rests from the end of that `advance` on. Its class is final, and computing it no more
        saves time.

    Raises
    ------
    InputError
        When there are more blocks than fit the tank, a flow does not cover it, the start has
        another shape, or an option is out of range.

    Examples
    --------
    Weak forces, and strong ones in the worlds where all blocks are still apart:

    >>> import driftwalk as dw
    >>> batch = dw.TankBatch(dw.Study(), dw.uniform_flow(0.0, 0.0), worlds=3, blocks=2)
    >>> batch.set(force_std=0.2e-3)
    >>> batch.advance(1.0)
    >>> batch.set(force_std=np.where(batch.outcome == "1+1", 1e-3, 0.2e-3))
    >>> batch.advance(1.0)
    >>> batch.time, batch.state()["pose"].shape
    (2.0, (3, 2, 3))
    """

    def __init__(
        self,
        study: Study,
        flow: xr.Dataset | Sequence[xr.Dataset],
        *,
        worlds: int | None = None,
        blocks: int | None = None,
        seed: int | None = None,
        first: int = 0,
        start: npt.ArrayLike | State | None = None,
        workers: int | None = None,
        backend: Backend = "cpu",
        complete: Complete = "moves",
    ) -> None:
        flows = list(flow) if isinstance(flow, Sequence) else [flow]
        count = study.assembly.runs if worlds is None else worlds
        if count < 1 or not flows:
            raise InputError(f"a batch has worlds and a flow, got {count} and {len(flows)}")
        if complete not in get_args(Complete):
            raise InputError(f"complete must be 'moves' or 'rests', got {complete!r}")
        plans = [
            make_plan(
                study,
                one,
                settings={"blocks": blocks, "seed": seed},
                index=first + np.arange(count),
                threads=workers,
                backend=backend,
                ends=False,
            )
            for one in flows
        ]
        plan = plans[0]
        self._study, self._threads = plan.study, plan.threads
        joined: dict[str, npt.NDArray[Any]] | None = None
        if isinstance(start, Mapping):
            joined = _joined(start, plan)
            poses = joined["pose"]
        else:
            poses = start_poses(plan, start)
        models, pull, rules = [one.model() for one in plans], block_pull(plan.study), plan.rules()
        # What the native core points to.
        self._kept = models, pull, rules
        self._batch = _core.TankBatch(
            models,
            start=np.ascontiguousarray(poses),
            key=plan.keys,
            precision="double" if backend == "reference" else "single",
            **{name: value for name, value in rules.items() if name != "latching"},
            pull=None if pull is None else pull.native,
            glued=None if joined is not None else glued_cells(plan.study.assembly),
            flow_start=[one.flow_start for one in plans],
            joined=joined,
            threads=plan.threads,
        )
        if joined is not None:
            self._require_lattice(poses)
        forces, settings = plan.study.forces, plan.study.assembly
        self._settings = self._next_settings = _Settings(
            flow=np.zeros(count, dtype=np.int32),
            latching=np.full(count, _LATCHING.index(settings.latching), dtype=np.int32),
            flow_scale=np.ones(count),
            drag_coefficient=np.full(count, forces.drag_coefficient),
            force_std=np.full(count, forces.force_std_N),
        )
        self._steps_per_interval = round(forces.force_interval_s / plan.study.time_step_s)
        self._due = 0.0
        self._rests = complete == "rests" and settings.blocks > 1 and not settings.bonds_break
        self._resting = np.zeros(count, dtype=bool)
        self._names: dict[bytes, str] = {}
        self._outcome = np.full(count, "", dtype=object)
        self._name(np.ones(count, dtype=bool))

    def set(
        self,
        *,
        flow: npt.ArrayLike | None = None,
        flow_scale: npt.ArrayLike | None = None,
        force_std: npt.ArrayLike | None = None,
        latching: str | Sequence[str] | npt.NDArray[Any] | None = None,
        drag_coefficient: npt.ArrayLike | None = None,
    ) -> None:
        """Change parameters from the next force interval on; None leaves one as it is.

        Each is one value for all worlds or one per world.

        Parameters
        ----------
        flow : array_like of int
            Index of the flow.
        flow_scale : array_like
            Factor on the velocity of the water, from 0 (still water); 1 at first. Worlds of equal
            flow, factor and latching are computed together: a batch in which all differ is slower.
        force_std : array_like
            sigma_F [N].
        latching : {"collision", "connector", "none"} or a sequence of them
            How blocks latch from then on; what is joined stays so.
        drag_coefficient : array_like
            C_d.

        Raises
        ------
        InputError
            When a value is out of range. Nothing changes then.
        """
        following = self._next_settings._asdict()
        if flow is not None:
            index = self._one_each("flow", flow, kinds="iu")
            flows = len(self._kept[0])
            if not (np.isin(index, np.arange(flows))).all():
                raise InputError(f"flow: expected indices of {flows} flows, from 0 on")
            following["flow"] = index.astype(np.int32)
        if latching is not None:
            names = self._one_each("latching", latching, kinds="U")
            following["latching"] = self._latching(names)
        for name, given in (
            ("flow_scale", flow_scale),
            ("force_std", force_std),
            ("drag_coefficient", drag_coefficient),
        ):
            if given is not None:
                following[name] = values = self._one_each(name, given).astype(np.float64)
                if not (np.isfinite(values) & (values >= 0)).all():
                    raise InputError(f"{name}: expected finite numbers from 0 on")
        self._next_settings = _Settings(**following)

    def advance(self, duration_s: float) -> None:
        """Let all worlds go on for a while.

        They go by whole time steps; what is left of a duration counts for the next one.

        Parameters
        ----------
        duration_s : float
            How long [s], from 0.

        Raises
        ------
        InputError
            When the duration is negative or too long.
        """
        step = self._study.time_step_s
        steps, self._due = steps_of(duration_s, self._due, step=step, had=self._batch.step)
        before = self._batch.last_event()
        while steps > 0:
            into = self._batch.step % self._steps_per_interval
            if into == 0:
                self._settings = self._next_settings
            waits = self._settings is not self._next_settings
            now = min(steps, self._steps_per_interval - into) if waits else steps
            settings = self._settings._asdict()
            settings["flow"] = np.where(self._resting, np.int32(-1), self._settings.flow)
            self._batch.advance(now, **settings, threads=self._threads)
            steps -= now
        self._name((self._batch.last_event() != before) | ~self.sound)

    def state(self) -> dict[str, npt.NDArray[Any]]:
        """Return copies of where all blocks are, how they move and what is joined.

        Returns
        -------
        dict of ndarray
            ``pose`` [m, m, rad] and ``velocity`` [m/s, m/s, rad/s] of each block's centre, shape
            (worlds, blocks, 3); ``assembly``, the lowest block of each block's assembly; ``cell``,
            shape (worlds, blocks, 2), and ``quarter``, its place and its quarter turns on the
            assembly's lattice; ``kind`` of faces with types.
        """
        return self._batch.state()

    def take(self, worlds: npt.ArrayLike, *, seed: int, first: int = 0) -> TankBatch:
        """Return a batch that begins from copies of some worlds, with new forces.

        Parameters
        ----------
        worlds : array_like of int or bool
            Which worlds, in any order; one may come many times. Or whether to take each of them.
        seed, first : int
            World i of the new batch has the forces of run ``first + i`` with this seed, from the
            next draw on: one draw serves two force intervals.

        Raises
        ------
        InputError
            When there is no such world, or none is taken.

        Examples
        --------
        >>> import driftwalk as dw
        >>> batch = dw.TankBatch(dw.Study(), dw.uniform_flow(0.0, 0.0), worlds=3, blocks=2)
        >>> batch.advance(1.0)
        >>> ahead = batch.take(np.repeat([0, 2], 10), seed=1)
        >>> ahead.advance(2.0)
        >>> ahead.worlds, ahead.time, batch.time
        (20, 3.0, 1.0)
        """
        index = np.atleast_1d(np.asarray(worlds))
        if index.dtype == np.bool_ and index.shape == (self.worlds,):
            index = np.flatnonzero(index)
        whole = index.ndim == 1 and index.size > 0 and index.dtype.kind in "iu"
        if not (whole and np.isin(index, np.arange(self.worlds)).all()):
            raise InputError(
                f"worlds: expected indices of {self.worlds} worlds, from 0 on, or true or false "
                "for each, true for one at least"
            )
        keys = stream_keys("run", seed=seed, trial=0, index=first + np.arange(index.size))
        taken = copy(self)
        taken._batch = self._batch.take(index.tolist(), keys)
        taken._settings, taken._next_settings = (
            _Settings(*(values[index] for values in one))
            for one in (self._settings, self._next_settings)
        )
        taken._outcome, taken._resting = self._outcome[index], self._resting[index]
        return taken

    @property
    def study(self) -> Study:
        """The study that the worlds began with."""
        return self._study

    @property
    def worlds(self) -> int:
        """Number of worlds."""
        return int(self._outcome.size)

    @property
    def time(self) -> float:
        """Time of the state since the start [s]: the end of a time step."""
        return float(times_of(np.array(self._batch.step), time_step=self._study.time_step_s))

    @property
    def outcome(self) -> npt.NDArray[np.str_]:
        """Outcome class of each world, as `assemble` names it; "" where the numbers are lost."""
        return self._outcome.astype(np.str_)

    @property
    def class_since(self) -> Floats:
        """When each world came to its class [s]: as blocks joined or parted last, or at time 0."""
        return times_of(self._batch.last_event(), time_step=self._study.time_step_s)

    @property
    def sound(self) -> Bools:
        """Whether each world's numbers are: false where the forces were too large for a step."""
        return np.asarray((self._batch.status() & BROKEN) == 0)

    def _one_each(self, name: str, given: Any, *, kinds: str = "iuf") -> npt.NDArray[Any]:
        """Return one value per world, of one of numpy's kinds."""
        try:
            values = np.asarray(given)
            values = np.array(values.tolist()) if values.dtype.hasobject else values
        except ValueError as error:
            raise InputError(f"{name}: expected one value, or one for each world") from error
        if values.dtype.kind not in kinds:
            wanted = {"iu": "whole numbers", "U": "names"}.get(kinds, "numbers")
            raise InputError(f"{name}: expected {wanted}, got {given!r:.60}")
        if values.shape not in ((), (self.worlds,)):
            raise InputError(
                f"{name}: expected one value, or one for each of {self.worlds} worlds, got shape "
                f"{values.shape}"
            )
        return np.ascontiguousarray(np.broadcast_to(values, (self.worlds,)))

    def _latching(self, names: npt.NDArray[np.str_]) -> npt.NDArray[np.int32]:
        """Return the native core's numbers of ways to latch, after checking them."""
        number = np.zeros(names.size, dtype=np.int32)
        for name in np.unique(names).tolist():
            require_room(apply_overrides(self._study, {"assembly.latching": name}))
            number[names == name] = _LATCHING.index(name)
        return number

    def _name(self, changed: Bools) -> None:
        """Name the outcome classes of worlds that have changed."""
        if not changed.any():
            return
        state, sound = self._batch.state(), self.sound
        self._resting = self._rests & (state["assembly"] == 0).all(axis=1)
        for world in np.flatnonzero(changed).tolist():
            own = {name: values[world] for name, values in state.items()}
            if not sound[world]:
                self._outcome[world] = ""
            elif not self._study.block.has_lattice:
                self._outcome[world] = state_class(own, self._study)
            else:
                address = own["assembly"].tobytes() + own["cell"].tobytes()
                if address not in self._names:
                    self._names[address] = state_class(own, self._study)
                self._outcome[world] = self._names[address]

    def _require_lattice(self, given: Floats) -> None:
        """Refuse a start beyond the tank, or off the lattices of its assemblies."""
        beyond = np.flatnonzero(~self.sound)
        if beyond.size:
            raise InputError(
                f"start: a block of world {beyond[0]} is beyond the tank, a "
                f"{self._study.tank.describe()}"
            )
        apart = self._batch.state()["pose"] - given
        turned = np.abs(np.angle(np.exp(1j * apart[..., 2])))
        side = self._study.block.side_m
        off = np.hypot(apart[..., 0], apart[..., 1]) + math.sqrt(0.5) * side * turned
        world, block = np.unravel_index(off.argmax(), off.shape)
        if off.max() > START_ASSEMBLY.off_lattice * side:
            raise InputError(
                f"start: a corner of block {block} of world {world} is {off.max():.3g} m off the "
                "place that the lattice of its assembly gives it: check assembly, cell and quarter"
            )


def _joined(start: State, plan: Plan) -> dict[str, npt.NDArray[Any]]:
    """Return a start with assemblies, after checking it."""
    whole = (plan.index.size, plan.study.assembly.blocks)
    arrays = {}
    for name, own, kind in (
        ("pose", (3,), np.float64),
        ("velocity", (3,), np.float64),
        ("assembly", (), np.int32),
        ("cell", (2,), np.int32),
        ("quarter", (), np.int32),
        ("kind", (), np.int32),
    ):
        values = np.asarray(start.get(name, np.zeros((*whole, *own))), dtype=kind)
        if name not in start and name not in ("velocity", "kind"):
            raise InputError(f"start: '{name}' is missing; a batch's own state has all of it")
        if values.shape != (*whole, *own):
            raise InputError(
                f"start: expected {name} of shape {(*whole, *own)}, got shape {values.shape}"
            )
        if not np.isfinite(values).all():
            raise InputError(f"start: a number of {name} is not finite")
        arrays[name] = np.ascontiguousarray(values)
    labels = arrays["assembly"]
    lowest = np.take_along_axis(labels, labels.clip(0, whole[1] - 1), axis=1)
    if ((labels < 0) | (labels > np.arange(whole[1])) | (lowest != labels)).any():
        raise InputError("start: assembly is the index of the lowest block of each assembly")
    return arrays
