"""Restarts of simulated recordings on the recorded path."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.comparison import StepDistance, apply_steps
from driftwalk.core.arrays import Floats
from driftwalk.likelihood.check.replicates import filtered_states
from driftwalk.likelihood.check.restarts import (
    RESTART,
    States,
    first_samples,
    frames_of,
    sections_of,
    within_sections,
)
from driftwalk.likelihood.preparation import prepare
from driftwalk.likelihood.start import first_point
from driftwalk.model import Study
from driftwalk.schema import Track, build_trajectory

WINDOW_S = 0.7


def track_at(time: Floats, *, seed: int = 1) -> Track:
    """Return a walk that turns (synthetic), with samples at these times."""
    generator = np.random.default_rng(seed)
    x, y = np.cumsum(0.002 * generator.normal(size=(2, time.size)), axis=1)
    return Track(time, x, y, 0.1 * time)


def unknown(samples: int) -> States:
    """Return the states of a filter that knows nothing."""
    return States(np.full((samples, 6), np.nan), np.tile(np.eye(6), (samples, 1, 1)))


def regular(minutes: float) -> Floats:
    return 5.0 + 0.1 * np.arange(round(600 * minutes) + 1)


def test_a_regular_recording_begins_again_every_ten_seconds() -> None:
    track = track_at(regular(3.0))
    first = first_samples(track, RESTART.steps_s)
    np.testing.assert_allclose(track.time[first] - 5.0, RESTART.steps_s * np.arange(18), atol=1e-9)
    (one,) = sections_of(track, first, unknown(track.time.size), window=WINDOW_S)
    np.testing.assert_allclose(one.time, 0.1 * np.arange(101), atol=1e-9)


@pytest.mark.parametrize(("dropped", "jitter"), [(0.0, 0.0), (0.03, 1e-4), (0.0, 0.02)])
def test_sections_hold_each_sample_at_its_time(dropped: float, jitter: float) -> None:
    generator = np.random.default_rng(2)
    time = regular(4.0)
    time = time[(generator.random(time.size) >= dropped) | (time == time[0])]
    time = time + jitter * generator.uniform(-1.0, 1.0, time.size)
    track = track_at(np.concatenate([time, time[-1] + 7.0 + 0.1 * np.arange(100)]))
    first = first_samples(track, RESTART.steps_s)
    parts = sections_of(track, first, unknown(track.time.size), window=WINDOW_S)
    assert len(parts) == (1 if jitter < 1e-3 else first.size)
    samples = np.concatenate([one.sample for one in parts])
    assert np.array_equal(samples, np.arange(track.time.size))
    past = track.time - track.time[0]
    for one in parts:
        own = one.begin[one.section] + one.time[one.place]
        np.testing.assert_allclose(
            own, past[one.sample], atol=4.0 * jitter * (len(parts) == 1) + 1e-9
        )
        assert np.diff(one.time).max() <= 1.0  # none goes over the gap of 7 s


@pytest.mark.parametrize("stamp", [0.0, 1e-3])
def test_frames_of_a_fast_camera_stay_on_its_clock(stamp: float) -> None:
    """At 60 Hz with missing frames, and with stamps that are rounded to milliseconds."""
    there = np.random.default_rng(4).random(36_000) > 0.02
    time = 5.0 + np.arange(36_000)[there] / 60.0
    seen = np.round(time / stamp) * stamp if stamp else time
    assert there[0]  # with this seed: frames count from it
    wanted = np.flatnonzero(np.flatnonzero(there) % 6 == 0)
    np.testing.assert_array_equal(frames_of(seen, 6), wanted)


def test_an_irregular_recording_begins_again_less_often() -> None:
    generator = np.random.default_rng(3)
    time = 5.0 + np.cumsum(generator.uniform(0.05, 0.15, size=12_000))
    assert first_samples(track_at(time), 10.0).size == RESTART.most_irregular


def test_starts_are_where_the_recording_is_and_how_it_moves() -> None:
    time = regular(2.0)
    angle = 0.7 * time
    track = Track(time, 0.1 * np.cos(angle), 0.1 * np.sin(angle), angle)
    first = first_samples(track, RESTART.steps_s)
    for one in sections_of(track, first, unknown(track.time.size), window=WINDOW_S):
        at = angle[first]
        start = [np.asarray(axis) for axis in one.start]
        np.testing.assert_allclose(start[0], 0.1 * np.cos(at), atol=1e-4)
        np.testing.assert_allclose(start[3], -0.07 * np.sin(at), atol=2e-3)
        np.testing.assert_allclose(start[4], 0.07 * np.cos(at), atol=2e-3)
        np.testing.assert_allclose(start[5], 0.7, atol=1e-6)


def test_starts_are_drawn_from_the_states_of_the_filter() -> None:
    """Means and covariances of 4000 starts, within five standard errors, and an unknown one."""
    track = track_at(regular(1.0))
    first = first_samples(track, RESTART.steps_s)
    generator = np.random.default_rng(5)
    mean = generator.normal(size=(track.time.size, 6))
    half = 1e-2 * generator.normal(size=(track.time.size, 6, 6))
    states = States(mean, half @ half.transpose(0, 2, 1))
    states.mean[first[2]] = np.nan
    (one,) = sections_of(track, first, states, window=WINDOW_S)
    drawn = np.reshape(one.starts(4000, 7), (6, 4000, first.size))
    for k, at in enumerate(first):
        if k == 2:
            assert np.ptp(drawn[:, :, k], axis=1).max() == 0.0
            np.testing.assert_allclose(drawn[0, 0, k], track.x[at], atol=4e-3)
            continue
        wanted = states.covariance[at]
        error = np.sqrt(np.diag(wanted) / 4000)
        assert (np.abs(drawn[:, :, k].mean(axis=1) - mean[at]) < 5.0 * error).all()
        scale = np.sqrt(np.outer(np.diag(wanted), np.diag(wanted)))
        assert np.abs((np.cov(drawn[:, :, k]) - wanted) / scale).max() < 5.0 * np.sqrt(2.0 / 4000)


@pytest.mark.parametrize(
    ("angle", "memory"), [("state", 0.0), ("state", 0.2), ("given", 0.0), ("none", 0.0)]
)
def test_states_are_those_of_the_filter(angle: Any, memory: float) -> None:
    """A circle with a noisy camera and a gap: the filter's state, and the angle that it lacks."""
    time, noise = 0.1 * np.arange(400), np.random.default_rng(5)
    turned = 0.4 * time
    parts = 0.06 * np.cos(turned), 0.06 * np.sin(turned), 0.5 * turned
    x, y, theta = (one + 3e-4 * noise.normal(size=one.shape) for one in parts)
    x[200:230] = np.nan
    ready = prepare([build_trajectory(time, x, y, theta)], Study(), angle, None)
    point = first_point(ready)
    point = replace(point, log_intensity=np.log(3e-5), log_noise=np.log(4e-4))
    if memory:
        point = point.with_extra("force_memory", memory)
    estimate: Any = SimpleNamespace(passes=ready.passes, tracks=ready.tracks, point=point)
    (found,) = filtered_states(estimate)
    (series,) = ready.series
    state = ready.passes.states(series, point)
    known = np.isfinite(found.mean[:, 3])
    # Neither before the first velocity nor after the gap.
    assert not known[0]
    assert not known[200]
    assert known.sum() > 300
    moved = found.mean[known]
    places = [0, 1, 2, 3, 4, 5] if angle == "state" else [0, 1, 3, 4]
    np.testing.assert_array_equal(moved[:, places], state[known])
    np.linalg.cholesky(found.covariance[known][:, places][:, :, places])
    if angle == "state":
        return
    truth = 0.5 * 0.4 * series.time[known]
    assert np.abs(np.angle(np.exp(1j * (moved[:, 2] - truth)))).max() < 5e-3
    assert np.abs(moved[:, 5] - 0.2).max() < 0.05


@pytest.mark.parametrize("interval", [0.1, 0.2, 0.25])
def test_steps_are_those_of_the_sections_alone(interval: float) -> None:
    track = track_at(regular(2.0))
    reference = StepDistance().prepare(track, step_interval=interval)
    plan = within_sections(reference.plan, first_samples(track, 10.0))
    steps = apply_steps(plan, track.x, track.y)
    found = np.column_stack([steps.step_length, steps.turning_angle])
    lengths, angles = [], []
    for begin, end in zip(range(0, 1200, 100), [*range(100, 1200, 100), 1201], strict=True):
        own = slice(begin, end)
        time = track.time[own]
        grid = time[0] + interval * np.arange(int((time[-1] - time[0]) / interval + 1e-6) + 1)
        path = np.interp(grid, time, track.x[own]) + 1j * np.interp(grid, time, track.y[own])
        step = np.diff(path)
        lengths.append(np.abs(step[1:]))
        angles.append(np.angle(step[1:] / step[:-1]))
    expected = np.column_stack([np.concatenate(lengths), np.concatenate(angles)])
    np.testing.assert_allclose(found, expected, atol=1e-7)
    assert len(expected) < len(reference.steps)
