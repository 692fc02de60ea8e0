"""The factor by which a covariance from simulations widens errors, against many repetitions."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.calibration.estimation.synthetic_likelihood import LocalEmulator

SUMMARIES, PARAMETERS, SIMULATIONS, REPETITIONS = 40, 2, 121, 1500


def emulator_with(freedom: int) -> LocalEmulator:
    flat = np.zeros((SUMMARIES, 1 + 2 * PARAMETERS))
    used = np.ones(SUMMARIES, dtype=bool)
    middle, width = np.full(PARAMETERS, 0.5), np.full(PARAMETERS, 0.1)
    return LocalEmulator(middle, width, "squares", flat, np.eye(SUMMARIES), used, freedom)


@pytest.mark.slow
def test_it_is_the_scatter_over_the_stated_error() -> None:
    """Linear least squares, the covariance from simulations drawn anew each time.

    The ratio of the variances has a relative error of sqrt(2 / 3000), 2.6 %; the formula leaves out
    terms of higher order, which are below 5 % here. Four errors and those make 15 %.
    """
    random = np.random.default_rng(7)
    slopes = random.normal(size=(SUMMARIES, PARAMETERS))
    errors, stated = [], []
    for _ in range(REPETITIONS):
        simulated = random.normal(size=(SIMULATIONS, SUMMARIES))
        inverse = np.linalg.inv(np.cov(simulated.T))
        curvature = slopes.T @ inverse @ slopes
        found = np.linalg.solve(curvature, slopes.T @ inverse @ random.normal(size=SUMMARIES))
        errors.append(found)
        stated.append(np.diag(np.linalg.inv(curvature)))
    ratio = np.mean(np.square(errors) / np.mean(stated, axis=0))
    assert np.isclose(emulator_with(SIMULATIONS - 1).error_inflation ** 2, ratio, rtol=0.15)


def test_it_is_one_with_many_simulations_and_without_end_with_few() -> None:
    assert np.isclose(emulator_with(10**6).error_inflation, 1.0, atol=1e-4)
    assert emulator_with(SUMMARIES + 3).error_inflation == np.inf
    assert np.isfinite(emulator_with(SUMMARIES + 5).error_inflation)
