"""Distances in all aspects, and how far a recording is from itself."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.comparison import ks_distance
from driftwalk.comparison.aspects import (
    Aspect,
    aspect_reference,
    block_of,
    form_aspects,
    interleaved,
    plan_aspects,
)
from driftwalk.core.errors import InputError

TIME = np.arange(2000.0)


def walk(seed, scale=1.0):
    x, y = scale * np.cumsum(np.random.default_rng(seed).normal(size=(2, TIME.size)), axis=1)
    return form_aspects(plan_aspects(TIME), x, y)


def test_a_distance_is_that_of_the_points():
    a, b = walk(1), walk(2, scale=1.3)
    found = aspect_reference(a, duration=TIME[-1]).distances([b])[0]
    expected = [ks_distance(one.points, other.points) for one, other in zip(a, b, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_threads_do_not_matter():
    reference = aspect_reference(walk(1), duration=TIME[-1])
    motions = [walk(seed) for seed in range(2, 6)]
    one, four = (reference.distances(motions, threads=count) for count in (1, 4))
    np.testing.assert_array_equal(one, four)


def test_the_floor_is_the_distance_of_another_motion_of_the_same_kind():
    """Steps are independent: two walks differ by chance alone, as blocks of one do.

    The median of 40 such distances over the floor; its error is some 5 %, that of the floor 10 %.
    """
    reference = aspect_reference(walk(1), duration=TIME[-1])
    others = reference.distances([walk(seed) for seed in range(2, 42)])
    np.testing.assert_allclose(np.median(others, axis=0) / reference.floor, 1.0, atol=0.35)


def test_the_overall_score_is_the_mean_over_the_floors():
    reference = aspect_reference(walk(1), duration=TIME[-1])
    distances = np.array([reference.floor, 3.0 * reference.floor])
    np.testing.assert_allclose(reference.overall(distances), [1.0, 3.0])


def test_a_motion_without_points_is_as_far_as_can_be():
    reference = aspect_reference(walk(1), duration=TIME[-1])
    none = [one.within(np.zeros(len(one.points), dtype=bool)) for one in walk(2)]
    assert (reference.distances([none]) == 1.0).all()


def test_halves_of_blocks_share_out_all_points():
    aspects = walk(1)
    even, odd = interleaved(aspects, duration=TIME[-1])
    for one, first, second in zip(aspects, even, odd, strict=True):
        assert len(first.points) + len(second.points) == len(one.points)
        assert (block_of(first.time, TIME[-1]) % 2 == 0).all()
        assert (block_of(second.time, TIME[-1]) % 2 == 1).all()


def test_a_changing_motion_is_further_from_itself():
    aspects = walk(1)
    slow = [
        Aspect(one.name, one.points * np.where(one.time < 1000.0, 1.0, 2.0)[:, None], one.time)
        for one in aspects
    ]
    steady = aspect_reference(aspects, duration=TIME[-1]).floor
    assert (aspect_reference(slow, duration=TIME[-1]).floor > 1.5 * steady).any()


def test_too_few_points_are_refused():
    few = [Aspect("steps", np.zeros((10, 2)), np.arange(10.0))]
    with pytest.raises(InputError, match="no aspect of the motion has 30 points"):
        aspect_reference(few, duration=10.0)
