"""Interface to the native core: prepare a model from plain numbers and datasets.

The walls of tanks and fields of view are here too, and the refusal of a flow that ends before them.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.schema import FLAGS, check_flow_field
from driftwalk.schema.kinds.motion import WORLD_STATUS
from driftwalk.simulation.series import frames_of

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import FieldOfView, Study, Tank
    from driftwalk.model.tank import Outline

STATUS: Final[dict[str, int]] = WORLD_STATUS
"""Bits of a world's status; 0 is sound."""
BROKEN: Final = STATUS["non_finite"] | STATUS["escaped"]
"""Bits of a world that lost its numbers: it has no distance and no outcome."""


class SizePolicy(NamedTuple):
    """Largest work that the native core is given."""

    nodes_per_side: int = 16_000
    """Nodes along a side of a flow field; chosen by hand."""
    nodes: int = 50_000_000
    """Nodes of all tables of a flow field; chosen by hand."""
    steps: int = 2_000_000_000
    """Steps of one world: half an hour of one processor. The longest run of a study, 1e7 s, has
    half as many steps of 10 ms. Chosen by hand."""
    step_takes_s: float = 0.85e-6
    """Duration of a step [s], measured on a Haswell core."""


_SIZES: Final = SizePolicy()


@dataclass(frozen=True)
class Camera:
    """Effect of the camera on a pose: noise per axis [m], [rad], and the file's resolution [m]."""

    position_noise: float = 0.0
    orientation_noise: float = 0.0
    position_quantum: float = 0.0


def require_steps(duration: float, step: float) -> None:
    """Refuse a simulation of more steps than anybody waits for.

    Parameters
    ----------
    duration : float
        Of one world [s].
    step : float
        Time step [s].

    Raises
    ------
    InputError
        With the number of steps and the time that they would take.

    Examples
    --------
    >>> require_steps(300.0, 0.008)
    """
    steps = duration / step
    if steps <= _SIZES.steps:
        return
    raise InputError(
        f"{duration:.4g} s in steps of {step:.3g} s are {steps:.2g} steps of every simulated "
        f"world, some {steps * _SIZES.step_takes_s / 3600.0:.2g} hours each; "
        f"{_SIZES.steps:.2g} at most are simulated: take a longer interval of the force "
        "(`forces.force_interval_s`), or a shorter time (`simulation.duration_s`)"
    )


def native_model(
    study: Study, flow: xr.Dataset, sample_time: Floats, camera: Camera
) -> _core.Model:
    """Return the native core's form of a model, from `model_arguments`."""
    return _core.Model(**model_arguments(study, flow, sample_time, camera))


def model_arguments(
    study: Study, flow: xr.Dataset, sample_time: Floats, camera: Camera
) -> dict[str, Any]:
    """Return a model as the native core takes it: numbers and arrays by name, in SI units.

    Parameters
    ----------
    study : Study
        Block, tank, water and the two times; its drag coefficient and force_std belong to the
        worlds and are not read.
    flow : xarray.Dataset
        A `flow_field`, steady or with a `time` dimension.
    sample_time : ndarray, shape (n,)
        Times of the samples from the start of the run [s], increasing, >= 0.
    camera : Camera
        Noise and resolution of the samples.

    Raises
    ------
    InputError
        When there is no sample, times are not finite or do not increase, or the dataset is no flow
        field, or the run has more steps than anybody waits for.
    """
    forces, step = study.forces, study.time_step_s
    check_sample_time(sample_time)
    require_steps(max(float(sample_time[-1]), forces.force_interval_s), step)
    body = study.body()
    return {
        "side": study.block.side_m,
        "mass": study.block.mass_kg,
        "inertia": study.block.inertia_kg_m2,
        "depth": study.wetted_depth_m,
        "strips": study.block.strips_per_face,
        "added_mass_share": forces.added_mass_share,
        "water_density": study.water.density_kg_m3,
        "linear_drag": forces.linear_drag_kg_s,
        "drag_power": forces.drag_power,
        "drag_speed": forces.drag_speed_m_s,
        "displaced_mass": study.displaced_mass_kg if forces.pressure_gradient else 0.0,
        "time_step": step,
        "steps_per_interval": round(forces.force_interval_s / step),
        "force_lever": study.force_lever_m,
        "force_memory": forces.force_memory_s,
        "disc_radius": body.disc_radius_m,
        **body.arrays(),
        **_surroundings(
            study.tank, study.observation.field_of_view, flow, sample_time, camera,
            accelerating=forces.pressure_gradient,
        ),
    }  # fmt: skip


