"""Synthetic worlds for the tests of the simulator: numbers in, native models and twins out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from twin.block import TwinModel

import driftwalk as dw
from driftwalk import _core
from driftwalk.core.random_streams import world_keys

Floats = npt.NDArray[np.float64]
Velocity = Callable[[Floats, Floats], tuple[Any, Any]]

SIDE, MASS, DENSITY, RADIUS = 0.03, 0.0116, 1000.0, 0.15
INERTIA = MASS * SIDE**2 / 6.0
CORNERS = SIDE / np.sqrt(2.0)

# What a floating body feels beyond the paper's law: keys of [forces], one by one and together.
BEYOND_PAPER: dict[str, dict[str, Any]] = {
    "added mass": {"added_mass_share": 0.6},
    "water": {"pressure_gradient": True},
    "linear drag": {"linear_drag_kg_s": 4e-3},
    "power of the drag": {"drag_power": 1.4, "drag_speed_m_s": 0.02},
    "memory": {"force_memory_s": 0.07},
    "all": {
        "added_mass_share": 0.6,
        "pressure_gradient": True,
        "linear_drag_kg_s": 4e-3,
        "force_memory_s": 0.07,
    },
}


def numbers_of(forces: Mapping[str, Any]) -> dict[str, float]:
    """Return the arguments of a native model, or its twin, that keys of [forces] stand for."""
    numbers = {
        "added_mass_share": forces.get("added_mass_share", 0.0),
        "linear_drag": forces.get("linear_drag_kg_s", 0.0),
        "displaced_mass": MASS if forces.get("pressure_gradient") else 0.0,
        "drag_power": forces.get("drag_power", 0.0),
        "drag_speed": forces.get("drag_speed_m_s", 0.0),
        "force_memory": forces.get("force_memory_s", 0.0),
    }
    return {name: value for name, value in numbers.items() if value}


# A flow that is linear on nodes at -31 .. 31 spacings is a whole number of quanta max|u| / 32767
# (32767 = 31 * 1057): the table holds it exactly.
NODES = np.arange(-31, 32) * 0.01


def still(x: Floats, y: Floats) -> tuple[Any, Any]:
    return 0.0 * x, 0.0 * y


def swirl(x: Floats, y: Floats) -> tuple[Any, Any]:
    """A curved flow of 5 cm/s without symmetry."""
    q = np.hypot(x, y) / RADIUS
    speed = 0.05 * (1.5 - q) / RADIUS
    return -speed * y + 0.01 * np.sin(40 * y), speed * x + 0.01 * np.cos(40 * x)


def flow_arrays(velocity: Velocity, nodes: Floats = NODES) -> tuple[Floats, Floats]:
    x, y = np.meshgrid(nodes, nodes)
    u, v = velocity(x, y)
    shape = np.ones_like(x)
    return np.ascontiguousarray(u * shape), np.ascontiguousarray(v * shape)


def model(
    velocity: Velocity = still, *, times: npt.ArrayLike, nodes: Floats = NODES, **changes: Any
) -> _core.Model:
    """Return a native model of the paper's block and tank, with `changes` to its arguments."""
    u, v = flow_arrays(velocity, nodes)
    settings: dict[str, Any] = {
        "side": SIDE,
        "mass": MASS,
        "inertia": INERTIA,
        "depth": SIDE,
        "strips": 8,
        "added_mass_share": 0.0,
        "water_density": DENSITY,
        "linear_drag": 0.0,
        "drag_power": 2.0,
        "drag_speed": 0.03,
        "displaced_mass": 0.0,
        "disc_radius": 0.0,
        "force_lever": 0.0,
        "radius": RADIUS,
        "edges": np.zeros((0, 3)),
        "restitution": 0.5,
        "friction": 0.0,
        "bounce_speed": 0.01,
        "u": u[None],
        "v": v[None],
        "frame_time": np.zeros(1),
        "origin_x": float(nodes[0]),
        "origin_y": float(nodes[0]),
        "spacing_x": float(nodes[1] - nodes[0]),
        "spacing_y": float(nodes[1] - nodes[0]),
        "time_step": 0.01,
        "steps_per_interval": 1,
        "force_memory": 0.0,
        "sample_time": np.asarray(times, dtype=np.float64),
        "position_noise": 0.0,
        "orientation_noise": 0.0,
        "position_quantum": 0.0,
        "view_radius": 0.0,
        "view_x": 0.0,
        "view_y": 0.0,
        "view_edges": np.zeros((0, 3)),
    }
    return _core.Model(**{**settings, **changes})


def twin(velocity: Velocity, **changes: Any) -> TwinModel:
    """Return the NumPy twin of `model`."""
    u, v = flow_arrays(velocity)
    settings: dict[str, Any] = {
        "side": SIDE,
        "mass": MASS,
        "depth": SIDE,
        "strips": 8,
        "water_density": DENSITY,
        "radius": RADIUS,
        "restitution": 0.5,
        "friction": 0.0,
        "bounce_speed": 0.01,
        "time_step": 0.01,
        "steps_per_interval": 1,
        "flow_x": NODES,
        "flow_y": NODES,
        "flow_u": u,
        "flow_v": v,
    }
    return TwinModel(**{**settings, **changes})


def random_worlds(
    count: int, *, seed: int = 1, drag: float = 0.45, force: float = 0.55e-3
) -> Floats:
    """Return worlds anywhere well inside the tank, in any motion."""
    rng = np.random.default_rng(seed)
    table = np.empty((count, 8))
    table[:, :2] = rng.uniform(-0.08, 0.08, (count, 2))
    table[:, 2] = rng.uniform(-np.pi, np.pi, count)
    table[:, 3:5] = rng.uniform(-0.05, 0.05, (count, 2))
    table[:, 5] = rng.uniform(-1.0, 1.0, count)
    table[:, 6], table[:, 7] = drag, force
    return table


def one_world(
    x: float = 0.0,
    y: float = 0.0,
    theta: float = 0.0,
    vx: float = 0.0,
    vy: float = 0.0,
    omega: float = 0.0,
    *,
    drag: float = 0.45,
    force: float = 0.0,
) -> Floats:
    return np.array([[x, y, theta, vx, vy, omega, drag, force]])


def run(
    native: _core.Model,
    worlds: Floats,
    *,
    keys: npt.NDArray[np.uint64] | None = None,
    seed: int = 1,
    threads: int = 1,
    precision: str = "double",
) -> tuple[npt.NDArray[Any], ...]:
    """Return x, y, theta (worlds, samples) and status of worlds."""
    if keys is None:
        keys = world_keys(seed, trial=0, replicate=np.arange(len(worlds)))
    return _core.simulate(native, worlds, keys, threads=threads, precision=precision)


def wrapped(angle: npt.ArrayLike) -> Floats:
    return np.asarray(np.remainder(np.asarray(angle) + np.pi, 2 * np.pi) - np.pi)


def corner_positions(x: Any, y: Any, theta: Any) -> tuple[Floats, Floats]:
    """Return the corners of blocks at poses of any shape, corners along a new last axis."""
    angle = np.asarray(theta)[..., None] + np.pi / 4 + np.arange(4) * np.pi / 2
    return np.asarray(x)[..., None] + CORNERS * np.cos(angle), np.asarray(y)[
        ..., None
    ] + CORNERS * np.sin(angle)


def study(**sections: Any) -> dw.Study:
    """Return a study that observes exactly, unless told otherwise."""
    exact = {"position_noise_m": 0.0, "orientation_noise_rad": 0.0, "position_quantum_m": 0.0}
    observation = {**exact, **sections.pop("observation", {})}
    return dw.Study(observation=observation, **sections)
