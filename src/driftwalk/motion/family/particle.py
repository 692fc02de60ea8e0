"""A member of the family as a motion model: its worlds come from the native core."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from driftwalk import _core
from driftwalk.conditions.recorded import Conditions
from driftwalk.core.arrays import Floats, Keys
from driftwalk.core.errors import InputError
from driftwalk.motion.family.columns import (
    STATE,
    Numbers,
    ParticleTable,
    State,
    inertial_table,
    switching_table,
)
from driftwalk.motion.family.members import Member
from driftwalk.motion.family.parts import Part
from driftwalk.motion.protocol import Values
from driftwalk.motion.score import NativeModel
from driftwalk.schema import Parameter
from driftwalk.simulation.backend import native_scene
from driftwalk.simulation.initial import world_orientations
from driftwalk.simulation.series import velocity_at

NEIGHBOURS: Final = "neighbours"
"""The part that needs the other bodies of a recording."""
LONGEST_STEP_S: Final = 0.02
"""Time step, unless samples are so dense that half their interval is shorter; chosen by hand."""


class ParticleModel(NativeModel):
    """A self-propelled body: a member of the family, with parts.

    Parameters
    ----------
    member : Member
        What it is.
    parts : tuple of Part
        What is added to it.
    parameters : tuple of Parameter
        What is searched.
    fixed : mapping of str to float
        Values of its other parameters.
    clearance : float, optional
        Distance of the recorded point from the wall at contact [m]; 0 when left out.

    Attributes
    ----------
    states_clearance : bool
        Whether it was given.
    feels_others : bool
        Whether it needs the other bodies of a recording.

    Examples
    --------
    >>> from driftwalk.motion.choose import family_model
    >>> [parameter.key for parameter in family_model("active").parameters]
    ['speed_m_s', 'rotational_diffusion_rad2_s', 'turn_rate_rad_s']
    """

    def __init__(
        self,
        member: Member,
        parts: tuple[Part, ...],
        parameters: tuple[Parameter, ...],
        *,
        fixed: Mapping[str, float],
        clearance: float | None,
    ) -> None:
        self.member, self.parts, self.parameters = member, parts, parameters
        self.fixed = dict(fixed)
        self.states_clearance = clearance is not None
        self.clearance = 0.0 if clearance is None else float(clearance)
        named = [part.name for part in parts]
        self.name = "+".join([member.name, *named])
        self.needs_flow = "flow" in named
        self.feels_others = NEIGHBOURS in named
        self.contact = "reflect" if "reflect" in named else "slide"

    def with_clearance(self, clearance: float) -> ParticleModel:
        """Return the same model with another distance from the wall at contact [m]."""
        return ParticleModel(
            self.member, self.parts, self.parameters, fixed=self.fixed, clearance=clearance
        )

    def table(self, values: Values, worlds: int) -> ParticleTable:
        """Return the numbers of worlds as the native core takes them."""
        given: Numbers = {"clearance": self.clearance, **self.fixed, **values}
        if self.member.kind == "inertial":
            return inertial_table(given, worlds=worlds)
        return switching_table(self._states(given), given, worlds=worlds)

    def _states(self, given: Numbers) -> list[State]:
        """Return the states, with what the parts say of those that move: a rest stays a rest."""
        said = [one.name for part in self.parts for one in part.parameters if one.name in STATE]
        numbers: dict[str, Any] = {name: given[name] for name in said}
        return [
            replace(one, **numbers) if np.any(np.asarray(one.speed) != 0.0) else one
            for one in self.member.states(given)
        ]

    def particle(self, table: ParticleTable, like: Conditions) -> _core.Particle:
        """Return the core's form of what all worlds have in common."""
        return _core.Particle(
            kind=table.kind,
            states=table.states,
            contact=self.contact,
            carried=self.needs_flow,
            neighbours=self._made_ready(like)[2],
        )

    def describe(self) -> dict[str, Any]:
        """Return its name, its parameters with their values or ranges, and the clearance."""
        return {
            "name": self.name,
            "parameters": [parameter.describe() for parameter in self.parameters],
            "fixed": dict(self.fixed),
            "clearance_m": self.clearance,
        }

    def facts(self, estimate: Mapping[str, float]) -> dict[str, Any]:  # noqa: ARG002
        """Return which model it was."""
        return {"model": self.name}

    @property
    def known(self) -> dict[str, float]:
        """Its known values under names with units: "turn_rate_rad_s", "clearance_m"."""
        usual = usual_parameters(self.member, self.parts)
        values = {one.key: self.fixed[name] for name, one in usual.items() if name in self.fixed}
        return {**values, "clearance_m": self.clearance}

    def _native(self, like: Conditions) -> tuple[_core.Model, Floats | None]:
        if self.needs_flow and like.flow is None:
            raise InputError(
                f"the water carries a body of the model {self.name}: its conditions need a flow "
                "field"
            )
        flow = like.flow if self.needs_flow else None
        time_step = time_step_of(like.sample_time)
        model = native_scene(
            like.tank, like.view, flow, like.sample_time, like.camera, time_step=time_step
        )
        return model, self._others(like, time_step)

    def require_others(self, like: Conditions) -> None:
        """Refuse conditions without other bodies, where the model feels them.

        Raises
        ------
        InputError
            When it does, and there are none.
        """
        if self.feels_others and like.neighbours is None:
            raise InputError(
                f"the model {self.name} feels the other bodies of a recording, and there are none: "
                "give a recording of several bodies, or leave out the part neighbours"
            )

    def _others(self, like: Conditions, time_step: float) -> Floats | None:
        """Return where the others are at every time step, shape (steps, bodies, 2)."""
        self.require_others(like)
        if not self.feels_others or like.neighbours is None:
            return None
        steps = int(np.ceil(like.sample_time[-1] / time_step)) + 1
        return like.neighbours.at(np.arange(steps) * time_step)

    def _worlds(
        self, values: Values, like: Conditions, keys: Keys
    ) -> tuple[Floats, _core.Particle]:
        """Return starts and numbers of worlds, and the particle.

        A body sets out in the direction that it moves in, relative to the water that carries it;
        where it does not move, in that of its recorded orientation, or a random one.
        """
        table = self.table(values, keys.size)
        x, y, theta, vx, vy, omega = (np.asarray(one, dtype=float) for one in like.start)
        if self.needs_flow and like.flow is not None:
            moment = 0.0 if like.flow_start is None else like.flow_start
            u, v = velocity_at(like.flow, x, y, moment)
            vx, vy = vx - u, vy - v
        heading = np.where(np.hypot(vx, vy) > 0.0, np.arctan2(vy, vx), theta)
        columns = np.broadcast_arrays(x, y, world_orientations(heading, keys), vx, vy, omega)
        rows = np.ascontiguousarray(np.column_stack([*columns, table.columns]))
        return rows, self.particle(table, like)


def usual_parameters(member: Member, parts: tuple[Part, ...]) -> dict[str, Parameter]:
    """Return the parameters of a member and its parts by name; where two share one, it is one."""
    groups = [member.parameters, *(part.parameters for part in parts)]
    return {one.name: one for group in groups for one in group}


def time_step_of(sample_time: Floats) -> float:
    """Return the time step for samples at these times [s]: a whole part of their interval.

    Examples
    --------
    >>> time_step_of(np.arange(5) * 0.1)
    0.02
    """
    if sample_time.size < 2:
        return LONGEST_STEP_S
    interval = float(np.median(np.diff(sample_time)))
    return interval / max(int(np.ceil(interval / LONGEST_STEP_S - 1e-9)), 2)
