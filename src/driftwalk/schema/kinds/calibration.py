"""Datasets of calibrations, and of the comparison of motion models.

A calibration of one or two parameters holds the map of KS distances and the results read from it;
it has the names, units and labels of its model's parameters, so its description is made from them.
That of the block stands in `KINDS`. A calibration of more parameters is a kind of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from driftwalk.schema.description import Kind, Variable, kind
from driftwalk.schema.parameters import StoredParameter

CELL_STATUS: Final = {"no_motion": 1, "non_finite": 2, "too_few_steps": 4}
"""Why a setting has no ordinary distance, in bits."""
QUADRANTS: Final = {
    name: at - 1
    for at, name in enumerate(("none", "left_below", "right_below", "left_above", "right_above"))
}
"""Quadrants about the point of the largest difference, as the native core numbers them."""

_BLOCK: Final = (
    StoredParameter("drag_coefficient", "1", "C_d", "linear"),
    StoredParameter("force_std", "N", "sigma_F", "linear"),
)
_OF_THE_BLOCK: Final = """
    force_interval [s]: time after which a force is redrawn; σ_F depends on it
    force_noise_intensity [N2 s]: σ_F² times the force interval
    wetted_depth [m]: depth of the block in the water
    time_step [s]: step of the integrator
"""
_OF_ANOTHER_MODEL: Final = """
attributes (the model names itself):
    model text: name of the model
attributes (the source is known):
    model_source_sha256 text: hash of the model's source
"""
OPTIMUM: Final = "optimum_"
"""In front of the distance at the optimum: the map's own has the plain name."""
_BINS: Final = "density_step_length density_turning_angle"
_REFINED: Final = "refined"
_BOOTSTRAPPED: Final = "with a bootstrap"
_OF_BOOTSTRAP: Final = "estimated from a recording simulated at the optimum"


def _map(prefix: str, grid: str, replicate: str) -> str:
    return f"""
    {prefix}ks_distance({grid}) [1]: mean KS distance
    {prefix}ks_distance_standard_error({grid}) [1]: standard error of the mean KS distance
    {prefix}ks_distance_replicate({grid} {replicate}) [1]: KS distance of each replicate; NaN \
        beyond the replicates that the setting has
    {prefix}replicate_count({grid}) [1] int: replicates of a setting
    {prefix}status({grid}) bits: reason why a setting has no ordinary distance
"""


def _axes(parameters: Sequence[StoredParameter], prefix: str, when: str) -> list[Variable]:
    names = [(f"{prefix}{one.name}", one) for one in parameters]
    return [Variable(name, name, one.unit, one.label, when=when) for name, one in names]


def _each(
    parameters: Sequence[StoredParameter], prefix: str, dim: str, words: str
) -> list[Variable]:
    """Return a variable per parameter, all along the same dimension."""
    return [
        Variable(f"{prefix}{one.name}", dim, one.unit, f"{one.label} {words}", when=_BOOTSTRAPPED)
        for one in parameters
    ]


