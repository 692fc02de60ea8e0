"""The dataset of a maximised yield: settings, how they were chosen, and what fresh runs gave."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from driftwalk.schema.description import SOURCE_WARNINGS, kind
from driftwalk.schema.kinds.sensitivity import AXES

YIELD: Final = kind(
    """
kind: yield
version: 1
dimensions:
    setting: settings that were compared, in the order in which they were begun
    time: from the start of the runs to their end
variables:
    runs(setting) [1] int: runs that chose
    reached(setting) [1] int: those of them that had the target by the time
    rounds(setting) [1] int: rounds of halving that it stayed in; 0 of a setting of the local search
    difference(setting) [1]: yield of the best less that of the setting, over the runs they share
    difference_low(setting) [1]: lower limit of the difference, at all looks and settings at once
    difference_high(setting) [1]: upper limit of the difference
    standing(setting) text: best, alike (cannot be distinguished from it) or worse
    fresh_runs(setting) [1] int: fresh runs, which chose nothing
    fresh_yield(setting) [1]: share of them with the target by the time; NaN where there are none
    fresh_yield_low(setting) [1]: lower limit of the yield; exact, of a binomial count
    fresh_yield_high(setting) [1]: upper limit of the yield; exact, of a binomial count
    share(setting time) [1]: share with the target; of the fresh runs where there are some
    front_setting(time) [1] int: setting that the first runs choose for the time
    front_yield(time) [1]: its share of the fresh runs
    front_yield_low(time) [1]: lower limit of it; exact
    front_yield_high(time) [1]: upper limit of it; exact
    time(time) [s]: time from the start of the run
attributes:
    target text: outcome class to be reached
    by_s number: time by which it is reached
    best number: index of the chosen setting
    within number: no setting is better by more than this, with the confidence
    indifference number: difference of yields that does not matter
    confidence number: of the choice and of the intervals
    searched text: axes with a range, which were searched
    selection_runs number: runs of halving
    chosen_runs number: runs that chose, of all settings
    reported_runs number: fresh runs, of all settings
    left_out number: runs that broke down, which count as without the target
    duration_s number: length of a run
    seed
    study
attributes (their number does not vary):
    blocks number: blocks in the tank
""",
    *(replace(one, dims="setting", when="it varies") for one in AXES),
    *SOURCE_WARNINGS,
)

KINDS: Final = (YIELD,)
