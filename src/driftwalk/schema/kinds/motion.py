"""Datasets of recorded and simulated motion, of its steps, and of the distance between motions."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import (
    ARENA,
    SOURCE,
    STUDY,
    WARNINGS,
    Attribute,
    Kind,
    Variable,
)
from driftwalk.schema.kinds.flow_series import FLOW_SERIES, began_in_flow

WORLD_STATUS: Final = {"non_finite": 1, "escaped": 2, "no_motion": 4}
"""Bits of a simulated world's status; 0 is sound."""

_FILE: Final = "read from a file"
_STATED: Final = "it was stated"
_TRACKED: Final = "tracked videos"

TRAJECTORY: Final = Kind(
    name="trajectory",
    version=1,
    dimensions={
        "time": "samples, at the union of the bodies' clocks",
        "body": "bodies, by name",
        "part": "xx, xy, yy, xtheta, ytheta, thetatheta",
    },
    variables=(
        Variable(
            "x", "time body", "m", "position x",
            note="the arena's centre is the origin; NaN is a gap",
        ),
        Variable("y", "time body", "m", "position y", note="y is up"),
        Variable(
            "theta", "time body", "rad", "orientation",
            note="counter-clockwise, in (-π, π]; NaN where it is unknown",
        ),
        Variable("time", "time", "s", "time", note="increases"),
        Variable("body", "body", None, "body", "text"),
        Variable(
            "ambiguous", "time body", "1", "score of the best other assignment of identities",
            when=_TRACKED, note="above 0 where identities could have been exchanged",
        ),
        Variable(
            "covariance", "time body part", "m, m, rad", "covariance of the measurement",
            when=_TRACKED, note="in m², m rad and rad²",
        ),
        Variable("part", "part", None, "part of the covariance", "text", when=_TRACKED),
    ),
    attributes=(
        Attribute("source", "text", SOURCE.meaning, _FILE),
        Attribute("format", "text", "format of the file", _FILE),
        Attribute("sample_rate_Hz", "number", "usual sampling rate", _FILE),
        Attribute("position_quantum_m", "number", "resolution of the file, 0 where unknown", _FILE),
        Attribute("metres_per_pixel", "number", "scale that was given", "positions in pixels"),
        Attribute("y_axis", "text", "which way y ran, and what was done about it", _FILE),
        Attribute("arena", "object", ARENA.meaning, "the tank is known"),
        Attribute("arena_found", "object", "how the tank was found", "the tank is known"),
        Attribute("origin_shift_m", "list", "offset that was subtracted from the positions", _FILE),
        Attribute("block_side_m", "number", "side of the block", _STATED),
        Attribute("block_mass_kg", "number", "mass of the block", _STATED),
        Attribute("block_depth_m", "number", "wetted depth of a side face", _STATED),
        Attribute("block_depth", "text", "immersed or archimedes, instead of a length", _STATED),
        Attribute("bodies_apart", "yes or no", "whether each has a tank of its own", "it has"),
        Attribute("counts", "object", "counts of what cleaning did", _FILE),
        Attribute("simulated", "yes or no", "whether a model made the motion", "simulated"),
        Attribute("tracked_from", "text", "the video or camera", _TRACKED),
        Attribute("complete", "yes or no", "whether tracking reached the end", _TRACKED),
        Attribute("interrupted", "text", "reason why tracking broke off", "tracking broke off"),
        Attribute(
            "tracking_counts", "object",
            "frames, dropped, duplicates, stale, what was rejected", _TRACKED,
        ),
    ),
    read="x y theta time body",
)  # fmt: skip

_BLOCK: Final = "the block"
_OTHER: Final = "another motion model"

SIMULATION: Final = Kind(
    name="simulation",
    version=1,
    dimensions={"replicate": "simulated worlds", "time": "samples", "body": "the block or body"},
    variables=(
        Variable("x", "replicate time body", "m", "position x"),
        Variable("y", "replicate time body", "m", "position y"),
        Variable(
            "theta", "replicate time body", "rad", "orientation",
            note="in (-π, π]; NaN where a model has none",
        ),
        Variable(
            "status", "replicate", None, "problems in a world", "int",
            note="0 is sound", flags=WORLD_STATUS, bits=True,
        ),
        Variable("time", "time", "s", "time"),
        Variable("body", "body", None, "body", "text"),
        Variable("replicate", "replicate", None, "replicate", "int"),
        began_in_flow("replicate"),
    ),
    attributes=(
        ARENA,
        Attribute("drag_coefficient", "number", "drag coefficient C_d", _BLOCK),
        Attribute("force_std_N", "number", "standard deviation σ_F of the force", _BLOCK),
        Attribute("force_interval_s", "number", "how long a force lasts", _BLOCK),
        Attribute("force_noise_intensity_N2_s", "number", "σ_F² times the force interval", _BLOCK),
        Attribute("backend", "text", "what computed it", _BLOCK),
        Attribute("model", "text", "name of the motion model", _OTHER),
        Attribute(
            "model_parameters", "object", "value of each parameter, by its name with the unit",
            _OTHER,
        ),
        Attribute(
            "model_source_sha256", "text", "hash of the model's source",
            f"{_OTHER}, and its source is known",
        ),
        Attribute(
            "time_step_s", "number", "step of the integrator", "the block, or one of the family"
        ),
        Attribute("seed", "number", "seed of the random numbers"),
        STUDY,
        *FLOW_SERIES,
    ),
    read="x y theta time body",
)  # fmt: skip

