"""Outliers of a track are found by their pattern; turns, bounces and jumps are none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from fit_worlds import coarse_study, fitted, recording
from hypothesis import given, strategies as st

import driftwalk as dw
from driftwalk.likelihood.preparation import prepare
from driftwalk.schema import Track, body_track
from driftwalk.schema.answers.facts import facts_of
from driftwalk.schema.outliers import OUTLIER, outliers_in, without_far_outliers, without_outliers

SECONDS = 300.0
NOISE_M = 3e-4
SAMPLES = 400
AT = 200


def smooth(seed: int = 1, noise_m: float = NOISE_M) -> Track:
    """Return a body on a circle, with noise."""
    time = 0.1 * np.arange(SAMPLES, dtype=np.float64)
    noise = np.random.default_rng(seed).normal(0.0, noise_m, (2, SAMPLES))
    x, y = 0.1 * np.cos(0.5 * time) + noise[0], 0.1 * np.sin(0.5 * time) + noise[1]
    return Track(time, x, y, np.zeros(SAMPLES))


@given(st.floats(5e-3, 0.2), st.floats(0.0, 2 * np.pi))
def test_a_sample_far_from_both_neighbours_is_a_mistake(size: float, direction: float) -> None:
    track = smooth()
    track.x[AT] += size * np.cos(direction)
    track.y[AT] += size * np.sin(direction)
    assert outliers_in(track).nonzero()[0].tolist() == [AT]


@given(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2))
def test_a_jump_to_another_place_is_none(along: float, across: float) -> None:
    track = smooth()
    track.x[AT:] += along
    track.y[AT:] += across
    assert not outliers_in(track).any()


@pytest.mark.slow
@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(0.0, 1.0))
def test_a_bounce_between_two_samples_is_none(vx: float, vy: float, share: float) -> None:
    """The velocity changes at once, by up to 3 m/s, anywhere between two samples."""
    track = smooth()
    since = np.maximum(track.time - (track.time[AT] + 0.1 * share), 0.0)
    assert not outliers_in(
        Track(track.time, track.x + vx * since, track.y + vy * since, track.theta)
    ).any()


@given(st.floats(0.5, 50.0), st.floats(0.01, 1.0))
def test_a_fast_turn_is_none(turn_rate: float, radius: float) -> None:
    """Even where the clock cannot follow it: less than a third of a turn between samples."""
    track = smooth()
    angle = min(turn_rate, 20.0) * track.time
    fast = Track(track.time, radius * np.cos(angle), radius * np.sin(angle), track.theta)
    assert not outliers_in(fast).any()


@pytest.mark.false_alarm(1e-4)
def test_noise_alone_is_none(fresh_seed: Callable[[int], int]) -> None:
    """Twenty tracks of 400: a sample is 6 sd off in x or y once in 4e8, less often in both."""
    for k in range(20):
        assert not outliers_in(smooth(fresh_seed(100 + k))).any()


@pytest.mark.parametrize("realisation", ["first", "second"])
def test_a_recording_of_the_model_has_none(realisation: str) -> None:
    """Half an hour with contacts at the wall: what is fitted has not changed."""
    track = body_track(dw.tank30_recording(realisation))  # type: ignore[arg-type]
    assert without_outliers(track) is track


def test_gaps_and_short_tracks_are_left_alone() -> None:
    track = smooth()
    retained = np.ones(SAMPLES, dtype=bool)
    retained[AT + 1] = retained[AT - 1] = False
    track.x[AT] += 0.05
    sparse = Track(*(axis[retained] for axis in track[:4]))
    assert not outliers_in(sparse).any()
    short = Track(*(axis[: OUTLIER.fewest - 1] for axis in track[:4]))
    assert not outliers_in(short).any()
    still = Track(track.time, np.zeros(SAMPLES), np.zeros(SAMPLES), track.theta)
    assert not outliers_in(still).any()


def walker() -> Track:
    """Return a body at 2 cm/s that turns by up to a right angle a second."""
    rng = np.random.default_rng(3)
    time = 0.1 * np.arange(6000.0)
    place = 2e-3 * np.cumsum(np.exp(1j * np.cumsum(0.3 * rng.normal(size=time.size))))
    seen = place + 3e-4 * (rng.normal(size=time.size) + 1j * rng.normal(size=time.size))
    return Track(time, seen.real, seen.imag, 0.0 * time)


def test_all_far_mistakes_of_a_walker_go_alone_in_pairs_and_beside_missing_frames() -> None:
    """One sample in fifty, 1 to 3 cm off, and one frame in twenty missing; no other sample goes."""
    rng = np.random.default_rng(4)
    clean = walker()
    assert without_far_outliers(clean).time.size > clean.time.size - 3
    wrong = rng.uniform(size=clean.time.size) < 0.02
    wrong[3000:3002] = True
    off = rng.uniform(0.01, 0.03, wrong.size) * np.exp(2j * np.pi * rng.uniform(size=wrong.size))
    kept = rng.uniform(size=wrong.size) < 0.95
    x, y = clean.x + wrong * off.real, clean.y + wrong * off.imag
    seen = Track(*(axis[kept] for axis in (clean.time, x, y, clean.theta)))
    left = without_far_outliers(seen).time
    assert np.isin(clean.time[wrong & kept], left).sum() <= 1
    assert np.isin(clean.time[~wrong & kept], left, invert=True).sum() <= 3


def test_the_tank_is_placed_without_the_mistakes(tmp_path: Path) -> None:
    """A body goes round at the wall; one sample in fifty is 3 cm off, half of these beyond it."""
    rng = np.random.default_rng(6)
    time = 0.1 * np.arange(6000.0)
    place = 0.135 * np.exp(0.2j * time) + 3e-4 * (
        rng.normal(size=6000) + 1j * rng.normal(size=6000)
    )
    place[rng.uniform(size=6000) < 0.02] *= 1.2
    path = tmp_path / "walker.csv"
    table = np.column_stack([time, place.real, place.imag])
    np.savetxt(path, table, delimiter=",", header="t,x,y", comments="", fmt="%.6f")
    read = dw.load(path, tank="circle:0.3", length_unit="m")
    assert read["x"].values[0, 0] == pytest.approx(place[0].real, abs=1e-6)


def test_a_body_that_turns_back_makes_no_mistake() -> None:
    """It goes to and fro within one sample, by its usual step."""
    track = walker()
    track.x[AT] += 2e-3
    assert track.time[AT] in without_far_outliers(track).time


def with_mistakes(track: xr.Dataset, share: float, size_m: float, seed: int) -> xr.Dataset:
    rng = np.random.default_rng(seed)
    count = track.sizes["time"]
    wrong = rng.uniform(size=count) < share
    direction = rng.uniform(0.0, 2 * np.pi, count)
    for name, part in (("x", np.cos(direction)), ("y", np.sin(direction))):
        track[name].values[wrong] += (size_m * part[wrong])[:, None]
    return track


@pytest.mark.slow
@pytest.mark.parametrize("size_m", [5e-3, 0.05])
def test_one_sample_in_twenty_may_be_wrong(size_m: float) -> None:
    """The estimates move by less than their own uncertainty.

    One sample in twenty is lost and the intervals around it are longer: the estimates may differ
    from those of the whole recording by the error that the lost samples bring. That is less than a
    third of the standard deviation; the limit is one.
    """
    clean = fitted(SECONDS)
    found = dw.fit_motion(with_mistakes(recording(SECONDS), 0.05, size_m, 5), coarse_study())
    std = np.sqrt(np.diag(clean["covariance"].values))[:3] * (1.0, 0.5, 1.0)
    names = ("drag_coefficient", "force_std_N", "tracking_noise_m")
    moved = [np.log(facts_of(found)[name] / facts_of(clean)[name]) for name in names]
    assert np.abs(np.array(moved) / std).max() < 1.0
    left_out = facts_of(found)["outliers"]
    assert 0.03 * 3001 < left_out < 0.06 * 3001
    assert facts_of(found)["samples"] == 3001
    assert any(f"{left_out} of 3001 samples" in text for text in facts_of(found)["warnings"])
    assert facts_of(clean)["outliers"] == 0


@pytest.mark.slow
def test_samples_beyond_the_greatest_speed_are_counted(tmp_path: Path) -> None:
    """Wrong by 50 mm they go when the recording is read, by 5 mm at 10 Hz when it is fitted."""
    film = with_mistakes(recording(SECONDS), 0.05, 0.05, 5)
    path = tmp_path / "film.nc"
    film.to_netcdf(path, engine="h5netcdf")
    read = dw.load(path, max_speed=0.3, tank="circle:0.3")
    ready = prepare([read], coarse_study(), None, None)
    wrong = int((film["x"].values != recording(SECONDS)["x"].values).sum())
    assert ready.facts["jumps_removed"] == wrong
    assert ready.outliers == 0
    assert ready.samples == 3001 - wrong
    damaged = read.assign_attrs(counts='{"per_body": [1]}')
    assert prepare([damaged], coarse_study(), None, None).facts["jumps_removed"] == 0


def test_a_body_that_hardly_moves_keeps_its_bouts() -> None:
    # Synthetic: positions rounded to 1 mm, at rest in 92 of 100 steps, quick turns in the others.
    rng = np.random.default_rng(1)
    moves = np.arange(2000) % 100 < 8
    x, y = np.round(np.cumsum(moves * rng.normal(0.0, 0.004, (2, 2000)), axis=1), 3)
    track = Track(0.1 * np.arange(2000), x, y, 0 * x)
    assert without_far_outliers(track).time.size == 2000
