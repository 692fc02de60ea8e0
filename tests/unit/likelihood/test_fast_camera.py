"""A pass over the samples of a fast camera, and what it predicts, sample by sample."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from fast_camera import CONTACT, LEAP, SAMPLES, filmed_fast, point_of
from scipy.stats import multivariate_normal

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.filter.filter_pass import Passes, log_densities, whitened
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import FILTER


@pytest.fixture(scope="module")
def passes() -> Passes:
    return filmed_fast()


@pytest.fixture(scope="module")
def point(passes: Passes) -> Point:
    return point_of(passes)


def covariances(lower: Floats) -> Floats:
    """Return symmetric 3 x 3 matrices from their lower parts, row by row."""
    return lower[:, [[0, 1, 3], [1, 2, 4], [3, 4, 5]]]


def test_sums_of_a_fast_camera_are_those_of_its_samples(passes: Passes, point: Point) -> None:
    """Likelihood and samples exactly; derivatives are means over a tenth of a second."""
    (series,) = passes.series
    assert series.pooled == round(FILTER.pooled_s / 0.01) == 10
    found = passes.sums(point, noise="without")
    whole = passes.kernel(series, point, sensitivities=True).run(SAMPLES)
    used = whole["used"].astype(bool)
    assert not used[LEAP]
    assert found.used == used.sum() < SAMPLES - 3
    deviance = 0.0
    for e, s in zip(whole["innovation"][used], covariances(whole["covariance"][used]), strict=True):
        deviance += 0.5 * float(e @ np.linalg.solve(s, e)) + 0.5 * float(np.linalg.slogdet(s)[1])
    assert found.deviance == pytest.approx(deviance, rel=1e-10)
    wanted = whole["jacobian"].T @ whole["jacobian"]
    score = whole["jacobian"].T @ whole["whitened"]
    size = np.sqrt(np.diag(wanted)) + 1e-3 * math.sqrt(float(np.diag(wanted).max()))
    assert np.abs((found.information - wanted) / np.outer(size, size)).max() < 0.1
    assert np.abs((found.score - score) / size).max() < 0.1
    # With the noises nothing is pooled, and the likelihood is the same.
    assert passes.sums(point).deviance == pytest.approx(found.deviance, rel=1e-10)


def test_densities_are_those_of_the_predictions(passes: Passes, point: Point) -> None:
    """Outliers have one, too; what a contact ended has none."""
    (series,) = passes.series
    found = log_densities(passes, series, point)
    whole = passes.run(series, point)
    known = covariances(whole["covariance"])
    for k in (3, 50, LEAP, SAMPLES - 1):
        law = multivariate_normal(np.zeros(3), known[k])
        assert found[k] == pytest.approx(law.logpdf(whole["innovation"][k]), rel=1e-9)
    assert math.isnan(found[CONTACT])
    assert np.isfinite(found).sum() > SAMPLES - 5


def test_an_angle_that_is_missing_has_no_whitened_error(passes: Passes, point: Point) -> None:
    (series,) = passes.series
    theta = series.theta.copy()
    theta[[60, 61]] = np.nan
    found = whitened(passes.run(replace(series, theta=theta), point))
    assert (found[[60, 61], 2] == 0.0).all()
    assert (found[[59, 62]] != 0.0).all()


def test_products_by_the_strength_are_those_of_two_passes(passes: Passes, point: Point) -> None:
    """Errors times their change by a stronger flow, whitened one by one."""
    (series,) = passes.series
    products, squares, errors = passes.strength_products(series, point)
    step = 1e-4
    base, moved = (
        passes.run(series, replace(point, opened={"strength_0": value})) for value in (0.0, step)
    )
    used = base["used"].astype(bool)
    roots = np.linalg.cholesky(covariances(base["covariance"])[used])
    change = (base["innovation"] - moved["innovation"])[used] / step
    white, slope = (
        np.stack([np.linalg.solve(root, one) for root, one in zip(roots, rows, strict=True)])
        for rows in (base["innovation"][used], change)
    )
    np.testing.assert_allclose(errors[used], white, rtol=1e-8)
    np.testing.assert_allclose(products[used], (white * slope).sum(axis=1), rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(squares[used], (slope**2).sum(axis=1), rtol=1e-3, atol=1e-3)
    for found in (products, squares, errors):
        assert (found[~used] == 0.0).all()