_CUT: Final = "cut from a recording"

STEPS: Final = Kind(
    name="steps",
    version=1,
    dimensions={"step": "pairs of a step and the turn before it"},
    variables=(
        Variable("step_length", "step", "m", "step length", note="above 0"),
        Variable("turning_angle", "step", "rad", "turning angle", note="in (-π, π]"),
        Variable("time", "step", "s", "time", note="when the step begins"),
    ),
    attributes=(
        Attribute("body", "text", "whose steps", _CUT),
        Attribute("step_interval_s", "number", "time of a step", _CUT),
        Attribute("mode", "text", '"exact": samples one interval apart; else "interpolated"', _CUT),
        Attribute("samples", "number", "samples of the motion", _CUT),
        Attribute("pairs", "number", "steps", _CUT),
        Attribute("zero_length", "number", "pairs left out because a step had no length", _CUT),
        Attribute("gaps", "number", "pairs left out at a gap", _CUT),
        Attribute("irregular_intervals", "number", "intervals of another length", _CUT),
        Attribute("warnings", "list", WARNINGS.meaning, _CUT),
    ),
    read="step_length turning_angle time",
)  # fmt: skip

_BINS: Final = "density_step_length density_turning_angle"

COMPARISON: Final = Kind(
    name="comparison",
    version=1,
    dimensions={
        "motion": "a, b",
        "density_step_length": "bins",
        "density_turning_angle": "bins",
        "step_length_edge": "edges of the bins",
        "turning_angle_edge": "edges of the bins",
    },
    variables=(
        Variable("ks_distance", "", "1", "KS distance"),
        Variable("ks_distance_a", "", "1", "KS distance, origins in a"),
        Variable("ks_distance_b", "", "1", "KS distance, origins in b"),
        Variable("score", "", "1", "1 - KS distance"),
        Variable("ks_step_length", "", "m", "step length at which the KS maximum sits"),
        Variable("ks_turning_angle", "", "rad", "turning angle at which the KS maximum sits"),
        Variable("ks_quadrant", "", None, "quadrant of the maximum", "int"),
        Variable("tied_fraction", "", "1", "share of points that share a coordinate"),
        Variable("p_value", "", "1", "p value of the permutation test", note="NaN without it"),
        Variable("noise_floor", "", "1", "median KS distance of the permutations"),
        Variable("block_length", "", "1", "steps in a block of the permutation test", "int"),
        Variable("autocorrelation_time", "", "1", "autocorrelation time in steps"),
        Variable("pairs", "motion", "1", "steps", "int"),
        Variable("zero_length", "motion", "1", "pairs left out for a step of no length", "int"),
        Variable("gaps", "motion", "1", "pairs left out at a gap", "int"),
        Variable("mode", "motion", None, "how the steps were cut", "text"),
        Variable("mean_step_length", "motion", "m", "mean step length"),
        Variable("median_step_length", "motion", "m", "median step length"),
        Variable("std_turning_angle", "motion", "rad", "standard deviation of the turning angle"),
        Variable("step_density", f"motion {_BINS}", "1", "fraction of steps"),
        Variable("motion", "motion", None, "motion", "text"),
        Variable("step_length_edge", "step_length_edge", "m", "edges of the step-length bins"),
        Variable(
            "turning_angle_edge", "turning_angle_edge", "rad", "edges of the turning-angle bins"
        ),
    ),
    attributes=(
        Attribute("step_interval_s", "number", "time of a step"),
        Attribute("permutations", "number", "permutations of the test"),
        Attribute("seed", "number", "seed of the permutations"),
        Attribute("ties", "text", "how points that share a coordinate are counted"),
        WARNINGS,
    ),
)  # fmt: skip

REPLICATE_COMPARISON: Final = Kind(
    name="replicate_comparison",
    version=1,
    dimensions={"replicate": "simulations of the recording"},
    variables=(
        Variable(
            "ks_distance", "replicate", "1", "KS distance of a replicate to the recording"
        ),
        Variable(
            "mean_ks_distance", "", "1", "mean KS distance of the replicates to the recording"
        ),
        Variable("noise_floor", "", "1", "mean KS distance of two replicates"),
        Variable(
            "p_value", "", "1", "share of motions as far from the others as the recording"
        ),
        Variable("replicate", "replicate", None, "replicate", "int"),
    ),
    attributes=(
        Attribute("step_interval_s", "number", "time of a step"),
        Attribute("ties", "text", "how points that share a coordinate are counted"),
    ),
)  # fmt: skip

KINDS: Final = (TRAJECTORY, SIMULATION, STEPS, COMPARISON, REPLICATE_COMPARISON)
