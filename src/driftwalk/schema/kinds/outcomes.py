"""Datasets made from the outcomes of runs: shares, times, sizes, rates, inferred parameters."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import SOURCE_WARNINGS, Attribute, kind, limited
from driftwalk.schema.kinds.assembly import CLASS, RATES, SETTINGS

_OF_RUNS: Final = "made from runs"
_SETTINGS_OF_RUNS: Final = (
    *limited(SETTINGS, _OF_RUNS, without="runs"),
    Attribute("drawn", "text", "as of the runs", _OF_RUNS),
)
_REALISED: Final = "the reference of a sensitivity analysis"

OUTCOME_DISTRIBUTION: Final = kind(
    f"""
kind: outcome_distribution
version: 1
dimensions:
    class: outcome classes
    realisation: realisations of the reference
    time: from the start of the runs to their end
    class_over_time: classes that occur
variables:
    count(class) [1] int: runs of this class
    proportion(class) [1]: share of runs
    interval_<low|high>(class) [1]: <lower|upper> limit of the simultaneous confidence interval
    {CLASS}
variables ({_REALISED}):
    realisation_count(realisation class) [1] int: runs of this class
    realisation_proportion(realisation class) [1]: share of runs
    standard_deviation(class) [1]: standard deviation of the share over realisations
    count_over_time(time class_over_time) [1] int: runs of this class at this time; of all \
        realisations
    time(time) [s]: time from the start of the run
    class_over_time(class_over_time) text: outcome class
attributes:
    runs number: runs with an outcome
    confidence number: with which all intervals hold at once
    method text: of the intervals
    complete number: share of runs with one assembly
    complete_<low|high> number: <lower|upper> end of its interval
attributes ({_OF_RUNS}):
    left_out number: runs without an outcome
    time_s number: when the outcomes were read
attributes ({_REALISED}):
    realisations number: realisations
    mean_pairwise_l1 number: mean l1 distance of two
    expected_pairwise_l1 number: what chance alone gives
    <drag_coefficient|force_std_N> number: of the reference
""",
    *_SETTINGS_OF_RUNS,
    *SOURCE_WARNINGS,
)


CLASS_TIMES: Final = kind(
    f"""
kind: class_times
version: 1
dimensions:
    time: from the start of the runs
    class: outcome classes
variables:
    proportion(time class) [1]: share of runs
    proportion_<low|high>(time class) [1]: <lower|upper> limit of the share of runs
    <first_contact|completion>(time) [1]: share of runs before <first contact|completion>
    first_contact_<low|high>(time) [1]: <lower|upper> limit, share before first contact
    completion_<low|high>(time) [1]: <lower|upper> limit, share before completion
    time(time) [s]: time from the start of the run
    {CLASS}
attributes:
    runs number: runs with an outcome
    left_out number: runs without an outcome
    confidence number: with which an interval holds at its time
    first_contact_median_s number: median time of first contact, NaN when not reached
    first_contact_median_<low|high>_s number: <lower|upper> end of its interval
    completion_median_s number: median time of completion, NaN when not reached
    completion_median_<low|high>_s number: <lower|upper> end of its interval
""",
    *_SETTINGS_OF_RUNS,
)


def _mean(name: str, dim: str, words: str, note: str = "") -> str:
    return f"""
    {name}({dim}) [1]: {words}, mean over runs{note}
    {name}_<low|high>({dim}) [1]: <lower|upper> limit, {words}; NaN of a single run
"""


ASSEMBLY_SIZES: Final = kind(
    f"""
kind: assembly_sizes
version: 1
dimensions:
    size: sizes: each up to 8 alone, beyond that groups that double
    time: from the start of the runs
variables:
    size(size) int: smallest size of the group, in blocks
    size_to(size) int: largest size of the group, in blocks
    time(time) [s]: time from the start of the run
    {_mean("number", "size", "assemblies of this size per run", "; at the end")}
    {_mean("block_share", "size", "share of the blocks in assemblies of this size", "; at the end")}
    {_mean("mean_size", "time", "blocks over assemblies")}
    {_mean("largest_share", "time", "share of the blocks in the largest assembly")}
    {_mean("free_share", "time", "share of the blocks that are alone")}
    {_mean("compactness", "time", "compactness, as at the end", "; NaN where no run has one")}
attributes:
    runs number: runs with an outcome
    left_out number: runs without an outcome
    confidence number: with which an interval holds, each on its own
    method text: of the intervals
    compactness number: least perimeter over that of the assembly, of assemblies of four blocks \
        and more, weighted by blocks; mean over runs, NaN where there are none
    compactness_<low|high> number: <lower|upper> end of its interval
    compactness_runs number: runs with an assembly of four blocks or more
""",
    *_SETTINGS_OF_RUNS,
)

STEADY_STATE: Final = kind(
    f"""
kind: steady_state
version: 1
dimensions:
    class: outcome classes
    age: from the beginning of a stay in a class
