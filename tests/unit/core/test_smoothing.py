"""Local quadratic smoothing against polyfit, savgol_filter and exact parabolas."""

from __future__ import annotations

import time as clock

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings, strategies as st
from scipy.signal import savgol_filter

from driftwalk.core.errors import InputError
from driftwalk.core.smoothing import MIN_SAMPLES, local_quadratic

Array = npt.NDArray[np.float64]


def fit_each_window(
    time: Array, values: Array, window: float, gap_factor: float = 1.5
) -> tuple[Array, Array, Array]:
    """Oracle: one polyfit per sample, over the window clipped at gaps."""
    gap = gap_factor * float(np.median(np.diff(time)))
    run = np.concatenate([[0], np.cumsum(np.diff(time) > gap)])
    fit = np.full((3, time.size), np.nan)
    for i in range(time.size):
        near = (abs(time - time[i]) <= window / 2 + 1e-9) & (run == run[i])
        if near.sum() >= MIN_SAMPLES:
            c = np.polyfit(time[near] - time[i], values[near], 2)
            fit[:, i] = c[2], c[1], 2.0 * c[0]
    return fit[0], fit[1], fit[2]


def assert_same_fit(got: tuple[Array, ...], expected: tuple[Array, ...], tolerance: float) -> None:
    for one, other in zip(got, expected, strict=True):
        scale = np.nanmax(abs(other), initial=1e-300)
        np.testing.assert_allclose(one, other, rtol=0.0, atol=tolerance * scale)


def synthetic_walk(n: int, seed: int) -> Array:
    return np.cumsum(np.random.default_rng(seed).normal(size=n))


def test_matches_savgol_filter_inside_a_uniform_run() -> None:
    values = synthetic_walk(200, 1)
    time = np.arange(200) * 0.1
    got = local_quadratic(time, values, window=0.7)
    for derivative in range(3):
        oracle = savgol_filter(values, 7, 2, deriv=derivative, delta=0.1)
        np.testing.assert_allclose(got[derivative][3:-3], oracle[3:-3], rtol=0, atol=1e-9)


def test_matches_polyfit_at_the_ends_of_a_uniform_run() -> None:
    values, time = synthetic_walk(60, 2), np.arange(60) * 0.1
    assert_same_fit(
        local_quadratic(time, values, window=0.9), fit_each_window(time, values, 0.9), 1e-11
    )


def test_matches_polyfit_on_an_uneven_clock_with_gaps() -> None:
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.06, 0.13, 300) + np.where(rng.random(300) < 0.05, 0.4, 0.0))
    values = synthetic_walk(300, 4)
    expected = fit_each_window(time, values, 0.7)
    assert np.isnan(expected[0]).any()
    found = local_quadratic(time, values, window=0.7)
    assert_same_fit(found, expected, 1e-10)
    for whole, some in zip(
        found, local_quadratic(time, values, window=0.7, at=slice(2)), strict=True
    ):
        np.testing.assert_array_equal(some[:2], whole[:2])
        assert np.isnan(some[2:]).all()


def test_no_window_reaches_across_a_gap() -> None:
    time = np.concatenate([np.arange(10) * 0.1, 1.3 + np.arange(10) * 0.1])
    values = np.where(time < 1.2, 0.0, 100.0)
    _, velocity, acceleration = local_quadratic(time, values, window=1.5)
    np.testing.assert_array_equal(velocity, 0.0)
    np.testing.assert_array_equal(acceleration, 0.0)
    bridged = local_quadratic(time, values, window=1.5, gap_factor=10.0)[1]
    assert abs(bridged).max() > 10.0


