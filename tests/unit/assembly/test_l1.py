"""The l1 distance of outcome distributions, and its noise floor against exact sums."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import binom

from driftwalk.assembly.outcomes.distribution import outcome_distribution
from driftwalk.assembly.outcomes.l1 import l1_distance, l1_in_floors, l1_noise_floor, pairwise_l1
from driftwalk.core.errors import InputError


def two_class_law(p: float, runs_a: int, runs_b: int | None) -> tuple[np.ndarray, np.ndarray]:
    """All l1 distances that two samples of two classes can have, and their probabilities.

    By brute force over all pairs of counts: the distance is twice that of the first proportion.
    """
    a = np.arange(runs_a + 1)
    if runs_b is None:
        other, weight = np.array([p]), np.array([1.0])
    else:
        b = np.arange(runs_b + 1)
        other, weight = b / runs_b, binom.pmf(b, runs_b, p)
    distance = 2 * np.abs(a[:, None] / runs_a - other)
    return distance.ravel(), (binom.pmf(a, runs_a, p)[:, None] * weight).ravel()


@pytest.mark.parametrize("p", [0.5, 0.2, 0.004])
@pytest.mark.parametrize(("runs_a", "runs_b"), [(60, 60), (200, 35), (150, None), (1, 1)])
def test_the_mean_floor_is_the_exact_sum(p: float, runs_a: int, runs_b: int | None) -> None:
    """Within 5 standard errors of the draws: 12 cases, false alarm 7e-6 in all."""
    distance, weight = two_class_law(p, runs_a, runs_b)
    exact = (distance * weight).sum()
    floor = l1_noise_floor([p, 1 - p], runs_a, runs_b)
    assert abs(floor.mean - exact) <= 5 * floor.standard_error
    spread = np.sqrt((distance**2 * weight).sum() - exact**2)
    assert floor.standard_error == pytest.approx(spread / np.sqrt(20_000), rel=0.1)


@pytest.mark.parametrize(("runs_a", "runs_b"), [(1000, 1000), (2000, 300), (1000, None)])
def test_the_quantile_has_its_probability(runs_a: int, runs_b: int | None) -> None:
    """The exact law at the quantile; 20,000 draws scatter by 0.0015 around 0.95."""
    distance, weight = two_class_law(0.3, runs_a, runs_b)
    quantile = l1_noise_floor([0.3, 0.7], runs_a, runs_b, quantile=0.95).quantile
    at_most = weight[distance <= quantile + 1e-12].sum()
    below = weight[distance < quantile - 1e-12].sum()
    # A count law has steps: the quantile sits on one.
    assert below - 0.008 <= 0.95 <= at_most + 0.008


@pytest.mark.parametrize("runs_b", [1000, None])
def test_the_normal_mean_of_two_classes(runs_b: int | None) -> None:
    """|x - y| of a normal difference with variance v has mean sqrt(2 v / pi), twice over."""
    variance = 0.2 * 0.8 * (1 / 1000 + (0 if runs_b is None else 1 / runs_b))
    floor = l1_noise_floor([0.2, 0.8], 1000, runs_b)
    assert floor.normal_mean == pytest.approx(2 * np.sqrt(2 * variance / np.pi), rel=1e-12)
    assert floor.mean == pytest.approx(floor.normal_mean, rel=0.03)


def test_many_classes_against_sums_of_binomials() -> None:
    """The mean is a sum over classes, each a binomial of its own, however they depend."""
    p = np.array([0.35, 0.3, 0.2, 0.1, 0.04, 0.009, 0.001])
    runs = 400
    exact = 0.0
    for q in p:
        pmf = binom.pmf(np.arange(runs + 1), runs, q)
        difference = np.convolve(pmf, pmf[::-1])
        exact += (np.abs(np.arange(-runs, runs + 1)) * difference).sum() / runs
    floor = l1_noise_floor(p, runs, runs)
    assert abs(floor.mean - exact) <= 5 * floor.standard_error
    # Rare classes: the normal approximation is too high.
    assert exact < floor.normal_mean < 1.05 * exact


def test_classes_that_never_occur_change_nothing_and_the_seed_decides() -> None:
    floor = l1_noise_floor([0.6, 0.4], 100, 50, seed=4)
    assert l1_noise_floor([0.6, 0.0, 0.4, 0.0], 100, 50, seed=4) == floor
    assert l1_noise_floor([0.6, 0.4], 100, 50, seed=5).mean != floor.mean
    assert l1_noise_floor([1.0, 0.0], 100, 50)[:3] == (0.0, 0.0, 0.0)


def test_a_large_table_is_drawn_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    import driftwalk.assembly.outcomes.l1 as module

    monkeypatch.setattr(module, "ENTRIES_AT_ONCE", 1000)
    distance, weight = two_class_law(0.5, 20, 20)
    floor = l1_noise_floor([0.5, 0.5], 20, 20, samples=20_001)
    assert abs(floor.mean - (distance * weight).sum()) <= 5 * floor.standard_error


WEIGHTS = arrays(np.float64, 6, elements=st.floats(0, 10)).filter(lambda w: w.sum() > 0.1)


@pytest.mark.slow
@given(WEIGHTS, WEIGHTS, WEIGHTS)
def test_it_is_a_distance_from_0_to_2(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> None:
    a, b, c = a / a.sum(), b / b.sum(), c / c.sum()
    by_hand = sum(abs(float(x) - float(y)) for x, y in zip(a, b, strict=True))
    assert l1_distance(a, b) == pytest.approx(by_hand, abs=1e-12)
    assert l1_distance(a, b) == l1_distance(b, a)
    assert l1_distance(a, a) == 0.0
    assert 0 <= l1_distance(a, b) <= 2 + 1e-12
    assert l1_distance(a, c) <= l1_distance(a, b) + l1_distance(b, c) + 1e-12


def test_distributions_are_aligned_by_name() -> None:
    a = outcome_distribution({"O": 3, "I": 1})
    b = outcome_distribution({"2+2": 2, "I": 1, "O": 1})
    assert l1_distance(a, b) == pytest.approx(0.5 + 0.0 + 0.5)
    assert l1_distance(a["proportion"], {"I": 1.0}) == pytest.approx(0.75 + 0.75)
    assert l1_distance({"O": 1.0}, {"I": 1.0, "O": 0.0}) == 2.0


def test_pairs() -> None:
    given = [[1.0, 0.0], [0.5, 0.5], [0.25, 0.75]]
    found = pairwise_l1(given)
    np.testing.assert_allclose(found.distance, [[0, 1, 1.5], [1, 0, 0.5], [1.5, 0.5, 0]])
    assert (found.mean, found.largest) == (1.0, 1.5)


@pytest.mark.false_alarm(1e-5)
def test_ten_realisations_lie_at_the_floor(fresh_seed: Callable[[int], int]) -> None:
    """The mean over 45 pairs scatters by 11 % (2000 repetitions); here that of 20 such means, 5 of
    its standard errors allowed: false alarm 6e-7."""
    p = [0.05, 0.3, 0.25, 0.2, 0.18, 0.0, 0.0, 0.01, 0.01, 0.0]
    samples = np.random.default_rng(fresh_seed(2)).multinomial(1000, p, size=(20, 10)) / 1000
    mean = np.mean([pairwise_l1(list(ten)).mean for ten in samples])
    floor = l1_noise_floor(p, 1000, 1000)
    assert mean == pytest.approx(floor.mean, rel=5 * 0.114 / np.sqrt(20))


@pytest.mark.false_alarm(3e-5)
def test_distances_in_floors_are_about_one_where_nothing_differs(
    fresh_seed: Callable[[int], int],
) -> None:
    """400 settings of one distribution: the mean of the ratio has standard error 0.023 (measured).

    False alarm 1e-5 for each of the three.
    """
    rng = np.random.default_rng(fresh_seed(3))
    p = np.array([0.4, 0.3, 0.2, 0.1])
    same = rng.multinomial(500, p, size=(20, 20)) / 500
    reference = rng.multinomial(2_000_000, p) / 2_000_000
    found = l1_in_floors(same, reference, runs=500, reference_runs=2_000_000)
    assert found.shape == (20, 20)
    assert found.mean() == pytest.approx(1.0, abs=0.1)
    exact = l1_in_floors(same, p, runs=500, reference_runs=None)
    assert exact.mean() == pytest.approx(1.0, abs=0.1)
    other = rng.multinomial(500, p, size=400) / 500
    both = [
        float(l1_in_floors(x, y, runs=500, reference_runs=500))
        for x, y in zip(same.reshape(-1, 4), other, strict=True)
    ]
    assert np.mean(both) == pytest.approx(1.0, abs=0.1)


def test_a_distance_in_floors_by_hand() -> None:
    """Pooled (40 + 5) / 150 = 0.3 of the first class."""
    floor = 2 * np.sqrt(2 / np.pi * 0.3 * 0.7 * (1 / 100 + 1 / 50))
    found = l1_in_floors([0.4, 0.6], [0.1, 0.9], runs=100, reference_runs=50)
    assert float(found) == pytest.approx(0.6 / floor, rel=1e-12)


def test_settings_without_a_distance_in_floors() -> None:
    p = [[0.5, 0.5], [np.nan, 0.5], [0.5, 0.5], [1.0, 0.0]]
    found = l1_in_floors(p, [1.0, 0.0], runs=[10, 10, 0, 10], reference_runs=None)
    np.testing.assert_array_equal(found, [np.inf, np.nan, np.nan, 0.0])


@pytest.mark.parametrize(
    ("a", "b", "message"),
    [
        ([1.0], [0.5, 0.5], "over 1 and 2 classes cannot be aligned"),
        ([], [], "a row of proportions, got shape \\(0,\\)"),
        ([[1.0]], [1.0], "a row of proportions, got shape \\(1, 1\\)"),
        ([3, 4], [0.5, 0.5], "must sum to 1, these sum to 7: divide counts"),
        ([1.5, -0.5], [0.5, 0.5], "negative or not finite"),
        ([np.nan, 0.5], [0.5, 0.5], "negative or not finite"),
        ({"O": 1.0}, [1.0], "has class names and the other has none"),
        ({"O": 1.0}, {"2+1": 1.0}, "no class in common \\('O', ... and '2\\+1', ...\\)"),
        (xr.Dataset(), {"O": 1.0}, "'proportion' is missing"),
        (xr.DataArray([1.0], dims="x"), {"O": 1.0}, "the one dimension 'class'"),
        (
            xr.DataArray([0.5, 0.5], dims="class", coords={"class": ["O", "O"]}),
            {"O": 1.0},
            "names a class twice",
        ),
        (
            outcome_distribution({"S": 1}).assign_attrs(chirality="merged"),
            outcome_distribution({"S": 1}).assign_attrs(chirality="distinct"),
            "count mirror images differently",
        ),
    ],
)
def test_what_cannot_be_compared_is_said(a: Any, b: Any, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        l1_distance(a, b)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("runs_a", "runs_b", "options", "message"),
    [
        (0, 10, {}, "runs_a must be a whole number of at least 1, got 0"),
        (10, 0, {}, "runs_b must be"),
        (10.5, 10, {}, "runs_a must be"),
        (10, 10, {"quantile": 1.0}, "quantile must lie"),
        (10, 10, {"samples": 10}, "samples must be at least 100"),
        (10, 10, {"seed": -1}, "seed must not be negative"),
    ],
)
def test_wrong_options_of_the_floor_are_said(
    runs_a: Any, runs_b: Any, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        l1_noise_floor([0.5, 0.5], runs_a, runs_b, **options)


@pytest.mark.parametrize(
    ("p", "runs", "reference_runs", "message"),
    [
        ([[1.0]], 10, 10, "do not end with the 2 classes"),
        (0.5, 10, 10, "do not end with the 2 classes"),
        ([[0.5, 0.5]], [10, 10], 10, "runs of shape \\(2,\\) do not fit"),
        ([[0.5, 0.5]], -1, 10, "negative"),
        ([[0.5, 0.5]], 10, 0, "reference_runs must be at least 1"),
    ],
)
def test_wrong_maps_are_said(p: Any, runs: Any, reference_runs: int, message: str) -> None:
    with pytest.raises(InputError, match=message):
        l1_in_floors(p, [0.5, 0.5], runs=runs, reference_runs=reference_runs)


def test_fewer_than_two_distributions_have_no_pairs() -> None:
    with pytest.raises(InputError, match="at least two distributions, got 1"):
        pairwise_l1([[1.0]])
