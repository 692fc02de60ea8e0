"""Dataset of runs whose bonds break: shares of time, lifetimes and rates of the classes."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import kind, limited
from driftwalk.schema.kinds.assembly import RATES, SETTINGS

_OF_RUNS: Final = "made from runs"

STEADY_STATE: Final = kind(
    f"""
kind: steady_state
version: 1
dimensions:
    class: outcome classes
    age: from the beginning of a stay in a class
variables:
    time_share(class) [1]: share of time in this class, second half of the runs
    time_share_low(class) [1]: lower limit of the share of time, between runs
    time_share_high(class) [1]: upper limit of the share of time, between runs
    class_time(class) [s]: time in this class, all runs
    lifetime_median(class) [s]: median lifetime of the class; NaN where not reached
    lifetime_median_low(class) [s]: lower limit of the median lifetime; NaN where not reached
    lifetime_median_high(class) [s]: upper limit of the median lifetime; NaN where not reached
    survival(age class) [1]: share of stays that last longer, Kaplan-Meier; NaN where there is none
    survival_low(age class) [1]: lower limit of the share of stays that last longer
    survival_high(age class) [1]: upper limit of the share of stays that last longer
    age(age) [s]: time since a stay began
    class(class) text: outcome class; [names](../explanation/assembly.md#outcome-classes)
attributes:
    runs number: runs with an outcome
    left_out number: runs without an outcome
    confidence number: with which an interval holds, each on its own
    method text: of the intervals
    from_s number: time from which shares count
    steady text: whether the shares of time are steady: yes or no
    steady_p number: how often chance makes the last two quarters differ as much
    false_alarms number: share of steady states that the test calls none
attributes ({_OF_RUNS}):
    drawn text: as of the runs
""",
    *RATES,
    *limited(SETTINGS, _OF_RUNS, without="runs"),
)

KINDS: Final = (STEADY_STATE,)
