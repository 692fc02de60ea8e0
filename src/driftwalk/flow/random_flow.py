"""Random flows of a stirred tank, for studies of what can be recovered in flows like them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, get_args

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.flow.analytic import TANK_30_CM, Velocity, flow_from_function
from driftwalk.flow.arena import Outline, outline_of
from driftwalk.flow.grid import make_grid
from driftwalk.schema.trajectory import read_arena

if TYPE_CHECKING:
    import xarray as xr

Family = Literal["swirl", "eddies"]


class RandomFlowPolicy(NamedTuple):
    """Parts of a random flow."""

    cells: int = 60
    """Cells across the tank: smaller than any jet or eddy; chosen by hand."""
    jets: int = 4
    """Jets of a flow with jets; chosen by hand."""
    waves: int = 25
    """Waves of a flow of eddies; chosen by hand."""
    wave_number: float = 3.75
    """Standard deviation of each component of a wave's number, in radians per radius of the
    tank; chosen by hand."""


_RANDOM_FLOW: Final = RandomFlowPolicy()


def random_tank_flow(
    seed: int,
    *,
    family: Family = "swirl",
    arena: Mapping[str, Any] | str | None = None,
    speed: float | None = None,
) -> xr.Dataset:
    """Draw the flow of a stirred tank.

    *swirl*: a rotation that fades near the wall, a sink, and four Gaussian jets from the wall in
    random directions; a block goes round in it on regular orbits. *eddies*: a random stream
    function of 25 waves, and a sink; its eddies are a third of the tank and cross the wall, so that
    a block comes to the wall more often.

    Parameters
    ----------
    seed : int
        At least 0; the same seed gives the same flow.
    family : {"swirl", "eddies"}
        The kind of flow.
    arena : mapping or str, optional
        The tank, as `flow_from_function` takes it; lengths scale with half its shorter side. The
        paper's 30-cm circle when left out.
    speed : float, optional
        Root mean square speed over the tank [m/s]; as drawn when left out, some 2 to 8 cm/s.

    Returns
    -------
    xarray.Dataset
        A `flow_field` with 60 cells across the tank.

    Raises
    ------
    InputError
        When the family is unknown, or the seed or the speed is out of range.

    Examples
    --------
    >>> flow = random_tank_flow(7, speed=0.05)
    >>> inside = flow["flag"] == 1
    >>> round(float(((flow["u"] ** 2 + flow["v"] ** 2).where(inside).mean()) ** 0.5), 12)
    0.05
    """
    if family not in get_args(Family):
        raise InputError(f"family must be one of {', '.join(get_args(Family))}, got {family!r}")
    if seed < 0:
        raise InputError(f"seed: expected a whole number from 0 on, got {seed}")
    if speed is not None and not (math.isfinite(speed) and speed > 0.0):
        raise InputError(f"the speed of a flow must be positive, got {speed}")
    described = read_arena(TANK_30_CM if arena is None else arena)
    outline = outline_of(described)
    velocity = (_swirl if family == "swirl" else _eddies)(np.random.default_rng(seed), outline)
    if speed is not None:
        velocity = _scaled(velocity, speed / _rms_speed(velocity, outline))
    parameters = {"seed": seed, "family": family, "speed": speed}
    attrs = {"method": "random tank flow", "parameters": json.dumps(parameters)}
    return flow_from_function(velocity, arena=described, cells=_RANDOM_FLOW.cells, attrs=attrs)


def _middle(outline: Outline) -> tuple[float, float, float]:
    """Return the centre of the bounding box and half its shorter side [m]."""
    x_min, y_min, x_max, y_max = outline.bounds
    radius = 0.5 * min(x_max - x_min, y_max - y_min)
    return 0.5 * (x_min + x_max), 0.5 * (y_min + y_max), radius


def _swirl(generator: np.random.Generator, outline: Outline) -> Velocity:
    center_x, center_y, radius = _middle(outline)
    rotation = generator.uniform(0.25, 0.6) * generator.choice([-1.0, 1.0])
    sink = generator.uniform(0.05, 0.25)
    jets = []
    for _ in range(_RANDOM_FLOW.jets):
        at = generator.uniform(0.0, 2.0 * math.pi)
        heading = at + math.pi + generator.uniform(-0.8, 0.8)
        width = generator.uniform(0.02, 0.04) / 0.15
        jets.append((at, heading, width, generator.uniform(0.03, 0.08)))

    def velocity(x: Floats, y: Floats) -> tuple[Floats, Floats]:
        # In radii of the tank; rates are per second and of a tank of 15 cm.
        east, north = (x - center_x) / radius, (y - center_y) / radius
        fading = 0.15 * rotation * np.exp(-((np.hypot(east, north) * 0.15 / 0.14) ** 4))
        u = -fading * north - 0.15 * sink * east
        v = fading * east - 0.15 * sink * north
        for at, heading, width, top in jets:
            from_x = east - 0.13 / 0.15 * math.cos(at)
            from_y = north - 0.13 / 0.15 * math.sin(at)
            jet = top * np.exp(-(from_x**2 + from_y**2) / (2.0 * width**2))
            u, v = u + jet * math.cos(heading), v + jet * math.sin(heading)
        return u, v

    return velocity


def _eddies(generator: np.random.Generator, outline: Outline) -> Velocity:
    center_x, center_y, radius = _middle(outline)
    numbers = generator.normal(0.0, _RANDOM_FLOW.wave_number, (_RANDOM_FLOW.waves, 2))
    heights = generator.normal(size=_RANDOM_FLOW.waves)
    phases = generator.uniform(0.0, 2.0 * math.pi, _RANDOM_FLOW.waves)
    typical, sink = generator.uniform(0.04, 0.07), generator.uniform(0.1, 0.3)

    def stirred(x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return the curl of the stream function; it is a sum of cosines."""
        east, north = (x - center_x) / radius, (y - center_y) / radius
        u, v = np.zeros_like(east), np.zeros_like(east)
        for (across, up), height, phase in zip(numbers, heights, phases, strict=True):
            wave = height * np.sin(across * east + up * north + phase)
            u, v = u - up * wave, v + across * wave
        return u, v

    scaled = _scaled(stirred, typical / _rms_speed(stirred, outline))

    def velocity(x: Floats, y: Floats) -> tuple[Floats, Floats]:
        u, v = scaled(x, y)
        inflow = 0.15 * sink / radius
        return u - inflow * (x - center_x), v - inflow * (y - center_y)

    return velocity


def _scaled(velocity: Velocity, factor: float) -> Velocity:
    def scaled(x: Floats, y: Floats) -> tuple[Floats, Floats]:
        u, v = velocity(x, y)
        return factor * u, factor * v

    return scaled


def _rms_speed(velocity: Velocity, outline: Outline) -> float:
    """Return the root mean square speed over the nodes in the tank [m/s]."""
    x, y = (part.ravel() for part in make_grid(outline, cells=_RANDOM_FLOW.cells).nodes())
    inside = outline.depth(x, y) >= 0.0
    u, v = velocity(x[inside], y[inside])
    return math.sqrt(float(np.mean(u**2 + v**2)))
