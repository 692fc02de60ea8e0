"""Lines in the spectra of the cells: a steady flow has none, and what is found is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.law.score_tests import Scores, ScoreTests
from driftwalk.likelihood.law.shape_changes import (
    ShapeChange,
    _highest,
    find_shape_change,
    shape_facts,
)

COUNT, SIDE = 6000, 0.03
TIME = 0.1 * np.arange(COUNT)
NONE = np.zeros(COUNT)


def wandering(seed: int) -> Series:
    """Return a track that is anywhere in the tank at any time: no period is taken for a place."""
    x, y = np.random.default_rng(seed).uniform(-0.09, 0.09, (2, COUNT))
    return Series(TIME, x, y, NONE, NONE, NONE.astype(np.uint8), span=float(TIME[-1]))


def scores(seed: int, change: np.ndarray, *, memory: float = 0.0) -> Scores:
    """Return scores with errors of one, white or with a memory [samples], and a change of them."""
    rng = np.random.default_rng(seed)
    errors = rng.normal(size=(COUNT, 3))
    if memory:
        kept = math.exp(-1.0 / memory)
        for n in range(1, COUNT):
            errors[n] = kept * errors[n - 1] + math.sqrt(1.0 - kept**2) * errors[n]
    return Scores(errors[:, 0] + change, np.ones(COUNT), errors[:, 1:])


@pytest.mark.parametrize("memory", [0.0, 3.0])
def test_errors_of_a_steady_flow_have_no_line(memory: float) -> None:
    """The chance that they seem to is 1e-6; a memory of the force makes no line either."""
    for seed in range(3):
        found = find_shape_change([wandering(seed)], [scores(seed, NONE, memory=memory)], side=SIDE)
        assert found is not None
        assert not found.significant


def alternating(series: Series, amplitude: float, period: float) -> np.ndarray:
    """Return a change that is opposite on either side of the tank."""
    return np.asarray(amplitude * np.sign(series.x) * np.sin(2.0 * np.pi * TIME / period))


@pytest.mark.parametrize(("period", "said"), [(10.0, "a period of 10 s"), (500.0, "slowly, over")])
def test_halves_of_the_tank_that_alternate_are_found(period: float, said: str) -> None:
    series = wandering(7)
    found = find_shape_change([series], [scores(7, alternating(series, 0.35, period))], side=SIDE)
    assert found is not None
    assert found.significant
    assert 1.0 / found.frequency == pytest.approx(period, rel=0.01 if period < 100.0 else 0.5)
    assert said in found.sentence
    assert "flow_shape_change" in shape_facts(found, None)


@pytest.mark.slow
def test_what_is_found_nine_times_in_ten_is() -> None:
    """Amplitude a has the non-centrality a^2 N / 2; of 80 lines 72 are found, give or take 2.7.

    The line lies on a frequency of the spectrum. 60 is 4.5 standard deviations away.
    """
    first = find_shape_change([wandering(0)], [scores(0, NONE)], side=SIDE)
    assert first is not None
    amplitude = math.sqrt(2.0 * first.found_nine_in_ten / COUNT)
    hits = 0
    for seed in range(80):
        series = wandering(seed)
        change = alternating(series, amplitude, 600.0 / 61.0)
        found = find_shape_change([series], [scores(seed, change)], side=SIDE)
        hits += found is not None and found.significant
    assert 60 <= hits <= 79


def test_a_change_that_is_found_is_as_large_as_a_cosine_tells() -> None:
    """A cosine with sd s is found at sqrt(120 / 0.2) s; without a cosine nothing is told."""
    found = ShapeChange(0.1, 0.5, 60.0, 120.0)
    one = np.ones(1)
    tests = ScoreTests(("strength_6",), 0.0 * one, 2e-3 * one, one[:, None], one)
    detectable = shape_facts(found, tests)["flow_shape_detectable"]
    assert detectable == pytest.approx(2e-3 * math.sqrt(600.0))
    assert "flow_shape_detectable" not in shape_facts(found, None)
    assert shape_facts(None, tests) == {}


def test_a_short_recording_has_no_spectrum() -> None:
    series = wandering(1).part(0, 100)
    part = Scores(*(values[:100] for values in scores(1, NONE)))
    assert find_shape_change([series], [part], side=SIDE) is None


def test_a_flow_that_turns_has_its_line_in_the_errors_alone() -> None:
    """Its frequency is one of the candidates; the strength itself has no line."""
    series = wandering(5)
    turning = scores(5, NONE)
    turning.errors[:, 0] += alternating(series, 0.4, 12.5)
    found = find_shape_change([series], [turning], side=SIDE)
    assert found is not None
    assert found.significant
    assert math.isnan(found.frequency)
    assert min(abs(one - 0.08) for one in found.candidates) < 2e-4
    assert 2 <= len(found.candidates) <= 4
    assert "with a period" not in found.sentence
    assert "slowly" not in found.sentence


def test_of_two_recordings_the_surer_line_counts() -> None:
    """And chance has twice as many lines to choose from."""
    steady, series = wandering(1), wandering(7)
    change = alternating(series, 0.25, 10.0)
    alone = find_shape_change([series], [scores(7, change)], side=SIDE)
    both = find_shape_change([steady, series], [scores(1, NONE), scores(7, change)], side=SIDE)
    assert alone is not None
    assert both is not None
    assert both.frequency == alone.frequency
    assert both.p_value == pytest.approx(2.0 * alone.p_value)


def test_lines_are_higher_than_their_neighbours() -> None:
    power = np.array([9.0, 1.0, 5.0, 4.0, 7.0, 8.0, 3.0, 3.0, 6.0, 2.0, 9.5])
    assert _highest(power) == [5, 8]
    assert _highest(np.array([1.0, 4.0, 4.0, 2.0])) == [2]
    assert _highest(np.arange(5.0)) == []
