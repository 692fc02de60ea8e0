"""Intervals and determined parameters, from draws whose quantiles are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from driftwalk.calibration.estimation.identifiability import DETERMINED, determination
from driftwalk.schema import Parameter

LOG = Parameter("speed", "m/s", 0.01, 1.0, scale="log")
LINEAR = Parameter("turn_rate", "rad/s", -2.0, 2.0)


def even(low: float, high: float) -> np.ndarray:
    """Return evenly spread draws: the quantile of a share lies at this share of them."""
    return np.linspace(low, high, 1001)[:, None]


def test_the_interval_of_a_logarithmic_scale():
    """A cube's coordinate u is 0.01 times 100 to the power of u."""
    found = determination(even(0.4, 0.6), [LOG], confidence=0.8)
    np.testing.assert_allclose(found.interval, [[0.01 * 100**0.42, 0.01 * 100**0.58]])
    # The half-width is always that of 90 %.
    assert found.half_width[0] == pytest.approx(0.09 * math.log(100.0))


def test_the_interval_of_a_linear_scale():
    found = determination(even(0.7, 0.8), [LINEAR], confidence=0.5)
    np.testing.assert_allclose(found.interval, [[-2.0 + 4 * 0.725, -2.0 + 4 * 0.775]])
    assert found.half_width[0] == pytest.approx(4 * 0.045 / 1.0)


@pytest.mark.parametrize("middle", [0.5, 0.52, 0.45])
def test_a_value_near_zero_counts_as_a_twentieth_of_the_range(middle):
    found = determination(even(middle - 0.01, middle + 0.01), [LINEAR], confidence=0.9)
    assert found.half_width[0] == pytest.approx(4 * 0.009 / 0.2)


@pytest.mark.parametrize("scale", ["log", "linear"])
@pytest.mark.parametrize("excess", [-0.002, 0.002])
def test_a_parameter_is_determined_up_to_a_part_of_its_value(scale, excess):
    """Draws whose 90 % interval ends a little less or more than that part from the middle."""
    wanted = DETERMINED.most_half_width + excess
    if scale == "log":
        parameter, half = LOG, wanted / math.log(100.0)
    else:
        # The middle draw is 1.2 on a range of 4.
        parameter, half = LINEAR, wanted * 1.2 / 4.0
    found = determination(even(0.8 - half / 0.9, 0.8 + half / 0.9), [parameter], confidence=0.9)
    assert found.half_width[0] == pytest.approx(wanted)
    assert found.determined.tolist() == [excess < 0]


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 0.02), (0.98, 1.0), (0.009, 0.0091), (0.9905, 0.991)]
)
def test_nothing_is_determined_at_the_end_of_its_range(low, high):
    found = determination(even(low, high), [LOG], confidence=0.9)
    assert math.isinf(found.half_width[0])
    assert found.determined.tolist() == [False]
    assert np.isfinite(found.interval).all()


def test_inside_the_range_by_more_than_a_hundredth_is_inside():
    found = determination(even(0.0105, 0.03), [LOG], confidence=0.9)
    assert found.determined.tolist() == [True]


def test_each_parameter_is_judged_by_its_own_draws():
    sample = np.hstack([even(0.49, 0.51), even(0.1, 0.9), even(0.6, 0.61)])
    found = determination(sample, [LOG, LOG, LINEAR], confidence=0.9)
    assert found.determined.tolist() == [True, False, True]
    assert found.interval.shape == (3, 2)


def test_more_confidence_makes_wider_intervals_and_determines_the_same():
    sample = np.random.default_rng(3).normal([0.5, 0.4], [0.015, 0.08], (512, 2))
    narrow, wide = (determination(sample, [LOG, LOG], confidence=one) for one in (0.5, 0.99))
    assert (wide.interval[:, 0] < narrow.interval[:, 0]).all()
    assert (wide.interval[:, 1] > narrow.interval[:, 1]).all()
    np.testing.assert_array_equal(wide.half_width, narrow.half_width)
    assert wide.determined.tolist() == narrow.determined.tolist() == [True, False]