def _calibration(
    parameters: Sequence[StoredParameter], facts: str, more: str = "", read: str = ""
) -> Kind:
    # A file of another program may have any names; a row of the text is one line.
    names = ["_".join(one.name.split()) for one in parameters]
    fine_names = [f"refined_{name}" for name in names]
    grid, fine = " ".join(names), " ".join(fine_names)
    axes = [f"{name}: coarse map, by the parameter's name" for name in names]
    rows = "\n".join([*axes, *(f"{name}: refined map" for name in fine_names)])
    return kind(
        f"""
kind: calibration
version: 4
read: ks_distance {grid} estimate parameter {read}
read_attributes: study
dimensions:
    parameter text: parameters of the model, by name
    bound: lower, upper
    <warning|verdict_reason>: sentences
    {rows}
    replicate: simulations of a setting
    refined_replicate: simulations of a setting of the refined map
    excerpt_sample: samples of the first seconds
    density_<step_length|turning_angle>: bins
    <step_length|turning_angle>_edge: edges of the bins
    recording_step: steps of the recording
    bootstrap: simulated recordings of the bootstrap
    region_vertex: border of the joint region
variables:
    estimate(parameter): estimates of the parameters; the optimum, in the units of the coordinate \
        unit
    coarse_estimate(parameter): best setting of the coarse map
    unit(parameter) text: unit of the parameter
    warning(warning) text: evidence against the calibration
    {OPTIMUM}ks_distance [1]: KS distance at the optimum
    noise_floor [1]: KS distance of two realisations of the optimum
    <position|orientation>_noise [<m|rad>]: <position|orientation> noise of the simulated camera
    position_quantum [m]: rounding of the simulated camera
    step_interval [s]: time of a step
    duration [s]: length of the recording
    recording_pairs [1] int: steps of the recording
    {facts}
    {_map("", grid, "replicate")}
    ks_step_length({grid} replicate) [m]: step length at which the KS maximum sits
    ks_turning_angle({grid} replicate) [rad]: turning angle at which the KS maximum sits
    ks_quadrant({grid} replicate) flags: quadrant of the KS maximum
    step_density({grid} {_BINS}) [1]: share of the steps in a bin
    excerpt_<x|y>({grid} excerpt_sample) [m]: position <x|y>, first seconds of replicate 0
    excerpt_time(excerpt_sample) [s]: time of the excerpt's samples
    recording_step_length(recording_step) [m]: step length of the recording
    recording_turning_angle(recording_step) [rad]: turning angle (step angle) of the recording
    recording_step_density({_BINS}) [1]: share of the recording's steps in a bin
    step_length_edge(step_length_edge) [m]: edges of the step-length bins; the last bin holds all \
        longer steps
    turning_angle_edge(turning_angle_edge) [rad]: edges of the turning-angle bins; the outer bins \
        hold all beyond
variables ({_BOOTSTRAPPED}):
    interval(parameter bound): intervals of the parameters; at the confidence
    bound(bound) text: end of an interval
    verdict text: whether the model explains the recording; "explains", "does not explain" or \
        "cannot tell"
    verdict_reason(verdict_reason) text: reason for the verdict
    confidence [1]: confidence of the intervals
    {OPTIMUM}ks_distance_standard_error [1]: its standard error
    noise_floor_upper [1]: its 95 % quantile
    distance_to_floor_ratio [1]: KS distance at the optimum over the noise floor
    far_above_floor [1]: ratio that is warned of
    region_level [1]: KS distance at the border of the joint region
    interval_stretch [1]: factor by which the intervals are widened
    bootstrap_ks_distance(bootstrap) [1]: KS distance of a recording simulated at the optimum to \
        the real one
variables ({_REFINED}):
    first_half_estimate(parameter): estimates from the first half of the recording
    second_half_ks_distance [1]: KS distance of the estimates from the first half to the second
    second_half_noise_floor [1]: noise floor of the second half
    {_map("refined_", fine, "refined_replicate")}
    refined_surface({fine}) [1]: smooth surface through the refined distances
variables (200 pairs of steps or more):
    halves_ks_distance [1]: KS distance between the recording's own two halves
    halves_ks_distance_expected [1]: the same between halves of parts drawn at random, the median
    halves_p_value [1]: share of the drawn halves that differ as much; at 0.005 the motion is not \
        steady
attributes:
    recording_name text: name of the recording
    <simulated_recording|study>
{more}
""",
        *_axes(parameters, "", ""),
        *_axes(parameters, "refined_", _REFINED),
        *_each(parameters, "bootstrap_", "bootstrap", _OF_BOOTSTRAP),
        *_each(parameters, "region_", "region_vertex", "at the border of the joint region"),
        flags={"status": CELL_STATUS, "refined_status": CELL_STATUS, "ks_quadrant": QUADRANTS},
    )


CALIBRATION: Final = _calibration(_BLOCK, _OF_THE_BLOCK, read="force_interval")


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
    return _calibration(parameters, "", _OF_ANOTHER_MODEL)


_RECORDED: Final = """
    own_distance(aspect) [1]: KS distance of the recording's own parts; mean over parts of \
        interleaved blocks
    floor(aspect) [1]: distance of the recording from itself; between random halves of its odd \
        blocks, over √2
    check_recorded(check): fact of the recording
    check_unit(check) text: unit of the fact
    warning text
    aspect(aspect) text: aspect of the motion
    check(check) text: fact of the motion
"""
"""Variables of both kinds, and their attributes."""
_ORIGIN: Final = """
    step_interval_s number: time between the positions of a step
    duration_s number: length of the recording
    <seed|arena|source|simulated_recording>
"""

