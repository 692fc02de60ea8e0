"""The parameter vector of the fit: flow, ln C_d, noises, numbers of departures; and the body.

The departures from the model, and their numbers, are in `likelihood.law.candidate_laws`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.law.candidate_laws import INTENSITIES, NUMBERS
from driftwalk.simulation.series import within_frames

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.model.rigid_bodies import RigidBody


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


@dataclass(frozen=True, eq=False)
class Body:
    """The block and the water of a study, as the native filter takes them."""

    study: Study
    orientation: str
    """"state", "given" or "none": the track's angle is measured like the position, is an input, or
    is not used."""

    @property
    def side(self) -> float:
        """Side of the block [m]."""
        return self.study.block.side_m

    @cached_property
    def outline(self) -> RigidBody:
        """The outline of the body."""
        return self.study.body()

    def native(self, point: Point) -> dict[str, Any]:
        """Return the arguments of the native filter."""
        block = self.study.block
        numbers = {
            "side": block.side_m,
            "mass": block.mass_kg,
            "depth": self.study.wetted_depth_m,
            "strips": block.strips_per_face,
            "water_density": self.study.water.density_kg_m3,
            # C_d holds at this speed, whatever the power of the drag.
            "drag_speed": self.study.forces.drag_speed_m_s,
            "orientation": self.orientation,
        }
        outline = self.outline
        if outline.is_square:
            return numbers
        if "hidden_share" in point.opened or "hidden_share" in point.fixed:
            outline = block.body(point.number("hidden_share"))
        return {
            **numbers,
            "panels": outline.panels,
            "moment_points": outline.moment_points,
            "mass_by_inertia": 1.0 / outline.moment_m2,
            "symmetry": max(outline.symmetry, 1),
            "round": outline.disc_radius_m > 0.0,
        }
