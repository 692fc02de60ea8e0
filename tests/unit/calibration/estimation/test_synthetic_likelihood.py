"""The synthetic likelihood at one setting, with summaries of a known normal law."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from driftwalk.calibration.estimation.synthetic_likelihood import (
    SYNTHETIC,
    synthetic_likelihood_at,
)

SPREAD = np.array([0.02, 0.5, 3.0, 0.1])
SETTING = np.array([0.3, 0.7])


class Law:
    """Gives summaries of a normal law with one correlation, whatever the setting is."""

    def __init__(self, seed: int, *, correlation: float = 0.0) -> None:
        self.rng, self.given = np.random.default_rng(seed), np.empty((0, 2))
        self.covariance = np.diag(SPREAD**2)
        self.covariance[0, 1] = self.covariance[1, 0] = correlation * SPREAD[0] * SPREAD[1]

    def __call__(self, settings: np.ndarray) -> np.ndarray:
        self.given = settings
        return self.rng.multivariate_normal(np.zeros(4), self.covariance, size=len(settings))


def test_every_simulation_is_of_the_setting() -> None:
    law = Law(1)
    found = synthetic_likelihood_at(law, np.zeros(4), SETTING, 30)
    assert law.given.shape == (SYNTHETIC.simulations + 30, 2)
    assert (law.given == SETTING).all()
    assert found.own_discrepancies.shape == (30,)


def test_own_misfits_have_the_quantiles_of_chi_squared() -> None:
    found = synthetic_likelihood_at(Law(2), np.zeros(4), SETTING, 2000)
    for share in (0.5, 0.95, 0.99):
        assert np.quantile(found.own_discrepancies, share) == pytest.approx(
            chi2.ppf(share, 4), rel=0.15
        )


def test_a_misfit_counts_standard_deviations() -> None:
    for off in (0.0, 3.0, 20.0):
        recorded = np.array([0.0, 0.0, off * SPREAD[2], 0.0])
        assert synthetic_likelihood_at(Law(3), recorded, SETTING, 2).discrepancy == pytest.approx(
            off**2, rel=0.15, abs=0.1
        )


def test_the_variance_is_that_of_the_law() -> None:
    law = Law(4, correlation=0.9)
    # A part of the correlations is taken away.
    wanted = np.log(np.linalg.det(np.diag(SPREAD**2))) + np.log1p(
        -((0.9 * (1 - SYNTHETIC.shrunk)) ** 2)
    )
    assert synthetic_likelihood_at(law, np.zeros(4), SETTING, 2).log_variance == pytest.approx(
        wanted, abs=0.4
    )


def test_it_is_the_mahalanobis_distance_of_the_simulations() -> None:
    """In the correlations of numpy, a twentieth of which is taken away, and their deviations."""
    mixed = np.random.default_rng(6).normal(size=(4, 4))

    def simulate(settings: np.ndarray) -> np.ndarray:
        return np.random.default_rng(5).normal(size=(len(settings), 4)) @ mixed + SPREAD

    recorded = np.array([0.3, -1.0, 4.0, 0.2])
    found = synthetic_likelihood_at(simulate, recorded, SETTING, 7)
    seen = simulate(np.zeros((SYNTHETIC.simulations + 7, 2)))
    known, others = seen[:-7], seen[-7:]
    correlation = 0.95 * np.corrcoef(known.T) + 0.05 * np.eye(4)
    std = known.std(axis=0, ddof=1)
    covariance = correlation * np.outer(std, std)
    off = np.vstack([recorded, others]) - known.mean(axis=0)
    wanted = [one @ np.linalg.solve(covariance, one) for one in off]
    assert found.discrepancy == pytest.approx(wanted[0], rel=1e-9)
    assert found.own_discrepancies == pytest.approx(wanted[1:], rel=1e-9)
    assert found.log_variance == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-9)
