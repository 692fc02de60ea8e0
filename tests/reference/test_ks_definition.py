"""The KS statistic against its definition."""

from __future__ import annotations

import numpy as np
import pytest
from ks_by_definition import differences, peacock

from driftwalk.comparison import ks_compare, ks_distance, ks_reference

pytestmark = pytest.mark.filterwarnings("ignore::driftwalk.comparison.ComparisonWarning")


def rounded(rng: np.random.Generator, n: int, levels: int) -> np.ndarray:
    points = rng.normal(size=(n, 2))
    return np.round(points * levels) / levels if levels else points


@pytest.mark.parametrize("levels", [0, 1, 3, 20])
@pytest.mark.parametrize(("n", "m"), [(1, 1), (1, 30), (40, 40), (37, 91)])
@pytest.mark.parametrize("ties", ["strict", "limits"])
def test_integers_equal_the_definition(n: int, m: int, levels: int, ties: str) -> None:
    rng = np.random.default_rng(n * 1000 + m + levels)
    a, b = rounded(rng, n, levels), rounded(rng, m, levels)
    result = ks_compare(a, b, ties=ties)  # type: ignore[arg-type]
    assert (result.difference_a, result.difference_b) == differences(a, b, ties=ties)
    assert result.distance == (result.difference_a + result.difference_b) / (2 * n * m)


@pytest.mark.parametrize("levels", [0, 2])
@pytest.mark.parametrize(("n", "m"), [(1, 1), (20, 20), (13, 31)])
def test_peacock_equals_the_definition(n: int, m: int, levels: int) -> None:
    rng = np.random.default_rng(n + m + levels)
    a, b = rounded(rng, n, levels), rounded(rng, m, levels) + 0.3 * (levels == 0)
    result = ks_compare(a, b, method="peacock")
    assert result.difference_a == peacock(a, b)
    if result.difference_a:
        left, below = (
            [
                sample[:, axis] <= result.place.x
                if axis == 0
                else sample[:, axis] <= result.place.y
                for sample in (a, b)
            ]
            for axis in (0, 1)
        )
        across = [~side if result.place.quadrant & 1 else side for side in left]
        along = [~side if result.place.quadrant & 2 else side for side in below]
        counts = [int((i & j).sum()) for i, j in zip(across, along, strict=True)]
        assert abs(m * counts[0] - n * counts[1]) == result.difference_a


def test_larger_samples_equal_the_definition() -> None:
    rng = np.random.default_rng(8)
    a, b = rng.normal(size=(700, 2)), rng.normal(size=(650, 2)) * 1.1
    result = ks_compare(a, b)
    assert (result.difference_a, result.difference_b) == differences(a, b)


# A comparison or a radix sort, blocks of 128 points, numbers that crowd on an even scale.
@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(("n", "m"), [(127, 128), (128, 129), (255, 1), (384, 257)])
@pytest.mark.parametrize("shape", ["even", "over all sizes", "one far point", "tied"])
def test_sizes_around_a_threshold_equal_the_definition(n: int, m: int, shape: str) -> None:
    rng = np.random.default_rng(n + m)
    a, b = rng.normal(size=(n, 2)), rng.normal(size=(m, 2)) + 0.1
    if shape == "over all sizes":
        a, b = np.sinh(100 * a), np.sinh(100 * b)
    elif shape == "one far point":
        a[n // 2] = 1e300, -1e300
    elif shape == "tied":
        a, b = np.round(6 * a), np.round(6 * b)
    for ties in ("strict", "limits"):
        result = ks_compare(a, b, ties=ties)  # type: ignore[arg-type]
        assert (result.difference_a, result.difference_b) == differences(a, b, ties=ties)


def test_the_place_holds_the_maximum() -> None:
    rng = np.random.default_rng(9)
    a, b = rng.normal(size=(80, 2)), rng.normal(size=(60, 2)) + 0.4
    result = ks_compare(a, b)
    for place, sample, difference in (
        (result.place_a, a, result.difference_a),
        (result.place_b, b, result.difference_b),
    ):
        np.testing.assert_array_equal(sample[place.row], [place.x, place.y])
        counts = []
        for points in (a, b):
            across = points[:, 0] > place.x if place.quadrant & 1 else points[:, 0] < place.x
            along = points[:, 1] > place.y if place.quadrant & 2 else points[:, 1] < place.y
            counts.append(int((across & along).sum()))
        assert abs(60 * counts[0] - 80 * counts[1]) == difference
    larger = result.difference_a >= result.difference_b
    assert result.place == (result.place_a if larger else result.place_b)


def test_more_points_than_16_bits_hold() -> None:
    """Every point of b a hundredfold: the fractions, and D, stay what they were."""
    rng = np.random.default_rng(10)
    a, b = rng.normal(size=(900, 2)), rng.normal(size=(800, 2))
    once = ks_compare(a, b)
    many = ks_compare(a, np.tile(b, (100, 1)))
    assert (many.difference_a, many.difference_b) == (
        100 * once.difference_a,
        100 * once.difference_b,
    )


def test_a_reference_gives_what_the_function_gives() -> None:
    rng = np.random.default_rng(11)
    a = rng.normal(size=(50, 2))
    reference = ks_reference(a)
    assert len(reference) == 50
    for size in (1, 20, 200, 3):
        b = rng.normal(size=(size, 2)) + 0.2
        for ties in ("strict", "limits"):
            assert reference.compare(b, ties=ties) == ks_compare(a, b, ties=ties)  # type: ignore[arg-type]
        assert reference.distance(b, method="peacock") == ks_distance(a, b, method="peacock")
        assert reference.distance(b, combine="max") == max(ks_compare(a, b)[1:3])


def test_a_constant_column_is_seen_with_limits_only() -> None:
    rng = np.random.default_rng(12)
    a, b = (np.column_stack([np.zeros(20), rng.normal(size=20) + shift]) for shift in (0, 3))
    assert ks_distance(a, b) == 0.0
    assert ks_distance(a, b, ties="limits") > 0.8
