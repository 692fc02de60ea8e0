"""The summary of a recovery study, against closed forms and other programs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from recovery_worlds import synthetic_recovery
from scipy import stats

from driftwalk.calibration.recovery_study import summarise
from driftwalk.likelihood.score import error_scale


def test_summary_of_four_recordings_by_hand() -> None:
    error = np.array([0.1, -0.2, 0.3, 0.0])
    found = summarise(error, np.array([1.0, -2.0, 2.0, 0.0]), np.array([1.0, 0.0, 1.0, 1.0]))
    assert found.median_absolute_error == pytest.approx(0.15)
    # Sorted 0, 0.1, 0.2, 0.3: 90 % is 2.7 steps up.
    assert found.absolute_error_90 == pytest.approx(0.27)
    assert found.bias == pytest.approx(0.05)
    assert found.rms_z == pytest.approx(1.5)
    assert found.coverage == 0.75
    squares = (np.log(1.1) ** 2 + np.log(0.8) ** 2 + np.log(1.3) ** 2) / 4
    assert found.rms_error == pytest.approx(squares**0.5)
    logs = [np.log(1.1), np.log(0.8), np.log(1.3), 0.0]
    middle = sum(logs) / 4
    assert found.spread == pytest.approx((sum((x - middle) ** 2 for x in logs) / 3) ** 0.5)


def test_nothing_is_said_of_no_recordings() -> None:
    nothing = np.zeros(0)
    assert np.isnan(summarise(nothing, nothing, nothing)).all()
    one = summarise(np.array([0.1]), np.array([1.0]), np.array([1.0]))
    assert np.isnan(one.spread)
    assert one.coverage_high == 1.0


@pytest.mark.parametrize(("count", "total"), [(0, 5), (5, 5), (1, 2), (17, 20), (180, 200)])
def test_the_interval_of_a_coverage_is_scipys_exact_one(count: int, total: int) -> None:
    exact = stats.binomtest(count, total).proportion_ci(0.95, method="exact")
    found = summarise(np.ones(total), np.ones(total), np.arange(total) < count)
    assert (found.coverage_low, found.coverage_high) == pytest.approx(tuple(exact))


def test_the_law_is_found_where_it_holds() -> None:
    duration = np.array([300.0, 600.0, 2400.0])
    scale = error_scale(duration, 3.0 / np.sqrt(duration), np.array([20, 20, 20]))
    assert scale.value == pytest.approx(3.0)
    # 5 %: sqrt(T) = 3 / 0.05.
    assert scale.needed(0.05)[0] == pytest.approx(3600.0)
    # 20 rms^2 / sigma^2 lies between 10.851 and 31.410 in 90 % (tables of chi-squared).
    assert scale.low == pytest.approx(3.0 * np.sqrt(20 / 31.410), rel=1e-4)
    assert scale.high == pytest.approx(3.0 * np.sqrt(20 / 10.851), rel=1e-4)
    assert scale.needed(0.05)[1:] == pytest.approx((3600 * 20 / 31.41, 3600 * 20 / 10.851), 1e-4)


def test_a_length_with_one_recording_does_not_count() -> None:
    scale = error_scale(np.array([100.0, 400.0]), np.array([np.nan, 0.1]), np.array([1, 10]))
    assert scale.value == pytest.approx(2.0)
    assert np.isnan(error_scale(np.array([100.0]), np.array([np.nan]), np.array([1]))).all()


@pytest.mark.false_alarm(6e-5)
def test_the_interval_of_the_law_holds_as_often_as_it_says(
    fresh_seed: Callable[[int], int],
) -> None:
    """2000 studies of 8 recordings: 90 +- 0.67 %; 4 sd, once in 16,000 if it is right."""
    generator = np.random.default_rng(fresh_seed(5))
    draws = generator.normal(0.0, 0.2, (2000, 8))
    draws = np.sqrt((draws**2).mean(axis=1))
    scales = [error_scale(np.array([100.0]), np.array([one]), np.array([8])) for one in draws]
    held = np.mean([scale.low <= 2.0 <= scale.high for scale in scales])
    assert held == pytest.approx(0.9, abs=0.027)


def test_the_summary_leaves_out_what_is_not_used() -> None:
    recovery = synthetic_recovery()
    for number in range(2):
        for angle in ("given", "none"):
            part = recovery.isel(duration=number).sel(angle=angle)
            retained = part["force_std_error"].values[1:]
            row = part.sel(parameter="force_std")
            assert float(row["median_absolute_error"]) == pytest.approx(np.median(np.abs(retained)))
            assert float(row["bias"]) == pytest.approx(retained.mean())
            assert float(part["median_flow_error"]) == np.median(part["flow_error"].values[1:])
    # Drawn with 3 / sqrt(T); 58 draws: 9.3 % sd, 4 of them.
    assert recovery["drag_coefficient_error_scale"].values == pytest.approx([3.0, 3.0], rel=0.38)
    needed = (recovery["drag_coefficient_error_scale"].values / 0.05) ** 2
    assert recovery["needed_duration"].values == pytest.approx(needed)
