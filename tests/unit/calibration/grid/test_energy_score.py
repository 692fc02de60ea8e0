"""What is taken off a distance, against closed forms of normal numbers."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.calibration.grid.energy_score import smooth_energy_score
from driftwalk.calibration.grid.grid_map import full_map

SHIFT = np.linspace(-1.0, 1.0, 21)
SPREAD = np.linspace(0.2, 1.8, 33)
TRUE_SPREAD = 1.0


def mean_size(shift, deviation):
    """Return the mean size of a normal number: of the folded normal distribution."""
    from scipy.special import erf

    return np.sqrt(2 / np.pi) * deviation * np.exp(-(shift**2) / (2 * deviation**2)) + shift * erf(
        shift / (np.sqrt(2) * deviation)
    )


def expected_map():
    """Return the expected map of recordings that are one normal number each, N(0, 1).

    A setting simulates N(shift, spread): the distance of two recordings is their difference.
    """
    shift, spread = np.meshgrid(SHIFT, SPREAD, indexing="ij")
    distance = mean_size(shift, np.hypot(spread, TRUE_SPREAD))
    apart = mean_size(0.0, np.sqrt(2) * spread)
    return full_map((SHIFT, SPREAD), distance[..., None], {"apart": apart})


@pytest.mark.slow
def test_half_the_floor_off_the_optimum_is_the_truth():
    found = smooth_energy_score(expected_map(), (0.1, 0.1))
    assert found.optimum.point == pytest.approx((0.0, TRUE_SPREAD), abs=0.03)
    # The mean distance alone is smallest where simulations scatter least.
    lowest = np.unravel_index(np.argmin(expected_map().mean), expected_map().mean.shape)
    assert SPREAD[lowest[1]] == pytest.approx(SPREAD[0])


def test_the_surface_counts_height_in_floors():
    """S is D - apart / 2 in closed form; its height over the floor is that over the optimum's."""
    found = smooth_energy_score(expected_map(), (0.1, 0.1))
    shift, spread = np.meshgrid(*found.smoother.axes, indexing="ij")
    floor = mean_size(0.0, np.sqrt(2) * spread)
    score = mean_size(shift, np.hypot(spread, TRUE_SPREAD)) - 0.5 * floor
    np.testing.assert_allclose(found.floor, floor, rtol=1e-3)
    np.testing.assert_allclose(found.height, (score - score.min()) / floor, atol=5e-3)
    assert found.surface.min() == pytest.approx(found.optimum.distance)
    assert found.optimum.distance == pytest.approx(mean_size(0.0, np.sqrt(2.0)), rel=5e-3)
    assert found.floor_at_optimum == pytest.approx(mean_size(0.0, np.sqrt(2.0)), rel=0.02)


def test_the_floor_stays_above_0_where_noise_would_take_it_below():
    apart = np.full((SHIFT.size, SPREAD.size), 0.1)
    apart[:4, :4] = 0.0
    noisy = expected_map()._replace(arrays={"apart": apart})
    assert smooth_energy_score(noisy, (0.1, 0.1)).floor.min() >= 0.02
