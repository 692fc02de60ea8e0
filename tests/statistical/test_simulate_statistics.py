"""Distributions. Seeds are fixed, so a failure repeats; were they redrawn, each check would fail
falsely at most once in 1e5 runs, unless it says otherwise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from single_block import MASS, SIDE, model, one_world, run, still, study, swirl

import driftwalk as dw
from driftwalk.core.seeds import world_keys
from driftwalk.simulation import initial

FALSE_ALARM = 1e-5


def _worlds(count: int, *, drag: float, force: float) -> np.ndarray:
    return np.repeat(one_world(drag=drag, force=force), count, axis=0)


def _is_variance(sample: np.ndarray, variance: float) -> bool:
    """Whether a centred normal sample may have a variance: chi-squared, two-sided."""
    low, high = stats.chi2.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], sample.size)
    return bool(low < np.sum(sample**2) / variance < high)


@pytest.mark.parametrize(("interval", "parts"), [(0.01, 1), (0.04, 4), (0.1, 10)])
def test_free_diffusion(interval: float, parts: int) -> None:
    # C_d = 0, no wall in reach: after n intervals the velocity is a sum of n draws, its variance
    # sigma_F^2 interval t / m^2; the position's is (sigma_F interval^2 / m)^2 sum (j + 1/2)^2.
    force, count, intervals = 1e-3, 2000, round(2.0 / interval)
    end = intervals * interval
    native = model(
        still,
        times=[end, end + 0.01],
        radius=5.0,
        nodes=np.arange(-1, 2) * 5.0,
        time_step=0.01,
        steps_per_interval=parts,
    )
    x, y, theta, status = run(native, _worlds(count, drag=0.0, force=force))
    assert not status.any()
    assert not theta.any()
    weights = np.arange(intervals) + 0.5
    for path in (x, y):
        assert _is_variance(path[:, 0], (force * interval**2 / MASS) ** 2 * np.sum(weights**2))
        # The mean velocity of the step after: the velocity, and half a step of the next draw.
        velocity = (path[:, 1] - path[:, 0]) / 0.01
        variance = force**2 / MASS**2 * (interval * end + 0.005**2)
        assert _is_variance(velocity, variance)
        assert stats.kstest(velocity / np.sqrt(variance), "norm").pvalue > FALSE_ALARM
    assert abs(stats.pearsonr(x[:, 0], y[:, 0]).statistic) < 4.5 / np.sqrt(count)


def test_only_the_noise_intensity_matters_where_the_interval_is_short() -> None:
    # The same sigma_F^2 interval at 10 and at 20 ms, with drag: displacements after 5 s come from
    # one distribution (two-sample KS), and from another where sigma_F alone is kept.
    count, samples = 1500, []
    for interval, force, seed in ((0.01, 1e-3, 1), (0.02, 1e-3 / np.sqrt(2), 2), (0.02, 1e-3, 3)):
        native = model(
            still,
            times=[0.0, 5.0],
            radius=1.0,
            time_step=0.01,
            steps_per_interval=round(interval / 0.01),
        )
        x, y, _, _ = run(
            native, _worlds(count, drag=0.45, force=force), seed=seed, precision="single"
        )
        samples.append(np.hypot(x[:, 1], y[:, 1]))
    assert stats.ks_2samp(samples[0], samples[1]).pvalue > FALSE_ALARM
    assert stats.ks_2samp(samples[0], samples[2]).pvalue < 1e-9


def test_camera_noise_has_the_spread_asked_for() -> None:
    time = np.arange(20_000) * 0.01
    for precision in ("single", "double"):
        native = model(still, times=time, position_noise=3e-4, orientation_noise=0.05)
        x, y, theta, _ = run(native, one_world(0.01, -0.02, 0.3), precision=precision)
        for sample, centre, std in ((x, 0.01, 3e-4), (y, -0.02, 3e-4), (theta, 0.3, 0.05)):
            noise = sample[0].astype(np.float64) - centre
            assert _is_variance(noise, std**2)
            assert stats.kstest(noise / std, "norm").pvalue > FALSE_ALARM
            neighbours = np.corrcoef(noise[:-1], noise[1:])[0, 1]
            assert abs(neighbours) < 4.5 / np.sqrt(noise.size)


def test_random_starts_are_uniform_over_the_poses_that_fit() -> None:
    # The orientation is uniform, and the position given it too: compared with poses drawn here by
    # rejection, corner by corner.
    chosen = study(tank={"diameter_m": 0.1})
    keys = world_keys(1, trial=0, replicate=np.arange(2500))
    start = initial.random_start(chosen, keys)
    rng = np.random.default_rng(8)
    x, y = rng.uniform(-0.05, 0.05, (2, 40_000))
    theta = rng.uniform(-np.pi, np.pi, x.size)
    angles = theta[:, None] + np.pi / 4 + np.arange(4) * np.pi / 2
    corners = np.hypot(
        x[:, None] + SIDE / np.sqrt(2) * np.cos(angles),
        y[:, None] + SIDE / np.sqrt(2) * np.sin(angles),
    )
    fits = (corners <= 0.05).all(axis=1)
    for drawn, expected in ((start.x, x), (start.y, y), (start.theta, theta)):
        assert stats.ks_2samp(np.asarray(drawn), expected[fits]).pvalue > FALSE_ALARM
    radius = np.hypot(np.asarray(start.x), np.asarray(start.y))
    assert stats.ks_2samp(radius, np.hypot(x, y)[fits]).pvalue > FALSE_ALARM
    quarter = np.remainder(np.asarray(start.theta), np.pi / 2)
    assert stats.kstest(quarter / (np.pi / 2), "uniform").pvalue > FALSE_ALARM


@pytest.mark.slow
def test_single_and_double_have_the_same_steps() -> None:
    # Paths part after some impacts; the distributions of steps must not. 40 worlds of 60 s each.
    keys = [world_keys(seed, trial=0, replicate=np.arange(40)) for seed in (1, 2)]
    native = model(swirl, times=np.arange(601) * 0.1)
    worlds = _worlds(40, drag=0.45, force=0.55e-3)
    single = run(native, worlds, keys=keys[0], precision="single")
    double = run(native, worlds, keys=keys[0], precision="double")
    other = run(native, worlds, keys=keys[1], precision="double")

    def steps(paths) -> np.ndarray:
        plan = dw.compare.plan_steps(np.arange(601) * 0.1)
        found = [
            dw.compare.apply_steps(plan, x, y) for x, y in zip(paths[0], paths[1], strict=True)
        ]
        return np.concatenate([np.column_stack([f.step_length, f.turning_angle]) for f in found])

    # Steps along a path are correlated, so another seed says what is ordinary.
    ordinary = dw.ks_distance(steps(double), steps(other))
    assert dw.ks_distance(steps(single), steps(double)) < ordinary < 0.1
