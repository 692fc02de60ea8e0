"""Results that are kept for the next call with the same arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import MOST_REMEMBERED, remembered

Floats = npt.NDArray[np.float64]


class Pair(NamedTuple):
    one: Floats
    other: Floats


def test_a_call_is_made_once_for_each_content() -> None:
    calls: list[float] = []

    @remembered
    def total(pair: Pair, factor: Floats) -> float:
        calls.append(float(factor))
        return float(factor * (pair.one.sum() + pair.other.sum()))

    pair = Pair(np.arange(3.0), np.ones(2))
    assert total(pair, np.array(2.0)) == total(Pair(*map(np.copy, pair)), np.array(2.0)) == 10.0
    assert calls == [2.0]
    pair.one[0] = 1.0
    assert total(pair, np.array(2.0)) == 12.0
    assert total(pair, factor=np.array(3.0)) == 18.0
    assert total(Pair(np.array([1.0, 1.0, 2.0, 1.0]), np.ones(1)), np.array(2.0)) == 12.0
    assert calls == [2.0, 2.0, 3.0, 2.0]


def test_the_oldest_results_are_forgotten() -> None:
    calls: list[int] = []

    @remembered
    def value(array: Floats) -> float:
        calls.append(1)
        return float(array)

    for number in range(MOST_REMEMBERED + 1):
        value(np.array(float(number)))
    value(np.array(float(MOST_REMEMBERED)))
    assert len(calls) == MOST_REMEMBERED + 1
    value(np.array(0.0))
    assert len(calls) == MOST_REMEMBERED + 2
