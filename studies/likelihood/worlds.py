"""Stirred tanks with a floating block, drawn at random: a flow, C_d and sigma_F.

Two families of flow, both with surface speeds of 3 to 8 cm/s (rms over the tank) and with a sink,
as where water is drawn off at the bottom:

- *regular*: a swirl and four jets from the wall. The block goes round on an orbit.
- *irregular*: 25 random waves of a stream function that vanishes outside the wall. The block
  wanders among vortices, or stays with one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

import driftwalk as dw
from driftwalk.schema import build_flow_field

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

FAMILIES = ("regular", "irregular")
RADIUS_M = 0.15
AXIS = np.linspace(-0.165, 0.165, 133)
"""Nodes of the true flow [m], 2.5 mm apart: an eighth of the knots of the fit."""
WAVES = 25
JETS = 4


@dataclass(frozen=True)
class World:
    """A flow at the nodes of AXIS [m/s], and the parameters of the block's motion in it."""

    drag_coefficient: float
    force_std_N: float
    """In the force interval of the default study, 10 ms."""
    u: Floats
    v: Floats

    def flow(self) -> xr.Dataset:
        """Return the flow as a `flow_field`, bilinear between its nodes."""
        flag = np.ones(self.u.shape, dtype=np.int8)
        return build_flow_field(AXIS, AXIS, u=self.u, v=self.v, flag=flag)

    def study(self, *, time_step: float) -> dw.Study:
        """Return the study that simulates it, with a time step [s]."""
        values = {
            "forces.drag_coefficient": self.drag_coefficient,
            "forces.force_std_N": self.force_std_N,
            "simulation.time_step_s": time_step,
        }
        return dw.apply_overrides(dw.Study(), values)


def draw_parameters(rng: np.random.Generator) -> tuple[float, float]:
    """Draw C_d and sigma_F [N]."""
    return float(rng.uniform(0.2, 1.0)), float(rng.uniform(0.2e-3, 1.2e-3))


def draw_flow(
    rng: np.random.Generator, family: str, *, sink_share: float = 1.0
) -> tuple[Floats, Floats]:
    """Draw u and v [m/s] at the nodes of AXIS, with a share of the sink that is drawn."""
    x, y = np.meshgrid(AXIS, AXIS)
    draw = _regular if family == "regular" else _irregular
    return draw(rng, x, y, sink_share)


def _regular(rng: np.random.Generator, x: Floats, y: Floats, share: float) -> tuple[Floats, Floats]:
    turning = rng.uniform(0.25, 0.6) * rng.choice([-1.0, 1.0])
    swirl = turning * np.exp(-((np.hypot(x, y) / 0.14) ** 4))
    sink = share * rng.uniform(0.05, 0.25)
    u, v = -swirl * y - sink * x, swirl * x - sink * y
    for _ in range(JETS):
        at = rng.uniform(0.0, 2.0 * np.pi)
        direction = at + np.pi + rng.uniform(-0.8, 0.8)
        width, speed = rng.uniform(0.02, 0.04), rng.uniform(0.03, 0.08)
        away = np.hypot(x - 0.13 * np.cos(at), y - 0.13 * np.sin(at))
        jet = speed * np.exp(-0.5 * (away / width) ** 2)
        u, v = u + jet * np.cos(direction), v + jet * np.sin(direction)
    return u, v


def _irregular(
    rng: np.random.Generator, x: Floats, y: Floats, share: float
) -> tuple[Floats, Floats]:
    stream = np.zeros_like(x)
    for _ in range(WAVES):
        along_x, along_y = rng.normal(0.0, 25.0, 2)
        phase = rng.uniform(0.0, 2.0 * np.pi)
        stream += rng.normal() * np.cos(along_x * x + along_y * y + phase)
    radius = np.hypot(x, y)
    stream *= np.clip(1.0 - (radius / AXIS[-1]) ** 4, 0.0, None)
    along_y, along_x = np.gradient(stream, AXIS, AXIS)
    u, v = along_y, -along_x
    rms = np.sqrt(np.mean((u**2 + v**2)[radius < RADIUS_M]))
    scale, sink = rng.uniform(0.03, 0.07) / rms, share * rng.uniform(0.1, 0.3)
    return scale * u - sink * x, scale * v - sink * y
