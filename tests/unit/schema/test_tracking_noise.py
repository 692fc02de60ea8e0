"""The tracking noise told apart from the body's own unrest."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from driftwalk.record import estimate_tracking_noise, noise_bound
from driftwalk.schema import Track

STEP_S = 0.1


def integrated_wiener(
    time: np.ndarray, intensity: float, random: np.random.Generator
) -> np.ndarray:
    """Return two paths under white acceleration, exact for any intervals."""
    paths = np.zeros((2, time.size))
    velocity = np.zeros(2)
    for index, step in enumerate(np.diff(time)):
        covariance = intensity * np.array([[step, step**2 / 2], [step**2 / 2, step**3 / 3]])
        kick = random.multivariate_normal([0.0, 0.0], covariance, size=2, method="cholesky")
        paths[:, index + 1] = paths[:, index] + velocity * step + kick[:, 1]
        velocity = velocity + kick[:, 0]
    return paths


def track_of(time: np.ndarray, paths: np.ndarray, theta: np.ndarray | None = None) -> Track:
    return Track(time, paths[0], paths[1], np.full(time.size, np.nan) if theta is None else theta)


@pytest.mark.false_alarm(1e-3)
@pytest.mark.parametrize(("ratio", "tolerance"), [(0.05, 0.065), (0.5, 0.065), (5.0, 0.11)])
def test_noise_for_several_ratios_of_unrest_to_noise(
    ratio: float, tolerance: float, fresh_seed: Callable[[int], int]
) -> None:
    """The ratio is q h^3 / r^2; 6000 samples.

    Over 25 seeds the sd was 1.2, 1.5 and 2.2 %; the tolerance is some 5 of them. A standard error
    of 8 blocks makes the deviation Student's t of 7 degrees of freedom: above 8 once in 10,000.
    """
    random = np.random.default_rng(fresh_seed(11))
    time = np.arange(6000) * STEP_S
    noise = 3e-4
    intensity = ratio * noise**2 / STEP_S**3
    paths = integrated_wiener(time, intensity, random) + random.normal(0.0, noise, (2, time.size))
    found = estimate_tracking_noise(track_of(time, paths))
    assert found.position_noise_m == pytest.approx(noise, rel=tolerance)
    error = found.position_noise_m - noise
    assert abs(error) < 8.0 * found.position_noise_standard_error_m
    assert found.position_noise_standard_error_m < 0.045 * noise
    if ratio > 1.0:  # below, the unrest drowns in the noise; here its sd is 22 %, of which 4
        assert found.acceleration_intensity_m2_s3 == pytest.approx(intensity, rel=0.9)
    assert np.isnan(found.orientation_noise_rad)


@pytest.mark.slow
@pytest.mark.false_alarm(1e-4)
def test_the_standard_error_covers(fresh_seed: Callable[[int], int]) -> None:
    """Forty recordings: the deviations in standard errors have a root mean square near one."""
    noise = 3e-4
    scores = []
    for seed in map(fresh_seed, range(40)):
        random = np.random.default_rng(seed)
        time = np.arange(3000) * STEP_S
        drift = np.stack([0.1 * np.sin(0.5 * time), 0.1 * np.cos(0.5 * time)])
        found = estimate_tracking_noise(
            track_of(time, drift + random.normal(0.0, noise, (2, time.size)))
        )
        scores.append((found.position_noise_m - noise) / found.position_noise_standard_error_m)
    # Chi-square with 40 degrees of freedom, jackknife of 8 blocks: 0.6 to 1.7 at 1 in 10^4.
    assert 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.7


@pytest.mark.false_alarm(1e-3)
def test_no_noise_is_none(fresh_seed: Callable[[int], int]) -> None:
    random = np.random.default_rng(fresh_seed(5))
    time = np.arange(5000) * STEP_S
    path = integrated_wiener(time, 4.5e-5, random)
    found = estimate_tracking_noise(track_of(time, path))
    assert found.position_noise_m < 0.03e-3  # q h^3 is (0.21 mm)^2
    assert found.acceleration_intensity_m2_s3 == pytest.approx(4.5e-5, rel=0.1)


@pytest.mark.slow
@pytest.mark.false_alarm(1e-3)
def test_an_uneven_clock_needs_no_special_case(fresh_seed: Callable[[int], int]) -> None:
    random = np.random.default_rng(fresh_seed(7))
    time = np.cumsum(random.uniform(0.065, 0.12, 6000))
    noise = 3e-4
    paths = integrated_wiener(time, 9e-5, random) + random.normal(0.0, noise, (2, time.size))
    found = estimate_tracking_noise(track_of(time, paths))
    assert found.position_noise_m == pytest.approx(noise, rel=0.05)


@pytest.mark.slow
@pytest.mark.false_alarm(1e-3)
def test_pixels_act_as_uniform_noise(fresh_seed: Callable[[int], int]) -> None:
    random = np.random.default_rng(fresh_seed(9))
    time = np.arange(6000) * STEP_S
    pixel = 1e-3
    paths = np.stack([0.1 * np.sin(0.6 * time), 0.1 * np.cos(0.6 * time)])
    paths = paths + integrated_wiener(time, 9e-5, random)
    found = estimate_tracking_noise(track_of(time, np.round(paths / pixel) * pixel))
    assert found.position_noise_m == pytest.approx(pixel / np.sqrt(12.0), rel=0.05)


@pytest.mark.false_alarm(1e-3)
def test_wall_hits_gaps_and_glitches_do_not_pass_for_noise(
    fresh_seed: Callable[[int], int],
) -> None:
    random = np.random.default_rng(fresh_seed(13))
    time = np.arange(8000) * STEP_S
    noise = 3e-4
    paths = np.stack([0.02 * time, 0.01 * time])
    hits = np.sort(random.choice(8000, 80, replace=False))
    for hit in hits:  # the velocity jumps
        paths[:, hit:] += random.normal(0.0, 0.05, (2, 1)) * (time[hit:] - time[hit])
    paths = paths + random.normal(0.0, noise, (2, time.size))
    glitches = random.choice(8000, 20, replace=False)
    paths[:, glitches] += 0.02
    present = np.ones(time.size, dtype=bool)
    present[random.choice(8000, 300, replace=False)] = False
    present[3000:3400] = False
    paths[:, 3400:] += 0.5  # what happened in the gap is nobody's noise
    found = estimate_tracking_noise(track_of(time[present], paths[:, present]))
    assert found.position_noise_m == pytest.approx(noise, rel=0.05)


def test_orientation_noise_across_the_wrap_and_missing_angles() -> None:
    random = np.random.default_rng(17)
    time = np.arange(6000) * STEP_S
    noise = np.radians(0.5)
    theta = 0.6 * time + 0.3 * np.sin(time) + random.normal(0.0, noise, time.size)
    theta = np.pi - np.mod(np.pi - theta, 2 * np.pi)
    theta[random.choice(6000, 100, replace=False)] = np.nan
    found = estimate_tracking_noise(track_of(time, np.zeros((2, time.size)), theta))
    assert found.orientation_noise_rad == pytest.approx(noise, rel=0.05)
    assert found.position_noise_m == 0.0


def test_noise_scales_with_the_unit_and_not_with_the_clock() -> None:
    random = np.random.default_rng(19)
    time = np.arange(1000) * STEP_S
    paths = random.normal(0.0, 1.0, (2, time.size))
    base = estimate_tracking_noise(track_of(time, paths))
    scaled = estimate_tracking_noise(track_of(time * 50.0 + 3.0, paths * 1e-3))
    assert scaled.position_noise_m == pytest.approx(1e-3 * base.position_noise_m, rel=1e-6)
    assert scaled.windows == base.windows


@pytest.mark.parametrize("count", [0, 1, 4, 5, 30])
def test_too_few_samples_give_no_estimate(count: int) -> None:
    time = np.arange(count) * STEP_S
    found = estimate_tracking_noise(track_of(time, np.zeros((2, count))))
    assert np.isnan(found.position_noise_m)
    assert found.windows == 0


def jerks_and_rests(random: np.random.Generator, samples: int) -> np.ndarray:
    """Return paths of a body that rests for half of its time, and jerks by some mm in between."""
    moves = np.repeat(random.random(samples // 4 + 1) < 0.5, 4)[:samples]
    return np.cumsum(random.normal(0.0, 3e-3, (2, samples)) * moves, axis=1)


@pytest.mark.false_alarm(1e-3)
@pytest.mark.parametrize(("pixel", "most"), [(0.0, 1.6), (1e-5, 1.8)])
def test_jerks_between_rests_do_not_pass_for_noise(
    pixel: float, most: float, fresh_seed: Callable[[int], int]
) -> None:
    """Noise of 0.08 mm; half of the steps are rests, and hardly another one is as short.

    A share s of all steps is 2 s of the rests, so the bound is above the noise by
    sqrt(ln(1 - 2 s) / ln(1 - s)): from 1.42 at 1 % to 1.51 at 20 %. The smallest of five bounds is
    lower than that by 4.5 standard errors of the 60 steps at 1 %, 6.5 % each, once in 10^5. Pixels
    of 0.01 mm lengthen the steps at 20 %, of 0.11 mm, by 0.014 mm.
    """
    random = np.random.default_rng(fresh_seed(23))
    time = np.arange(6000) * STEP_S
    noise = 8e-5
    paths = jerks_and_rests(random, time.size) + random.normal(0.0, noise, (2, time.size))
    if pixel:
        paths = np.round(paths / pixel) * pixel
    track = track_of(time, paths)
    found, bound = estimate_tracking_noise(track), noise_bound(track)
    assert found.position_noise_m == bound.position_noise_m
    assert found.position_noise_standard_error_m == bound.standard_error_m
    assert noise < bound.position_noise_m < most * noise


@pytest.mark.false_alarm(1e-3)
def test_a_body_at_rest_has_its_noise_for_a_bound(fresh_seed: Callable[[int], int]) -> None:
    """The step of a resting body has the length 2 r sqrt(-ln(1 - s)) at the share s.

    The largest share, 1200 of 6000 steps, is good to 1.5 % (steps that share a sample included,
    1.7 %); the smallest of five bounds is lower than it by 5 standard errors of 60 steps at most.
    """
    random = np.random.default_rng(fresh_seed(29))
    time = np.arange(6000) * STEP_S
    bound = noise_bound(track_of(time, random.normal(0.0, 3e-4, (2, time.size))))
    assert 0.67 * 3e-4 < bound.position_noise_m < 1.09 * 3e-4
    assert bound.standard_error_m < 0.07 * 3e-4


def test_repeated_positions_are_no_rests_without_noise() -> None:
    random = np.random.default_rng(31)
    time = np.arange(6000) * STEP_S
    paths = jerks_and_rests(random, time.size) + random.normal(0.0, 8e-5, (2, time.size))
    once = noise_bound(track_of(time, paths))
    twice = noise_bound(track_of(np.arange(12000) * STEP_S, np.repeat(paths, 2, axis=1)))
    assert twice.position_noise_m == pytest.approx(once.position_noise_m, rel=0.02)


@pytest.mark.parametrize("count", [0, 1, 100])
def test_few_steps_bound_nothing(count: int) -> None:
    time = np.arange(count) * STEP_S
    assert noise_bound(track_of(time, np.zeros((2, count)))).position_noise_m == np.inf
