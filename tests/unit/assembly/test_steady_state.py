"""Steady states: shares of time, lifetimes and rates against chains whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy.stats import chi2

from driftwalk.assembly import rate_interval, steady_state
from driftwalk.assembly.outcomes.steady_state import clustering
from driftwalk.core.errors import InputError

BREAK, LATCH = 0.5, 0.2


def telegraph(
    runs: int, duration: float, seed: int, *, start: int = 1, latch: float = LATCH
) -> xr.Dataset:
    """Two blocks that latch and part at constant rates; state 1 is apart."""
    generator = np.random.default_rng(seed)
    times, kinds = [], []
    for _ in range(runs):
        now, state, own_times, own_kinds = 0.0, start, [], []
        while True:
            now += generator.exponential(1.0 / (latch if state else BREAK))
            if now > duration:
                break
            own_times.append(now)
            own_kinds.append(0 if state else 1)
            state = 1 - state
        times.append(own_times)
        kinds.append(own_kinds)
    rows = max(1, *map(len, times))
    time, kind = np.full((runs, rows), np.nan), np.full((runs, rows), -1)
    for run, (one, other) in enumerate(zip(times, kinds, strict=True)):
        time[run, : len(one)], kind[run, : len(one)] = one, other
    last = [one[-1] if one else start for one in kinds]
    return xr.Dataset(
        {
            "event_time": (("run", "event"), time),
            "event_kind": (("run", "event"), kind),
            "event_class": (("run", "event"), kind),
            "outcome": ("run", last),
            "end_time": ("run", np.full(runs, duration)),
        },
        coords={"class": ["2", "1+1"]},
        attrs={"kind": "assembly", "blocks": 2, "duration_s": duration},
    )


def test_intervals_of_rates_are_those_of_garwood() -> None:
    count = np.array([0, 1, 7, 300])
    low, high = rate_interval(count, 20.0, confidence=0.95)
    expected = chi2.ppf(0.025, 2 * count[1:]) / 40.0, chi2.ppf(0.975, 2 * count + 2) / 40.0
    np.testing.assert_allclose(low, [0.0, *expected[0]])
    np.testing.assert_allclose(high, expected[1])
    nothing = rate_interval(0, 0.0)
    assert (float(nothing[0]), float(nothing[1])) == (0.0, np.inf)
    with pytest.raises(InputError, match="not negative"):
        rate_interval(-1, 1.0)


@pytest.mark.parametrize(("burst", "exact"), [(1, 0.9), (4, 0.55)])
def test_intervals_of_events_that_come_in_bursts(burst: int, exact: float) -> None:
    """Bursts at random times, 30 events on average: the exact interval fails where they are of 4.

    400 sets, 93 to 95 % of which hold: false alarms 1 in 1000.
    """
    rng = np.random.default_rng(4)
    held, plain = [], []
    for _ in range(400):
        starts = rng.uniform(0.0, 100.0, rng.poisson(30 / burst))
        when = np.repeat(starts, burst)
        less = clustering(when, 100.0)
        low, high = rate_interval(when.size / less, 100.0 / less)
        held.append(low <= 0.3 <= high)
        low, high = rate_interval(when.size, 100.0)
        plain.append(low <= 0.3 <= high)
    assert 0.89 < np.mean(held) < 0.98
    assert np.mean(plain) == pytest.approx(exact, abs=0.05)


@pytest.mark.slow
def test_intervals_hold_as_often_as_they_say() -> None:
    # 300 sets: 90 % within 85.5 and 94.5 %, false alarms 1 in 100 for each of the three.
    share = LATCH / (LATCH + BREAK)
    held = np.zeros(3)
    for seed in range(300):
        found = steady_state(telegraph(25, 60.0, seed))
        truth = {"time_share": share, "parting_rate": BREAK, "lifetime_median": np.log(2) / BREAK}
        bound = found.sel({"class": "2"})
        for place, (name, value) in enumerate(truth.items()):
            held[place] += float(bound[f"{name}_low"]) <= value <= float(bound[f"{name}_high"])
    assert (np.abs(held / 300 - 0.9) < 0.045).all(), held / 300


@pytest.mark.slow
def test_the_test_of_the_steady_state_has_its_rate_of_false_alarms() -> None:
    # Runs that have forgotten their start. 400 sets of 5 %: 1.7 to 8.3 % are 3 standard errors.
    alarms = sum(
        steady_state(telegraph(30, 60.0, seed)).attrs["steady"] == "no" for seed in range(400)
    )
    assert 0.017 < alarms / 400 < 0.083


def test_an_approach_is_no_steady_state() -> None:
    slow = steady_state(telegraph(400, 4.0, 1))
    assert slow.attrs["steady"] == "no"
    assert slow.attrs["steady_p"] < 0.05
    assert steady_state(telegraph(400, 60.0, 1)).attrs["steady"] == "yes"


def test_few_runs_are_cut_into_batches() -> None:
    found = steady_state(telegraph(1, 4000.0, 3)).sel({"class": "2"})
    share = LATCH / (LATCH + BREAK)
    width = float(found["time_share_high"] - found["time_share_low"])
    # The variance of a telegraph's share over a long time T is 2 p q / (T (k + r)).
    expected = 2 * 1.645 * np.sqrt(2 * share * (1 - share) / (2000.0 * (LATCH + BREAK)))
    assert width == pytest.approx(expected, rel=0.5)
    assert abs(float(found["time_share"]) - share) < width


def test_a_class_that_never_came_has_an_upper_limit_and_no_lifetime() -> None:
    never = steady_state(telegraph(30, 50.0, 1, latch=1e-9)).sel({"class": "2"})
    assert float(never["time_share"]) == 0.0
    assert float(never["time_share_high"]) == pytest.approx(1 - 0.05 ** (1 / 30))
    assert np.isnan(float(never["lifetime_median"]))
    assert np.isnan(float(never["parting_rate"]))
