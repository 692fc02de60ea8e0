"""Frames that are missing under a constant rate are found where they are, and nothing else is."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from drifts import NOISE_M, RATE_HZ, drift
from fit_worlds import coarse_study, fitted, recording
from hypothesis import given, settings, strategies as st

import driftwalk as dw
from driftwalk.likelihood.interval_inflation import with_mended_frames
from driftwalk.likelihood.recording_artifacts.dropped_frames import (
    DROPPED,
    _axes,
    find_dropped_frames,
    places_of,
    with_gaps,
)
from driftwalk.schema import Track, body_track, build_trajectory
from driftwalk.schema.answers.facts import facts_of


def test_the_noise_of_the_angle_is_not_bounded_as_that_of_a_position() -> None:
    """Of one angle many steps are short, of two coordinates few: 0.5 degrees are 0.5 degrees.

    With a fifth of that hundreds of frames seemed to be missing where a block moved slowly.
    """
    track = drift(4)
    *_, angle = _axes(track, track.time)
    assert angle.noise == pytest.approx(np.deg2rad(0.5), rel=0.1)


class Filmed(NamedTuple):
    """A track without some frames, and which it has."""

    track: Track
    frame: npt.NDArray[np.int64]


def without(track: Track, dropped: npt.NDArray[np.bool_]) -> Filmed:
    """Return a track that lacks frames, with stamps at a constant rate."""
    frame = np.flatnonzero(~dropped)
    retained = Track(*(axis[frame] for axis in track[:4]))
    return Filmed(retained._replace(time=track.time[: frame.size]), frame)


def dropped_at_random(track: Track, share: float, seed: int) -> Filmed:
    dropped = np.random.default_rng(seed).uniform(size=track.time.size) < share
    dropped[[0, -1]] = False
    return without(track, dropped)


@pytest.mark.slow
@pytest.mark.false_alarm(1e-4)
@pytest.mark.parametrize("angle", ["with", "without"])
def test_dropped_frames_are_found_where_they_are(
    angle: str, fresh_seed: Callable[[int], int]
) -> None:
    """Nine in ten: some are lost in the noise of a body that stands still for a moment.

    Of 150 frames each is missed with a probability below 0.05, so that 15 are once in 1e3 tracks;
    at most 0.05 of those that are found are not there or not so many.
    """
    whole = drift(fresh_seed(1))
    if angle == "without":
        whole = whole._replace(theta=np.full(whole.time.size, np.nan))
    track, frame = dropped_at_random(whole, 0.05, fresh_seed(2))
    true = np.diff(frame) - 1
    found = find_dropped_frames(track, track.time)
    assert found.evidence > 3.0 * DROPPED.evidence
    right = true[found.after] == found.missing
    assert right.mean() > 0.95
    assert found.missing[right].sum() > 0.9 * true.sum()
    assert found.rate == pytest.approx((true > 0).mean(), abs=0.02)
    np.testing.assert_allclose(found.time, track.time[found.after])
    later = with_gaps(track, found).time - whole.time[frame]
    assert np.abs(np.diff(later)).mean() < 0.1 * (true > 0).mean() / RATE_HZ


@pytest.mark.slow
def test_one_frame_in_five_may_be_missing() -> None:
    """More windows lack a frame than do not: two in one do not pass for something else."""
    track, frame = dropped_at_random(drift(4), 0.2, 4)
    true = np.diff(frame) - 1
    found = find_dropped_frames(track, track.time)
    assert found.frames > 0.7 * true.sum()
    assert (true[found.after] > 0).mean() > 0.9


@pytest.mark.slow
def test_two_and_three_frames_in_a_row_are_counted() -> None:
    dropped = np.zeros(drift(3).time.size, dtype=bool)
    singles, twos, threes = np.arange(40, 1500, 40), np.arange(1550, 2200, 60), (2300, 2500, 2700)
    dropped[singles] = True
    for first in twos:
        dropped[first : first + 2] = True
    for first in threes:
        dropped[first : first + 3] = True
    track, frame = without(drift(3), dropped)
    found = find_dropped_frames(track, track.time)
    true = np.diff(frame) - 1
    assert found.after.tolist() == np.flatnonzero(true).tolist()
    # Where the block has just been pushed, two missing frames may pass for three.
    wrong = found.missing != true[true > 0]
    assert wrong.mean() < 0.05
    assert abs(found.frames - dropped.sum()) <= wrong.sum()
    assert places_of(found).startswith("after 3.9 s, 7.8 s, 11.7 s, 15.6 s, 19.5 s and ")


@pytest.mark.false_alarm(1e-4)
def test_no_frame_is_missed_where_none_is(fresh_seed: Callable[[int], int]) -> None:
    """Five tracks: a ratio of likelihoods is above e^30 once in e^30 cases at most."""
    for k in range(5):
        track = drift(fresh_seed(100 + k), seconds=120.0)
        found = find_dropped_frames(track, track.time)
        assert found.frames == 0
        assert found.evidence < 2.0
        assert with_gaps(track, found) is track


@settings(max_examples=5)
@given(
    st.lists(st.integers(20, 1180), min_size=1, max_size=30, unique=True),
    st.floats(-0.2, 0.2),
    st.floats(-0.2, 0.2),
    st.floats(0.0, 1.0),
)
def test_bounces_are_no_dropped_frames(
    places: list[int], vx: float, vy: float, share: float
) -> None:
    """The velocity changes at once, to and fro, anywhere between two samples."""
    track = drift(5, seconds=120.0)
    x, y = track.x.copy(), track.y.copy()
    for number, at in enumerate(sorted(places)):
        since = np.maximum(track.time - (at + share) / RATE_HZ, 0.0)
        sign = (-1.0) ** number
        x += sign * vx * since
        y += sign * vy * since
    assert find_dropped_frames(track._replace(x=x, y=y), track.time).frames == 0


@pytest.mark.slow
@settings(max_examples=5)
@given(st.floats(1e-3, 0.05), st.integers(1, 3), st.integers(0, 100))
def test_wrong_samples_and_jumps_are_no_dropped_frames(size: float, run: int, seed: int) -> None:
    track = drift(6, seconds=120.0)
    rng = np.random.default_rng(seed)
    x, y = track.x.copy(), track.y.copy()
    for at in rng.choice(1180, 30, replace=False):
        direction = rng.uniform(0.0, 2.0 * np.pi)
        x[at : at + run] += size * np.cos(direction)
        y[at : at + run] += size * np.sin(direction)
    for at in rng.choice(1180, 5, replace=False):
        x[at:] += size * rng.normal()
    assert find_dropped_frames(track._replace(x=x, y=y), track.time).frames == 0


@pytest.mark.slow
def test_a_body_that_moves_in_leaps_lacks_no_frames() -> None:
    """One step in twenty is one half to three and a half times as long: the control finds those."""
    track = drift(7)
    rng = np.random.default_rng(7)
    factor = np.where(rng.uniform(size=3000) < 0.05, rng.uniform(0.5, 3.5, 3000), 1.0)
    steps = np.diff(np.stack([track.x, track.y]), axis=1) * factor[1:]
    x, y = np.cumsum(np.concatenate([np.zeros((2, 1)), steps], axis=1), axis=1)
    assert find_dropped_frames(track._replace(x=x, y=y), track.time).frames == 0


@pytest.mark.slow
def test_a_recording_of_the_model_lacks_none() -> None:
    track = body_track(dw.tank30_recording())
    assert find_dropped_frames(track, track.time).evidence == pytest.approx(0.0, abs=0.5)


@pytest.mark.slow
def test_stamps_of_a_clock_are_believed() -> None:
    """Right stamps, whose gaps say where frames are missing, and stamps that are not regular."""
    whole = drift(8, seconds=120.0)
    track, frame = dropped_at_random(whole, 0.05, 8)
    stamped = track._replace(time=whole.time[frame])
    assert np.isnan(find_dropped_frames(stamped, stamped.time).interval)
    uneven = track.time + 0.02 * np.random.default_rng(8).uniform(-1.0, 1.0, track.time.size)
    assert np.isnan(find_dropped_frames(track._replace(time=uneven), uneven).interval)
    rounded = np.round(track.time / 3.0, 3)
    assert find_dropped_frames(track._replace(time=rounded), rounded).frames > 40


@pytest.mark.slow
def test_short_tracks_and_bodies_at_rest_are_left_alone() -> None:
    track = drift(9)
    short = Track(*(axis[:60] for axis in track[:4]))
    assert find_dropped_frames(short, short.time).frames == 0
    still = np.zeros(track.time.size)
    assert find_dropped_frames(Track(track.time, still, still, still), track.time).frames == 0
    noise = NOISE_M * np.random.default_rng(9).normal(size=(2, track.time.size))
    resting = Track(track.time, noise[0], noise[1], track.theta)
    assert find_dropped_frames(resting, track.time).frames == 0


@pytest.mark.slow
def test_one_frame_in_twenty_may_be_missing() -> None:
    """The estimates are those of the whole recording to two of their standard deviations."""
    clean = fitted(300.0)
    whole = body_track(recording(300.0))
    track, frame = dropped_at_random(whole, 0.05, 5)
    film = build_trajectory(*track[:4], attrs=recording(300.0).attrs)
    found = dw.fit_motion(film, coarse_study())
    std = np.sqrt(np.diag(clean["covariance"].values))[:2] * (1.0, 0.5)
    names = ("drag_coefficient", "force_std_N")
    moved = [np.log(facts_of(found)[name] / facts_of(clean)[name]) for name in names]
    assert np.abs(np.array(moved) / std).max() < 2.0
    missing = facts_of(found)["dropped_frames"]
    assert missing == pytest.approx(np.sum(np.diff(frame) - 1), rel=0.1)
    assert any(f"{missing} frames are missing" in text for text in facts_of(found)["warnings"])
    assert facts_of(clean)["dropped_frames"] == 0


def test_the_interval_of_the_force_knows_of_mended_frames() -> None:
    """0.7 of their share, in squares; that of C_d stays as it is."""
    covariance = np.diag([0.04, 0.09, 0.01])
    wider = with_mended_frames(covariance, 0.1)
    assert wider[1, 1] == pytest.approx(0.09 + (2.0 * 0.7 * 0.1) ** 2)
    assert np.array_equal(np.delete(wider, 1, axis=0), np.delete(covariance, 1, axis=0))
    assert np.array_equal(with_mended_frames(covariance, 0.0), covariance)
