"""Estimates of simulated recordings show a bias and a scatter that were put in."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.calibration.estimation.bootstrap_correction import (
    BootstrapEstimates,
    bootstrap_estimates,
)
from driftwalk.calibration.estimation.posterior import Posterior, Region
from driftwalk.calibration.estimation.synthetic_likelihood import fit_emulator

STD = 0.01
CENTRE = np.array([0.4, 0.6])


def repeated(
    count: int, *, noise: float = 1.0, off: tuple[float, float] = (0.0, 0.0)
) -> BootstrapEstimates:
    """Repeat with summaries that are the parameters and noise of `STD`; the model's differ."""
    rng = np.random.default_rng(1)

    def simulate(settings: np.ndarray) -> np.ndarray:
        return settings + off + noise * STD * rng.normal(size=settings.shape)

    region = Region(CENTRE, STD * np.eye(2))
    settings = region.filled(4096, 1)
    summaries = settings + STD * rng.normal(size=settings.shape)
    emulator = fit_emulator(settings, summaries, centre=region.centre, width=6 * region.width)
    sample = CENTRE + STD * rng.normal(size=(512, 2))
    solution = emulator.solve(CENTRE, reach=1.0)
    posterior = Posterior(sample, emulator, region, solution, (), np.zeros(2))
    return bootstrap_estimates(simulate, posterior, count)


@pytest.mark.slow
def test_a_right_emulator_needs_no_correction():
    """The bias of 400 has an error of 0.05 deviations, the scatter one of 4 %, draws one of 3 %."""
    found = repeated(400)
    assert found.discrepancies.shape == (400,)
    np.testing.assert_allclose(found.bias, 0.0, atol=0.2 * STD)
    assert (found.spread >= 1.0).all()
    assert (found.spread < 1.2).all()


@pytest.mark.slow
def test_a_scatter_that_the_draws_do_not_have_is_found():
    np.testing.assert_allclose(repeated(400, noise=2.0).spread, 2.0, rtol=0.2)


@pytest.mark.slow
def test_draws_are_never_made_narrower():
    assert (repeated(400, noise=0.5).spread == 1.0).all()


@pytest.mark.slow
def test_a_bias_is_found():
    """Summaries of the model are half a deviation more than the emulator says, or less."""
    found = repeated(400, off=(0.5 * STD, -1.0 * STD))
    np.testing.assert_allclose(found.bias, [0.5 * STD, -1.0 * STD], atol=0.2 * STD)


def test_few_recordings_tell_misfits_alone():
    found = repeated(39, noise=2.0, off=(STD, STD))
    assert found.discrepancies.size == 39
    assert (found.bias == 0.0).all()
    assert found.spread == pytest.approx([1.0, 1.0], abs=0.02)
