"""The two stages of matching summaries, with simulators whose answer is known in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import chi2

from driftwalk.calibration.estimation.estimate import (
    MATCHING,
    Matched,
    match_summaries,
    most_simulations,
)

SPREAD = np.array([0.02, 0.04, 0.03, 0.05, 0.02, 0.03])
TRUTH = np.array([0.4, 0.6])
EVEN = np.array([0.41, 0.57])
Expected = Callable[[np.ndarray], np.ndarray]


def bent(settings: np.ndarray) -> np.ndarray:
    a, b = settings.T
    return np.column_stack([np.exp(a), a * b, b**2, a - b, np.sin(2 * a), b / (1 + a)])


def waves(count: float) -> Expected:
    """Return summaries that tell a setting only from those nearby: so many waves in the ranges."""

    def expected(settings: np.ndarray) -> np.ndarray:
        turns = 2 * np.pi * count * settings
        return 0.5 * np.column_stack([np.sin(turns), np.cos(turns), np.sin(1.37 * turns)])

    return expected


class Toy:
    """Gives summaries of settings, with noise, and those of a recording without."""

    def __init__(self, expected: Expected, seed: int, *, off: float = 0.0) -> None:
        self.expected, self.rng = expected, np.random.default_rng(seed)
        self.recorded = expected(np.array([TRUTH, EVEN]))
        # One summary that the model cannot give, by so many of its standard deviations.
        self.recorded[:, 3] += off * SPREAD[3]
        self.simulated = 0

    def __call__(self, settings: np.ndarray, *, parts: int = 1) -> np.ndarray:
        assert settings.min() >= 0.0
        assert settings.max() <= 1.0
        self.simulated += len(settings)
        found = self.expected(settings)[:, None]
        return found + SPREAD * self.rng.normal(size=(len(settings), parts, SPREAD.size))


class Starts:
    def __init__(self, *points: tuple[float, float]) -> None:
        self.points, self.calls = np.array(points), 0

    def __call__(self) -> np.ndarray:
        self.calls += 1
        return self.points


def matched(toy: Toy, starts: Starts, *, replicates: int = 60, seed: int = 1) -> Matched:
    found = match_summaries(toy, 2, starts, order=np.asarray, replicates=replicates, seed=seed)
    assert toy.simulated <= most_simulations(2, replicates)
    return found


def deviations() -> np.ndarray:
    """Return the standard deviations of the posterior at the truth, from numerical slopes."""
    step = 1e-5
    shifts = step * np.eye(2)
    slopes = (bent(TRUTH + shifts) - bent(TRUTH - shifts)).T / (2 * step)
    scaled = slopes / SPREAD[:, None]
    return np.sqrt(np.diag(np.linalg.inv(scaled.T @ scaled)))


@pytest.mark.slow
def test_a_recording_of_the_model_is_matched_by_its_summaries_alone():
    """The search is not asked for; intervals are those of the model, and so are the discrepancies.

    Six summaries less two parameters leave a chi-square with 4 degrees of freedom; the median of
    200 such numbers has an error of 0.24, their 95 % quantile one of 0.8.
    """
    starts = Starts()
    found = matched(Toy(bent, 1), starts, replicates=200)
    assert starts.calls == 0
    assert found.discrepancy.usual
    assert not found.undetermined
    assert found.stretch == 1.0
    std = deviations()
    assert (np.abs(found.point - TRUTH) < 0.6 * std).all()
    assert (np.abs(found.even_point - EVEN) < 0.6 * std).all()
    np.testing.assert_allclose(found.sample.std(axis=0), std, rtol=0.25)
    assert found.discrepancy.median == pytest.approx(chi2(4).median(), abs=1.1)
    assert found.discrepancy.upper == pytest.approx(chi2(4).ppf(0.95), abs=4.0)
    assert found.discrepancy.value < MATCHING.matches * SPREAD.size


@pytest.mark.slow
def test_what_the_model_cannot_give_widens_the_draws():
    """One summary is ten deviations off: draws are spread as the discrepancy is above its usual
    one."""
    starts = Starts((0.4, 0.6), (0.41, 0.6), (0.9, 0.9))
    found = matched(Toy(bent, 2, off=10.0), starts)
    assert starts.calls == 1
    assert not found.discrepancy.usual
    assert (
        MATCHING.matches * SPREAD.size
        < found.discrepancy.value
        < MATCHING.no_restart_above * SPREAD.size
    )
    assert found.stretch == pytest.approx(
        np.sqrt(found.discrepancy.value / found.discrepancy.median)
    )
    assert found.stretch > 2.0
    assert found.undetermined
    np.testing.assert_allclose(found.sample.std(axis=0), found.stretch * deviations(), rtol=0.35)
    np.testing.assert_allclose(found.point, np.median(found.sample, axis=0), atol=1e-9)


@pytest.mark.slow
def test_a_small_misfit_leaves_parameters_determined():
    """One summary is three deviations off, 9 of discrepancy beside the usual 3.4 of 4 degrees."""
    found = matched(Toy(bent, 2, off=3.0), Starts((0.4, 0.6)), replicates=200)
    assert 1.0 < found.discrepancy.value / found.discrepancy.median < 4.0
    assert not found.undetermined


@pytest.mark.slow
def test_another_start_is_no_use_for_another_model():
    starts = Starts((0.4, 0.6))
    found = matched(Toy(bent, 3, off=300.0), starts)
    assert starts.calls == 0
    assert found.discrepancy.value > MATCHING.no_restart_above * SPREAD.size
    assert not found.discrepancy.usual
    assert ((found.sample >= 0.0) & (found.sample <= 1.0)).all()


@pytest.mark.slow
def test_a_regression_with_large_errors_is_a_start_all_the_same():
    """Three waves: the errors of a regression over the whole ranges are a quarter of them."""
    starts = Starts((0.9, 0.1))
    found = matched(Toy(waves(3.0), 4), starts)
    assert starts.calls == 0
    assert found.discrepancy.usual
    np.testing.assert_allclose(found.point, TRUTH, atol=0.01)


@pytest.mark.slow
def test_where_summaries_find_no_neighbourhood_the_search_does():
    """Five waves look the same at more settings: only a start near the truth ends at it."""
    starts = Starts((0.9, 0.1), (0.91, 0.11), (0.42, 0.58))
    found = matched(Toy(waves(5.0), 4), starts)
    assert starts.calls == 1
    assert found.discrepancy.usual
    np.testing.assert_allclose(found.point, TRUTH, atol=0.01)


@pytest.mark.slow
def test_draws_are_put_in_order():
    """Two parameters that change places: the larger one comes first here."""

    def alike(settings: np.ndarray) -> np.ndarray:
        a, b = settings.T
        return np.column_stack([a + b, a * b, a**2 + b**2, (a - b) ** 2, a * b * (a + b), a + b])

    def larger_first(settings: np.ndarray) -> np.ndarray:
        return -np.sort(-settings, axis=1)

    toy = Toy(alike, 5)
    found = match_summaries(toy, 2, Starts(), order=larger_first, replicates=20, seed=5)
    assert (found.sample[:, 0] >= found.sample[:, 1]).all()
    np.testing.assert_allclose(found.point, TRUTH[::-1], atol=4 * found.sample.std(axis=0).max())


@pytest.mark.slow
def test_the_same_seed_gives_the_same_answer():
    first, again = (matched(Toy(bent, 6), Starts(), replicates=10) for _ in range(2))
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one, other)
