"""Smoothed orientation: a known turning, gaps, uneven clocks, missing angles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import savgol_coeffs

from driftwalk.likelihood.filter.series import smooth_angle


def wrapped(angle: np.ndarray) -> np.ndarray:
    return np.angle(np.exp(1j * angle))


def test_a_parabola_is_returned_on_any_clock() -> None:
    time = np.cumsum(np.random.default_rng(2).uniform(0.03, 0.3, 300))
    time = np.concatenate([time, 200.0 + time])
    true = 0.3 + 0.4 * (time % 200.0) - 0.01 * (time % 200.0) ** 2
    found = smooth_angle(time, wrapped(true))
    rate = 0.4 - 0.02 * (time % 200.0)
    assert found.known.all()
    assert np.cos(found.theta - true) == pytest.approx(1.0, abs=1e-12)
    assert found.omega == pytest.approx(rate, abs=1e-8)


@pytest.mark.false_alarm(2e-5)
@pytest.mark.parametrize(("interval", "size"), [(0.1, 5), (0.04, 5), (0.01, 17)])
def test_noise_shrinks_as_the_filter_of_savitzky_and_golay(
    interval: float, size: int, fresh_seed: Callable[[int], int]
) -> None:
    """Of five points or those in 0.16 s, whichever are more, by weights of another library.

    10,000 samples with correlated errors; 5 and 10 % are beyond 4 sd of the spread.
    """
    time = interval * np.arange(10_000)
    noise = np.random.default_rng(fresh_seed(4)).normal(0.0, 0.01, time.size)
    found = smooth_angle(time, noise)
    inner = slice(size // 2, -(size // 2))
    value, rate = (savgol_coeffs(size, 2, deriv=n, delta=interval, use="dot") for n in (0, 1))
    within = 0.05 if size == 5 else 0.1
    assert found.theta[inner].std() == pytest.approx(0.01 * np.sqrt((value**2).sum()), rel=within)
    assert found.omega[inner].std() == pytest.approx(0.01 * np.sqrt((rate**2).sum()), rel=within)
    assert found.theta[inner] == pytest.approx(np.convolve(noise, value, "valid"), abs=1e-12)


def test_an_angle_between_neighbours_is_interpolated_and_one_far_away_unknown() -> None:
    time = 0.1 * np.arange(100)
    theta = 0.5 * time
    theta[20] = np.nan
    theta[40:75] = np.nan
    found = smooth_angle(time, theta)
    assert found.theta[20] == pytest.approx(1.0)
    assert found.omega[20] == pytest.approx(0.5)
    # The last angle before the hole is at 3.9 s, the first after it at 7.5 s.
    assert np.flatnonzero(~found.known).tolist() == list(range(50, 65))


def test_no_window_reaches_over_a_long_gap() -> None:
    time = np.concatenate([0.1 * np.arange(10), 50.0 + 0.1 * np.arange(10)])
    theta = np.where(time < 25.0, 0.2 * time, 1.0 - 0.3 * time)
    found = smooth_angle(time, theta)
    assert found.omega == pytest.approx(np.where(time < 25.0, 0.2, -0.3), abs=1e-9)


@pytest.mark.parametrize("seen", [0, 4])
def test_too_few_angles_tell_nothing(seen: int) -> None:
    theta = np.full(50, np.nan)
    theta[:seen] = 0.1
    found = smooth_angle(0.1 * np.arange(50), theta)
    assert not found.known.any()
    assert np.isfinite(found.theta).all()
