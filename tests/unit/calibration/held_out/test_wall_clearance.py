"""The distance from the wall at contact, of walkers that slide along it and of drawn distances."""

from __future__ import annotations

import numpy as np
import pytest
from sliding_walkers import CLEARANCE, NOISE, TANK, sliding_recording

from driftwalk.calibration.held_out.wall_clearance import estimate_clearance


@pytest.mark.slow
@pytest.mark.parametrize("name", ["run_and_tumble", "active_chiral", "two_state"])
def test_the_noise_of_the_camera_brings_no_wall_nearer(name: str) -> None:
    """The 1 % quantile of the recorded distances is 0.4 mm too short."""
    recording = sliding_recording(name, 300.0, seed=4)
    from_wall = TANK - np.hypot(recording["x"].values, recording["y"].values).ravel()
    assert np.quantile(from_wall, 0.01) < CLEARANCE - 3e-4
    # The camera's noise is estimated, to some 5 %.
    for noise in (NOISE, 0.95 * NOISE, 1.05 * NOISE):
        found = estimate_clearance(from_wall, noise)
        assert abs(found.distance - CLEARANCE) < 3.0 * found.std
        assert found.std < 3e-5


def drawn(random: np.random.Generator, *, at_wall: float, noise: float = NOISE) -> np.ndarray:
    """Return distances from the wall, a share of them at contact and the others up to 0.1 m."""
    inwards = 0.1 * random.beta(1.0, 2.0, 3000)
    true = CLEARANCE + np.where(random.random(3000) < at_wall, 0.0, inwards)
    return true + noise * random.normal(size=true.size)


@pytest.mark.slow
@pytest.mark.parametrize("at_wall", [0.0, 0.05, 0.5])
def test_errors_are_as_large_as_stated(at_wall: float) -> None:
    """Ten recordings: the mean square of errors over their standard errors is 1 ± 0.45."""
    random = np.random.default_rng(7)
    found = [estimate_clearance(drawn(random, at_wall=at_wall), NOISE) for _ in range(10)]
    errors = [(one.distance - CLEARANCE) / one.std for one in found]
    assert 0.2 < np.mean(np.square(errors)) < 2.8


def test_tracking_errors_beyond_the_wall_count_little() -> None:
    random = np.random.default_rng(8)
    from_wall = drawn(random, at_wall=0.3)
    from_wall[:15] = random.uniform(-0.01, CLEARANCE, 15)
    assert estimate_clearance(from_wall, NOISE).distance == pytest.approx(CLEARANCE, abs=6e-5)


def test_without_noise_the_edge_is_sharp() -> None:
    from_wall = drawn(np.random.default_rng(9), at_wall=0.3, noise=0.0)
    assert estimate_clearance(from_wall, 0.0).distance == pytest.approx(CLEARANCE, abs=1e-5)


def test_a_body_that_is_never_at_the_wall_says_little() -> None:
    from_wall = np.random.default_rng(10).normal(0.06, 0.01, 3000)
    assert estimate_clearance(from_wall, NOISE).std > NOISE
