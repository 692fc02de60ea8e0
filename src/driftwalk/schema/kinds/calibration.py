"""The dataset of the stage calibration: the map of KS distances, and the results read from it.

A calibration has the names, units and labels of its model's parameters, so its description is made
from them. That of the block stands in `KINDS`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from driftwalk.schema.calibration import StoredParameter
from driftwalk.schema.description import SIMULATED, STUDY, Attribute, Kind, Variable

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
    Variable(
        "force_interval", "", "s", "time after which a force is redrawn",
        note="σ_F depends on it",
    ),
    Variable("force_noise_intensity", "", "N2 s", "σ_F² times the force interval"),
    Variable("wetted_depth", "", "m", "depth of the block in the water"),
    Variable("time_step", "", "s", "step of the integrator"),
)  # fmt: skip
_OF_ANOTHER_MODEL: Final = (
    Attribute("model", "text", "name of the model", "the model names itself"),
    Attribute("model_source_sha256", "text", "hash of the model's source", "the source is known"),
)
OPTIMUM: Final = "optimum_"
"""In front of the distance at the optimum: the map's own has the plain name."""
_BINS: Final = "density_step_length density_turning_angle"
_REFINED: Final = "refined"
_BOOTSTRAPPED: Final = "with a bootstrap"
_LONG: Final = "200 pairs of steps or more"


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
            note="NaN beyond the replicates that the setting has",
        ),
        Variable(
            f"{prefix}replicate_count", dims, "1", "replicates of a setting", "int", when=when,
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


_ANSWER: Final = (
    Variable(
        "estimate", "parameter", None, "estimates of the parameters",
        note="the optimum, in the units of the coordinate unit",
    ),
    Variable(
        "interval", "parameter bound", None, "intervals of the parameters",
        when=_BOOTSTRAPPED, note="at the confidence",
    ),
    Variable("coarse_estimate", "parameter", None, "best setting of the coarse map"),
    Variable(
        "first_half_estimate", "parameter", None, "estimates from the first half of the recording",
        when=_REFINED,
    ),
    Variable("parameter", "parameter", None, "parameter", "text"),
    Variable("unit", "parameter", None, "unit of the parameter", "text"),
    Variable("bound", "bound", None, "end of an interval", "text", when=_BOOTSTRAPPED),
    Variable("warning", "warning", None, "evidence against the calibration", "text"),
    Variable(
        "explained", "", None, "whether the model explains the recording", "bool",
        when=_BOOTSTRAPPED, note="a distance near the floor is no proof",
    ),
    Variable("confidence", "", "1", "confidence of the intervals", when=_BOOTSTRAPPED),
    Variable(f"{OPTIMUM}ks_distance", "", "1", "KS distance at the optimum"),
    Variable(
        f"{OPTIMUM}ks_distance_standard_error", "", "1", "its standard error", when=_BOOTSTRAPPED
    ),
    Variable("noise_floor", "", "1", "KS distance of two realisations of the optimum"),
    Variable("noise_floor_upper", "", "1", "its 95 % quantile", when=_BOOTSTRAPPED),
    Variable(
        "distance_to_floor_ratio", "", "1", "KS distance at the optimum over the noise floor",
        when=_BOOTSTRAPPED,
    ),
    Variable("far_above_floor", "", "1", "ratio that is warned of", when=_BOOTSTRAPPED),
    Variable(
        "second_half_ks_distance", "", "1",
        "KS distance of the estimates from the first half to the second", when=_REFINED,
    ),
    Variable("second_half_noise_floor", "", "1", "noise floor of the second half", when=_REFINED),
    Variable(
        "halves_ks_distance", "", "1", "KS distance between the recording's own two halves",
        when=_LONG,
    ),
    Variable(
        "halves_ks_distance_expected", "", "1",
        "the same between halves of parts drawn at random, the median", when=_LONG,
    ),
    Variable(
        "halves_p_value", "", "1", "share of the drawn halves that differ as much", when=_LONG,
        note="at 0.005 the motion is not steady",
    ),
    Variable(
        "region_level", "", "1", "KS distance at the border of the joint region",
        when=_BOOTSTRAPPED,
    ),
    Variable(
        "interval_stretch", "", "1", "factor by which the intervals are widened",
        when=_BOOTSTRAPPED,
    ),
    Variable("position_noise", "", "m", "position noise of the simulated camera"),
    Variable("orientation_noise", "", "rad", "orientation noise of the simulated camera"),
    Variable("position_quantum", "", "m", "rounding of the simulated camera"),
    Variable("step_interval", "", "s", "time of a step"),
    Variable("duration", "", "s", "length of the recording"),
    Variable("recording_pairs", "", "1", "steps of the recording", "int"),
)  # fmt: skip


def _calibration(
    parameters: Sequence[StoredParameter],
    facts: tuple[Variable, ...],
    attributes: tuple[Attribute, ...],
    read: str = "",
) -> Kind:
    names = [one.name for one in parameters]
    grid = " ".join(names)
    fine = " ".join(f"refined_{name}" for name in names)
    return Kind(
        name="calibration",
        version=3,
        dimensions={
            "parameter": "parameters of the model, by name",
            "bound": "lower, upper",
            "warning": "sentences",
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
            *_ANSWER,
            *facts,
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
        attributes=(
            *attributes,
            Attribute("recording_name", "text", "name of the recording"),
            SIMULATED,
            STUDY,
        ),
        read=f"ks_distance {grid} estimate parameter {read}",
        read_attributes="study",
    )  # fmt: skip


CALIBRATION: Final = _calibration(_BLOCK, _OF_THE_BLOCK, (), "force_interval")


def calibration_of(parameters: Sequence[StoredParameter]) -> Kind:
    """Return the description of a calibration of another model than the block.

    Parameters
    ----------
    parameters : sequence of StoredParameter
        Its parameters, in the order of the dimensions.

    Examples
    --------
    >>> kind = calibration_of([StoredParameter("speed", "m/s", "speed", "linear")])
    >>> kind.variable("bootstrap_speed").units, kind.read.split()
    ('m/s', ['ks_distance', 'speed', 'estimate', 'parameter'])
    """
    return _calibration(parameters, (), _OF_ANOTHER_MODEL)


KINDS: Final = (CALIBRATION,)
