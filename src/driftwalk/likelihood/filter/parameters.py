"""The parameter vector of the fit: flow, ln C_d, noises, numbers of departures; and the body.

A departure is a way in which the world can differ from the model; it has one number or a few. In
the model each has the value of `Number.model`; opened, it is a parameter like the noises, with a
derivative from a second pass of the filter. A weak prior keeps it within what is possible.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.simulation.series import within_frames

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.model.block import Block
    from driftwalk.model.rigid_bodies import RigidBody


class Number(NamedTuple):
    """One number of a departure."""

    model: float
    """Its value in the model."""
    step: float
    """Change for the derivative by it."""
    prior_std: float
    """Of the normal prior around the value in the model."""
    most: float
    """Largest change in one step of the search."""
    low: float
    high: float
    trial: tuple[float, float] | None = None
    """Two values between which the derivative is taken where the number is closed; by default the
    model's and one step above it."""

    def tried_from(self, value: float) -> tuple[float, float]:
        """Return the two values for the derivative where the number is closed at a value."""
        if self.trial is not None and value == self.model:
            return self.trial
        return value, value + self.step


STRENGTHS: Final = ("strength_trend", *(f"strength_{k}" for k in range(1, 7)))
"""Numbers of a slow change of the flow's strength over the recording: a straight line, then cosines
of half a period, of one and so on. Cosines alone hold 0.93 of a straight line."""
CHANGES: Final = ("strength_trend", *STRENGTHS[1::2])
"""Those whose shapes go from 1 to -1 between the first sample and the last."""
DRAG_SHAPES: Final = ("linear_share", "drag_power")
"""How the drag may go with the speed otherwise: one of them at most is opened."""
OF_PREDICTIONS: Final = ("hidden_share",)
"""Numbers that the predictions alone determine, as they do C_d: what the covariances say of a drag
is wrong to the order in which the filter is. Of a dimer that was slow in the water they said 1
where the share was 0, by seven standard deviations."""
PULSES: Final = ("pulse_cosine", "pulse_sine")
INTENSITIES: Final = tuple(f"flow_intensity_{k}" for k in range(1, 64))
"""ln q in the second flow, the third and so on, less that in the first."""


class Drag(NamedTuple):
    """A way in which the drag goes with the speed."""

    opened: Mapping[str, float] = {}
    """Its own number with a first value."""
    fixed: Mapping[str, float] = {}


DRAGS: Final[Mapping[str, Drag]] = {
    "quadratic": Drag(),
    "linear": Drag(fixed={"linear_share": 1.0}),
    "mixed": Drag(opened={"linear_share": 0.3}),
    "power": Drag(opened={"drag_power": 1.7}),
}
"""By the word of a study for it."""

NUMBERS: Final[Mapping[str, Number]] = {
    "water_acceleration": Number(0.0, 1e-4, 1.0, 0.5, -1.0, 3.0),
    "water_spin": Number(0.0, 1e-5, 1.0, 0.5, -1.0, 3.0),
    "linear_share": Number(0.0, 1e-4, 1.0, 0.3, -0.5, 1.2),
    "drag_power": Number(2.0, 1e-4, 1.0, 0.3, 0.5, 3.5),
    "hidden_share": Number(0.0, 1e-3, 1.0, 0.3, -0.3, 1.3),
    "force_memory": Number(0.0, 1e-3, 1.0, 0.2, 2e-3, 10.0, (2e-3, 6e-2)),
    "time_variance": Number(0.0, 1e-7, 1e-3, 1e-3, 0.0, 1e-1),
    "angle_offset": Number(0.0, 1e-4, 0.5, 0.15, -1.0, 1.0),
    "marker_x": Number(0.0, 1e-6, 0.01, 3e-3, -0.05, 0.05),
    "marker_y": Number(0.0, 1e-6, 0.01, 3e-3, -0.05, 0.05),
    **{
        name: Number(0.0, 1e-4, 0.3 / max(k, 1), 0.2, -1.0, 1.0) for k, name in enumerate(STRENGTHS)
    },
    **dict.fromkeys(INTENSITIES, Number(0.0, 1e-4, 3.0, 1.0, -12.0, 12.0)),
    "strength_0": Number(0.0, 1e-4, 0.3, 0.2, -1.0, 1.0),
    "pulse_cosine": Number(0.0, 1e-4, 0.3, 0.2, -1.0, 1.0),
    "pulse_sine": Number(0.0, 1e-4, 0.3, 0.2, -1.0, 1.0),
    "pulse_frequency": Number(0.0, 1e-7, 1e-2, 1e-3, 0.0, 10.0),
    "mode_frequency": Number(0.0, 1e-7, 1e-2, 2e-4, 0.0, 10.0),
    "mode_phase": Number(0.0, 1e-4, 2.0, 0.3, -10.0, 10.0),
}


class Amplitudes(NamedTuple):
    """Amplitudes of the flow's modes that are known from measured frames, of unit rms."""

    time: Floats
    """Of the frames, from the first sample of the recording on [s]."""
    value: Floats
    """Shape (modes, frames); linear in between."""
    repeat: str
    """How they go on beyond the frames: "loop", "mirror", or else as in the last one."""

    def at(self, time: Floats) -> Floats:
        """Return the amplitudes at times [s], shape (modes, n)."""
        if self.repeat in ("loop", "mirror"):
            time = within_frames(time, self.time, self.repeat)
        return np.stack([np.interp(time, self.time, one) for one in self.value])


