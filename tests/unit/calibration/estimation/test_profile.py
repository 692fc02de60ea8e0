"""Profiles of a discrepancy that is a quadratic form: they are parabolas known in closed form."""

from __future__ import annotations

import numpy as np

from driftwalk.calibration.estimation.identifiability import discrepancy_profiles
from driftwalk.calibration.estimation.synthetic_likelihood import LocalEmulator

CENTRE, WIDTH = np.array([0.4, 0.6]), np.array([0.1, 0.05])
REACH = 1.25


def linear(slopes: np.ndarray) -> LocalEmulator:
    """Return summaries that are linear in two parameters, with unit noise."""
    count = len(slopes)
    coefficients = np.concatenate([np.zeros((count, 1)), slopes, np.zeros((count, 2))], axis=1)
    used = np.ones(count, dtype=bool)
    return LocalEmulator(CENTRE, WIDTH, False, coefficients, np.eye(count), used, 1000)


def test_profiles_are_parabolas_of_the_standard_error():
    """Linear least squares: the rise is (step / standard error)^2, related parameters or not."""
    slopes = np.random.default_rng(3).normal(size=(12, 2)) * 20.0 + 10.0
    emulator = linear(slopes)
    summaries = slopes @ np.array([0.1, -0.2]) + 0.3 * np.cos(np.arange(12))
    solution = emulator.solve(summaries, reach=REACH)
    std = WIDTH * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    found = discrepancy_profiles(emulator, summaries, solution, std, reach=REACH)
    assert found.place.shape == found.rise.shape == (2, 21)
    np.testing.assert_allclose(found.place[:, -1] - solution.setting, 3.0 * std, rtol=1e-9)
    steps = (found.place - solution.setting[:, None]) / std[:, None]
    # The solver stops within 1e-8 of the discrepancy, and a held value may move by 1e-9 of the box.
    np.testing.assert_allclose(found.rise, steps**2, atol=1e-5)


def test_a_parameter_without_effect_has_a_flat_profile_over_the_box():
    slopes = np.column_stack([np.linspace(5.0, 9.0, 12), np.zeros(12)])
    emulator = linear(slopes)
    solution = emulator.solve(np.zeros(12), reach=REACH)
    found = discrepancy_profiles(
        emulator, np.zeros(12), solution, np.array([0.01, np.inf]), reach=REACH
    )
    np.testing.assert_allclose(found.rise[1], 0.0, atol=1e-6)
    np.testing.assert_allclose(
        found.place[1, [0, -1]], CENTRE[1] + REACH * WIDTH[1] * np.array([-1.0, 1.0])
    )
