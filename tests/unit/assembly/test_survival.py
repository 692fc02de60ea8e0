"""Survival curves with censoring, and classes over time, against hand work and plain loops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.stats import binom, binomtest, norm

from driftwalk.assembly.outcomes.distribution import class_at
from driftwalk.assembly.outcomes.outcome_classes import outcome_classes
from driftwalk.assembly.outcomes.survival import class_times, survival_curve
from driftwalk.core.errors import InputError

CLASSES = list(outcome_classes(4))
DURATION = 100.0
# From all single blocks to one assembly, by random choice.
NEXT = {
    "1+1+1+1": ["2+1+1"],
    "2+1+1": ["2+2", "I3+1", "L3+1"],
    "2+2": ["I", "O", "L"],
    "I3+1": ["I", "T"],
    "L3+1": ["O", "S", "T"],
}


def assembly(runs: int, *, seed: int = 1, broken: int = 0) -> xr.Dataset:
    """Made-up runs of four blocks with exponential times between events."""
    rng = np.random.default_rng(seed)
    event_time = np.full((runs, 3), np.nan)
    event_class = np.full((runs, 3), -1, np.int32)
    outcome, end = np.empty(runs, np.int32), np.full(runs, DURATION)
    for run in range(runs):
        state, time = "1+1+1+1", 0.0
        for event in range(3):
            time += rng.exponential(40.0)
            if time > DURATION:
                break
            state = str(rng.choice(NEXT[state]))
            event_time[run, event], event_class[run, event] = time, CLASSES.index(state)
        outcome[run] = CLASSES.index(state)
        if "+" not in state:
            end[run] = time
    outcome[:broken] = -1
    return xr.Dataset(
        {
            "event_time": (("run", "event"), event_time),
            "event_class": (("run", "event"), event_class),
            "outcome": ("run", outcome),
            "first_contact_time": ("run", event_time[:, 0]),
            "completion_time": ("run", event_time[:, 2]),
            "end_time": ("run", end),
        },
        coords={"class": ("class", np.array(CLASSES, dtype=object))},
        attrs={"kind": "assembly", "blocks": 4, "runs": runs, "duration_s": DURATION, "seed": seed},
    )


NAN = np.nan
# Seven runs: events at 2, 3, 3, 8; ended without it at 1, 3, 9.
EVENTS = [2.0, 3.0, 3.0, 8.0, NAN, NAN, NAN]
ENDS = [9.0, 9.0, 9.0, 9.0, 1.0, 3.0, 9.0]


def test_kaplan_meier_by_hand() -> None:
    """At risk: 6 at 2, 5 at 3 (the one that ends then among them), 2 at 8."""
    found = survival_curve(EVENTS, ENDS, times=[0, 1.5, 2, 2.5, 3, 7.9, 8, 9])
    at_2, at_3, at_8 = 5 / 6, 5 / 6 * 3 / 5, 5 / 6 * 3 / 5 * 1 / 2
    expected = [1, 1, at_2, at_2, at_3, at_3, at_8, at_8]
    np.testing.assert_allclose(found.survival, expected, rtol=1e-12)
    assert found.median == 3.0


def test_its_interval_by_hand() -> None:
    """Greenwood's variance of log S, on the scale of log(-log S), at 90 %."""
    found = survival_curve(EVENTS, ENDS, times=[3.0, 8.0], confidence=0.9)
    z = norm.ppf(0.95)
    for i, greenwood in enumerate((1 / (6 * 5) + 2 / (5 * 3), 1 / 30 + 2 / 15 + 1 / (2 * 1))):
        s = found.survival[i]
        reach = z * np.sqrt(greenwood) / abs(np.log(s))
        assert found.low[i] == pytest.approx(s ** np.exp(reach), rel=1e-9)
        assert found.high[i] == pytest.approx(s ** np.exp(-reach), rel=1e-9)


def test_where_greenwood_is_not_defined_the_exact_limit_stands() -> None:
    found = survival_curve([2.0, 3.0, 4.0, NAN], [9.0, 9.0, 9.0, 1.0], times=[0.5, 1.5, 5.0])
    # Four runs watched without an event, then three; at last it has happened in all three.
    for i, watched in enumerate((4, 3)):
        exact = binomtest(watched, watched).proportion_ci(0.9, method="exact")
        assert (found.low[i], found.high[i]) == pytest.approx((exact.low, 1.0))
    exact = binomtest(0, 3).proportion_ci(0.9, method="exact")
    assert (found.survival[2], found.low[2], found.high[2]) == pytest.approx((0, 0, exact.high))


