"""What must hold of the KS distance whatever the points are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from driftwalk.comparison import ks_compare, ks_distance

pytestmark = pytest.mark.filterwarnings("ignore::driftwalk.comparison.ComparisonWarning")

# Few distinct values, so that ties abound, and both zeros among them.
coordinate = st.one_of(
    st.sampled_from([-1.0, -0.0, 0.0, 0.5, 1.0, 2.0]),
    st.floats(-1e6, 1e6, allow_nan=False, width=32),
)
points = st.integers(1, 25).flatmap(lambda n: arrays(np.float64, (n, 2), elements=coordinate))
ties = st.sampled_from(["strict", "limits"])
modest = settings(deadline=None, max_examples=60)

MIRRORED_IN_X = {0: 1, 1: 0, 2: 3, 3: 2, -1: -1}


@modest
@given(a=points, ties=ties)
def test_zero_on_itself(a: np.ndarray, ties: str) -> None:
    assert ks_distance(a, a, ties=ties) == 0.0  # type: ignore[arg-type]
    assert ks_distance(a, a, method="peacock") == 0.0


@pytest.mark.slow
@modest
@given(a=points, b=points, ties=ties)
def test_symmetric_and_within_bounds(a: np.ndarray, b: np.ndarray, ties: str) -> None:
    there, back = ks_compare(a, b, ties=ties), ks_compare(b, a, ties=ties)  # type: ignore[arg-type]
    assert 0.0 <= there.distance <= 1.0
    assert there.distance == back.distance
    assert (there.difference_a, there.difference_b) == (back.difference_b, back.difference_a)


@pytest.mark.slow
@modest
@given(a=points, b=points, seed=st.integers(0, 99))
def test_order_does_not_matter(a: np.ndarray, b: np.ndarray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    assert ks_distance(rng.permutation(a), rng.permutation(b)) == ks_distance(a, b)


# Sizes at which another way to sort or to count begins: 128 and 4,096 points of a sample, blocks of
# 128, 65,536 and 131,072 points of both.
THRESHOLDS = (128, 256, 4096, 65_536)


@settings(deadline=None, max_examples=12)
@given(
    threshold=st.sampled_from(THRESHOLDS),
    more=st.tuples(st.integers(-2, 2), st.integers(-2, 2)),
    levels=st.sampled_from([0, 3, 1000]),
    ties=ties,
    seed=st.integers(0, 99),
)
def test_order_and_monotone_maps_do_not_matter_at_a_threshold(
    threshold: int, more: tuple[int, int], levels: int, ties: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    a, b = (rng.normal(size=(threshold + extra, 2)) for extra in more)
    if levels:
        a, b = np.round(levels * a), np.round(levels * b)
    expected = ks_compare(a, b, ties=ties)  # type: ignore[arg-type]
    ranks = [np.unique(column, return_inverse=True)[1] for column in np.concatenate([a, b]).T]
    # On the third power of the ranks most points crowd at one end of the scale.
    crooked = np.column_stack(ranks).astype(float) ** 3
    shuffled = [rng.permutation(part) for part in (crooked[: len(a)], crooked[len(a) :])]
    found = ks_compare(*shuffled, ties=ties)  # type: ignore[arg-type]
    assert (found.difference_a, found.difference_b, found.tied_fraction) == (
        expected.difference_a,
        expected.difference_b,
        expected.tied_fraction,
    )
    turned = ks_compare(b[:, ::-1], a[:, ::-1], ties=ties)  # type: ignore[arg-type]
    assert (turned.difference_b, turned.difference_a) == (
        expected.difference_a,
        expected.difference_b,
    )


# Strictly increasing and far from linear. Coordinates are numbers of 24 bits, so their images in
# 53 bits neither meet nor swap, and no map takes a small number beside a large one, where it would
# be lost.
INCREASING = {
    "cube": lambda v: v**3,
    "cube root": np.cbrt,
    "arctan": np.arctan,
    "arsinh": np.arcsinh,
    "bend": lambda v: np.where(v < 0, v, 1e4 * v),
}


@pytest.mark.slow
@modest
@given(a=points, b=points, ties=ties, maps=st.tuples(*[st.sampled_from(sorted(INCREASING))] * 2))
def test_strictly_monotone_maps_do_not_matter(
    a: np.ndarray, b: np.ndarray, ties: str, maps: tuple[str, str]
) -> None:
    def mapped(sample: np.ndarray) -> np.ndarray:
        return np.column_stack([INCREASING[name](sample[:, k]) for k, name in enumerate(maps)])

    pooled = np.concatenate([a, b])
    for before, after in zip(pooled.T, mapped(pooled).T, strict=True):
        ranks = [np.unique(column, return_inverse=True)[1] for column in (before, after)]
        assert np.array_equal(*ranks), "the map has to keep order and ties"
    assert ks_distance(mapped(a), mapped(b), ties=ties) == ks_distance(a, b, ties=ties)  # type: ignore[arg-type]


@pytest.mark.slow
@modest
@given(a=points, b=points)
def test_ranks_are_all_that_matters(a: np.ndarray, b: np.ndarray) -> None:
    """A map as crooked as can be: every coordinate replaced by the cube of its rank."""
    pooled = np.concatenate([a, b])
    ranks = np.column_stack(
        [np.unique(column, return_inverse=True)[1].astype(float) ** 3 for column in pooled.T]
    )
    assert ks_distance(ranks[: len(a)], ranks[len(a) :]) == ks_distance(a, b)


@pytest.mark.slow
@modest
@given(a=points, b=points, ties=ties)
def test_mirroring_and_swapping_axes_do_not_matter(a: np.ndarray, b: np.ndarray, ties: str) -> None:
    expected = ks_compare(a, b, ties=ties)  # type: ignore[arg-type]
    for change in (lambda s: s * [-1, 1], lambda s: s * [1, -1], lambda s: s[:, ::-1]):
        result = ks_compare(change(a), change(b), ties=ties)  # type: ignore[arg-type]
        assert result.difference_a == expected.difference_a
        assert result.difference_b == expected.difference_b


@pytest.mark.slow
@modest
@given(a=points, b=points)
def test_the_two_zeros_are_one_number(a: np.ndarray, b: np.ndarray) -> None:
    assert ks_distance(np.where(a == 0, -0.0, a), np.where(b == 0, 0.0, b)) == ks_distance(a, b)


@pytest.mark.slow
@modest
@given(a=points, b=points)
def test_the_conventions_are_ordered(a: np.ndarray, b: np.ndarray) -> None:
    """Limits look at more sets than open quadrants do, and Peacock's cuts at more than limits."""
    strict = ks_compare(a, b)
    limits = ks_compare(a, b, ties="limits")
    cuts = ks_compare(a, b, method="peacock")
    assert strict.difference_a <= limits.difference_a <= cuts.difference_a
    assert strict.difference_b <= limits.difference_b <= cuts.difference_b


@pytest.mark.slow
@modest
@given(a=points, b=points, copies=st.integers(2, 4))
def test_copies_of_a_sample_do_not_matter(a: np.ndarray, b: np.ndarray, copies: int) -> None:
    assert ks_distance(np.tile(a, (copies, 1)), b) == pytest.approx(ks_distance(a, b), abs=1e-15)
