"""Regions and intervals against a bowl whose level sets are known ellipses."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.calibration.goodness_of_fit import within_chance
from driftwalk.calibration.grid.bootstrap_region import (
    Bootstrap,
    confidence_region,
    region_contains,
)
from driftwalk.calibration.grid.energy_score import EnergyScore, Optimum, make_smoother

DRAG = np.linspace(0.3, 0.5, 21)
FORCE = np.linspace(4e-4, 8e-4, 21)
SMOOTHER = make_smoother((DRAG, FORCE), bandwidth=(0.02, 4e-5))


def bowl(drag, force):
    x, y = (drag - 0.4) / 0.1, (force - 6e-4) / 2e-4
    return 0.02 + x**2 + 0.5 * x * y + y**2


SURFACE = bowl(SMOOTHER.axes[0][:, None], SMOOTHER.axes[1][None, :])


def bootstrap_with(excess, parameters=2):
    count = len(excess)
    zeros = np.zeros(count)
    return Bootstrap(
        np.zeros((count, parameters)),
        np.column_stack([excess] * (1 + parameters)),
        zeros,
        np.zeros((2, max(count - 2, 1))),
    )


def test_the_region_is_the_level_set_of_the_quantile_of_the_excess():
    excess = np.linspace(0.0, 0.1, 101)
    region = confidence_region(SMOOTHER, SURFACE, bootstrap_with(excess), confidence=0.9)
    assert region.level == pytest.approx(0.02 + 0.09)
    border = bowl(*region.border.T)
    np.testing.assert_allclose(border, region.level, rtol=0.02)
    # Extent of x^2 + x y / 2 + y^2 <= 0.09 along x: sqrt(0.09 / (1 - 1/16)).
    half = 0.1 * np.sqrt(0.09 / (1 - 0.25**2))
    assert np.ptp(region.border[:, 0]) == pytest.approx(2 * half, rel=0.02)
    low, high = region.intervals[0]
    assert (low, high) == pytest.approx((0.4 - half, 0.4 + half), abs=1e-3)
    low, high = region.intervals[1]
    assert (low, high) == pytest.approx((6e-4 - 2e-3 * half, 6e-4 + 2e-3 * half), abs=2e-6)


def test_stretch_raises_the_level_and_widens_the_region():
    excess = np.linspace(0.0, 0.05, 101)
    plain = confidence_region(SMOOTHER, SURFACE, bootstrap_with(excess), confidence=0.9)
    wide = confidence_region(SMOOTHER, SURFACE, bootstrap_with(excess), confidence=0.9, stretch=2.0)
    assert wide.level - 0.02 == pytest.approx(2 * (plain.level - 0.02))
    assert np.ptp(wide.border[:, 1]) > 1.3 * np.ptp(plain.border[:, 1])


def test_a_stretch_below_one_does_not_shrink_the_region():
    excess = np.linspace(0.0, 0.05, 101)
    plain = confidence_region(SMOOTHER, SURFACE, bootstrap_with(excess), confidence=0.9)
    shrunk = confidence_region(
        SMOOTHER, SURFACE, bootstrap_with(excess), confidence=0.9, stretch=0.3
    )
    assert shrunk.level == plain.level


def test_a_region_that_reaches_the_end_of_the_grid_is_closed_along_it():
    excess = np.full(10, 1.0)
    region = confidence_region(SMOOTHER, SURFACE, bootstrap_with(excess), confidence=0.9)
    assert region.intervals[0] == (pytest.approx(0.3), pytest.approx(0.5))
    assert region.border[0, 0] == pytest.approx(region.border[-1, 0])
    assert region.border[0, 1] == pytest.approx(region.border[-1, 1])


@pytest.mark.parametrize(
    ("point", "inside"),
    [((0.4, 6e-4), True), ((0.42, 6.2e-4), True), ((0.45, 6e-4), False), ((0.7, 6e-4), False)],
)
def test_a_point_is_in_the_region_where_the_surface_is_low(point, inside):
    region = confidence_region(SMOOTHER, SURFACE, bootstrap_with(np.full(10, 0.09)), confidence=0.9)
    assert region_contains(SMOOTHER, SURFACE, region, point) is inside


def test_the_region_of_one_parameter_is_the_interval_of_its_level():
    smoother = make_smoother((DRAG,), bandwidth=(0.02,))
    surface = 0.02 + ((smoother.axes[0] - 0.4) / 0.1) ** 2
    bootstrap = bootstrap_with(np.linspace(0.0, 0.1, 101), parameters=1)
    region = confidence_region(smoother, surface, bootstrap, confidence=0.9)
    half = 0.1 * np.sqrt(0.09)
    assert region.intervals[0] == pytest.approx((0.4 - half, 0.4 + half), abs=1e-3)
    assert region.border[:, 0] == pytest.approx(region.intervals[0])
    assert region_contains(smoother, surface, region, (0.41,))
    assert not region_contains(smoother, surface, region, (0.45,))


def test_no_setting_is_in_the_region_whose_own_distance_is_beyond_chance():
    """Where two recordings of a setting differ twice as much, the surface is half as high."""
    surface = 0.02 + 0.02 * (SURFACE - SURFACE.min())
    floor = np.where(SMOOTHER.axes[0][:, None] > 0.4, 0.04, 0.02) + 0.0 * surface
    score = EnergyScore(SMOOTHER, Optimum((0.4, 6e-4), 0.02), floor, surface)
    # S is the mean less half the floor; its rise over the floor is that of the surface over 0.02.
    mean = 0.01 + (surface - 0.02) * floor / 0.02 + 0.5 * floor
    np.testing.assert_allclose(score.mean, mean)
    apart = np.full((2, 8), 0.02)
    apart[:, 3] = 0.03  # one of the recordings is 1.5 floors from the others
    bootstrap = bootstrap_with(np.linspace(0.0, 0.1, 10))._replace(to_each_other=apart)
    raised = within_chance(score, bootstrap, 1.0)
    beyond = mean > 1.5 * floor
    assert 0.2 < beyond.mean() < 0.9
    assert (raised[beyond] > surface.max()).all()
    np.testing.assert_array_equal(raised[~beyond], surface[~beyond])
    # A model that leaves twice the floor is allowed twice the distance.
    assert (within_chance(score, bootstrap, 2.0) == surface).mean() > (~beyond).mean()