def test_short_runs_and_missing_samples_are_nan() -> None:
    time = np.concatenate([np.arange(4) * 0.1, 5.0 + np.arange(9) * 0.1])
    values = np.ones((13, 2))
    values[8, 1] = np.nan
    value, velocity, _ = local_quadratic(time, values, window=1.0, gap_factor=3.0)
    assert np.isnan(value[:4]).all()
    assert np.isnan(value[8]).all()
    present = [4, 5, 6, 7, 9, 10, 11, 12]
    np.testing.assert_allclose(value[present], 1.0)
    np.testing.assert_allclose(velocity[present], 0.0, atol=1e-12)


def test_columns_are_fitted_one_by_one_and_shape_is_kept() -> None:
    time = np.arange(50) * 0.04
    values = np.column_stack([synthetic_walk(50, 5), synthetic_walk(50, 6)])
    together = local_quadratic(time, values, window=0.4)
    for column in range(2):
        alone = local_quadratic(time, values[:, column], window=0.4)
        for one, other in zip(together, alone, strict=True):
            assert one.shape == (50, 2)
            np.testing.assert_allclose(one[:, column], other, rtol=1e-12, atol=1e-12)


def test_large_offsets_cost_no_digits() -> None:
    time = 1.7e9 + np.cumsum(np.random.default_rng(7).integers(2, 5, 100)) / 32.0
    tau = time - time[0]
    values = 1e6 + 0.25 * tau - 0.5 * tau**2
    _, velocity, acceleration = local_quadratic(time, values, window=1.0)
    np.testing.assert_allclose(acceleration, -1.0, atol=1e-6)
    np.testing.assert_allclose(velocity, 0.25 - tau, atol=1e-6)


def test_bunched_times_that_determine_no_parabola_are_nan() -> None:
    time = np.array([0.0, 1e-13, 2e-13, 3e-13, 1.0])
    assert np.isnan(local_quadratic(time, time, window=4.0, gap_factor=1e14)[0]).all()


def test_empty_and_tiny_tracks() -> None:
    for n in (0, 1, 4):
        value, _, _ = local_quadratic(np.arange(n), np.arange(n), window=10.0)
        assert value.shape == (n,)
        assert np.isnan(value).all()


@pytest.mark.parametrize(
    ("time", "values", "options", "message"),
    [
        ([0.0, 1.0], [0.0], {"window": 1.0}, "same number"),
        ([0.0, 1.0], [0.0, 1.0], {"window": 0.0}, "window"),
        ([0.0, 1.0], [0.0, 1.0], {"window": float("nan")}, "window"),
        ([0.0, 0.0], [0.0, 1.0], {"window": 1.0}, "increasing"),
        ([0.0, 1.0], [0.0, 1.0], {"window": 1.0, "gap_factor": 0.5}, "gap_factor"),
    ],
)
def test_refuses(time: list[float], values: list[float], options: dict[str, float], message: str):
    with pytest.raises(InputError, match=message):
        local_quadratic(time, values, **options)  # type: ignore[arg-type]


@settings(deadline=None, max_examples=40)
@given(
    intervals=st.lists(st.floats(0.01, 0.3), min_size=6, max_size=40),
    coefficients=st.tuples(*[st.floats(-10.0, 10.0)] * 3),
)
def test_a_parabola_is_returned_exactly(
    intervals: list[float], coefficients: tuple[float, float, float]
) -> None:
    time = np.cumsum(intervals)
    c, b, a = coefficients
    got = local_quadratic(time, a * time**2 + b * time + c, window=1.0, gap_factor=1e3)
    fitted = np.isfinite(got[0])
    expected = (a * time**2 + b * time + c, 2.0 * a * time + b, np.full(time.size, 2.0 * a))
    for one, other in zip(got, expected, strict=True):
        np.testing.assert_allclose(one[fitted], other[fitted], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_a_million_samples_take_a_few_seconds(jitter: float) -> None:
    rng = np.random.default_rng(8)
    time = (np.arange(200_000) + jitter * rng.random(200_000)) * 0.1
    values = rng.normal(size=(200_000, 2))
    start = clock.process_time()
    local_quadratic(time, values, window=0.7)
    assert clock.process_time() - start < 10.0
