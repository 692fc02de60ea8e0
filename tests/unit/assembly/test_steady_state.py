"""Steady states: shares of time, lifetimes and rates against chains whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from driftwalk.assembly import steady_state

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