@dataclass(frozen=True, eq=False)
class Point:
    """Values of everything that is estimated."""

    coefficients: Floats
    """Of the flow [m/s], shape (2, rows, columns); with several flows (flows, 2, rows, columns),
    with modes in time (1 + modes, 2, rows, columns)."""
    log_drag: float
    """ln C_d."""
    log_intensity: float
    """ln q, q in m^2/s^3."""
    log_noise: float
    """ln r, r in m."""
    log_lever: float | None = None
    """Logarithm of the rms distance [m] from the centre at which the stochastic force acts; with
    the angle in the state only."""
    log_angle_noise: float | None = None
    """Logarithm of the noise of the angle [rad]; with the angle in the state only."""
    opened: Mapping[str, float] = field(default_factory=dict)
    """Numbers of departures from the model that are estimated too (`NUMBERS`)."""
    fixed: Mapping[str, float] = field(default_factory=dict)
    """Those that have a known value other than the model's."""
    amplitudes: Amplitudes | None = None
    """Those of the modes of a measured flow; else the modes, if there are any, are periodic."""

    @property
    def noises(self) -> dict[str, float]:
        """Names and values of the noises, in the order of the parameters."""
        names = ("log_intensity", "log_noise", "log_lever", "log_angle_noise")
        found = {name: getattr(self, name) for name in names}
        return {name: value for name, value in found.items() if value is not None}

    @property
    def extras(self) -> dict[str, float]:
        """Names and values of everything but coefficients and ln C_d, in the parameters' order."""
        return {**self.noises, **self.opened}

    def number(self, name: str) -> float:
        """Return a number of a departure; the model's where it is neither opened nor fixed."""
        return self.opened.get(name, self.fixed.get(name, NUMBERS[name].model))

    def with_extra(self, name: str, value: float) -> Point:
        """Return the point with another value of a noise or of a number."""
        if name in NUMBERS:
            return replace(self, opened={**self.opened, name: value})
        changed: dict[str, Any] = {name: value}
        return replace(self, **changed)

    @property
    def layers(self) -> int:
        """Number of layers of the flow: its mean, and its modes in time."""
        known = self.amplitudes is not None or self.number("mode_frequency")
        return len(self.coefficients) if known else 1

    @property
    def mean_coefficients(self) -> Floats:
        """Coefficients of the mean flow, (2, rows, columns), of a point in one flow."""
        return np.asarray(self.coefficients[0] if self.layers > 1 else self.coefficients)

    def in_flow(self, flow: int) -> Point:
        """Return the point with the coefficients and the q of one flow alone, modes included."""
        if self.coefficients.ndim == 3 or self.layers > 1:
            return self
        more = self.intensity_contrasts.get(flow, 0.0)
        return replace(
            self, coefficients=self.coefficients[flow], log_intensity=self.log_intensity + more
        )

    @property
    def intensity_contrasts(self) -> dict[int, float]:
        """The ln q of each flow less that of the first; empty where all have one q."""
        known = {**self.fixed, **self.opened}
        if INTENSITIES[0] not in known:
            return {}
        named = enumerate(INTENSITIES, start=1)
        return {flow: known[name] for flow, name in named if name in known}

    def moved(self, step: Floats) -> Point:
        """Return the point after a step in (coefficients, ln C_d, noises, numbers)."""
        size = self.coefficients.size
        moved = replace(
            self,
            coefficients=self.coefficients + step[:size].reshape(self.coefficients.shape),
            log_drag=self.log_drag + float(step[size]),
        )
        for (name, old), change in zip(self.extras.items(), step[size + 1 :], strict=True):
            value = old + float(change)
            if name in NUMBERS:
                value = min(max(value, NUMBERS[name].low), NUMBERS[name].high)
            moved = moved.with_extra(name, value)
        return moved


@dataclass(frozen=True)
class Body:
    """The block and the water, as arguments of the native filter."""

    side: float
    mass: float
    depth: float
    strips: int
    water_density: float
    drag_speed: float
    """Speed [m/s] at which C_d holds, whatever the power of the drag."""
    orientation: str
    """"state", "given" or "none": the track's angle is measured like the position, is an input, or
    is not used."""
    block: Block
    hidden_share: float
    """Share of the drag of a free face that a face between two glued blocks feels."""

    @cached_property
    def outline(self) -> RigidBody:
        """The outline of the body."""
        return self.block.body(self.hidden_share)

    def native(self, point: Point) -> dict[str, Any]:
        """Return the arguments of the native filter."""
        names = ("side", "mass", "depth", "strips", "water_density", "drag_speed", "orientation")
        numbers = {name: getattr(self, name) for name in names}
        if self.outline.is_square:
            return numbers
        outline = self.outline
        if "hidden_share" in point.opened or "hidden_share" in point.fixed:
            outline = self.block.body(point.number("hidden_share"))
        return {
            **numbers,
            "panels": outline.panels,
            "moment_points": outline.moment_points,
            "mass_by_inertia": 1.0 / outline.moment_m2,
            "symmetry": max(outline.symmetry, 1),
            "round": outline.disc_radius_m > 0.0,
        }


def body_of(study: Study, used_angle: str) -> Body:
    """Return the block of a study as the filter takes it."""
    return Body(
        side=study.block.side_m,
        mass=study.block.mass_kg,
        depth=study.wetted_depth_m,
        strips=study.block.strips_per_face,
        water_density=study.water.density_kg_m3,
        drag_speed=study.forces.drag_speed_m_s,
        orientation=used_angle,
        block=study.block,
        hidden_share=study.assembly.hidden_share,
    )
