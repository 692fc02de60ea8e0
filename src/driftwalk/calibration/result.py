"""The `calibration` dataset: everything that a calibration found, in one file.

Coarse map on the model's parameters by name, ``(drag_coefficient, force_std[, replicate])`` for the
block, refined map on the same names with the prefix ``refined_``, what is kept of every setting
(excerpt, step density, place of the KS maximum), the recording's own steps, the bootstrap and the
joint region. The answer is ``estimate`` and ``interval`` along ``parameter``, and variables without
a dimension; see `driftwalk.schema.answers.facts`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.grid.energy_score import at_settings
from driftwalk.calibration.grid.grid_map import Map
from driftwalk.calibration.problem import Problem
from driftwalk.comparison.statistic import BINS, joint_density
from driftwalk.core.arrays import Floats
from driftwalk.motion.score import broken_worlds, excerpt_samples
from driftwalk.schema import Parameter
from driftwalk.schema.answers.facts import GOODNESS, calibration_parts
from driftwalk.schema.answers.verdict import verdict_variables
from driftwalk.schema.check import build_dataset
from driftwalk.schema.kinds.calibration import CELL_STATUS
from driftwalk.simulation.backend import STATUS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.calibration.goodness_of_fit import Halves
    from driftwalk.calibration.grid.bootstrap_region import Bootstrap, Region
    from driftwalk.calibration.grid.stages import GridCalibration
    from driftwalk.calibration.stationarity import Stationarity


_Variable = tuple[tuple[str, ...], npt.NDArray[Any]]


def build_calibration(
    stages: GridCalibration,
    halves: Halves | None,
    stationarity: Stationarity | None,
    recording: xr.Dataset,
) -> xr.Dataset:
    """Put what the stages of a calibration left into one dataset, and state the answer."""
    problem, coarse, refined = stages.problem, stages.coarse, stages.refined
    parameters = problem.parameters
    names = tuple(parameter.name for parameter in parameters)
    answer = calibration_parts(_facts(stages, halves, stationarity, recording), parameters)
    data: dict[str, Any] = {
        **answer.data,
        **_map_variables(coarse, names, "", "replicate"),
        **_details(coarse, names),
        **_recording(problem),
    }
    length_edge, angle_edge = _bin_edges(problem)
    coords: dict[str, Any] = {
        **answer.coords,
        **_axes(parameters, coarse.axes, ""),
        "step_length_edge": ("step_length_edge", length_edge),
        "turning_angle_edge": ("turning_angle_edge", angle_edge),
    }
    if refined is not None:
        dims = tuple(f"refined_{name}" for name in names)
        data.update(_map_variables(refined.map, dims, "refined_", "refined_replicate"))
        data["refined_surface"] = (dims, at_settings(refined.energy_score.surface))
        coords.update(_axes(parameters, refined.map.axes, "refined_"))
    if stages.bootstrap is not None and stages.region is not None:
        data.update(_uncertainty(parameters, stages.bootstrap, stages.region))
    if stages.verdict is not None:
        data.update(verdict_variables(stages.verdict))
    return build_dataset("calibration", data, coords, answer.attrs)


def _facts(
    stages: GridCalibration,
    halves: Halves | None,
    stationarity: Stationarity | None,
    recording: xr.Dataset,
) -> dict[str, Any]:
    """Return the point estimate, what the model says of it, and how sure and good it is."""
    problem, point = stages.problem, stages.optimum.point
    lowest = stages.coarse.point(stages.coarse.cell_of_minimum())
    names = [parameter.name for parameter in problem.parameters]
    facts: dict[str, Any] = {
        **_estimate(problem, point),
        **problem.model.facts(dict(zip(names, _values(problem, point), strict=True))),
        "position_noise_m": problem.like.camera.position_noise,
        "orientation_noise_rad": problem.like.camera.orientation_noise,
        "position_quantum_m": problem.like.camera.position_quantum,
        "step_interval_s": float(problem.reference.plan.step_interval),
        "duration_s": problem.duration,
        "recording_pairs": len(problem.steps),
        **_estimate(problem, lowest, "coarse_"),
        "ks_distance": stages.optimum.distance,
        "noise_floor": stages.floor,
        # Without a verdict, what would leave it open is a warning.
        "warnings": stages.warnings if stages.verdict else [*stages.warnings, *stages.unable],
        "recording_name": str(recording.attrs.get("source", "")),
        "simulated_recording": str(recording.attrs.get("simulated", "no")),
        "study": problem.study.to_toml(),
    }
    # Only a bootstrap tells how sure the answer is; its mean distance replaces the surface's.
    quality, region = stages.quality, stages.region
    if quality is not None and region is not None:
        facts |= {
            f"{parameter.key}_interval": [float(parameter.to_value(end)) for end in ends]
            for parameter, ends in zip(problem.parameters, region.intervals, strict=True)
        }
        facts |= {
            "confidence": problem.study.calibration.confidence,
            "ks_distance": quality.distance,
            "ks_distance_standard_error": quality.standard_error,
            "noise_floor_upper": quality.floor_upper,
            "distance_to_floor_ratio": quality.distance / quality.floor,
            "far_above_floor": GOODNESS.far_above_floor,
            "region_level": region.level,
            "interval_stretch": quality.stretch,
        }
    if halves is not None:
        facts |= _estimate(problem, halves.point, "first_half_")
        facts["second_half_ks_distance"] = halves.distance
        facts["second_half_noise_floor"] = halves.floor
    if stationarity is not None:
        facts["halves_ks_distance"] = stationarity.distance
        facts["halves_ks_distance_expected"] = stationarity.expected
        facts["halves_p_value"] = stationarity.p_value
    return facts


def _estimate(problem: Problem, point: Sequence[float], prefix: str = "") -> dict[str, float]:
    """Return a point under the parameters' names with their units."""
    keys = (f"{prefix}{parameter.key}" for parameter in problem.parameters)
    return dict(zip(keys, _values(problem, point), strict=True))


