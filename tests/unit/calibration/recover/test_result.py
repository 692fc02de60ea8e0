"""Errors, determined shares and coverage of a recovery study, against plain loops."""

from __future__ import annotations

import math
import statistics

import numpy as np
import pytest
from model_recovery_worlds import VALUES, lost, made_up, made_up_recovery

from driftwalk.calibration.recovery_study import relative_errors, summary_by_parameter


def test_errors_on_each_scale() -> None:
    """By hand: ln on a logarithmic scale; over the truth, or over a twentieth of the range."""
    estimate = np.array([[0.02, 3.3, 0.5], [0.08, 2.4, -0.5]])
    ranges = np.broadcast_to(np.array([[0.01, 1.0], [0.0, 10.0], [-5.0, 5.0]]), (2, 3, 2))
    found = relative_errors(
        estimate, np.array([0.04, 3.0, 0.1]), ranges, ["log", "linear", "linear"]
    )
    expected = [[-math.log(2.0), 0.1, 0.8], [math.log(2.0), -0.2, -1.2]]
    assert found == pytest.approx(np.array(expected), rel=1e-12)


def test_the_summary_counts_as_loops_do() -> None:
    found = lost(lost(made_up(), 3, 1, "too short"), 7, 2, "no numbers")
    # One calibration has an estimate without intervals.
    found["interval"][5] = np.nan
    study = made_up_recovery(found)
    truth = list(VALUES.values())
    for column, scale in enumerate(["log", "log", "linear"]):
        errors, known, held, total = [], [], 0, 0
        for row in range(12):
            value = float(found["estimate"][row, column])
            if math.isnan(value):
                continue
            if scale == "log":
                error = abs(math.log(value / truth[column]))
            else:
                error = abs(value - truth[column]) / max(truth[column], 0.3)
            errors.append(error)
            if found["determined"][row, column]:
                known.append(error)
            low, high = found["interval"][row, column]
            if not math.isnan(low):
                total += 1
                held += low <= truth[column] <= high
        one = study.isel(parameter=column)
        assert (len(errors), total) == (10, 9)
        assert float(one["median_error"]) == pytest.approx(statistics.median(errors), rel=1e-12)
        assert float(one["determined_share"]) == pytest.approx(len(known) / len(errors))
        assert float(one["coverage"]) == pytest.approx(held / total)
        assert float(one["coverage_standard_error"]) == pytest.approx(math.sqrt(0.9 * 0.1 / total))
        if known:
            assert float(one["determined_median_error"]) == pytest.approx(statistics.median(known))
        else:
            assert np.isnan(one["determined_median_error"])
    shares = study["coverage"].values
    assert 0.0 < shares.min() < 1.0  # the made-up intervals hold some truths, not all


def test_an_interval_holds_the_truth_where_its_errors_hold_zero() -> None:
    study = made_up_recovery()
    low, high = np.moveaxis(study["error_interval"].values, -1, 0)
    share = ((low <= 0.0) & (high >= 0.0)).mean(axis=0)
    assert share == pytest.approx(study["coverage"].values)


def test_the_standard_error_is_that_of_counted_intervals() -> None:
    """Brute force: coverages of 25 intervals that hold the truth in 80 of 100 cases.

    The standard deviation of 4000 draws is within 5 % of the truth but for one seed in 10 000
    (its own standard error is 1.1 %).
    """
    random = np.random.default_rng(1)
    drawn = (random.random((4000, 25)) < 0.8).mean(axis=1)
    nothing = np.zeros((25, 1))
    found = summary_by_parameter(
        nothing, np.zeros((25, 1, 2)), nothing > 0.0, np.zeros(1), confidence=0.8
    )
    assert drawn.std() == pytest.approx(float(found["coverage_standard_error"][0]), rel=0.05)


def test_nothing_calibrated_is_not_a_number() -> None:
    found = made_up(2)
    for which in range(2):
        found = lost(found, which, 1, "too short")
    study = made_up_recovery(found)
    for name in ("median_error", "determined_share", "coverage", "coverage_standard_error"):
        assert np.isnan(study[name].values).all(), name