def test_an_event_that_never_came() -> None:
    found = survival_curve([NAN] * 20, [5.0] * 20, times=[0.0, 5.0])
    assert found.survival.tolist() == [1.0, 1.0]
    exact = binomtest(20, 20).proportion_ci(0.9, method="exact")
    np.testing.assert_allclose(found.low, exact.low)
    assert found.high.tolist() == [1.0, 1.0]
    assert np.isnan([found.median, found.median_low, found.median_high]).all()


def test_the_median_of_exactly_one_half_and_its_interval() -> None:
    """Without censoring the interval of the median is where the interval of the curve holds 1/2."""
    event = np.arange(1.0, 101.0)
    found = survival_curve(event, np.full(100, 200.0), times=event)
    assert found.median == 50.0
    assert found.median_low == event[np.argmax(found.low <= 0.5)]
    assert found.median_high == event[np.argmax(found.high <= 0.5)]
    assert 38 <= found.median_low < 50 < found.median_high <= 62


def test_a_median_whose_upper_limit_is_not_reached() -> None:
    event = np.where(np.arange(100) < 52, np.linspace(1, 9, 100), np.nan)
    found = survival_curve(event, np.full(100, 10.0), times=[0.0])
    assert found.median == event[49]
    assert found.median_low < found.median
    assert np.isnan(found.median_high)


@pytest.mark.slow
def test_intervals_hold_as_often_as_stated() -> None:
    """400 data sets of 150 exponential times, half of them censored; curve and median, at 90 %.

    The limits are approximate: a coverage of 86 to 94 % passes with probability 1 - 2e-5. An
    interval of one standard error (68 %) or of 99 % fails.
    """
    rng = np.random.default_rng(4)
    curve_holds = median_holds = 0
    for _ in range(400):
        event, end = rng.exponential(1.0, 150), rng.exponential(1.0, 150)
        known = np.where(event <= end, event, np.nan)
        found = survival_curve(known, end, times=[0.5], confidence=0.9)
        curve_holds += found.low[0] <= np.exp(-0.5) <= found.high[0]
        # A limit that was not reached lies beyond the data.
        high = np.nan_to_num(found.median_high, nan=np.inf)
        median_holds += found.median_low <= np.log(2) <= high
    least, most = binom.ppf(1e-5, 400, 0.86), binom.isf(1e-5, 400, 0.94)
    assert least <= curve_holds <= most
    assert least <= median_holds <= most


@pytest.mark.slow
def test_class_proportions_are_those_of_a_plain_count() -> None:
    runs = assembly(300, broken=7)
    times = np.array([0.0, 0.7, 10.0, 33.3, 99.0, 100.0])
    found = class_times(runs, times=times)
    for i, time in enumerate(times):
        outcome = class_at(runs, time)
        for j, name in enumerate(CLASSES):
            count = int((outcome == j).sum())
            one = found.sel({"class": name}).isel(time=i)
            exact = binomtest(count, 293).proportion_ci(0.9, method="exact")
            assert float(one["proportion"]) == pytest.approx(count / 293)
            limits = float(one["proportion_low"]), float(one["proportion_high"])
            assert limits == pytest.approx((exact.low, exact.high), abs=1e-12)
    np.testing.assert_array_equal(class_at(runs, DURATION), runs["outcome"])
    attrs = found.attrs
    assert (attrs["runs"], attrs["left_out"], attrs["confidence"]) == (293, 7, 0.9)
    assert (attrs["kind"], attrs["schema_version"], attrs["seed"]) == ("class_times", 1, 1)


def test_an_event_at_a_time_counts_at_that_time() -> None:
    runs = assembly(50)
    times = np.sort(runs["event_time"].values[np.isfinite(runs["event_time"].values)])
    found = class_times(runs, times=times)
    expected = [(class_at(runs, t) == CLASSES.index("1+1+1+1")).mean() for t in times]
    np.testing.assert_allclose(found["proportion"].sel({"class": "1+1+1+1"}), expected)