MODEL_CALIBRATION: Final = kind(f"""
kind: model_calibration
version: 2
dimensions:
    parameter text: parameters of the model
    bound: lower and upper end
    draw: settings that could have given the recording
    profile_point: values along a parameter
    aspect: aspects of the motion, by name
    check: facts of the motion that no model is fitted to
    <warning|verdict_reason>: sentences
variables:
    estimate(parameter): value of the parameter; in its unit
    interval(parameter bound): interval of the parameter; NaN where the estimate is the search's
    determined(parameter) bool: whether the recording determines the parameter; within 15 % of its \
        value, with 90 % confidence
    half_width(parameter) [1]: half the 90 % interval over the value; of its logarithm on a \
        logarithmic scale; NaN as the interval
    range(parameter bound): range of the search
    unit(parameter) text: unit of the parameter
    scale(parameter) text: scale of the parameter: linear or log
    meaning(parameter) text: what the parameter is
    held_out_distance(aspect) [1]: KS distance; odd blocks of time, by the answer for the even \
        ones
    trained_distance(aspect) [1]: KS distance; even blocks
    check_median(check): fact of the model, median of its replicates
    check_<low|high>(check): <smallest|largest> of its replicates
    {_RECORDED}
    score [1]: mean over the aspects of distance over floor; held out
    score_std [1]: its standard error; from leaving blocks out
    verdict text: whether the model explains the recording; "explains", "does not explain" or \
        "cannot tell"
    verdict_reason(verdict_reason) text: reason for the verdict
    bound(bound) text: end of an interval
variables (the model was searched):
    searched_estimate(parameter): answer of the search by KS distances
    searched_score [1]: score of the search's answer; even blocks
variables (summaries were matched):
    posterior_sample(draw parameter): values that could have given the recording; an \
        approximate posterior with even priors on the scales
    matched_score [1]: score of the answer of the summaries; even blocks
    discrepancy [1]: sum of the squares of the summaries' deviations; in standard deviations, \
        correlations taken into account
    discrepancy_median [1]: its median over simulated recordings of the model
    discrepancy_q95 [1]: its 95 % quantile over these
    interval_stretch [1]: factor by which the draws are spread for the discrepancy
variables (summaries were matched and no states changed places):
    profile_value(parameter profile_point): value of the parameter; in its unit
    profile_discrepancy(parameter profile_point) [1]: rise of the discrepancy there, the others at \
        their best; over the square of the factor by which intervals are widened
attributes:
    model text: name of the model
    estimate_from text: stage of the estimate: summaries, or search
    fixed object: known values of the model's other numbers, SI units
    confidence number: of the intervals
    position_noise_m number: noise of the recorded positions
    worlds number: worlds by which the model is judged
    {_ORIGIN}
""")

_HELD: Final = "odd blocks of time, which no model has seen"

MODEL_COMPARISON: Final = kind(f"""
kind: model_comparison
version: 2
dimensions:
    model: motion models, from the closest to the farthest
    aspect: aspects of the motion, by name
    check: facts of the motion that no model is fitted to
    parameter text: parameters of all the models
    end: searches: the short ones, and the long one
    <finding|warning>: sentences
variables:
    score(model) [1]: mean over the aspects of distance over floor; {_HELD}
    score_std(model) [1]: its standard error; from leaving blocks out
    behind(model) [1]: score above that of the first model
    behind_std(model) [1]: its standard error
    free_numbers(model) int: numbers that were fitted
    baseline(model) bool: whether it is a walk of recorded steps, which is no answer
    verdict(model) text: whether the model explains the recording; "explains", "does not explain" \
        or "cannot tell"
    verdict_reason(model) text: reasons for the verdict, separated by "; "
    held_out_distance(model aspect) [1]: KS distance; {_HELD}
    trained_distance(model aspect) [1]: KS distance; even blocks
    check_median(model check): fact of the model, median of its replicates
    check_<low|high>(model check): <smallest|largest> of its replicates
    {_RECORDED}
    estimate(model parameter): value of the parameter; NaN where the model has no such parameter
    parameter_unit(parameter) text: unit of the parameter
    end_score(model end) [1]: score at the end of a search; even blocks
    evaluations(model) int: settings that were simulated
    finding(finding) text: answer
    model(model) text: motion model
variables (of two models or more):
    asked(model) bool: whether the summaries of the motion were matched
    named(model) bool: whether the summaries of the motion speak for the model
    discrepancy(model) [1]: sum of squares of the deviations of the summaries; in standard \
        deviations; NaN where it was not asked
    discrepancy_median(model) [1]: its median over the model's own recordings
    discrepancy_q95(model) [1]: its 95 % quantile over them
    deviance(model) [1]: -2 log of the evidence of the summaries; but for a constant that all \
        models share
attributes:
    worlds number: worlds by which each model is judged
    {_ORIGIN}
attributes (200 pairs of steps or more):
    halves_ks_distance number: KS distance of the first half's steps to the second's
    halves_p_value number: share of random halves that differ as much
""")
