"""The dataset of the stage calibration: the map of KS distances, and the results read from it.

A calibration has the names, units and labels of its model's parameters, so its description is made
from them. That of the block stands in `KINDS`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from driftwalk.schema.calibration import StoredParameter
from driftwalk.schema.description import SIMULATED, STUDY, WARNINGS, Attribute, Kind, Variable

CELL_STATUS: Final = {"no_motion": 1, "non_finite": 2, "too_few_steps": 4}
"""Why a setting has no ordinary distance, in bits."""
QUADRANTS: Final = {
    "none": -1, "left_below": 0, "right_below": 1, "left_above": 2, "right_above": 3,
}  # fmt: skip

_BLOCK: Final = (
    StoredParameter("drag_coefficient", "1", "C_d", "linear"),
    StoredParameter("force_std", "N", "sigma_F", "linear"),
)
_OF_THE_BLOCK: Final = (
    Attribute("force_interval_s", "number", "how long a force lasts; σ_F depends on it"),
    Attribute("force_noise_intensity_N2_s", "number", "σ_F² times the force interval"),
    Attribute("wetted_depth_m", "number", "depth of the block in the water"),
    Attribute("time_step_s", "number", "step of the integrator"),
)
_OF_ANOTHER_MODEL: Final = (
    Attribute("model", "text", "name of the model", "the model names itself"),
    Attribute("model_source_sha256", "text", "hash of the model's source", "the source is known"),
)
_BINS: Final = "density_step_length density_turning_angle"
_REFINED: Final = "refined"
_BOOTSTRAPPED: Final = "with a bootstrap"


def _map(prefix: str, dims: str, replicate: str, when: str) -> tuple[Variable, ...]:
    return (
        Variable(f"{prefix}ks_distance", dims, "1", "mean KS distance", when=when),
        Variable(
            f"{prefix}ks_distance_standard_error", dims, "1",
            "standard error of the mean KS distance", when=when,
        ),
        Variable(
            f"{prefix}ks_distance_replicate", f"{dims} {replicate}", "1",
            "KS distance of each replicate", when=when,
        ),
        Variable(
            f"{prefix}status", dims, None, "reason why a setting has no ordinary distance", "int",
            when=when, flags=CELL_STATUS, bits=True,
        ),
    )  # fmt: skip


def _axes(parameters: Sequence[StoredParameter], prefix: str, when: str) -> tuple[Variable, ...]:
    names = [(f"{prefix}{one.name}", one) for one in parameters]
    return tuple(Variable(name, name, one.unit, one.label, when=when) for name, one in names)


def _each(
    parameters: Sequence[StoredParameter], prefix: str, dim: str, words: str
) -> tuple[Variable, ...]:
    """Return a variable per parameter, all along the same dimension."""
    return tuple(
        Variable(
            f"{prefix}{one.name}", dim, one.unit, f"{one.label} {words}", when=_BOOTSTRAPPED
        )
        for one in parameters
    )  # fmt: skip


def _details(grid: str) -> tuple[Variable, ...]:
    """Return what is kept of every setting of the coarse map."""
    return (
        Variable(
            "ks_step_length", f"{grid} replicate", "m",
            "step length at which the KS maximum sits",
        ),
        Variable(
            "ks_turning_angle", f"{grid} replicate", "rad",
            "turning angle at which the KS maximum sits",
        ),
        Variable(
            "ks_quadrant", f"{grid} replicate", None, "quadrant of the KS maximum", "int",
            flags=QUADRANTS,
        ),
        Variable("step_density", f"{grid} {_BINS}", "1", "share of the steps in a bin"),
        Variable(
            "excerpt_x", f"{grid} excerpt_sample", "m", "position x, first seconds of replicate 0"
        ),
        Variable(
            "excerpt_y", f"{grid} excerpt_sample", "m", "position y, first seconds of replicate 0"
        ),
        Variable("excerpt_time", "excerpt_sample", "s", "time of the excerpt's samples"),
    )  # fmt: skip


_RECORDING: Final = (
    Variable("recording_step_length", "recording_step", "m", "step length of the recording"),
    Variable(
        "recording_turning_angle", "recording_step", "rad",
        "turning angle (step angle) of the recording",
    ),
    Variable("recording_step_density", _BINS, "1", "share of the recording's steps in a bin"),
    Variable(
        "step_length_edge", "step_length_edge", "m",
        "edges of the step-length bins; the last bin holds all longer steps",
    ),
    Variable(
        "turning_angle_edge", "turning_angle_edge", "rad",
        "edges of the turning-angle bins; the outer bins hold all beyond",
    ),
)  # fmt: skip


def _estimates(
    keys: Sequence[str], prefix: str, meaning: str, when: str = ""
) -> tuple[Attribute, ...]:
    return tuple(Attribute(f"{prefix}{key}", "number", meaning, when) for key in keys)


def _attributes(
    parameters: Sequence[StoredParameter], facts: tuple[Attribute, ...]
) -> tuple[Attribute, ...]:
    keys = [one.key for one in parameters]
    level = "[low, high] at the confidence"
    return (
        *_estimates(keys, "", "the optimum"),
        *(Attribute(f"{key}_interval", "numbers", level, _BOOTSTRAPPED) for key in keys),
        Attribute("confidence", "number", "of the intervals", _BOOTSTRAPPED),
        *facts,
        Attribute("ks_distance", "number", "distance at the optimum"),
        Attribute("ks_distance_standard_error", "number", "its standard error", _BOOTSTRAPPED),
        Attribute("noise_floor", "number", "distance of two realisations of the optimum"),
        Attribute("noise_floor_upper", "number", "95 % quantile of that", _BOOTSTRAPPED),
        Attribute("distance_to_floor_ratio", "number", "how good the fit is", _BOOTSTRAPPED),
        Attribute("far_above_floor", "number", "ratio that is warned of", _BOOTSTRAPPED),
        *_estimates(keys, "coarse_", "best setting of the coarse map"),
        *_estimates(keys, "first_half_", "fitted on the first half", _REFINED),
        Attribute("second_half_ks_distance", "number", "tested on the second half", _REFINED),
        Attribute("second_half_noise_floor", "number", "tested on the second half", _REFINED),
        Attribute("region_level", "number", "distance at the border of the region", _BOOTSTRAPPED),
        Attribute("interval_stretch", "number", "factor of the intervals", _BOOTSTRAPPED),
        Attribute("position_noise_m", "number", "noise of the simulated camera"),
        Attribute("orientation_noise_rad", "number", "noise of the simulated camera"),
        Attribute("position_quantum_m", "number", "rounding of the simulated camera"),
        Attribute("step_interval_s", "number", "time of a step"),
        Attribute("duration_s", "number", "of the recording"),
        Attribute("recording_pairs", "number", "steps of the recording"),
        Attribute("recording_name", "text", "name of the recording"),
        WARNINGS,
        SIMULATED,
        STUDY,
    )


def _calibration(
    parameters: Sequence[StoredParameter], facts: tuple[Attribute, ...], read: str
) -> Kind:
    names = [one.name for one in parameters]
    grid = " ".join(names)
    fine = " ".join(f"refined_{name}" for name in names)
    return Kind(
        name="calibration",
        version=1,
        dimensions={
            **dict.fromkeys(names, "coarse map, by the parameter's name"),
            **dict.fromkeys(fine.split(), "refined map"),
            "replicate": "simulations of a setting",
            "refined_replicate": "simulations of a setting of the refined map",
            "excerpt_sample": "samples of the first seconds",
            "density_step_length": "bins",
            "density_turning_angle": "bins",
            "step_length_edge": "edges of the bins",
            "turning_angle_edge": "edges of the bins",
            "recording_step": "steps of the recording",
            "bootstrap": "simulated recordings of the bootstrap",
            "region_vertex": "border of the joint region",
        },
        variables=(
            *_map("", grid, "replicate", ""),
            *_axes(parameters, "", ""),
            *_details(grid),
            *_RECORDING,
            *_map("refined_", fine, "refined_replicate", _REFINED),
            *_axes(parameters, "refined_", _REFINED),
            Variable(
                "refined_surface", fine, "1", "smooth surface through the refined distances",
                when=_REFINED,
            ),
            *_each(
                parameters, "bootstrap_", "bootstrap",
                "estimated from a recording simulated at the optimum",
            ),
            Variable(
                "bootstrap_ks_distance", "bootstrap", "1",
                "KS distance of a recording simulated at the optimum to the real one",
                when=_BOOTSTRAPPED,
            ),
            *_each(parameters, "region_", "region_vertex", "at the border of the joint region"),
        ),
        attributes=_attributes(parameters, facts),
        read=f"ks_distance {grid}",
        read_attributes=f"{' '.join(one.key for one in parameters)} {read}",
    )  # fmt: skip


CALIBRATION: Final = _calibration(_BLOCK, _OF_THE_BLOCK, "force_interval_s study warnings")


def calibration_of(parameters: Sequence[StoredParameter]) -> Kind:
    """Return the description of a calibration of another model than the block.

    Parameters
    ----------
    parameters : sequence of StoredParameter
        Its parameters, in the order of the dimensions.

    Examples
    --------
    >>> kind = calibration_of([StoredParameter("speed", "m/s", "speed", "linear")])
    >>> kind.variable("bootstrap_speed").units, kind.read_attributes
    ('m/s', 'speed_m_s study warnings')
    """
    return _calibration(parameters, _OF_ANOTHER_MODEL, "study warnings")


KINDS: Final = (CALIBRATION,)
