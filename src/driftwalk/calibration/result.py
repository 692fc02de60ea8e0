"""The `calibration` dataset: everything that a calibration found, in one file.

Coarse map on the model's parameters by name, ``(drag_coefficient, force_std[, replicate])`` for the
block, refined map on the same names with the prefix ``refined_``, what is kept of every setting
(excerpt, step density, place of the KS maximum), the recording's own steps, the bootstrap and the
joint region. The answer stands in ``attrs``, under the parameters' names with their units.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.problem import Floats, Problem
from driftwalk.calibration.search import Map
from driftwalk.motion.score import DENSITY_BINS, broken_worlds, excerpt_samples
from driftwalk.schema import Parameter
from driftwalk.schema.kinds import KINDS
from driftwalk.schema.kinds.calibration import CELL_STATUS
from driftwalk.simulation.backend import STATUS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.calibration.region import Bootstrap, Region


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

    parameters = problem.parameters
    names = tuple(parameter.name for parameter in parameters)
    reference = problem.reference
    data: dict[str, _Variable] = {
        **_map_variables(coarse, names, "", "replicate"),
        **_details(coarse, names),
        **_recording(problem),
    }
    coords: dict[str, Any] = {
        **_axes(parameters, coarse.axes, ""),
        "step_length_edge": (
            "step_length_edge",
            np.linspace(0.0, reference.length_limit, DENSITY_BINS + 1),
            _units("m", "edges of the step-length bins; the last bin holds all longer steps"),
        ),
        "turning_angle_edge": (
            "turning_angle_edge",
            np.linspace(-reference.angle_limit, reference.angle_limit, DENSITY_BINS + 1),
            _units("rad", "edges of the turning-angle bins; the outer bins hold all beyond"),
        ),
    }
    if refined is not None and surface is not None:
        dims = tuple(f"refined_{name}" for name in names)
        data.update(_map_variables(refined, dims, "refined_", "refined_replicate"))
        data["refined_surface"] = (
            dims,
            surface,
            _units("1", "smooth surface through the refined distances"),
        )
        coords.update(_axes(parameters, refined.axes, "refined_"))
    return xr.Dataset(
        data,
        coords,
        {"kind": "calibration", "schema_version": KINDS["calibration"].version, **attrs},
    )


def _axes(
    parameters: Sequence[Parameter], axes: Sequence[Floats], prefix: str
) -> dict[str, tuple[str, Floats, dict[str, Any]]]:
    """Return the coordinates of a map, in the units of the parameters."""
    found = {}
    for parameter, axis in zip(parameters, axes, strict=True):
        facts = _units(parameter.unit, parameter.symbol)
        if parameter.scale != "linear":
            facts["scale"] = parameter.scale
        name = f"{prefix}{parameter.name}"
        found[name] = (name, parameter.to_value(axis), facts)
    return found


def add_uncertainty(
    dataset: xr.Dataset, problem: Problem, bootstrap: Bootstrap, region: Region
) -> xr.Dataset:
    """Return the calibration with its bootstrap estimates and joint region."""
    estimates: dict[str, _Variable] = {}
    border: dict[str, _Variable] = {}
    for index, parameter in enumerate(problem.parameters):
        words = f"{parameter.symbol} estimated from a recording simulated at the optimum"
        estimates[f"bootstrap_{parameter.name}"] = (
            ("bootstrap",),
            parameter.to_value(bootstrap.estimates[:, index]),
            _units(parameter.unit, words),
        )
        border[f"region_{parameter.name}"] = (
            ("region_vertex",),
            parameter.to_value(region.border[:, index]),
            _units(parameter.unit, f"{parameter.symbol} at the border of the joint region"),
        )
    to_recording: _Variable = (
        ("bootstrap",),
        bootstrap.to_recording,
        _units("1", "KS distance of a recording simulated at the optimum to the real one"),
    )
    return dataset.assign({**estimates, "bootstrap_ks_distance": to_recording, **border})


def answer_attrs(problem: Problem, point: Sequence[float]) -> dict[str, Any]:
    """Return the point estimate as attributes, with what the model says of it."""
    estimate = dict(
        zip((one.name for one in problem.parameters), _values(problem, point), strict=True)
    )
    return {
        **estimate_attrs(problem, point),
        **problem.model.facts(estimate),
        "position_noise_m": problem.like.camera.position_noise,
        "orientation_noise_rad": problem.like.camera.orientation_noise,
        "position_quantum_m": problem.like.camera.position_quantum,
        "step_interval_s": float(problem.reference.plan.step_interval),
        "duration_s": problem.duration,
        "recording_pairs": len(problem.steps),
    }


def estimate_attrs(problem: Problem, point: Sequence[float], prefix: str = "") -> dict[str, float]:
    """Return a point as attributes: the parameters' names with their units."""
    keys = (f"{prefix}{parameter.key}" for parameter in problem.parameters)
    return dict(zip(keys, _values(problem, point), strict=True))


def interval_attrs(problem: Problem, region: Region) -> dict[str, list[float]]:
    """Return the intervals as attributes."""
    return {
        f"{parameter.key}_interval": [float(parameter.to_value(end)) for end in ends]
        for parameter, ends in zip(problem.parameters, region.intervals, strict=True)
    }


def _values(problem: Problem, point: Sequence[float]) -> list[float]:
    return [
        float(parameter.to_value(coordinate))
        for parameter, coordinate in zip(problem.parameters, point, strict=True)
    ]


def as_json(values: Any) -> str:
    """Return a value as the JSON text of an attribute."""
    return json.dumps(values)


def _map_variables(
    found: Map, dims: tuple[str, ...], prefix: str, replicate: str
) -> dict[str, _Variable]:
    status = found.arrays["status"]
    cause = np.zeros(status.shape[:-1], dtype=np.int8)
    cause[(status & STATUS["no_motion"]).all(axis=-1) > 0] |= CELL_STATUS["no_motion"]
    cause[broken_worlds(status).any(axis=-1)] |= CELL_STATUS["non_finite"]
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


def _details(coarse: Map, names: tuple[str, ...]) -> dict[str, _Variable]:
    arrays = coarse.arrays
    place = (*names, "replicate")
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
            (*names, "excerpt_sample"),
            arrays["excerpt_x"],
            _units("m", "position x, first seconds of replicate 0"),
        ),
        "excerpt_y": (
            (*names, "excerpt_sample"),
            arrays["excerpt_y"],
            _units("m", "position y, first seconds of replicate 0"),
        ),
        "step_density": (
            (*names, "density_step_length", "density_turning_angle"),
            arrays["step_density"].astype(np.float32),
            _units("1", "share of the steps in a bin"),
        ),
    }


def _recording(problem: Problem) -> dict[str, _Variable]:
    length, angle = problem.steps.T
    reference = problem.reference
    bins = [
        np.linspace(0.0, reference.length_limit, DENSITY_BINS + 1),
        np.linspace(-reference.angle_limit, reference.angle_limit, DENSITY_BINS + 1),
    ]
    density, _, _ = np.histogram2d(
        np.clip(length, 0.0, reference.length_limit),
        np.clip(angle, -reference.angle_limit, reference.angle_limit),
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
            problem.like.sample_time[: excerpt_samples(problem.like)],
            _units("s", "time of the excerpt's samples"),
        ),
    }


def _units(units: str, long_name: str) -> dict[str, Any]:
    return {"units": units, "long_name": long_name}