POINT: Final[dict[str, Any]] = {
    "mass": 1.0, "inertia": 1.0, "depth": 1.0, "strips": 1, "added_mass_share": 0.0,
    "water_density": 1.0, "linear_drag": 0.0, "drag_power": 2.0, "drag_speed": 1.0,
    "displaced_mass": 0.0, "disc_radius": 0.0, "steps_per_interval": 1, "force_lever": 0.0,
    "force_memory": 0.0,
}  # fmt: skip
"""Numbers of a block where there is none: a self-propelled particle reads nothing of them."""


def native_scene(
    tank: Tank,
    view: FieldOfView | None,
    flow: xr.Dataset | None,
    sample_time: Floats,
    camera: Camera,
    *,
    time_step: float,
) -> _core.Model:
    """Return the native core's form of what surrounds a self-propelled particle.

    Parameters
    ----------
    tank : Tank
        The arena and its wall.
    view : FieldOfView or None
        What the camera sees, when that is less.
    flow : xarray.Dataset or None
        A `flow_field` that carries the particle; None: still water.
    sample_time : ndarray, shape (n,)
        Times of the samples from the start of the run [s], increasing, >= 0.
    camera : Camera
        Noise and resolution of the samples.
    time_step : float
        Time step [s].

    Raises
    ------
    InputError
        As `native_model`.
    """
    check_sample_time(sample_time)
    require_steps(float(sample_time[-1]), time_step)
    return _core.Model(
        # A contact is rounded, by less than this share of the arena.
        side=4e-6 * max(tank.extent_m),
        time_step=time_step,
        **POINT,
        **_surroundings(tank, view, flow, sample_time, camera, accelerating=False),
    )


def _surroundings(
    tank: Tank,
    view: FieldOfView | None,
    flow: xr.Dataset | None,
    sample_time: Floats,
    camera: Camera,
    *,
    accelerating: bool,
) -> dict[str, Any]:
    """Return wall, flow, samples and camera in the words of the native core."""
    return {
        **(_still_water(tank) if flow is None else _water(flow, tank, accelerating=accelerating)),
        "radius": tank.radius_m or 0.0,
        "edges": wall_edges(tank),
        "restitution": tank.wall_restitution,
        "friction": tank.wall_friction,
        "bounce_speed": tank.bounce_speed_m_s,
        "sample_time": np.ascontiguousarray(sample_time, dtype=np.float64),
        **asdict(camera),
        **_field_of_view(view),
    }


def _water(flow: xr.Dataset, tank: Tank, *, accelerating: bool) -> dict[str, Any]:
    check_flow_field(flow)
    _require_table(flow, tank, accelerating=accelerating)
    x, y = flow["x"].values, flow["y"].values
    u, v, frame_time, repeat = frames_of(flow)
    return {
        "u": u,
        "v": v,
        "frame_time": frame_time,
        "flow_repeat": repeat,
        "origin_x": float(x[0]),
        "origin_y": float(y[0]),
        "spacing_x": float((x[-1] - x[0]) / (x.size - 1)),
        "spacing_y": float((y[-1] - y[0]) / (y.size - 1)),
    }


def _still_water(tank: Tank) -> dict[str, Any]:
    """Return a flow of four nodes at the corners of the tank's box: zero everywhere."""
    width, height = tank.extent_m
    none = np.zeros((1, 2, 2))
    return {
        "u": none,
        "v": none,
        "frame_time": np.zeros(1),
        "origin_x": -width / 2.0,
        "origin_y": -height / 2.0,
        "spacing_x": width,
        "spacing_y": height,
    }


def check_sample_time(time: Floats) -> None:
    """Refuse times of samples [s] that are not finite or do not increase from 0 on.

    Raises
    ------
    InputError
        When they are not, or there is none.
    """
    # Without a finite end a run would never come to its last sample.
    sound = time.ndim == 1 and time.size > 0 and np.isfinite(time).all()
    if not sound or time[0] < 0 or (np.diff(time) <= 0).any():
        raise InputError(
            "sampling times must be a list of finite, increasing times from 0 s on, at least one"
        )


