"""Facts of a motion against closed forms, with gaps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from driftwalk.calibration.held_out.recorded import CHECKS, LAGS, motion_checks
from driftwalk.comparison.aspects import plan_aspects

INTERVAL = 0.1


def checks_of(
    x: np.ndarray, y: np.ndarray, time: np.ndarray | None = None, *, usual: float = 0.01
) -> dict[str, float]:
    """Return the facts of a motion in a tank of radius 1 m."""
    stamps = INTERVAL * np.arange(x.size) if time is None else time
    found = motion_checks(
        plan_aspects(stamps, step_interval=INTERVAL),
        x,
        y,
        wall=lambda x, y: 1.0 - np.hypot(x, y),
        depth=1.0,
        usual_step=usual,
    )
    return dict(zip(CHECKS, found.tolist(), strict=True))


def test_a_straight_path_gets_as_far_as_its_speed_says() -> None:
    x = 0.001 * np.arange(500)
    found = checks_of(x, 0 * x, usual=0.001)
    for lag in LAGS:
        assert found[f"displacement_{lag}"] == pytest.approx((0.001 * lag) ** 2)
    assert found["wall_share"] == 0.0
    assert found["rest_share"] == 0.0
    assert math.isnan(found["speed_time"])  # the speed does not vary


def test_a_gap_is_not_bridged() -> None:
    """Half a minute is missing, in which the body was carried far away."""
    time = INTERVAL * np.concatenate([np.arange(300), np.arange(600, 900)])
    x = 0.001 * np.concatenate([np.arange(300), 5000 + np.arange(300)])
    found = checks_of(x, 0 * x, time)
    for lag in LAGS:
        assert found[f"displacement_{lag}"] == pytest.approx((0.001 * lag) ** 2)


def test_a_random_walk_spreads_in_proportion_to_time() -> None:
    """Steps of 0.01 m in both directions: 2 s^2 lag.

    The standard error of the mean over 20,000 / lag independent stretches is sqrt(lag / 20,000) of
    it; the bound is five of those.
    """
    x, y = np.cumsum(np.random.default_rng(3).normal(0.0, 0.01, (2, 20_001)), axis=1)
    found = checks_of(x, y)
    for lag in LAGS:
        error = 5.0 * math.sqrt(lag / 20_000)
        assert found[f"displacement_{lag}"] == pytest.approx(2e-4 * lag, rel=error)


def test_the_memory_of_a_speed_is_that_of_its_process() -> None:
    """Speeds that forget by a twentieth in each interval: exp(-1) after -1 / ln 0.95 of them."""
    random = np.random.default_rng(4)
    speed = np.zeros(60_000)
    for k in range(1, speed.size):
        speed[k] = 0.95 * speed[k - 1] + random.normal(0.0, 0.05)
    x = np.cumsum(1e-3 * (1.0 + 0.3 * speed))
    expected = -INTERVAL / math.log(0.95)
    # The autocorrelation there has a standard error of some 0.02: 6 % of the time.
    assert checks_of(x, 0 * x)["speed_time"] == pytest.approx(expected, rel=0.2)


def test_shares_are_counted() -> None:
    """A quarter of the time at rest, and from there on in the outer fifth."""
    x = np.concatenate([np.full(101, 0.5), 0.5 + 0.001 * np.arange(1, 301), np.full(100, 0.9)])
    x = np.where(np.arange(x.size) < 401, x, 0.9 + 0.0005 * (np.arange(x.size) - 400))
    found = checks_of(x, 0 * x, usual=0.001)
    assert found["rest_share"] == pytest.approx(100 / 500, abs=0.005)
    assert found["wall_share"] == pytest.approx(np.mean(x[:-1] > 0.8), abs=0.005)


def test_a_motion_that_is_nowhere_has_no_facts() -> None:
    nowhere = np.full(200, np.nan)
    assert all(math.isnan(value) for value in checks_of(nowhere, nowhere).values())