variables:
    time_share(class) [1]: share of time in this class, second half of the runs
    time_share_<low|high>(class) [1]: <lower|upper> limit of the share of time, between runs
    class_time(class) [s]: time in this class, all runs
    lifetime_median(class) [s]: median lifetime of the class; NaN where not reached
    lifetime_median_low(class) [s]: lower limit of the median lifetime; NaN where not reached
    lifetime_median_high(class) [s]: upper limit of the median lifetime; NaN where not reached
    survival(age class) [1]: share of stays that last longer, Kaplan-Meier; NaN where there is none
    survival_<low|high>(age class) [1]: <lower|upper> limit of the share of stays that last longer
    age(age) [s]: time since a stay began
    {CLASS}
attributes:
    runs number: runs with an outcome
    left_out number: runs without an outcome
    confidence number: with which an interval holds, each on its own
    method text: of the intervals
    from_s number: time from which shares count
    steady text: whether the shares of time are steady: yes or no
    steady_p number: how often chance makes the last two quarters differ as much
    false_alarms number: share of steady states that the test calls none
""",
    *RATES,
    *_SETTINGS_OF_RUNS,
)

OUTCOME_POSTERIOR: Final = kind(
    """
kind: outcome_posterior
version: 1
dimensions:
    parameter text: parameters that were inferred, by name
    bound: lower, upper
    point: sample of the prior
    data text: kinds of data
    class text: final outcome classes, the most frequent ones, and the rest
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
    <low|high>(parameter): <lower|upper> end of the range
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
    unit(parameter) text: unit of the parameter
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
    <seed|study>
""",
    *SOURCE_WARNINGS,
)

_RATE: Final = "source transition"


KINETICS: Final = kind(
    f"""
kind: kinetics
version: 1
dimensions:
    source text: data sets, the first and where it was given the second
    transition text: changes of class that were seen
    class text: outcome classes that were seen
    time: from the start of the runs to their end
    model text: candidates, the simplest first
    test text: tests of a well-mixed tank
    reason text: reasons of the verdict
    bin: bins of the time since a class was entered, of the chosen model
    hidden: hidden states of the chosen model
    hidden_after: the same, after a change of class
variables:
    count({_RATE}) [1] int: transitions seen
    time_in_class(source class) [s]: time spent in the class, over all runs
    rate({_RATE}) [s-1]: transitions over the time in their class
    rate_standard_error({_RATE}) [s-1]: standard error of the rate by the likelihood
    rate_low({_RATE}) [s-1]: lower limit of the rate, Poisson, widened as far as events cluster
    rate_high({_RATE}) [s-1]: upper limit of the rate, Poisson, widened as far as events cluster
    score(model) [1]: mean log likelihood of a held-out run; times in s
    score_behind(model) [1]: score less that of the best model
    score_behind_standard_error(model) [1]: its standard error over the runs
    share(time class) [1]: share of runs that the chosen model predicts
    share_low(time class) [1]: lower limit of the predicted share
    share_high(time class) [1]: upper limit of the predicted share; by a bootstrap over runs
    empirical(source time class) [1]: share of the runs still watched; NaN where none is
    hazard(transition bin hidden) [s-1]: cause-specific hazard of the chosen model
    hazard_standard_error(transition bin hidden) [s-1]: its standard error; by a bootstrap over runs
    bin_start(class bin) [s]: time since entry from which a hazard holds; NaN where there is no bin
    hidden_start(class hidden) [1]: share of runs that begin in a class and a hidden state
    hidden_change(class hidden hidden_after) [1]: probability of the hidden state after the class \
        was entered
    statistic(test) [1]: Weibull shape of a sojourn, or Spearman's coefficient of two
    statistic_<low|high>(test) [1]: <lower|upper> end of its 90 % interval
    events(test) [1] int: sojourns that ended
    p(test) [1]: p-value; likelihood ratio of a shape, Cox's score of a memory
    p_corrected(test) [1]: p-value, corrected for the number of tests (Holm)
    time(time) [s]: time from the start of the run
variables (two data sets):
    equal_p(transition) [1]: p-value of equal rates; log-rank of permuted runs, NaN below five \
        events
    equal_p_corrected(transition) [1]: p-value of equal rates, corrected for their number
variables (a target was named):
    committor(class) [1]: probability to reach the target from the class
    committor_standard_error(class) [1]: standard error, probability to reach the target from the \
        class
    passage_time(class) [s]: mean first-passage time to the target, of those that do
    passage_time_standard_error(class) [s]: standard error, mean first-passage time to the target, \
        of those that do
attributes:
    verdict text: well mixed, what refuses it, or cannot tell
    chosen text: name of the chosen model
    blocks number: blocks in the tank
    runs number: runs of the first data set
    joins number: changes of class in them
    duration_s number: length of the longest run
    confidence number: of the intervals
    seed
attributes (a target was named):
    target text: outcome class to be reached
attributes (a run was complete):
    completion_ks number: KS distance of predicted and seen completion times
    completion_ks_floor number: what chance alone exceeds in 5 %
attributes (two data sets):
    other_runs number: runs of the second
    equal_p number: smallest corrected p-value of equal rates
attributes (another number of blocks was asked for):
    other_blocks number: blocks for which the rate of the first joining is extrapolated
attributes (the tank is well mixed, for another number of blocks):
    other_blocks_rate_per_s number: rate of the first joining of so many blocks
    other_blocks_rate_standard_error_per_s number: its standard error
attributes (the tank is not well mixed, for another number of blocks):
    other_blocks_refused text: why no rate is extrapolated
""",
)
