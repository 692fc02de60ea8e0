"""Rates of error of the tests of a well-mixed tank and of equal rates, on simulated chains."""

from __future__ import annotations

import numpy as np
import pytest
from chain_runs import CLASSES, chain_runs
from scipy.stats import binom

from driftwalk.assembly.chains.hidden import FORMS, Form, fit, passage, shares
from driftwalk.assembly.chains.histories import histories
from driftwalk.assembly.chains.mixing import (
    CANNOT_TELL,
    WELL_MIXED,
    equal_rates,
    judge_mixing,
)
from driftwalk.assembly.chains.transition_rates import Replicate, empirical_shares
from driftwalk.sweep import grid, run_sweep

CHAINS = 400


@pytest.mark.slow
@pytest.mark.parametrize("runs", [40, pytest.param(400, marks=pytest.mark.study)])
def test_a_well_mixed_tank_is_refused_in_five_percent_at_most(runs: int) -> None:
    """More than the 99.9 % quantile of 5 % would be no chance."""
    words = [judge_mixing(histories([chain_runs(runs, seed)])).word for seed in range(CHAINS)]
    refused = sum(word not in (WELL_MIXED, CANNOT_TELL) for word in words)
    assert refused <= binom.ppf(0.999, CHAINS, 0.05), refused


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "memory"), [(0.7, 1.0), (1.0, 0.15)])
def test_a_tank_that_is_not_is_refused(shape: float, memory: float) -> None:
    """In 0.9 of the data sets; fewer than the 0.1 % quantile would be no chance."""
    found = [
        judge_mixing(histories([chain_runs(300, seed, shape=shape, memory=memory)])).word
        for seed in range(100)
    ]
    refused = sum(word not in (WELL_MIXED, CANNOT_TELL) for word in found)
    assert refused >= binom.ppf(0.001, 100, 0.9), refused


@pytest.mark.slow
@pytest.mark.parametrize("memory", [1.0, pytest.param(0.1, marks=pytest.mark.study)])
def test_equal_rates_are_refused_in_five_percent_at_most(memory: float) -> None:
    """Of 300 simulated runs and 30 others of half the length, with memory or without."""
    refused, sets = 0, 100
    for seed in range(sets):
        one = histories([chain_runs(300, seed, memory=memory)])
        other = histories(
            [chain_runs(30, 1000 + seed, memory=memory, duration=150.0)], classes=one.classes
        )
        one = one._replace(classes=other.classes)
        pairs = [(i, j) for i in range(7) for j in range(7)]
        corrected = equal_rates(one, other, pairs)[1]
        refused += bool(np.nanmin(corrected) <= 0.05)
    assert refused <= binom.ppf(0.999, sets, 0.05), refused


@pytest.mark.parametrize(
    ("form", "memory"),
    [
        pytest.param(FORMS[0], 1.0, marks=pytest.mark.slow),
        pytest.param(FORMS[2], 0.2, marks=pytest.mark.study),
    ],
)
def test_bands_hold_the_truth_as_often_as_they_say(form: Form, memory: float) -> None:
    """Shares after 60 and 150 s and the committor, of 200 runs; 90 % within binomial chance."""
    truth = histories([chain_runs(30_000, 9, memory=memory)], classes=CLASSES)
    times, sets, at = np.array([60.0, 150.0]), 30, CLASSES.index("1+1+1+1")
    chosen = [CLASSES.index("T"), CLASSES.index("2+1+1")]
    seen = empirical_shares(truth, times)[:, chosen]
    held = []
    for seed in range(sets):
        found = histories([chain_runs(200, seed, memory=memory)], classes=CLASSES)
        model = fit(found, form)
        again = Replicate(found, model, np.zeros((0, 2), int), CLASSES.index("T"), seed)
        made = run_sweep(again, grid(replicate=np.arange(50)).units(1))
        course = shares(model, 300.0, steps=600)[1][[120, 300]]
        wide = 1.645 * made["share"].std(axis=0, ddof=1)[[24, 60]]
        error = made["committor"].std(axis=0, ddof=1)[at]
        reach = passage(model, CLASSES.index("T")).committor[at]
        inside = np.abs(course[:, chosen] - seen) < wide[:, chosen]
        held.append(np.append(inside.ravel(), abs(reach - 10 / 21) < 1.645 * error))
    share = np.mean(held, axis=0)
    assert (share >= binom.ppf(0.001, sets, 0.9) / sets).all(), share
