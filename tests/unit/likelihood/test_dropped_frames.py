"""Frames that are missing under a constant rate are found where they are, and nothing else is."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from drifts import NOISE_M, RATE_HZ, drift
from fit_worlds import coarse_study, fitted, recording
from hypothesis import given, settings, strategies as st

import driftwalk as dw
from driftwalk.core.arrays import Floats
from driftwalk.likelihood.interval_inflation import with_mended_frames
from driftwalk.likelihood.recording_artifacts import dropped_frames
from driftwalk.likelihood.recording_artifacts.dropped_frames import (
    BOUNCE,
    CLEAN,
    CONTROL,
    DROPPED,
    DROPS,
    JUMP,
    WRONG,
    Axis,
    DroppedFrames,
    _axes,
    find_dropped_frames,
    log_likelihoods,
    patterns_of,
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


def integrated_accelerations(time: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the covariance of a path under white accelerations, summed over their times.

    By Gauss's rule of three points, which is exact for the product of two ramps.
    """
    nodes, weights = np.polynomial.legendre.leggauss(3)
    both = np.minimum(time[:, None], time)[..., None]
    past = 0.5 * both * (nodes + 1.0)
    ramps = (time[:, None, None] - past) * (time[None, :, None] - past)
    return np.asarray((0.5 * both * weights * ramps).sum(axis=-1))


AXIS = Axis(0.01 * np.cumsum(np.random.default_rng(3).normal(size=40)), 3e-4, 2e-3, 4e-3)


def by_hand(
    axis: Axis, first: int, lengths: npt.NDArray[np.float64], shift: npt.NDArray[np.float64] | None
) -> tuple[float, float]:
    """Return chi squared and the constant of one window, with the parabola integrated out.

    Of what may be added to the path, of unknown size, the covariance is that of its normal law.
    """
    time = 0.1 * np.concatenate([[0.0], np.cumsum(lengths)])
    known = axis.intensity * integrated_accelerations(time) + axis.noise**2 * np.eye(8)
    if shift is not None:
        known += np.outer(shift, shift)
    precision = np.linalg.inv(known)
    terms = (time[:, None] / time[-1]) ** np.arange(3)
    inner = terms.T @ precision @ terms
    left = precision - precision @ terms @ np.linalg.solve(inner, terms.T @ precision)
    values = axis.values[first : first + 8]
    constant = -0.5 * np.linalg.slogdet(known)[1] - 0.5 * np.linalg.slogdet(inner)[1]
    return float(values @ left @ values), float(constant)


def test_the_likelihood_of_a_window_is_that_of_a_bent_path() -> None:
    """Two axes add up; Student's law with 6 degrees of freedom stands for the normal one.

    The third interval of one window is stamped as two, and the fourth of another.
    """
    other = Axis(2.0 * AXIS.values[::-1].copy(), 5e-4, 1e-3, 9e-3)
    starts = np.arange(30)
    stamped = np.ones(39)
    stamped[[7, 20]] = 2.0
    found = log_likelihoods([AXIS, other], starts, stamped, stamped, dt=0.1)
    plain = patterns_of(np.ones(7), 1.0)
    assert found.shape == (30, len(plain))
    chis = [
        sum(by_hand(axis, k, stamped[k : k + 7], None)[0] for axis in (AXIS, other)) for k in starts
    ]
    usual = max(float(np.median(chis)) / (10.0 - 2.0 / 3.0), 1.0)
    for first in (0, 5, 17):
        window = stamped[first : first + 7]
        logs = []
        for one in patterns_of(window, window[3]):
            chi = constant = 0.0
            for axis in (AXIS, other):
                size = {
                    WRONG: 10.0 * axis.noise + 2.0 * axis.step,
                    BOUNCE: 2.0 * axis.step,
                    JUMP: 10.0 * axis.noise + 3.0 * axis.step,
                }.get(one.kind, 0.0)
                shift = None if one.shift is None else size * one.shift
                more, half = by_hand(axis, first, one.lengths, shift)
                chi, constant = chi + more, constant + half
            logs.append(constant - 0.5 * 16.0 * math.log1p(chi / (6.0 * usual)))
        np.testing.assert_allclose(found[first], np.array(logs) - logs[0], rtol=1e-6, atol=1e-6)
    # An axis with a missing value in a window says nothing there.
    holes = AXIS._replace(values=np.where(np.arange(40) == 12, np.nan, AXIS.values))
    alone = log_likelihoods([other], starts[:1], stamped, stamped, dt=0.1)
    both = log_likelihoods([holes, other], starts, stamped, stamped, dt=0.1)
    assert np.isfinite(both).all()
    assert alone.shape == (1, len(plain))


