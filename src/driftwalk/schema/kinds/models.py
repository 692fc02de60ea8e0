"""The calibration of a model of many parameters, and the comparison of motion models."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import kind

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
    parameter text
"""
"""Variables of both kinds, and their attributes."""
_ORIGIN: Final = """
    step_interval_s number: time between the positions of a step
    duration_s number: length of the recording
    seed
    arena
    source
    simulated_recording
"""

MODEL_CALIBRATION: Final = kind(f"""
kind: model_calibration
version: 2
dimensions:
    parameter: parameters of the model
    bound: lower and upper end
    draw: settings that could have given the recording
    profile_point: values along a parameter
    aspect: aspects of the motion, by name
    check: facts of the motion that no model is fitted to
    warning: sentences
    verdict_reason: sentences
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
    check_median(check): fact of the model, median of its worlds
    check_low(check): smallest of its worlds
    check_high(check): largest of its worlds
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
    draws(draw parameter): values that could have given the recording; a sample of an approximate \
        posterior with even priors on the scales
    matched_score [1]: score of the answer of the summaries; even blocks
    misfit [1]: sum of the squares of the summaries' deviations; in standard deviations, \
        correlations taken into account
    usual_misfit [1]: its median over simulated recordings of the model
    most_misfit [1]: its 95 % quantile over these
    interval_stretch [1]: factor by which the draws are spread for the misfit
variables (summaries were matched and no states changed places):
    profile_value(parameter profile_point): value of the parameter; in its unit
    profile_misfit(parameter profile_point) [1]: rise of the misfit there, the others at their \
        best; over the square of the factor by which intervals are widened
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
    parameter: parameters of all the models
    end: searches: the short ones, and the long one
    finding: sentences
    warning: sentences
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
    check_median(model check): fact of the model, median of its worlds
    check_low(model check): smallest of its worlds
    check_high(model check): largest of its worlds
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
    misfit(model) [1]: sum of squares of the deviations of the summaries; in standard deviations; \
        NaN where it was not asked
    usual_misfit(model) [1]: its median over the model's own recordings
    most_misfit(model) [1]: its 95 % quantile over them
    unlikely(model) [1]: -2 log of the evidence of the summaries; but for a constant that all \
        models share
attributes:
    worlds number: worlds by which each model is judged
    {_ORIGIN}
attributes (200 pairs of steps or more):
    halves_ks_distance number: KS distance of the first half's steps to the second's
    halves_p_value number: share of random halves that differ as much
""")

KINDS: Final = (MODEL_CALIBRATION, MODEL_COMPARISON)