def _require_table(flow: xr.Dataset, tank: Outline, *, accelerating: bool) -> None:
    """Refuse a grid so fine that its tables, which reach to the wall, would not fit.

    The water's acceleration has one table for each frame and two for each step between frames.
    """
    width, height = tank.extent_m
    sides = []
    for axis, extent in (("x", width), ("y", height)):
        nodes = flow[axis].values
        spacing = (nodes[-1] - nodes[0]) / (nodes.size - 1)
        sides.append(nodes.size + 2.0 * extent / spacing)
    frames = flow.sizes.get("time", 1)
    tables = 4 * frames - 2 if accelerating else frames
    if max(sides) > _SIZES.nodes_per_side or tables * sides[0] * sides[1] > _SIZES.nodes:
        of_water = f" (with the water's acceleration {tables} tables)" if accelerating else ""
        raise InputError(
            f"the flow field's grid is too fine for the tank: {sides[0]:.0f} x {sides[1]:.0f} "
            f"nodes and {frames} frames{of_water} would reach its wall, at most "
            f"{_SIZES.nodes_per_side} a side and {_SIZES.nodes:.0e} in all are possible; use a "
            "coarser grid (a block feels nothing much finer than its strips)"
        )


def _field_of_view(view: FieldOfView | None) -> dict[str, Any]:
    """Return what the camera sees, in the words of the native core."""
    if view is None:
        return {"view_radius": 0.0, "view_x": 0.0, "view_y": 0.0, "view_edges": np.zeros((0, 3))}
    x, y = view.center_m
    edges = wall_edges(view)
    edges[:, 2] += edges[:, 0] * x + edges[:, 1] * y
    return {"view_radius": view.radius_m or 0.0, "view_x": x, "view_y": y, "view_edges": edges}


def wall_edges(outline: Outline) -> Floats:
    """Return the edges of a rectangle or polygon: outward normal and distance from the origin [m].

    Shape (edges, 3); empty for a circle.
    """
    corners = np.asarray(outline.corners_m, dtype=np.float64).reshape(-1, 2)
    along = np.roll(corners, -1, axis=0) - corners
    # Counter-clockwise corners: the outside is to the right of each edge.
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.column_stack([normal, np.sum(normal * corners, axis=1)])


def wall_depth(outline: Outline, x: Floats, y: Floats) -> Floats:
    """Return how deep points lie inside the wall [m], negative beyond it."""
    if outline.radius_m is not None:
        return np.asarray(outline.radius_m - np.hypot(x, y))
    return np.asarray(
        np.min([far - nx * x - ny * y for nx, ny, far in wall_edges(outline)], axis=0)
    )


def require_cover(flow: xr.Dataset, tank: Tank) -> None:
    """Refuse a flow field that does not reach the wall of the tank to within one of its cells.

    Raises
    ------
    InputError
        When the grid ends earlier, or nodes of the tank are flagged as outside of the field's own
        tank; or when the dataset is no flow field.
    """
    check_flow_field(flow)
    x, y = (flow[name].values.astype(np.float64) for name in ("x", "y"))
    cells = tuple((nodes[-1] - nodes[0]) / (nodes.size - 1) for nodes in (x, y))
    radius = tank.radius_m
    corners = tank.corners_m if radius is None else ((-radius, -radius), (radius, radius))
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    for nodes, cell, begin, end in zip((x, y), cells, low, high, strict=True):
        if nodes[0] - cell > begin + 1e-9 or nodes[-1] + cell < end - 1e-9:
            raise InputError(
                f"the flow field does not cover the tank, a {tank.describe()} that reaches "
                f"{_range(*np.stack([low, high], axis=1))}: it spans {_range(x, y)}; give the "
                "field of this tank, or the tank of this field (`tank.diameter_m`, [tank])"
            )
    if "flag" not in flow:
        return
    outside = flow["flag"].values == FLAGS["outside"]
    outside = outside.reshape(-1, *outside.shape[-2:]).any(axis=0)
    inner = wall_depth(tank, *np.meshgrid(x, y)) > float(np.hypot(*cells))
    lacking = int(np.count_nonzero(outside & inner))
    if lacking:
        raise InputError(
            f"the flow field does not cover the tank, a {tank.describe()}: {lacking} of its "
            f"{np.count_nonzero(inner)} nodes in there are flagged as outside of the tank that it "
            "was made for; give the field of this tank, or the tank of this field "
            "(`tank.diameter_m`, [tank])"
        )


def _range(x: npt.ArrayLike, y: npt.ArrayLike) -> str:
    ends = [np.asarray(values)[[0, -1]] for values in (x, y)]
    return ", ".join(
        f"{name} from {low:.4g} to {high:.4g} m"
        for name, (low, high) in zip("xy", ends, strict=True)
    )
