"""Mistakes of the tracker are found by their pattern; turns, bounces and jumps are none."""

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
from driftwalk.record.cleaning.outliers import OUTLIER, outliers_in, without_outliers
from driftwalk.schema import Track, body_track
from driftwalk.schema.answers.facts import facts_of

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
    retained[AT + 1 : AT + 4] = retained[AT - 3 : AT] = False
    track.x[AT] += 0.05
    sparse = Track(*(axis[retained] for axis in track[:4]))
    assert not outliers_in(sparse).any()
    short = Track(*(axis[: OUTLIER.fewest - 1] for axis in track[:4]))
    assert not outliers_in(short).any()
    still = Track(track.time, np.zeros(SAMPLES), np.zeros(SAMPLES), track.theta)
    assert not outliers_in(still).any()


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
    left_out = facts_of(found)["mistakes"]
    assert 0.03 * 3001 < left_out < 0.06 * 3001
    assert facts_of(found)["samples"] == 3001
    assert any(f"{left_out} of 3001 samples" in text for text in facts_of(found)["warnings"])
    assert facts_of(clean)["mistakes"] == 0


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
    assert ready.mistakes == 0
    assert ready.samples == 3001 - wrong
    damaged = read.assign_attrs(counts='{"per_body": [1]}')
    assert prepare([damaged], coarse_study(), None, None).facts["jumps_removed"] == 0
