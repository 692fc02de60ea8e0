"""Positions that a tracker has smoothed are recognised, and how; others are not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from drifts import drift
from fit_worlds import coarse_study, recording
from hypothesis import given, settings, strategies as st
from scipy.signal import lfilter, savgol_filter

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.likelihood.recording_artifacts.smoothed import SMOOTHING, find_smoothing
from driftwalk.schema import Track, body_track, build_trajectory

Floats = npt.NDArray[np.float64]
Filter = Callable[[Floats], Floats]


def averaged(weights: list[float]) -> Filter:
    return lambda axis: np.convolve(axis, np.array(weights) / sum(weights), mode="same")


def fitted_locally(frames: int, degree: int) -> Filter:
    return lambda axis: savgol_filter(axis, frames, degree)


def filtered(track: Track, by: Filter) -> Track:
    return track._replace(x=by(track.x), y=by(track.y))


WAYS = {
    "averages over 2 frames": averaged([1, 1]),
    "averages over 3 frames": averaged([1, 1, 1]),
    "averages over 5 frames": averaged([1] * 5),
    "averages over 9 frames": averaged([1] * 9),
    "weighted averages over 3 frames": averaged([1, 2, 1]),
    "weighted averages over 5 frames": averaged([1, 2, 3, 2, 1]),
    "parabolas through 5 frames (Savitzky-Golay)": fitted_locally(5, 3),
    "parabolas through 9 frames (Savitzky-Golay)": fitted_locally(9, 2),
    "quartics through 7 frames (Savitzky-Golay)": fitted_locally(7, 4),
}


@pytest.mark.false_alarm(1e-6)
@pytest.mark.parametrize("way", WAYS)
def test_smoothing_is_recognised(way: str, fresh_seed: Callable[[int], int]) -> None:
    """Evidence of some 800 in five minutes: another way is ahead with a chance below e^-50."""
    found = find_smoothing(filtered(drift(fresh_seed(1)), WAYS[way]))
    assert found is not None
    assert found.way == way
    assert found.evidence > 5.0 * SMOOTHING.evidence


@pytest.mark.slow
@settings(max_examples=20)
@given(st.integers(0, 10_000), st.floats(0.0, 2e-3), st.floats(0.0, 1e-3))
def test_raw_positions_are_not_smoothed(seed: int, noise_m: float, rounded_m: float) -> None:
    """Of any noise, also none: then the motion alone is there at every frequency; and rounded."""
    track = drift(seed, noise_m=noise_m)
    assert find_smoothing(track) is None
    if rounded_m > 1e-6:
        assert find_smoothing(filtered(track, lambda x: np.rint(x / rounded_m) * rounded_m)) is None


def test_a_force_that_remembers_is_no_smoothing() -> None:
    """Neither is an exponential filter, which looks the same."""
    assert find_smoothing(filtered(drift(2), lambda x: lfilter([0.5], [1.0, -0.5], x))) is None


@pytest.mark.parametrize("noise_m", [0.0, 1e-4, 1e-3])
def test_it_is_recognised_at_any_noise(noise_m: float) -> None:
    found = find_smoothing(filtered(drift(3, noise_m=noise_m), averaged([1, 1, 1])))
    assert found is not None
    assert found.way == "averages over 3 frames"


def test_rounding_comes_after_the_smoothing() -> None:
    smooth = filtered(drift(4), averaged([1, 1, 1]))
    found = find_smoothing(filtered(smooth, lambda x: np.round(x, 4)))
    assert found is not None
    assert found.way == "averages over 3 frames"


def test_another_periodic_error_has_no_name() -> None:
    """It is no motion with white noise, but no smoothing either."""
    track = drift(5)
    shaken = track._replace(x=track.x + 1e-3 * np.sin(2.0 * np.pi * 3.0 * track.time))
    assert find_smoothing(shaken) is None


def test_gaps_are_passed_over_and_short_tracks_left_alone() -> None:
    smooth = filtered(drift(6), averaged([1, 1, 1]))
    retained = np.arange(3000) % 250 != 0
    found = find_smoothing(Track(*(axis[retained] for axis in smooth[:4])))
    assert found is not None
    assert found.way == "averages over 3 frames"
    short = Track(*(axis[:100] for axis in smooth[:4]))
    assert find_smoothing(short) is None
    still = np.zeros(3000)
    assert find_smoothing(Track(smooth.time, still, still, still)) is None


@pytest.mark.parametrize("realisation", ["first", "second"])
def test_a_recording_of_the_model_is_raw(realisation: str) -> None:
    assert find_smoothing(body_track(dw.tank30_recording(realisation))) is None  # type: ignore[arg-type]


def test_a_fit_refuses_smoothed_positions() -> None:
    raw = recording(120.0)
    smooth = filtered(body_track(raw), averaged([1, 1, 1]))
    film = build_trajectory(*smooth[:4], attrs=raw.attrs)
    with pytest.raises(InputError, match=r"look like averages over 3 frames.*export the raw"):
        dw.likelihood.check_fit(film, coarse_study("auto"))
    dw.likelihood.check_fit(raw, coarse_study("auto"))


def test_a_quick_orbit_is_no_smoothing() -> None:
    # Synthetic: round the core of an eddy 0.95 times a second, with the noise of a camera. By the
    # whole spectrum these were averages over 7 frames.
    rng = np.random.default_rng(2)
    steps, noise = rng.normal(size=(2, 6000)), 3e-4 * rng.normal(size=(2, 6000))
    turn = np.exp(0.1 * (2j * np.pi * 0.95 - 0.1))
    place = lfilter([1.0], [1.0, -turn], steps[0] + 1j * steps[1])
    place *= 1e-3 / place.real.std()
    time = 0.1 * np.arange(6000)
    track = Track(time, place.real + noise[0], place.imag + noise[1], np.zeros(6000))
    assert find_smoothing(track) is None