def test_what_may_have_happened_in_a_window() -> None:
    """Each interval may be longer, the middle one by more; each sample wrong; each may be hit."""
    lengths = np.array([1.0, 2.0, 1.0, 3.0, 1.0, 1.0, 1.0])
    found = patterns_of(lengths, 1.0)
    kinds = [one.kind for one in found]
    assert [kinds.count(kind) for kind in (CLEAN, *DROPS, CONTROL, WRONG, BOUNCE, JUMP)] == [
        1, 7, 1, 1, 3, 8, 7, 7,
    ]  # fmt: skip
    plain = np.array([1.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    assert (found[0].lengths == plain).all()
    for one in found:
        more = one.lengths - plain
        if one.kind in DROPS:
            assert more[one.at] == one.kind
            assert np.count_nonzero(more) == 1
        elif one.kind == CONTROL:
            assert one.at == 3
            assert more[3] in (-0.5, 0.5, 1.5)
        else:
            assert (more == 0.0).all()
        assert (one.shift is None) == (one.kind in (CLEAN, *DROPS, CONTROL))
    bounce = next(one for one in found if one.kind == BOUNCE and one.at == 1)
    # From the middle of the interval on, which lasts from 1 to 3.
    assert bounce.shift is not None
    assert bounce.shift.tolist() == [0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    jump = next(one for one in found if one.kind == JUMP and one.at == 4)
    assert jump.shift is not None
    assert jump.shift.tolist() == [0.0] * 5 + [1.0] * 3
    wrong = next(one for one in found if one.kind == WRONG and one.at == 7)
    assert wrong.shift is not None
    assert wrong.shift.tolist() == [0.0] * 7 + [1.0]


def sure_windows(kinds: list[int]) -> npt.NDArray[np.float64]:
    """Return likelihoods of windows of each of which it is sure what happened in its middle."""
    number = dropped_frames.KIND.size
    found = np.full((len(kinds), number), -500.0)
    for row, kind in enumerate(kinds):
        at = np.flatnonzero((kind == dropped_frames.KIND) & dropped_frames.AT_MIDDLE)[0]
        found[row, at] = 0.0
    return found


def test_rates_are_shares_of_the_windows_where_it_is_sure() -> None:
    """Ten in a hundred lack a frame, four two, six are hit; each by the number of its patterns."""
    kinds = [DROPS[0]] * 10 + [DROPS[1]] * 4 + [BOUNCE] * 6 + [CLEAN] * 80
    likelihood = sure_windows(kinds)
    shares = dropped_frames._shares(likelihood)
    assert (shares.top == 0.0).all()
    rates, value = dropped_frames._rates(shares)
    wanted = {DROPS[0]: 0.1, DROPS[1]: 0.04, BOUNCE: 0.06}
    for kind in range(1, JUMP + 1):
        assert rates[kind] == pytest.approx(wanted.get(kind, 0.0), abs=2e-6)
    # A window in which one thing happens has six intervals in which nothing does.
    nothing = 1.0 - rates[1:].sum()
    logs = [
        math.log(rates[kind] * nothing**6) if kind else 7.0 * math.log(nothing) for kind in kinds
    ]
    assert value == pytest.approx(sum(logs) / 7.0, rel=1e-5)
    none, less = dropped_frames._rates(shares, without=DROPS)
    assert none[list(DROPS)].tolist() == [0.0, 0.0, 0.0]
    assert less < value - 50.0
    share = dropped_frames._posterior(likelihood, rates)
    np.testing.assert_allclose(share[:10], np.tile([1.0, 0.0, 0.0], (10, 1)), atol=1e-9)
    assert share[10:14, 1] == pytest.approx(np.ones(4))
    assert share[14:].max() < 1e-12
    # Where two things are as likely by themselves, the one that happens more often is.
    even = likelihood[:1].copy()
    even[0, np.flatnonzero((DROPS[1] == dropped_frames.KIND) & dropped_frames.AT_MIDDLE)] = 0.0
    assert dropped_frames._posterior(even, rates)[0] == pytest.approx(
        [10 / 14, 4 / 14, 0.0], rel=1e-4
    )


@pytest.mark.parametrize(
    ("single", "double", "control", "right"),
    [
        (0.05, 0.01, 0.0099, True),  # of three control lengths a half of the rate
        (0.05, 0.01, 0.0101, False),
        (0.03, 0.031, 0.0, False),  # mostly two at once: leaps
        (0.03, 0.029, 0.0, True),
    ],
)
def test_dropped_frames_are_whole_ones_and_mostly_single(
    single: float, double: float, control: float, right: bool
) -> None:
    rates = np.zeros(JUMP + 1)
    rates[DROPS[0]], rates[DROPS[1]], rates[CONTROL] = single, 0.5 * double, control
    rates[DROPS[2]] = 0.5 * double
    assert dropped_frames._are_dropped_frames(rates, 0.5) is right


def test_the_time_of_missing_frames_is_put_in() -> None:
    time = np.arange(6.0)
    track = Track(time, time, time, time)
    expected = np.array([0.0, 1.0, 0.2, 0.0, 2.0])
    after = np.array([1, 4])
    found = DroppedFrames(after, time[after], np.array([1, 2]), expected, 0.4, 50.0, 0.5)
    assert found.frames == 3
    wanted = time + 0.5 * np.array([0.0, 0.0, 1.0, 1.2, 1.2, 3.2])
    assert with_gaps(track, found).time == pytest.approx(wanted)
    assert places_of(found) == "after 1 s, 4 s"
    many = found._replace(time=np.arange(7.0))
    assert places_of(many) == "after 0 s, 1 s, 2 s, 3 s, 4 s and 2 more"


def test_stamps_of_a_constant_rate_may_be_rounded() -> None:
    clock = 3.0 + 0.25 * np.arange(100)
    assert dropped_frames._regular_interval(clock) == pytest.approx(0.25)
    for off, regular in ((0.024, True), (0.026, False)):
        moved = clock.copy()
        moved[40] += off
        assert math.isfinite(dropped_frames._regular_interval(moved)) is regular
    assert math.isnan(dropped_frames._regular_interval(clock[:1]))
    lengths = np.ones(40)
    lengths[12] = 15.0
    assert dropped_frames._windows(lengths).size == 34
    lengths[12] = 16.0
    assert dropped_frames._windows(lengths).tolist() == [*range(6), *range(13, 34)]


def test_frames_of_a_short_recording_are_found_with_their_number(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A wave of 0.1 m with 0.3 mm of noise: every fortieth frame, and twice two of them."""
    dropped = np.zeros(900, dtype=bool)
    dropped[50::40] = True
    dropped[[251, 651]] = True
    frame = np.flatnonzero(~dropped)
    noise = np.random.default_rng(1).normal(0.0, 3e-4, (2, frame.size))
    x, y = 0.1 * np.cos(0.05 * frame) + noise[0], 0.1 * np.sin(0.05 * frame) + noise[1]
    clock = 0.1 * np.arange(frame.size)
    shares: list[Floats] = []
    share_of = dropped_frames._posterior

    def posterior(*args: Floats) -> Floats:
        shares.append(share_of(*args))
        return shares[-1]

    monkeypatch.setattr(dropped_frames, "_posterior", posterior)
    found = find_dropped_frames(Track(clock, x, y, np.full(frame.size, np.nan)), clock)
    gaps = np.diff(frame) - 1
    assert found.after.tolist() == np.flatnonzero(gaps).tolist()
    assert found.missing.tolist() == gaps[gaps > 0].tolist()
    assert found.time.tolist() == clock[found.after].tolist()
    assert found.rate == pytest.approx(np.mean(gaps > 0), rel=0.2)
    assert found.expected == pytest.approx(gaps, abs=0.01)
    # The last round sees the true lengths, and has no doubt of any.
    starts = dropped_frames._windows(np.diff(frame).astype(float))
    assert len(shares[-1]) == starts.size
    middle = np.searchsorted(starts, found.after - dropped_frames.MIDDLE)
    assert (shares[-1].sum(axis=1)[middle] > 0.99).all()
    assert found.interval == pytest.approx(0.1)
    assert found.evidence > 2.0 * DROPPED.evidence


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
