"""The ellipsoid that is simulated, against the closed form of an even ball."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import gammainc

from driftwalk.calibration.estimation.posterior import SIMULATED_REGION, Region, region_about
from driftwalk.calibration.evolution import rounded

ROOT = np.array([[0.02, 0.0, 0.0], [0.015, 0.01, 0.0], [-0.01, 0.004, 0.005]])
MIDDLE = np.full(3, 0.5)


def test_settings_fill_the_ball_evenly():
    """Their covariance is that of the draws, enlarged; the share within r of the radius is r^3.

    4096 points of a Sobol' sequence: errors of single percents.
    """
    region = Region(MIDDLE, ROOT)
    settings = region.filled(4096, 1)
    np.testing.assert_array_equal(settings, rounded(settings))
    wanted = SIMULATED_REGION.spread**2 * ROOT @ ROOT.T
    np.testing.assert_allclose(np.cov(settings.T), wanted, atol=0.03 * wanted.max())
    apart = region.distances(settings)
    assert apart.max() < 1.001
    for part in (0.5, 0.8, 0.95):
        assert np.mean(apart < part) == pytest.approx(part**3, abs=0.01)


def test_most_of_normal_draws_lie_inside():
    """A chi-square with as many degrees of freedom as parameters, below the squared radius."""
    for count in (1, 3, 9):
        region = Region(np.full(count, 0.5), 0.01 * np.eye(count))
        sample = 0.5 + 0.01 * np.random.default_rng(2).normal(size=(20_000, count))
        share = gammainc(count / 2, region.radius**2 / 2)
        assert share > 0.985
        assert np.mean(region.distances(sample) < 1.0) == pytest.approx(share, abs=0.003)


def test_settings_beyond_an_end_are_mirrored_into_the_cube():
    region = Region(np.array([0.0, 1.0, 0.5]), ROOT)
    settings = region.filled(1024, 3)
    assert settings.min() >= 0.0
    assert settings.max() <= 1.0
    # Half of the ball lies beyond, and none of it is heaped up at the end.
    assert np.mean(settings[:, 0] == 0.0) < 0.01
    assert settings[:, 0].mean() == pytest.approx(SIMULATED_REGION.spread * 0.02 * 0.8, rel=0.15)


def test_a_region_has_the_mean_and_the_axes_of_the_draws():
    sample = MIDDLE + np.random.default_rng(4).normal(size=(5000, 3)) @ ROOT.T
    region = region_about(sample)
    np.testing.assert_allclose(region.centre, sample.mean(axis=0), atol=1e-6)
    wanted = np.cov(sample.T) + SIMULATED_REGION.narrowest**2 * np.eye(3)
    np.testing.assert_allclose(region.root @ region.root.T, wanted, rtol=1e-9)
    np.testing.assert_allclose(region.std, np.sqrt(np.diag(wanted)))


def test_it_is_no_wider_than_a_part_of_the_ranges():
    """The other parameters keep their widths, and the correlations stay."""
    sample = np.random.default_rng(6).uniform(size=(5000, 3))
    sample[:, 2] = 0.5 + 0.01 * (sample[:, 1] - 0.5)
    region = region_about(sample)
    np.testing.assert_allclose(region.width[:2], SIMULATED_REGION.widest)
    assert region.width[2] < 0.1 * SIMULATED_REGION.widest
    covariance = region.root @ region.root.T
    found = covariance[1, 2] / np.sqrt(covariance[1, 1] * covariance[2, 2])
    small = 0.01 * np.sqrt(1 / 12)
    assert found == pytest.approx(small / np.hypot(small, SIMULATED_REGION.narrowest), abs=0.02)
