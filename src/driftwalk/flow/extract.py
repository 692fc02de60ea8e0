"""The flow field that a floating body's own track shows: the paper's estimator (Eq. 4)."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.smoothing import local_quadratic
from driftwalk.flow.arena import outline_of
from driftwalk.flow.cell_means import Samples, average_cells, field_of_cells
from driftwalk.flow.grid import Grid, make_grid
from driftwalk.schema import body_names, body_track, check_trajectory
from driftwalk.schema.trajectory import read_arena

if TYPE_CHECKING:
    import xarray as xr


Inertia = Literal["corrected", "none"]

ALL_BODIES = "all"


@dataclass(frozen=True)
class _Smoothed:
    """Samples with derivatives, and how many had none."""

    position: Floats
    samples: Samples
    without_derivative: int


def extract_flow(
    trajectory: xr.Dataset,
    *,
    body: str | None = None,
    arena: Mapping[str, Any] | str | None = None,
    cells: int = 50,
    cell_size: float | None = None,
    window: float = 0.7,
    inertia: Inertia = "corrected",
    mass: float | None = None,
    area: float | None = None,
    side: float | None = None,
    depth: float | None = None,
    water_density: float = 1000.0,
    flow_drag_coefficient: float = 1.05,
    min_count: int = 1,
) -> xr.Dataset:
    """Estimate the velocity of the water from the track of a body that floats in it.

    The tank is cut into square cells. Velocity and acceleration come from a local quadratic fit
    (`driftwalk.core.smoothing.local_quadratic`), are averaged in each cell, and the mean velocity
    is corrected for the body's inertia with the mean acceleration (Eq. 4 of the paper, see
    `inertia_correction`). Cells without data are filled from their neighbours with no flow through
    the wall (`fill_velocity`).

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory` in metres, with its arena in ``attrs["arena"]`` unless `arena` is given.
    body : str, optional
        Name of the body, or ``"all"`` to pool every body of the recording; may be left out when
        there is only one.
    arena : mapping or str, optional
        Outline of the tank, as `outline_of` reads it; default: the trajectory's own.
    cells : int, optional
        Cells across the longer side of the tank.
    cell_size : float, optional
        Side of a cell [m], in place of `cells`.
    window : float, optional
        Width of the smoothing window [s].
    inertia : {"corrected", "none"}
        With ``"none"`` the water is taken to move as the body does (for tracers, or bodies that
        drive themselves).
    mass : float, optional
        Mass of the body [kg]; needed for the correction.
    area : float, optional
        Cross-section of the body to the flow [m²]; needed for the correction, unless `side` is
        given.
    side, depth : float, optional
        Side and wetted depth of a square body [m], in place of `area`, which is their product;
        the depth is the side when it is not given (almost full immersion, as in the paper).
    water_density : float, optional
        Density of the water [kg/m³].
    flow_drag_coefficient : float, optional
        Drag coefficient C_x of the whole body in Eq. 4.
    min_count : int, optional
        Smallest number of samples in a measured cell.

    Returns
    -------
    xarray.Dataset
        A `flow_field`. ``flag`` is *measured* for cells of the tank with at least `min_count`
        samples, *filled* for its other cells, *outside* for nodes beyond the wall; a cell that the
        wall cuts belongs to the tank when its centre does or when it is measured. ``count`` is the
        number of smoothed samples. The standard errors treat each visit to a cell as one
        observation, because the samples of a visit share their smoothing windows (a return within
        one `window` continues the visit; `average_cells`); they are NaN with fewer than two
        visits, and are of the scatter alone, not of the larger bias of Eq. 4. ``attrs`` holds
        every setting, the shares of measured and filled cells, the samples used and left out, and,
        where few cells are measured or samples lie beyond the wall, ``warning``.

    Raises
    ------
    InputError
        When no arena is known, the body is not named, mass or area are missing, an option is out
        of range, or no cell has enough samples.

    Examples
    --------
    >>> import numpy as np
    >>> from driftwalk.schema import build_trajectory
    >>> t = np.arange(600) * 0.1
    >>> tank = '{"shape": "circle", "diameter_m": 0.3}'
    >>> track = build_trajectory(t, 0.1 * np.cos(t), 0.1 * np.sin(t), attrs={"arena": tank})
    >>> flow = extract_flow(track, mass=0.0116, side=0.03)
    >>> sorted(set(flow.flag.values.ravel().tolist()))
    [0, 1, 2]
    """
    check_trajectory(trajectory)
    _check_options(inertia, min_count)
    described = _arena_of(trajectory, arena)
    outline = outline_of(described)
    grid = make_grid(outline, cells=cells, cell_size=cell_size)
    settings: dict[str, Any] = {"inertia": inertia, "min_count": min_count, "window_s": window}
    correction: Callable[[Floats], Floats] = np.zeros_like
    method = "cell means of a body's velocity, without inertia correction"
    if inertia == "corrected":
        if mass is None:
            raise InputError(
                "the inertia correction needs the body's mass (`mass`); give it, or choose inertia "
                '"none" for a body without inertia'
            )
        method = "cell means of a body's velocity, Eq. 4 with the mean acceleration"
        physics = {
            "mass": mass,
            "area": cross_section(area, side, depth),
            "water_density": water_density,
            "flow_drag_coefficient": flow_drag_coefficient,
        }
        correction = partial(inertia_correction, **physics)
        units = {"mass": "mass_kg", "area": "area_m2", "water_density": "water_density_kg_m3"}
        settings.update({units.get(name, name): value for name, value in physics.items()})
    bodies = _chosen_bodies(trajectory, body)
    smoothed = _smooth(trajectory, bodies, window, grid)
    # Smoothed before cells are formed: samples beyond the wall help the derivatives of those
    # within.
    kept = (smoothed.samples.cell >= 0) & (outline.depth(*smoothed.position.T) >= 0.0)
    inside = smoothed.samples.select(kept)
    means = average_cells(inside, cells=grid.size, pause=window, correction=correction)
    measured = means.count.reshape(grid.shape) >= min_count
    if not measured.any():
        raise InputError(_nothing_measured(smoothed, inside, min_count, window))
    settings.update(
        bodies=json.dumps(bodies),
        samples_used=int(inside.time.size),
        samples_without_derivative=smoothed.without_derivative,
        samples_outside_tank=int(smoothed.samples.time.size - inside.time.size),
        arena=json.dumps(described),
        source=str(trajectory.attrs.get("source", "")),
    )
    block = means.velocity.reshape(*grid.shape, 2)
    return field_of_cells(
        grid,
        outline,
        means,
        measured,
        {"method": method, "cell_size_m": grid.cell_size, **settings},
        u_block=block[..., 0],
        v_block=block[..., 1],
        count=means.count.reshape(grid.shape),
    )


def _check_options(inertia: str, min_count: int) -> None:
    if inertia not in ("corrected", "none"):
        raise InputError(f"`inertia` must be 'corrected' or 'none', got {inertia!r}")
    if min_count < 1:
        raise InputError(f"`min_count` must be at least 1, got {min_count}")


def _arena_of(trajectory: xr.Dataset, arena: Mapping[str, Any] | str | None) -> dict[str, Any]:
    described = trajectory.attrs.get("arena") if arena is None else arena
    if not described:
        raise InputError(
            "the recording does not contain the size of the tank: give its outline with `tank` of "
            '`load`, or `arena={"shape": "circle", "diameter_m": 0.3}` for a circle'
        )
    return read_arena(described)


def _chosen_bodies(trajectory: xr.Dataset, body: str | None) -> list[str]:
    names = body_names(trajectory)
    if body == ALL_BODIES and ALL_BODIES not in names:
        return names
    if body is None and len(names) == 1:
        return names
    if body is None:
        raise InputError(
            f"the recording has {len(names)} bodies: name one with `body`, or pool them with "
            'body="all"; of passive tracers `flow_from_tracers` makes one flow'
        )
    body_track(trajectory, body)  # raises, naming the bodies, when there is no such one
    return [str(body)]


def _smooth(trajectory: xr.Dataset, bodies: list[str], window: float, grid: Grid) -> _Smoothed:
    """Return the smoothed samples of the chosen bodies; cell -1 lies off the grid."""
    rows, numbers, missing = [], [], 0
    for number, name in enumerate(bodies):
        track = body_track(trajectory, name)
        fit = local_quadratic(track.time, np.column_stack([track.x, track.y]), window=window)
        present = np.isfinite(fit[0][:, 0])
        missing += int(np.count_nonzero(~present))
        rows.append(np.column_stack([track.time, *fit])[present])
        numbers.append(np.full(len(rows[-1]), number, dtype=np.intp))
    table = np.concatenate(rows)
    cell = grid.cell_of(table[:, 1], table[:, 2])
    samples = Samples(cell, np.concatenate(numbers), table[:, 0], table[:, 3:5], table[:, 5:7])
    return _Smoothed(table[:, 1:3], samples, missing)


def _nothing_measured(smoothed: _Smoothed, inside: Samples, min_count: int, window: float) -> str:
    if smoothed.samples.time.size == 0:
        return (
            f"none of {smoothed.without_derivative} samples has enough neighbours within "
            f"{window} s for a velocity: give a longer window (`window`)"
        )
    if inside.time.size == 0:
        low, high = smoothed.position.min(axis=0), smoothed.position.max(axis=0)
        return (
            f"no sample lies in the tank: the track covers x from {low[0]:.4g} to {high[0]:.4g} m, "
            f"y from {low[1]:.4g} to {high[1]:.4g} m; check the scale, the origin and the arena"
        )
    return f"no cell has {min_count} samples: lower `min_count` or give larger cells (`cells`)"


def inertia_correction(
    acceleration: npt.ArrayLike,
    *,
    mass: float,
    area: float,
    water_density: float = 1000.0,
    flow_drag_coefficient: float = 1.05,
) -> Floats:
    """Return the velocity of the water relative to the body that it carries.

    A body of mass m that accelerates by a feels the force m a. If that force is the quadratic drag
    ``½ rho A C_x |w| w`` of water that passes it at w, then (Eq. 4 of the paper)

        w = m a / sqrt(½ rho A C_x m |a|),    and w = 0 where a = 0.

    Parameters
    ----------
    acceleration : array_like, shape (..., 2)
        Acceleration of the body [m/s²].
    mass : float
        Mass m [kg].
    area : float
        Cross-section A that the body turns to the flow [m²].
    water_density : float, optional
        rho [kg/m³].
    flow_drag_coefficient : float, optional
        C_x of the whole body, 1.05 for a cube. It is not the coefficient of the strips that the
        simulation uses and the calibration finds.

    Returns
    -------
    ndarray, shape (..., 2)
        Velocity of the water minus velocity of the body [m/s].

    Raises
    ------
    InputError
        When a parameter is not a positive number.

    Examples
    --------
    >>> inertia_correction([0.5, 0.0], mass=0.0116, area=9e-4).round(4).tolist()
    [0.1108, 0.0]
    """
    for name, value in (
        ("mass", mass),
        ("area", area),
        ("water_density", water_density),
        ("flow_drag_coefficient", flow_drag_coefficient),
    ):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{name} must be a positive number, got {value}")
    a = np.asarray(acceleration, dtype=np.float64)
    size = np.hypot(a[..., 0], a[..., 1])[..., None]
    factor = math.sqrt(mass / (0.5 * water_density * area * flow_drag_coefficient))
    # a / sqrt|a| tends to 0 with a, though the quotient is 0/0 there.
    root = np.sqrt(np.where(size > 0.0, size, 1.0))
    return np.asarray(np.where(size > 0.0, factor * a / root, 0.0 * size))


def cross_section(area: float | None, side: float | None, depth: float | None) -> float:
    """Return the cross-section to the flow [m²], given as such or as side and wetted depth [m].

    Raises
    ------
    InputError
        When both or neither are given.

    Examples
    --------
    >>> cross_section(None, 0.03, 0.01)
    0.0003
    """
    if area is not None:
        if side is not None or depth is not None:
            raise InputError(f"area={area} and side={side}, depth={depth} given: keep one of them")
        return area
    if side is None:
        raise InputError(
            "the inertia correction needs the body's cross-section: give `side` or `area`, "
            'or choose inertia "none"'
        )
    return side * (side if depth is None else depth)
