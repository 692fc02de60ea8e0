"""The `calibration` dataset: everything that a calibration found, in one file.

Coarse map on ``(drag_coefficient, force_std[, replicate])``, refined map on the same names with the
prefix ``refined_``, what is kept of every setting (excerpt, step density, place of the KS maximum),
the recording's own steps, the bootstrap and the joint region. The answer stands in ``attrs``.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.problem import DENSITY_BINS, Floats, Problem
from driftwalk.calibration.search import Map
from driftwalk.simulation.backend import BROKEN, STATUS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.calibration.region import Bootstrap, Region
    from driftwalk.calibration.surface import Optimum

SCHEMA_VERSION: Final = 1
CELL_STATUS: Final[dict[str, int]] = {"no_motion": 1, "non_finite": 2, "too_few_steps": 4}
GRID: Final = ("drag_coefficient", "force_std")
REFINED: Final = ("refined_drag_coefficient", "refined_force_std")

_Variable = tuple[tuple[str, ...], npt.NDArray[Any], dict[str, Any]]


def build_calibration(
    problem: Problem,
    coarse: Map,
    refined: Map | None,
    surface: Floats | None,
    *,
    attrs: dict[str, Any],
) -> xr.Dataset:
    """Assemble the dataset of a calibration without its bootstrap.

    Parameters
    ----------
    problem : Problem
        The recording.
    coarse : Map
        The first pass, with densities and excerpts.
    refined : Map, optional
        The second pass.
    surface : ndarray, optional
        The smooth surface at the refined settings.
    attrs : dict
        Attributes.
    """
    import xarray as xr

    data: dict[str, _Variable] = {
        **_map_variables(coarse, GRID, "", "replicate"),
        **_details(coarse),
        **_recording(problem),
    }
    coords: dict[str, Any] = {
        "drag_coefficient": ("drag_coefficient", coarse.drag_coefficient, _units("1", "C_d")),
        "force_std": ("force_std", coarse.force_std, _units("N", "sigma_F")),
        "step_length_edge": (
            "step_length_edge",
            np.linspace(0.0, problem.length_limit, DENSITY_BINS + 1),
            _units("m", "edges of the step-length bins; the last bin holds all longer steps"),
        ),
        "turning_angle_edge": (
            "turning_angle_edge",
            np.linspace(-problem.angle_limit, problem.angle_limit, DENSITY_BINS + 1),
            _units("rad", "edges of the turning-angle bins; the outer bins hold all beyond"),
        ),
    }
    if refined is not None and surface is not None:
        data.update(_map_variables(refined, REFINED, "refined_", "refined_replicate"))
        data["refined_surface"] = (
            REFINED,
            surface,
            _units("1", "smooth surface through the refined distances"),
        )
        coords[REFINED[0]] = (REFINED[0], refined.drag_coefficient, _units("1", "C_d"))
        coords[REFINED[1]] = (REFINED[1], refined.force_std, _units("N", "sigma_F"))
    return xr.Dataset(
        data, coords, {"kind": "calibration", "schema_version": SCHEMA_VERSION, **attrs}
    )


def add_uncertainty(dataset: xr.Dataset, bootstrap: Bootstrap, region: Region) -> xr.Dataset:
    """Return the calibration with its bootstrap estimates and joint region."""
    return dataset.assign(
        bootstrap_drag_coefficient=(
            "bootstrap",
            bootstrap.drag_coefficient,
            _units("1", "C_d estimated from a recording simulated at the optimum"),
        ),
        bootstrap_force_std=(
            "bootstrap",
            bootstrap.force_std,
            _units("N", "sigma_F estimated from a recording simulated at the optimum"),
        ),
        bootstrap_ks_distance=(
            "bootstrap",
            bootstrap.to_recording,
            _units("1", "KS distance of a recording simulated at the optimum to the real one"),
        ),
        region_drag_coefficient=(
            "region_vertex",
            region.drag_coefficient,
            _units("1", "C_d at the border of the joint region"),
        ),
        region_force_std=(
            "region_vertex",
            region.force_std,
            _units("N", "sigma_F at the border of the joint region"),
        ),
    )


def answer_attrs(problem: Problem, optimum: Optimum) -> dict[str, Any]:
    """Return the point estimate as attributes; sigma_F is never without its interval."""
    interval = problem.study.forces.force_interval_s
    return {
        "drag_coefficient": optimum.drag_coefficient,
        "force_std_N": optimum.force_std,
        "force_interval_s": interval,
        "force_noise_intensity_N2_s": optimum.force_std**2 * interval,
        "wetted_depth_m": problem.study.wetted_depth_m,
        "position_noise_m": problem.camera.position_noise,
        "orientation_noise_rad": problem.camera.orientation_noise,
        "position_quantum_m": problem.camera.position_quantum,
        "step_interval_s": float(problem.plan.step_interval),
        "time_step_s": problem.study.time_step_s,
        "duration_s": problem.duration,
        "recording_pairs": len(problem.steps),
    }


def as_json(values: Any) -> str:
    """Return a value as the JSON text of an attribute."""
    return json.dumps(values)


def _map_variables(
    found: Map, dims: tuple[str, str], prefix: str, replicate: str
) -> dict[str, _Variable]:
    status = found.arrays["status"]
    cause = np.zeros(status.shape[:2], dtype=np.int8)
    cause[(status & STATUS["no_motion"]).all(axis=2) > 0] |= CELL_STATUS["no_motion"]
    broken = (status & BROKEN) > 0
    cause[broken.any(axis=2)] |= CELL_STATUS["non_finite"]
    cause[found.arrays["pairs"] == 0] |= CELL_STATUS["too_few_steps"]
    flags = {
        "long_name": "reason why a setting has no ordinary distance",
        "flag_masks": np.array(list(CELL_STATUS.values()), dtype=np.int8),
        "flag_meanings": " ".join(CELL_STATUS),
    }
    return {
        f"{prefix}ks_distance": (dims, found.mean, _units("1", "mean KS distance")),
        f"{prefix}ks_distance_standard_error": (
            dims,
            found.standard_error,
            _units("1", "standard error of the mean KS distance"),
        ),
        f"{prefix}ks_distance_replicate": (
            (*dims, replicate),
            found.distance,
            _units("1", "KS distance of each replicate"),
        ),
        f"{prefix}status": (dims, cause, flags),
    }


def _details(coarse: Map) -> dict[str, _Variable]:
    arrays = coarse.arrays
    place = (*GRID, "replicate")
    return {
        "ks_step_length": (
            place,
            arrays["ks_step_length"],
            _units("m", "step length at which the KS maximum sits"),
        ),
        "ks_turning_angle": (
            place,
            arrays["ks_turning_angle"],
            _units("rad", "turning angle at which the KS maximum sits"),
        ),
        "ks_quadrant": (
            place,
            arrays["ks_quadrant"].astype(np.int8),
            {
                "long_name": "quadrant of the KS maximum",
                "flag_values": np.array([-1, 0, 1, 2, 3], dtype=np.int8),
                "flag_meanings": "none left_below right_below left_above right_above",
            },
        ),
        "excerpt_x": (
            (*GRID, "excerpt_sample"),
            arrays["excerpt_x"],
            _units("m", "position x, first seconds of replicate 0"),
        ),
        "excerpt_y": (
            (*GRID, "excerpt_sample"),
            arrays["excerpt_y"],
            _units("m", "position y, first seconds of replicate 0"),
        ),
        "step_density": (
            (*GRID, "density_step_length", "density_turning_angle"),
            arrays["step_density"].astype(np.float32),
            _units("1", "share of the steps in a bin"),
        ),
    }


def _recording(problem: Problem) -> dict[str, _Variable]:
    length, angle = problem.steps.T
    bins = [
        np.linspace(0.0, problem.length_limit, DENSITY_BINS + 1),
        np.linspace(-problem.angle_limit, problem.angle_limit, DENSITY_BINS + 1),
    ]
    density, _, _ = np.histogram2d(
        np.clip(length, 0.0, problem.length_limit),
        np.clip(angle, -problem.angle_limit, problem.angle_limit),
        bins=bins,
    )
    return {
        "recording_step_length": (
            ("recording_step",),
            length,
            _units("m", "step length of the recording"),
        ),
        "recording_turning_angle": (
            ("recording_step",),
            angle,
            _units("rad", "turning angle (step angle) of the recording"),
        ),
        "recording_step_density": (
            ("density_step_length", "density_turning_angle"),
            (density / len(length)).astype(np.float32),
            _units("1", "share of the recording's steps in a bin"),
        ),
        "excerpt_time": (
            ("excerpt_sample",),
            problem.sample_time[: problem.excerpt],
            _units("s", "time of the excerpt's samples"),
        ),
    }


def _units(units: str, long_name: str) -> dict[str, Any]:
    return {"units": units, "long_name": long_name}