def _values(problem: Problem, point: Sequence[float]) -> list[float]:
    return [
        float(parameter.to_value(coordinate))
        for parameter, coordinate in zip(problem.parameters, point, strict=True)
    ]


def _axes(
    parameters: Sequence[Parameter], axes: Sequence[Floats], prefix: str
) -> dict[str, tuple[str, Floats, dict[str, Any]]]:
    """Return the coordinates of a map. A parameter brings its own unit, name and scale."""
    found = {}
    for parameter, axis in zip(parameters, axes, strict=True):
        facts = {"units": parameter.unit, "long_name": parameter.symbol}
        if parameter.scale != "linear":
            facts["scale"] = parameter.scale
        name = f"{prefix}{parameter.name}"
        found[name] = (name, parameter.to_value(axis), facts)
    return found


def _uncertainty(
    parameters: Sequence[Parameter], bootstrap: Bootstrap, region: Region
) -> dict[str, _Variable]:
    """Return the bootstrap estimates and the border of the joint region."""
    found: dict[str, _Variable] = {
        "bootstrap_ks_distance": (("bootstrap",), bootstrap.to_recording)
    }
    for index, parameter in enumerate(parameters):
        estimates, border = (each[:, index] for each in (bootstrap.estimates, region.border))
        found[f"bootstrap_{parameter.name}"] = (("bootstrap",), parameter.to_value(estimates))
        found[f"region_{parameter.name}"] = (("region_vertex",), parameter.to_value(border))
    return found


def _map_variables(
    found: Map, dims: tuple[str, ...], prefix: str, replicate: str
) -> dict[str, _Variable]:
    status = found.arrays["status"]
    cause = np.zeros(status.shape[:-1], dtype=np.int8)
    still = ((status & STATUS["no_motion"]) > 0) | ~found.simulated
    cause[still.all(axis=-1)] |= CELL_STATUS["no_motion"]
    cause[broken_worlds(status).any(axis=-1)] |= CELL_STATUS["non_finite"]
    cause[found.arrays["pairs"] == 0] |= CELL_STATUS["too_few_steps"]
    return {
        f"{prefix}ks_distance": (dims, found.mean),
        f"{prefix}ks_distance_standard_error": (dims, found.standard_error),
        f"{prefix}ks_distance_replicate": ((*dims, replicate), found.distance),
        f"{prefix}replicate_count": (dims, found.replicates.astype(np.int32)),
        f"{prefix}status": (dims, cause),
    }


def _details(coarse: Map, names: tuple[str, ...]) -> dict[str, _Variable]:
    arrays = coarse.arrays
    place, excerpt = (*names, "replicate"), (*names, "excerpt_sample")
    bins = (*names, "density_step_length", "density_turning_angle")
    return {
        "ks_step_length": (place, arrays["ks_step_length"]),
        "ks_turning_angle": (place, arrays["ks_turning_angle"]),
        "ks_quadrant": (place, arrays["ks_quadrant"].astype(np.int8)),
        "excerpt_x": (excerpt, arrays["excerpt_x"]),
        "excerpt_y": (excerpt, arrays["excerpt_y"]),
        "step_density": (bins, arrays["step_density"].astype(np.float32)),
    }


def _recording(problem: Problem) -> dict[str, _Variable]:
    length, angle = problem.steps.T
    length_edge, angle_edge = _bin_edges(problem)
    density = joint_density(
        length, angle, step_length_edge=length_edge, turning_angle_edge=angle_edge
    )
    bins = ("density_step_length", "density_turning_angle")
    excerpt = problem.like.sample_time[: excerpt_samples(problem.like)]
    return {
        "recording_step_length": (("recording_step",), length),
        "recording_turning_angle": (("recording_step",), angle),
        "recording_step_density": (bins, density.astype(np.float32)),
        "excerpt_time": (("excerpt_sample",), excerpt),
    }


def _bin_edges(problem: Problem) -> tuple[Floats, Floats]:
    """Return the edges of the bins: of step lengths [m], of turning angles [rad]."""
    reference = problem.reference
    return (
        np.linspace(0.0, reference.length_limit, BINS + 1),
        np.linspace(-reference.angle_limit, reference.angle_limit, BINS + 1),
    )
