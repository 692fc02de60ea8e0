"""Datasets for the tests of figures: a synthetic calibration, and the bundled flow and recording.

No calibration was run. The map is a curved valley, the densities are Gaussian clouds whose
place and width follow the two parameters as the model's do, and one corner has no motion.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from driftwalk.schema import FLAGS, build_flow_field, build_trajectory
from driftwalk.schema.answers.facts import calibration_parts, facts_of
from driftwalk.schema.parameters import stored_parameters

BUNDLED = Path(__file__).parents[2] / "src" / "driftwalk" / "datasets" / "tank30_ode_a"
ARENA = json.dumps({"shape": "circle", "diameter_m": 0.3, "center_m": [0.0, 0.0]})
BEST_DRAG, BEST_FORCE = 0.39, 0.61e-3
STEPS_PER_CELL = 1500


def bundled_recording(*, rows: int | None = None) -> xr.Dataset:
    """Return the bundled recording as a trajectory."""
    t, x, y, theta = np.loadtxt(
        BUNDLED / "recording.csv", delimiter=",", skiprows=1, unpack=True, max_rows=rows
    )
    return build_trajectory(t, x, y, theta, attrs={"arena": ARENA})


def bundled_flow() -> xr.Dataset:
    """Return the bundled true flow, with block velocities and flags made from the recording."""
    x, y, u, v = np.loadtxt(BUNDLED / "flow_true.csv", delimiter=",", skiprows=1, unpack=True)
    nodes_x, nodes_y = np.unique(np.round(x, 6)), np.unique(np.round(y, 6))
    shape = (nodes_y.size, nodes_x.size)
    recording = bundled_recording()
    px, py = (recording[name].values[:, 0] for name in ("x", "y"))
    vx, vy = (np.convolve((p[2:] - p[:-2]) / 0.2, np.ones(5) / 5, "same") for p in (px, py))
    half = (nodes_x[1] - nodes_x[0]) / 2
    edges = [np.append(nodes - half, nodes[-1] + half) for nodes in (nodes_y, nodes_x)]
    count, sum_u, sum_v = (
        np.histogram2d(py[1:-1], px[1:-1], bins=edges, weights=weights)[0]
        for weights in (None, vx, vy)
    )
    seen = count >= 3
    mean_u, mean_v = (
        np.divide(total, count, out=np.full(shape, np.nan), where=seen) for total in (sum_u, sum_v)
    )
    radius = np.hypot(*np.meshgrid(nodes_x, nodes_y))
    flag = np.where(seen, FLAGS["measured"], FLAGS["filled"])
    flag[radius > 0.15 + half] = FLAGS["outside"]
    return build_flow_field(
        nodes_x,
        nodes_y,
        u=u.reshape(shape),
        v=v.reshape(shape),
        flag=flag,
        u_block=mean_u,
        v_block=mean_v,
        count=count,
        attrs={"arena": ARENA},
    )


def recording_steps() -> tuple[np.ndarray, np.ndarray]:
    """Return step lengths [m] and turning angles [rad] of the bundled recording."""
    recording = bundled_recording()
    step = np.diff(recording["x"].values[:, 0] + 1j * recording["y"].values[:, 0])
    return np.abs(step[1:]), np.angle(step[1:] / step[:-1])


def distance_formula(drag: Any, force: Any) -> Any:
    """Return a KS distance [0, 1] whose valley bends towards larger forces at low drag."""
    valley = BEST_FORCE * (BEST_DRAG / np.maximum(drag, 0.05)) ** 0.45
    across = (force - valley) / 0.55e-3
    along = np.log(np.maximum(drag, 0.02) / BEST_DRAG) / 0.9
    return np.clip(0.035 + 0.93 * (1.0 - np.exp(-0.8 * across**2 - 0.7 * along**2)), 0.0, 1.0)


def synthetic_calibration(*, simulated: str = "yes", points: int = 17) -> xr.Dataset:
    """Return a calibration dataset with every variable of the contract."""
    random = np.random.default_rng(20110507)
    drag, force = np.linspace(0.0, 1.6, points), np.linspace(0.0, 2e-3, points)
    length, angle = recording_steps()
    edges = np.linspace(0.0, 0.012, 33), np.linspace(-np.pi / 3, np.pi / 3, 33)
    coarse = _map(drag, force, random, replicates=4, prefix="")
    status = np.zeros((points, points), np.int8)
    status[0, :2] = 1  # no drag and next to no force: nothing moves
    status[1, 0] = 1
    status[-1, -1] = 2
    status[-1, -2] = 4
    _only_one_replicate(coarse, far=coarse["ks_distance"][1] > 0.5)
    coarse["ks_distance"][1][status == 1] = 1.0
    coarse["ks_distance_replicate"][1][status == 1] = 1.0
    coarse["ks_distance"][1][status == 2] = np.nan
    density = np.zeros((points, points, 32, 32))
    for i, j in np.ndindex(points, points):
        if status[i, j] == 0:
            density[i, j] = _cell_density(drag[i], force[j], random, edges)
    fine_drag = np.linspace(0.24, 0.56, 13)
    fine_force = np.linspace(0.3e-3, 0.95e-3, 13)
    refined = _map(fine_drag, fine_force, random, replicates=8, prefix="refined_")
    refined["refined_surface"] = (
        ("refined_drag_coefficient", "refined_force_std"),
        distance_formula(fine_drag[:, None], fine_force[None, :]),
    )
    cloud = random.multivariate_normal([0.0, 0.0], [[1.0, -0.7], [-0.7, 1.0]], 200)
    boot_drag, boot_force = BEST_DRAG + 0.03 * cloud[:, 0], BEST_FORCE + 0.05e-3 * cloud[:, 1]
    region_drag, region_force = _region(boot_drag, boot_force)
    plane = ("drag_coefficient", "force_std")
    place = random.uniform(0.0, 0.01, (points, points))[..., None].repeat(4, axis=-1)
    each = (*plane, "replicate")
    found = xr.Dataset(
        {
            **coarse,
            **refined,
            "status": (plane, status),
            "ks_step_length": (each, place, {"units": "m"}),
            "ks_turning_angle": (each, place, {"units": "rad"}),
            "ks_quadrant": (each, np.ones(place.shape, np.int8)),
            "step_density": ((*plane, "density_step_length", "density_turning_angle"), density),
            "recording_step_length": ("recording_step", length, {"units": "m"}),
            "recording_turning_angle": ("recording_step", angle, {"units": "rad"}),
            "recording_step_density": (
                ("density_step_length", "density_turning_angle"),
                np.histogram2d(length, angle, bins=edges)[0] / length.size,
            ),
            "bootstrap_drag_coefficient": ("bootstrap", boot_drag),
            "bootstrap_force_std": ("bootstrap", boot_force, {"units": "N"}),
            "region_drag_coefficient": ("region_vertex", region_drag),
            "region_force_std": ("region_vertex", region_force, {"units": "N"}),
        },
        coords={
            "drag_coefficient": ("drag_coefficient", drag, {"units": "1"}),
            "force_std": ("force_std", force, {"units": "N"}),
            "refined_drag_coefficient": ("refined_drag_coefficient", fine_drag, {"units": "1"}),
            "refined_force_std": ("refined_force_std", fine_force, {"units": "N"}),
            "step_length_edge": ("step_length_edge", edges[0], {"units": "m"}),
            "turning_angle_edge": ("turning_angle_edge", edges[1], {"units": "rad"}),
        },
    )
    facts = {
        "drag_coefficient": BEST_DRAG,
        "force_std_N": BEST_FORCE,
        "drag_coefficient_interval": [0.34, 0.44],
        "force_std_N_interval": [0.53e-3, 0.70e-3],
        "force_interval_s": 0.016,
        "force_noise_intensity_N2_s": BEST_FORCE**2 * 0.016,
        "ks_distance": 0.041,
        "noise_floor": 0.032,
        "warnings": [],
        "recording_name": "synthetic",
        "simulated_recording": simulated,
        "duration_s": 1800.0,
        "kind": "calibration",
    }
    return answered(found, facts)


def answered(calibration: xr.Dataset, facts: dict[str, Any]) -> xr.Dataset:
    """Return a calibration that says more under flat names, as attributes or in variables."""
    parts = calibration_parts({**facts_of(calibration), **facts}, stored_parameters(calibration))
    found = calibration.assign(parts.data).assign_coords(parts.coords)
    found.attrs = parts.attrs
    return found


def _map(
    drag: np.ndarray,
    force: np.ndarray,
    random: np.random.Generator,
    *,
    replicates: int,
    prefix: str,
) -> dict[str, Any]:
    exact = distance_formula(drag[:, None], force[None, :])
    noisy = exact[..., None] + random.normal(0.0, 0.012, (*exact.shape, replicates))
    noisy = np.clip(noisy, 0.0, 1.0)
    plane = (f"{prefix}drag_coefficient", f"{prefix}force_std")
    error = noisy.std(axis=-1, ddof=1) / np.sqrt(replicates)
    return {
        f"{prefix}ks_distance": (plane, noisy.mean(axis=-1)),
        f"{prefix}ks_distance_standard_error": (plane, error),
        f"{prefix}ks_distance_replicate": ((*plane, f"{prefix}replicate"), noisy),
        f"{prefix}replicate_count": (plane, np.full(exact.shape, replicates, np.int32)),
    }


def _only_one_replicate(coarse: dict[str, Any], *, far: np.ndarray) -> None:
    """Leave settings far from the minimum a single replicate, as a calibration does."""
    replicates = coarse["ks_distance_replicate"][1]
    replicates[far, 1:] = np.nan
    coarse["ks_distance"][1][far] = replicates[far, 0]
    coarse["ks_distance_standard_error"][1][far] = np.nan
    coarse["replicate_count"][1][far] = 1


def _cell_density(
    drag: float, force: float, random: np.random.Generator, edges: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    follow = drag / (drag + 0.12) * np.exp(-0.7 * max(drag - 0.45, 0.0) / 0.4)
    mean = 8.5e-3 * follow
    length = np.abs(random.normal(mean, 0.25e-3 + 0.8 * force, STEPS_PER_CELL))
    turn = -0.08 * drag / 0.4 - 0.25 * max(drag - 0.5, 0.0)
    width = 0.05 + 0.6 * force / max(mean, 0.8e-3)
    angle = np.angle(np.exp(1j * random.normal(turn, width, STEPS_PER_CELL)))
    counts: np.ndarray = np.histogram2d(length, angle, bins=edges)[0] / STEPS_PER_CELL
    return counts


def _region(drag: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    covariance = np.cov(drag, force)
    turn = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    circle = np.sqrt(4.605) * np.vstack([np.cos(turn), np.sin(turn)])
    ellipse = np.linalg.cholesky(covariance) @ circle
    return drag.mean() + ellipse[0], force.mean() + ellipse[1]
