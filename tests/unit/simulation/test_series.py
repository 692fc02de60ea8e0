"""How a flow in frames goes on, which is refused, and when each world begins in it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.schema.kinds.flow import flow_series_words
from driftwalk.simulation import simulate
from driftwalk.simulation.series import (
    continued_flow,
    flow_since,
    flow_starts,
    series_facts,
    series_of,
    velocity_at,
)

SPEEDS = (0.01, 0.03, -0.02, 0.02)
TINY: dict[str, Any] = {"tank": {"diameter_m": 0.3}, "forces": {"force_std_N": 0.0}}


def series(*speeds: float, interval: float = 2.5, begin: float = 0.0) -> xr.Dataset:
    """A uniform stream along x that changes in time."""
    time = begin + interval * np.arange(len(speeds))
    frames = [dw.uniform_flow(speed, 0.0) for speed in speeds]
    return xr.concat(frames, dim=xr.IndexVariable("time", time, {"units": "s"}))


def study(**flow: str) -> dw.Study:
    return dw.Study(**TINY, flow=flow)


def starts_of(flow: xr.Dataset, chosen: dw.Study, duration: float, count: int = 400) -> Any:
    known = continued_flow(flow, chosen, duration=duration)
    keys = world_keys(1, trial=0, replicate=np.arange(count))
    return flow_starts(known, chosen, keys, duration=duration)


def test_a_series_that_is_over_before_the_simulation_is_refused() -> None:
    with pytest.raises(InputError, match=r"spans 0 to 7.5 s.*needs 0 to 60 s") as refused:
        dw.simulate(study(), series(*SPEEDS), sample_time=[0.0, 60.0])
    assert '`flow.repeat="loop"`' in str(refused.value)
    with pytest.raises(InputError, match=r"spans 0 to 7.5 s"):
        dw.assemble(study(), series(*SPEEDS), blocks=1, runs=1, duration=8.0)
    with pytest.raises(InputError, match="moves without end"):
        dw.LiveTank(study(), series(*SPEEDS), blocks=1)


def test_a_recording_has_its_own_clock() -> None:
    recording = dw.tank30_recording().isel(time=slice(0, 200))  # of 20 s
    chosen = dw.Study()
    with pytest.raises(InputError, match=r"spans 100 to 150 s.*clock of the recording"):
        dw.simulate_like(chosen, series(*SPEEDS, *SPEEDS, interval=50 / 7, begin=100.0), recording)
    found = dw.simulate_like(chosen, series(*SPEEDS, interval=10.0), recording, replicates=3)
    assert found.attrs["flow_begins"] == "together"
    assert found["flow_start"].values.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("repeat", ["none", "loop", "mirror", "hold"])
def test_a_part_of_a_recording_has_the_clock_of_the_whole(repeat: str) -> None:
    whole = continued_flow(series(*SPEEDS), study(repeat=repeat), duration=6.0, begin=0.0)
    part = flow_since(series(*SPEEDS), 2.0)
    assert part is not None
    part = continued_flow(part, study(repeat=repeat), duration=4.0, begin=0.0)
    time = np.linspace(0.0, 4.0 if repeat == "none" else 20.0, 41)
    here, later = (velocity_at(*one)[0] for one in ((part, 0, 0, time), (whole, 0, 0, time + 2.0)))
    assert here == pytest.approx(later, abs=1e-12)
    steady = dw.uniform_flow(0.01, 0.0)
    assert flow_since(steady, 2.0) is steady


def test_a_series_as_long_as_its_frames_last_is_long_enough() -> None:
    # 600 frames of 0.1 s are a minute, the last of which stands at 59.9 s.
    minute = series(0.01, 0.02).isel(time=np.arange(600) % 2)
    minute = minute.assign_coords(time=("time", 0.1 * np.arange(600), {"units": "s"}))
    assert continued_flow(minute, study(), duration=60.0).attrs["repeat"] == "none"
    with pytest.raises(InputError):
        continued_flow(minute, study(), duration=60.1)


def test_a_loop_closes_after_one_more_interval_or_at_once() -> None:
    open_one = continued_flow(series(*SPEEDS), study(repeat="loop"), duration=60.0)
    assert series_of(open_one).period == 10.0
    closed = continued_flow(series(*SPEEDS, 0.01 + 1e-17), study(repeat="loop"), duration=60.0)
    assert series_of(closed).period == 10.0
    mirrored = continued_flow(series(*SPEEDS), study(repeat="mirror"), duration=60.0)
    assert series_of(mirrored).period == 15.0


@pytest.mark.parametrize(
    ("repeat", "duration", "first", "last"),
    [("loop", 60.0, 0.0, 10.0), ("mirror", 60.0, 0.0, 15.0), ("none", 3.0, 0.0, 4.5)],
)
def test_each_world_begins_at_its_own_moment(
    repeat: str, duration: float, first: float, last: float
) -> None:
    starts = starts_of(series(*SPEEDS), study(repeat=repeat), duration)
    # Uniform: the mean of 400 within 4 standard errors, and moments near both ends.
    width = last - first
    assert abs(starts.mean() - (first + last) / 2) < 4 * width / np.sqrt(12 * 400)
    assert first <= starts.min() < first + 0.02 * width
    assert last - 0.02 * width < starts.max() < last


def test_a_moment_depends_on_the_worlds_address_alone() -> None:
    few, many = (starts_of(series(*SPEEDS), study(repeat="loop"), 60.0, n) for n in (3, 40))
    np.testing.assert_array_equal(few, many[:3])
    chosen = dw.Study(**TINY, flow={"repeat": "loop"}, assembly={"blocks": 1, "duration_s": 1.0})
    all_runs = dw.assemble(chosen, series(*SPEEDS), runs=6)
    path = dw.assembly_path(chosen, series(*SPEEDS), runs=[4], sample_interval=1.0)
    for axis in ("x", "y"):
        np.testing.assert_allclose(path[axis][0, -1], all_runs[axis][4], rtol=1e-6)


@pytest.mark.parametrize("flow", [{"repeat": "hold"}, {"repeat": "loop", "start": "first"}])
def test_worlds_begin_together_where_there_is_no_choice_or_none_is_wanted(
    flow: dict[str, str],
) -> None:
    assert set(starts_of(series(*SPEEDS, begin=3.0), study(**flow), 60.0)) == {3.0}


def test_a_steady_flow_has_no_moments_and_no_facts() -> None:
    steady = dw.uniform_flow(0.01, 0.0)
    assert starts_of(steady, study(), 60.0) is None
    assert series_facts(steady, None, duration=60.0) == {}
    found = dw.simulate(study(), steady, sample_time=[0.0, 1.0])
    assert "flow_start" not in found
    assert flow_series_words(found.attrs, holds="it holds") == []


def test_random_moments_spread_what_the_water_carries() -> None:
    # No force, one start: what differs between replicates is the moment of the water alone.
    chosen = dw.Study(**TINY, simulation={"start": {"x_m": 0.0}}, flow={"repeat": "loop"})
    together = dw.apply_overrides(chosen, {"flow.start": "first"})
    flow, time = series(*SPEEDS), np.arange(41) * 0.1
    same = dw.simulate(together, flow, sample_time=time, replicates=64)
    apart = dw.simulate(chosen, flow, sample_time=time, replicates=64)
    assert float(np.ptp(same["x"].values[:, -1])) == 0.0
    assert float(np.ptp(apart["x"].values[:, -1])) > 0.02
    # Each goes the way that it goes alone from the moment that the result states.
    begin = float(apart["flow_start"][5])
    alone = simulate(chosen, flow, sample_time=time, flow_start=begin)
    np.testing.assert_allclose(alone["x"][0], apart["x"][5], atol=1e-7)
    assert apart.attrs["flow_begins"] == "random"
    assert apart.attrs["flow_period_s"] == 10.0


def test_a_flow_that_says_how_it_goes_on_needs_no_word() -> None:
    switched = series(*SPEEDS, begin=600.0).assign_attrs(repeat="hold")
    assert set(starts_of(switched, study(), 3600.0)) == {0.0}


def test_what_the_intervals_hold_for_is_said() -> None:
    def words(flow: xr.Dataset, **flow_settings: str) -> str:
        chosen = study(**flow_settings)
        found = dw.simulate(chosen, flow, sample_time=[0.0, 5.0], replicates=3)
        return " | ".join(flow_series_words(found.attrs, holds="the paths hold"))

    assert "its own moment of its period" in words(series(*SPEEDS), repeat="loop")
    assert "its own moment of the first 2.5 s" in words(series(*SPEEDS))
    assert "this one course of the water" in words(series(*SPEEDS), start="first")
    assert "stands still after its last frame" in words(series(*SPEEDS), repeat="hold")
    rising = series(*np.linspace(0.0, 0.03, 10))
    assert "does not close" in words(rising, repeat="loop")
    assert "does not close" not in words(rising, repeat="mirror")


@pytest.mark.parametrize("repeat", ["none", "loop", "mirror", "hold"])
def test_velocity_at_a_moment(repeat: str) -> None:
    flow = continued_flow(series(*SPEEDS), study(repeat=repeat), duration=5.0)
    time = np.array([0.0, 3.75, 7.5, 8.75, 11.25, 16.0])
    expected = {
        "loop": [0.01, 0.005, 0.02, 0.015, 0.02, -0.004],
        "mirror": [0.01, 0.005, 0.02, 0.0, 0.005, 0.018],
    }.get(repeat, [0.01, 0.005, 0.02, 0.02, 0.02, 0.02])
    u, v = velocity_at(flow, 0.0, 9.0, time)
    np.testing.assert_allclose(u, expected, atol=1e-12)
    assert not v.any()


def test_a_body_carried_by_the_water_starts_at_its_speed_of_that_moment() -> None:
    model = dw.motion_model("inertial+flow")
    values = {"speed_std": 1e-6, "memory_time": 1.0, "turn_rate": 0.0}
    found = dw.motion.simulate_motion(
        model, values, study(repeat="loop"), flow=series(*SPEEDS), sample_time=[0.0, 0.02],
        replicates=20, start=None,
    )  # fmt: skip
    begins = found["flow_start"].values
    assert np.unique(begins).size == 20
    speed = np.diff(found["x"].values[:, :, 0], axis=1)[:, 0] / 0.02
    expected = np.interp(begins + 0.01, [0, 2.5, 5.0, 7.5, 10.0], [*SPEEDS, SPEEDS[0]])
    np.testing.assert_allclose(speed, expected, atol=2e-5)
