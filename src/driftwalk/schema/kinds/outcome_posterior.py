"""The dataset of parameters inferred from outcomes alone, with the self-check of regions."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import SOURCE_WARNINGS, kind

OUTCOME_POSTERIOR: Final = kind(
    """
kind: outcome_posterior
version: 1
dimensions:
    parameter: parameters that were inferred, by name
    bound: lower, upper
    point: sample of the prior
    data: kinds of data
    class: final outcome classes, the most frequent ones, and the rest
    node: simulated settings that the emulator learned from
    truth: simulated data sets of the self-check
    reason: sentences on what is not determined
variables:
    value(point parameter): parameters of the sample; in the units of the coordinate unit
    weight(point) [1]: posterior weight of a point of the sample
    estimate(parameter): posterior median
    interval(parameter bound): shortest interval of the posterior; at the confidence; NaN where \
        none is stated
    determined(parameter) bool: whether the outcomes determine the parameter from both sides
    limit(parameter) text: which ends of the interval the outcomes set: both, lower, upper or none
    low(parameter): lower end of the range
    high(parameter): upper end of the range
    observed(data) bool: whether the observed runs hold this kind of data
    offered(data) bool: whether its regions cover in the self-check
    power(data) [1]: power of the likelihood with which they do; NaN where none does
    coverage(data) [1]: share of the truths in their joint region, in the self-check
    interval_coverage(data parameter) [1]: share of the truths in their intervals
    expected_width(data parameter) [1]: median width of the intervals over that of the prior
    width(data parameter) [1]: the same of the observed runs; NaN where they hold no such data
    count(class) [1] int: observed runs of this class
    share(class) [1]: share that the posterior predicts
    node_value(node parameter): parameters of the nodes
    truth_value(truth parameter): parameters of the data sets of the self-check
    reason(reason) text: what is not determined, and why
    parameter text
    unit(parameter) text: unit of the parameter
    data text
    class text
attributes:
    verdict text: determined, partly determined, or cannot tell
    used text: kind of data that the posterior is from, or none: then the sample is the prior's
    runs number: observed runs
    blocks number: blocks in the tank
    after_s number: when the final classes were read
    p number: share of simulated data sets that agree with the model no better
    emulator_noise number: error of the emulator over the sampling error, of the kind of data used
    node_runs number: simulated runs of a node
    truths number: data sets of the self-check
    confidence number: of intervals and regions
    seed
    study
""",
    *SOURCE_WARNINGS,
)

KINDS: Final = (OUTCOME_POSTERIOR,)
