"""The strongest pulse of the flow's strength in the spectrum of errors times derivatives."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.likelihood.law.score_tests import Scores, find_pulses


def spectrum_of(time: np.ndarray, products: np.ndarray) -> Any:
    """Return the pulse of a series with given products of each sample."""
    series: Any = SimpleNamespace(time=time)
    return find_pulses([series], [Scores(products, np.ones(time.size), np.zeros((time.size, 2)))])


@pytest.mark.parametrize("first", [0.0, 23.7])
def test_a_pulse_has_its_frequency_and_phase(first: float) -> None:
    """Noise of 1 on 4000 samples: the amplitudes have sd 0.022, here 5 of them are allowed."""
    time = first + 0.1 * np.arange(4000)
    phase = 2.0 * np.pi * 0.25 * time
    noise = np.random.default_rng(1).normal(size=time.size)
    found = spectrum_of(time, 0.6 * np.cos(phase) - 0.8 * np.sin(phase) + noise)
    assert found.significant
    assert found.frequency == pytest.approx(0.25, abs=1e-4)
    assert found.cosine == pytest.approx(0.6, abs=0.11)
    assert found.sine == pytest.approx(-0.8, abs=0.11)
    assert found.amplitude == pytest.approx(np.hypot(found.cosine, found.sine))


def test_noise_has_no_pulse() -> None:
    """The chance that it seems to have one is 1e-6."""
    time = 0.1 * np.arange(4000)
    noise = np.random.default_rng(2).normal(size=time.size)
    assert not spectrum_of(time, noise).significant
