"""Flow fields given by a formula: uniform, vortex, shear and wall jets, with exact values.

Each comes as a plain function of position, exact everywhere, and as a `flow_field` of its values
at the nodes of a grid.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.flow.arena import outline_of
from driftwalk.flow.grid import make_grid, positions
from driftwalk.schema import FLAGS, build_flow_field
from driftwalk.schema.trajectory import read_arena

if TYPE_CHECKING:
    import xarray as xr

Velocity = Callable[[Floats, Floats], tuple[Floats, Floats]]

TANK_30_CM: dict[str, Any] = {"shape": "circle", "diameter_m": 0.3, "center_m": [0.0, 0.0]}
"""The tank of the paper."""


def uniform_velocity(
    x: npt.ArrayLike, y: npt.ArrayLike, *, u: float = 0.0, v: float = 0.0
) -> tuple[Floats, Floats]:
    """Return the same velocity at every position.

    Parameters
    ----------
    x, y : array_like
        Positions [m].
    u, v : float, optional
        The velocity [m/s].

    Returns
    -------
    tuple of ndarray
        u and v [m/s] at the positions.

    Examples
    --------
    >>> uniform_velocity([0.0, 1.0], 0.0, u=0.1)[0].tolist()
    [0.1, 0.1]
    """
    shape = np.broadcast(x, y).shape
    return np.full(shape, float(u)), np.full(shape, float(v))


def vortex_velocity(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    angular_velocity: float,
    core_radius: float | None = None,
) -> tuple[Floats, Floats]:
    """Return the velocity of a vortex about the origin.

    Solid rotation ``w r``; with a core radius c a Rankine vortex, ``w c² / r`` beyond it.

    Parameters
    ----------
    x, y : array_like
        Positions [m].
    angular_velocity : float
        Rate w of the (core's) rotation [rad/s], counter-clockwise positive.
    core_radius : float, optional
        Radius c of the core [m]; None: solid rotation everywhere.

    Raises
    ------
    InputError
        When the core radius is not positive.

    Examples
    --------
    >>> vortex_velocity(0.0, 0.1, angular_velocity=2.0)[0].tolist()
    -0.2
    """
    at_x, at_y = positions(x, y)
    rate: Floats | float = angular_velocity
    if core_radius is not None:
        if not core_radius > 0.0:
            raise InputError(f"core_radius must be positive, got {core_radius}")
        rate = angular_velocity * core_radius**2 / np.maximum(at_x**2 + at_y**2, core_radius**2)
    return -rate * at_y, rate * at_x


def shear_velocity(
    x: npt.ArrayLike, y: npt.ArrayLike, *, rate: float, at_rest: float = 0.0
) -> tuple[Floats, Floats]:
    """Return a flow along x that grows along y: ``u = rate (y - at_rest)``, ``v = 0``.

    Parameters
    ----------
    x, y : array_like
        Positions [m].
    rate : float
        Shear rate [1/s].
    at_rest : float, optional
        The y [m] at which the water is at rest.

    Examples
    --------
    >>> shear_velocity(0.0, [0.0, 0.1], rate=0.5)[0].tolist()
    [0.0, 0.05]
    """
    at_x, at_y = positions(x, y)
    return rate * (at_y - at_rest), np.zeros_like(at_x)


def jets_velocity(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    radius: float = 0.15,
    jet_speed: float = 0.1,
    jet_width: float = 0.01,
    inlet_angles: Sequence[float] = (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi),
    inclination: float = 0.0,
    swirl_speed: float = 0.04,
    sink_speed: float = 0.01,
) -> tuple[Floats, Floats]:
    """Return the flow of a round tank with inlets in its wall: jets, a swirl and a sink.

    From every inlet a Gaussian jet: at a distance s along its axis and n across it, the speed is
    ``jet_speed sqrt(jet_width / b) exp(-(n / b)²)`` with ``b = jet_width + 0.1 s``, a plane jet
    that spreads and keeps its momentum; nothing behind the inlet. Swirl and sink are
    ``4 q (1 - q)`` times their speeds, with q = r / radius, and vanish at the centre and the wall.

    Parameters
    ----------
    x, y : array_like
        Positions [m], the tank's centre at the origin.
    radius : float, optional
        Radius of the tank [m].
    jet_speed, jet_width : float, optional
        Speed [m/s] and half-width [m] of each jet at its inlet.
    inlet_angles : sequence of float, optional
        Where in the wall the inlets are [rad].
    inclination : float, optional
        Angle of the jets from the inward normal [rad], positive to the left of it; 0 is a
        perpendicular inlet, near pi/2 a tangential one.
    swirl_speed : float, optional
        Largest speed of the swirl [m/s], counter-clockwise positive.
    sink_speed : float, optional
        Largest speed towards the centre [m/s].

    Raises
    ------
    InputError
        When `radius` or `jet_width` is not positive.

    Examples
    --------
    >>> u, v = jets_velocity(0.15, 0.0, inlet_angles=[0.0], jet_speed=0.1)
    >>> round(float(u), 12), round(float(v), 12)
    (-0.1, 0.0)
    """
    for name, value in (("radius", radius), ("jet_width", jet_width)):
        if not value > 0.0:
            raise InputError(f"{name} must be positive, got {value}")
    at_x, at_y = positions(x, y)
    q = np.minimum(np.hypot(at_x, at_y) / radius, 1.0)
    # 4 q (1 - q) times the unit vectors: r cancels, so the centre needs no special case.
    bump = 4.0 * (1.0 - q) / radius
    u = bump * (-swirl_speed * at_y - sink_speed * at_x)
    v = bump * (swirl_speed * at_x - sink_speed * at_y)
    for angle in inlet_angles:
        heading = angle + math.pi + inclination
        dx, dy = math.cos(heading), math.sin(heading)
        from_x, from_y = at_x - radius * math.cos(angle), at_y - radius * math.sin(angle)
        along, beside = from_x * dx + from_y * dy, from_y * dx - from_x * dy
        # A hair of tolerance keeps the inlet itself in its own jet.
        # A turbulent plane jet widens by a tenth of its length, as usually measured.
        width = jet_width + 0.1 * np.maximum(along, 0.0)
        speed = jet_speed * np.sqrt(jet_width / width) * np.exp(-((beside / width) ** 2))
        speed = np.where(along >= -1e-9 * radius, speed, 0.0)
        u, v = u + speed * dx, v + speed * dy
    return u, v


def flow_from_function(
    velocity: Velocity,
    *,
    arena: Mapping[str, Any] | str | None = None,
    cells: int = 50,
    cell_size: float | None = None,
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Return the `flow_field` of a formula.

    Parameters
    ----------
    velocity : callable
        From arrays x, y [m] to arrays u, v [m/s].
    arena : mapping or str, optional
        The tank, as `driftwalk.flow.arena.outline_of` reads it; the paper's 30-cm circle when left
        out.
    cells : int, optional
        Cells across the longer side of the tank.
    cell_size : float, optional
        Side of a cell [m], in place of `cells`.
    attrs : mapping, optional
        Attributes to add.

    Returns
    -------
    xarray.Dataset
        A `flow_field`: the formula's value at every node, also beyond the wall, where the flag is
        *outside*; all other nodes count as *measured*.

    Examples
    --------
    >>> flow_from_function(lambda x, y: (0.1 + 0.0 * x, 0.0 * y), cells=4).sizes["x"]
    4
    """
    described = read_arena(TANK_30_CM if arena is None else arena)
    outline = outline_of(described)
    grid = make_grid(outline, cells=cells, cell_size=cell_size)
    x, y = grid.nodes()
    u, v = velocity(x, y)
    inside = outline.depth(x.ravel(), y.ravel()).reshape(grid.shape) >= 0.0
    facts = {
        "method": "formula",
        "cell_size_m": grid.cell_size,
        "arena": json.dumps(described),
        **(attrs or {}),
    }
    flag = np.where(inside, FLAGS["measured"], FLAGS["outside"])
    return build_flow_field(grid.x, grid.y, u=u, v=v, flag=flag, attrs=facts)


def uniform_flow(u: float, v: float, **grid: Any) -> xr.Dataset:
    """Return a flow of one velocity.

    Parameters
    ----------
    u, v : float
        The velocity [m/s].
    **grid
        ``arena``, ``cells``, ``cell_size``: see `flow_from_function`.

    Returns
    -------
    xarray.Dataset
        A `flow_field`.

    Examples
    --------
    >>> float(uniform_flow(0.1, 0.0).u.mean().round(12))
    0.1
    """
    return _named("uniform", uniform_velocity, {"u": u, "v": v}, grid)


def vortex_flow(
    angular_velocity: float, *, core_radius: float | None = None, **grid: Any
) -> xr.Dataset:
    """Return the flow of a vortex about the origin, see `vortex_velocity`.

    Parameters
    ----------
    angular_velocity : float
        Rotation of the core [rad/s], counter-clockwise positive.
    core_radius : float, optional
        Radius of the solid rotation [m]; all of it is when left out.
    **grid
        ``arena``, ``cells``, ``cell_size``: see `flow_from_function`.

    Returns
    -------
    xarray.Dataset
        A `flow_field`.

    Examples
    --------
    >>> vortex_flow(1.0, core_radius=0.05, cells=20).attrs["method"]
    'formula: vortex'
    """
    parameters = {"angular_velocity": angular_velocity, "core_radius": core_radius}
    return _named("vortex", vortex_velocity, parameters, grid)


def shear_flow(rate: float, *, at_rest: float = 0.0, **grid: Any) -> xr.Dataset:
    """Return a flow along x that grows along y, see `shear_velocity`.

    Parameters
    ----------
    rate : float
        Shear rate [1/s].
    at_rest : float, optional
        The y [m] at which the water is at rest.
    **grid
        ``arena``, ``cells``, ``cell_size``: see `flow_from_function`.

    Returns
    -------
    xarray.Dataset
        A `flow_field`.

    Examples
    --------
    >>> shear_flow(0.5).attrs["parameters"]
    '{"rate": 0.5, "at_rest": 0.0}'
    """
    return _named("shear", shear_velocity, {"rate": rate, "at_rest": at_rest}, grid)


def jets_flow(*, diameter: float = 0.3, cells: int = 50, **jets: Any) -> xr.Dataset:
    """Return the flow of a round tank with inlets in its wall, see `jets_velocity`.

    Parameters
    ----------
    diameter : float, optional
        Diameter of the tank [m].
    cells : int, optional
        Cells across it.
    **jets
        ``jet_speed``, ``swirl_speed`` and the other options of `jets_velocity`.

    Returns
    -------
    xarray.Dataset
        A `flow_field`.

    Examples
    --------
    >>> jets_flow(swirl_speed=0.0).sizes["y"]
    50
    """
    grid = {"arena": {**TANK_30_CM, "diameter_m": diameter}, "cells": cells}
    return _named("jets", jets_velocity, {"radius": diameter / 2.0, **jets}, grid)


def _named(
    name: str, velocity: Callable[..., Any], parameters: dict[str, Any], grid: dict[str, Any]
) -> xr.Dataset:
    attrs = {"method": f"formula: {name}", "parameters": json.dumps(parameters)}
    return flow_from_function(partial(velocity, **parameters), attrs=attrs, **grid)