def test_curves_and_classes_tell_the_same() -> None:
    """All runs that did not get there are watched to the end: then survival is a plain share."""
    found = class_times(assembly(200))
    proportion = found["proportion"]
    assert found["time"].values[[0, 1, -1]].tolist() == [0.0, 0.5, 100.0]
    np.testing.assert_allclose(proportion.sum("class"), 1.0)
    apart = ["+" in name for name in CLASSES]
    np.testing.assert_allclose(found["completion"], proportion[:, apart].sum("class"), atol=1e-12)
    np.testing.assert_allclose(
        found["first_contact"], proportion.sel({"class": "1+1+1+1"}), atol=1e-12
    )
    for event in ("first_contact", "completion"):
        assert (found[f"{event}_low"] <= found[event]).all()
        assert (found[event] <= found[f"{event}_high"]).all()
        assert (np.diff(found[event]) <= 0).all()


def test_medians_of_an_assembly() -> None:
    """The time that half of 201 runs had reached is the 101st of their times."""
    runs = assembly(201, seed=2)
    attrs = class_times(runs).attrs
    contact = np.sort(runs["first_contact_time"].values)
    assert attrs["first_contact_median_s"] == contact[100]
    assert attrs["first_contact_median_low_s"] < contact[100] < attrs["first_contact_median_high_s"]
    # Fewer than half of them became one assembly in time.
    assert np.isfinite(runs["completion_time"]).mean() < 0.5
    assert np.isnan(attrs["completion_median_s"])


def test_a_single_block_is_complete_from_the_start() -> None:
    runs = xr.Dataset(
        {
            "event_time": (("run", "event"), np.full((6, 1), np.nan)),
            "event_class": (("run", "event"), np.full((6, 1), -1, np.int32)),
            "outcome": ("run", np.zeros(6, np.int32)),
            "first_contact_time": ("run", np.full(6, np.nan)),
            "completion_time": ("run", np.zeros(6)),
            "end_time": ("run", np.zeros(6)),
        },
        coords={"class": ["1"]},
        attrs={"kind": "assembly", "blocks": 1, "duration_s": 10.0},
    )
    found = class_times(runs, times=[0.0, 10.0])
    assert found["completion"].values.tolist() == [0.0, 0.0]
    assert found["proportion"].values.tolist() == [[1.0], [1.0]]
    assert found["first_contact"].values.tolist() == [1.0, 1.0]
    # Nobody is watched any more: nothing is known.
    assert found["first_contact_low"].values[1] == 0.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"times": []}, "increasing numbers"),
        ({"times": [2.0, 1.0]}, "increasing numbers"),
        ({"times": [1.0, 101.0]}, "101 s lies outside the runs, which last 100 s"),
        ({"times": [np.nan]}, "nan s lies outside the runs"),
        ({"times": 3.0}, "increasing numbers"),
        ({"confidence": 0.0}, "confidence must lie between 0 and 1"),
    ],
)
def test_wrong_options_are_said(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        class_times(assembly(5), **options)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("runs", "message"),
    [
        (assembly(5, broken=5), "no run with an outcome"),
        (assembly(5).drop_vars("end_time"), "'end_time' is missing"),
        (assembly(5).assign_attrs(kind="steps"), "got steps"),
    ],
)
def test_runs_without_times_are_said(runs: xr.Dataset, message: str) -> None:
    with pytest.raises(InputError, match=message):
        class_times(runs)


@pytest.mark.parametrize(
    ("event", "end", "times", "message"),
    [
        ([], [], [0.0], "at least one run"),
        ([1.0], [2.0, 3.0], [0.0], "not of the same runs"),
        ([3.0], [2.0], [0.0], "an event lies outside its run"),
        ([-1.0], [2.0], [0.0], "an event lies outside its run"),
        ([np.inf], [2.0], [0.0], "an event lies outside its run"),
        ([1.0], [np.nan], [0.0], "a run has no end"),
        ([1.0], [2.0], [np.nan], "a row of finite numbers"),
    ],
)
def test_times_that_make_no_curve_are_said(
    event: list[float], end: list[float], times: list[float], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        survival_curve(event, end, times=times)
