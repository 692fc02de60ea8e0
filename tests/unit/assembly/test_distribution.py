"""Proportions of outcome classes: exact intervals, their joint coverage, outcomes at a time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.stats import binom, binomtest

from driftwalk.assembly.outcomes.distribution import (
    class_at,
    class_names,
    outcome_distribution,
    sampling_variance,
)
from driftwalk.assembly.outcomes.outcome_classes import outcome_classes
from driftwalk.core.errors import InputError
from driftwalk.core.intervals import difference_interval, proportion_interval

CLASSES = outcome_classes(4)
SQUARE, BENT, PAIRS, PAIR, SINGLE = (
    CLASSES.index(name) for name in ("O", "L3+1", "2+2", "2+1+1", "1+1+1+1")
)


def assembly() -> xr.Dataset:
    """Four runs by hand: two come together, one stays apart, one broke."""
    nan = np.nan
    return xr.Dataset(
        {
            "event_time": (
                ("run", "event"),
                [[10.0, 20.0, 30.0], [10.0, 10.0, nan], [nan, nan, nan], [5.0, nan, nan]],
            ),
            "event_class": (
                ("run", "event"),
                np.array(
                    [[PAIR, BENT, SQUARE], [PAIR, PAIRS, -1], [-1, -1, -1], [PAIR, -1, -1]],
                    np.int32,
                ),
            ),
            "outcome": ("run", np.array([SQUARE, PAIRS, SINGLE, -1], np.int32)),
        },
        coords={"class": ("class", np.array(CLASSES, dtype=object))},
        attrs={
            "kind": "assembly",
            "schema_version": 7,
            "runs": 4,
            "blocks": 4,
            "chirality": "merged",
            "duration_s": 60.0,
            "seed": 3,
        },
    )


@pytest.mark.parametrize(("count", "runs"), [(0, 1), (1, 1), (0, 40), (3, 40), (40, 40), (17, 999)])
@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.999])
def test_the_interval_is_that_of_the_exact_binomial_test(
    count: int, runs: int, confidence: float
) -> None:
    expected = binomtest(count, runs).proportion_ci(confidence, method="exact")
    found = proportion_interval(count, runs, confidence=confidence)
    assert found == pytest.approx((expected.low, expected.high), abs=1e-12)


@pytest.mark.parametrize("counts", [(56, 48), (9, 3), (10, 0), (0, 0)])
def test_the_interval_of_a_difference_is_made_of_two_of_wilson(counts: tuple[int, int]) -> None:
    runs = (70, 80)
    (p, below, above), (q, less, more) = (
        (k / n, *binomtest(k, n).proportion_ci(0.9, method="wilson"))
        for k, n in zip(counts, runs, strict=True)
    )
    expected = (
        p - q - np.hypot(p - below, more - q),
        p - q + np.hypot(above - p, q - less),
    )
    assert difference_interval(counts, runs, confidence=0.9) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("share", [0.05, 0.35, 0.7])
def test_equal_proportions_seem_to_differ_as_often_as_is_stated(share: float) -> None:
    # A plan of 3000 worlds and a test of 2000, 40,000 times; six standard errors: false alarm below
    # 1e-8. The plan's share outside of the test's own interval: in one of five.
    runs = np.array([2000, 3000])[:, None]
    counts = np.random.default_rng(5).binomial(runs, share, size=(2, 40_000))
    low, high = difference_interval(counts, runs, confidence=0.9)
    alarms = float(((low > 0.0) | (high < 0.0)).mean())
    assert abs(alarms - 0.1) < 6.0 * np.sqrt(0.09 / 40_000)


def test_without_trials_nothing_is_known() -> None:
    assert proportion_interval(0, 0, confidence=0.9) == (0.0, 1.0)


def test_the_level_of_a_class_is_shared_out_and_that_of_complete_is_not() -> None:
    counts = {"I": 2, "O": 70, "2+2": 8, "1+1+1+1": 0}
    found = outcome_distribution(counts, confidence=0.8)
    for name, count in counts.items():
        exact = binomtest(count, 80).proportion_ci(1 - 0.2 / 4, method="exact")
        one = found.sel({"class": name})
        assert int(one["count"]) == count
        assert float(one["proportion"]) == count / 80
        assert (float(one["interval_low"]), float(one["interval_high"])) == pytest.approx(exact)
    exact = binomtest(72, 80).proportion_ci(0.8, method="exact")
    attrs = found.attrs
    assert attrs["complete"] == 0.9
    assert (attrs["complete_low"], attrs["complete_high"]) == pytest.approx(exact)
    assert (attrs["runs"], attrs["left_out"], attrs["blocks"]) == (80, 0, 4)
    assert attrs["kind"] == "outcome_distribution"


RARE = [0.5, 0.3, 0.1979, 0.001, 0.0005, 0.0003, 0.0002, 0.0001, 0.0, 0.0]


@pytest.mark.slow
@pytest.mark.parametrize("proportions", [[0.1] * 10, RARE])
def test_all_intervals_hold_at_once_as_often_as_stated(proportions: list[float]) -> None:
    """600 samples of 1000 runs at 90 %; a true coverage of 90 % fails with probability 1e-5.

    Intervals of 90 % for each class alone hold at once in 40 % of samples of ten equal classes,
    and Goodman's in 79 % with rare classes: either fails.
    """
    rng = np.random.default_rng(1)
    p = np.array(proportions)
    held = 0
    for count in rng.multinomial(1000, p, size=600):
        found = outcome_distribution(dict(zip(CLASSES, count, strict=True)))
        low, high = found["interval_low"].values, found["interval_high"].values
        held += bool(((low <= p) & (p <= high)).all())
    assert held >= binom.ppf(1e-5, 600, 0.9)


def test_outcomes_of_an_assembly_are_counted_and_broken_runs_left_out() -> None:
    found = outcome_distribution(assembly())
    assert found["class"].values.tolist() == list(CLASSES)
    expected = np.zeros(10)
    expected[[SQUARE, PAIRS, SINGLE]] = 1
    np.testing.assert_array_equal(found["count"], expected)
    np.testing.assert_allclose(found["proportion"], expected / 3)
    attrs = found.attrs
    assert (attrs["runs"], attrs["left_out"], attrs["complete"]) == (3, 1, pytest.approx(1 / 3))
    assert (attrs["time_s"], attrs["seed"], attrs["chirality"]) == (60.0, 3, "merged")
    assert (attrs["kind"], attrs["schema_version"]) == ("outcome_distribution", 1)


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        (0.0, [SINGLE, SINGLE, SINGLE, -1]),
        (9.999, [SINGLE, SINGLE, SINGLE, -1]),
        (10.0, [PAIR, PAIRS, SINGLE, -1]),
        (29.0, [BENT, PAIRS, SINGLE, -1]),
        (60.0, [SQUARE, PAIRS, SINGLE, -1]),
    ],
)
def test_class_at_an_earlier_time(time: float, expected: list[int]) -> None:
    assert class_at(assembly(), time).tolist() == expected
    found = outcome_distribution(assembly(), time=time)
    np.testing.assert_array_equal(found["count"], np.bincount(expected[:3], minlength=10))
    assert found.attrs["time_s"] == time


def test_the_class_of_single_blocks_is_added_where_it_is_not_listed() -> None:
    """Beyond 8 blocks only the classes that occurred as an outcome or after an event are listed."""
    nine = xr.Dataset(
        {
            "event_time": (("run", "event"), [[1.0]]),
            "event_class": (("run", "event"), [[0]]),
            "outcome": ("run", [0]),
        },
        coords={"class": ["2+1+1+1+1+1+1+1"]},
        attrs={"kind": "assembly", "blocks": 9, "duration_s": 2.0},
    )
    single = "1+1+1+1+1+1+1+1+1"
    assert class_names(nine) == ["2+1+1+1+1+1+1+1", single]
    found = outcome_distribution(nine, time=0.5)
    assert found["count"].sel({"class": single}) == 1


def test_a_single_block_is_complete() -> None:
    found = outcome_distribution({"1": 5})
    assert found.attrs["complete"] == 1.0
    assert float(found["interval_high"][0]) == 1.0


def test_sampling_variance_is_unbiased() -> None:
    """Its exact mean over all counts is the variance of the proportion."""
    n, p = 12, 0.3
    count = np.arange(n + 1)
    mean = (binom.pmf(count, n, p) * sampling_variance(count / n, n)).sum()
    assert mean == pytest.approx(p * (1 - p) / n, rel=1e-12)


@pytest.mark.parametrize(
    ("given", "options", "message"),
    [
        ({}, {}, "there are no classes"),
        ({"O": 0}, {}, "no run with an outcome"),
        ({"O": 3, "I": -1}, {}, "class 'I': expected a number of runs from 0, got -1"),
        ({"O": 1.5}, {}, "class 'O': expected a number of runs"),
        ({"O": float("nan")}, {}, "class 'O': expected a number of runs"),
        ({"O": "many"}, {}, "class 'O': expected a number of runs"),
        ({"O": 3, "2+1": 1}, {}, "class '2\\+1' is of 3 blocks and class 'O' of 4"),
        ({"Q": 3}, {}, "no shape is called 'Q'"),
        ([1, 2], {}, "expected an assembly dataset or counts by class name"),
        ({"O": 3}, {"confidence": 1.0}, "confidence must lie between 0 and 1"),
        ({"O": 3}, {"time": 5.0}, "plain counts have no times"),
        (xr.Dataset(attrs={"kind": "steps"}), {}, "got steps"),
        (xr.Dataset(attrs={"kind": "assembly"}), {}, "'outcome' is missing"),
        (assembly().drop_vars("event_time"), {"time": 1.0}, "'event_time' is missing"),
        (assembly(), {"time": -1.0}, "-1 s lies outside the runs, which last 60 s"),
        (assembly(), {"time": 61.0}, "61 s lies outside the runs"),
        (assembly(), {"time": float("nan")}, "nan s lies outside the runs"),
        (assembly().isel(run=[3]), {}, "no run with an outcome"),
    ],
)
def test_what_is_no_distribution_is_said(given: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        outcome_distribution(given, **options)
    assert "\n" not in str(caught.value)


def test_wrong_counts_and_runs_are_said() -> None:
    with pytest.raises(InputError, match="0 <= count <= runs"):
        proportion_interval(5, 4, confidence=0.9)
    with pytest.raises(InputError, match="at least 2 runs"):
        sampling_variance(0.5, 1)
    with pytest.raises(InputError, match="numbers from 0 to 1"):
        sampling_variance(1.5, 10)


def test_counts_of_many_blocks_have_a_distribution() -> None:
    found = outcome_distribution({"37 assemblies": 3, "1 assembly": 1})
    assert found.attrs["complete"] == 0.25
    assert "blocks" not in found.attrs
    assert "37 assemblies" in repr(found)
