"""The dataset of the kinetics of self-assembly: rates between classes, and what they predict."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import Variable, kind, variables

_RATE: Final = "source transition"


def _with_error(name: str, unit: str, words: str) -> tuple[Variable, ...]:
    return variables(f"""
variables (a target was named):
    {name}(class) [{unit}]: {words}
    {name}_standard_error(class) [{unit}]: standard error, {words}
""")


KINETICS: Final = kind(
    f"""
kind: kinetics
version: 1
dimensions:
    source: data sets, the first and where it was given the second
    transition: changes of class that were seen
    class: outcome classes that were seen
    time: from the start of the runs to their end
    model: candidates, the simplest first
    test: tests of a well-mixed tank
    reason: reasons of the verdict
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
    statistic_low(test) [1]: lower end of its 90 % interval
    statistic_high(test) [1]: upper end of its 90 % interval
    events(test) [1] int: sojourns that ended
    p(test) [1]: p-value; likelihood ratio of a shape, Cox's score of a memory
    p_corrected(test) [1]: p-value, corrected for the number of tests (Holm)
    source text
    transition text
    class text
    time(time) [s]: time from the start of the run
    model text
    test text
    reason text
variables (two data sets):
    equal_p(transition) [1]: p-value of equal rates; log-rank of permuted runs, NaN below five \
        events
    equal_p_corrected(transition) [1]: p-value of equal rates, corrected for their number
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
    *_with_error("committor", "1", "probability to reach the target from the class"),
    *_with_error("passage_time", "s", "mean first-passage time to the target, of those that do"),
)

KINDS: Final = (KINETICS,)
