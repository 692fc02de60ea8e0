"""Regions and intervals against a bowl whose level sets are known ellipses."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.path import Path

from driftwalk.calibration.region import Bootstrap, confidence_region
from driftwalk.calibration.surface import make_smoother

DRAG = np.linspace(0.3, 0.5, 21)
FORCE = np.linspace(4e-4, 8e-4, 21)
SMOOTHER = make_smoother(DRAG, FORCE, bandwidth=(0.02, 4e-5))


def bowl(drag, force):
    x, y = (drag - 0.4) / 0.1, (force - 6e-4) / 2e-4
    return 0.02 + x**2 + 0.5 * x * y + y**2


SURFACE = bowl(SMOOTHER.drag_coefficient[:, None], SMOOTHER.force_std[None, :])


def bootstrap_with(excess):
    count = len(excess)
    zeros = np.zeros(count)
    return Bootstrap(
        zeros, zeros, np.column_stack([excess] * 3), zeros, np.zeros((2, max(count - 2, 1)))
    )


def test_the_region_is_the_level_set_of_the_quantile_of_the_excess():
    excess = np.linspace(0.0, 0.1, 101)
    region = confidence_region(SMOOTHER, SURFACE, bootstrap_with(excess), confidence=0.9)
    assert region.level == pytest.approx(0.02 + 0.09)
    border = bowl(region.drag_coefficient, region.force_std)
    np.testing.assert_allclose(border, region.level, rtol=0.02)
    # Extent of x^2 + x y / 2 + y^2 <= 0.09 along x: sqrt(0.09 / (1 - 1/16)).
    half = 0.1 * np.sqrt(0.09 / (1 - 0.25**2))
    assert np.ptp(region.drag_coefficient) == pytest.approx(2 * half, rel=0.02)
    low, high = region.drag_coefficient_interval
    assert (low, high) == pytest.approx((0.4 - half, 0.4 + half), abs=1e-3)
    low, high = region.force_std_interval
    assert (low, high) == pytest.approx((6e-4 - 2e-3 * half, 6e-4 + 2e-3 * half), abs=2e-6)


def test_stretch_raises_the_level_and_widens_the_region():
    excess = np.linspace(0.0, 0.05, 101)
    plain = confidence_region(SMOOTHER, SURFACE, bootstrap_with(excess), confidence=0.9)
    wide = confidence_region(SMOOTHER, SURFACE, bootstrap_with(excess), confidence=0.9, stretch=2.0)
    assert wide.level - 0.02 == pytest.approx(2 * (plain.level - 0.02))
    assert np.ptp(wide.force_std) > 1.3 * np.ptp(plain.force_std)


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
    assert region.drag_coefficient_interval == (pytest.approx(0.3), pytest.approx(0.5))
    assert region.drag_coefficient[0] == pytest.approx(region.drag_coefficient[-1])
    assert region.force_std[0] == pytest.approx(region.force_std[-1])


@pytest.mark.parametrize(
    ("point", "inside"),
    [((0.4, 6e-4), True), ((0.42, 6.2e-4), True), ((0.45, 6e-4), False), ((0.7, 6e-4), False)],
)
def test_a_point_is_in_the_region_where_the_surface_is_low(point, inside):
    region = confidence_region(SMOOTHER, SURFACE, bootstrap_with(np.full(10, 0.09)), confidence=0.9)
    border = Path(np.column_stack([region.drag_coefficient, region.force_std]))
    assert border.contains_point(point) == inside
