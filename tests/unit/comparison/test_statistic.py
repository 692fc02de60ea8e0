"""Distances between the rows of a table."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt
import pytest

from driftwalk.comparison import StepDistance, StepTable
from driftwalk.comparison.statistic import distances_among


class Recorder(StepDistance):
    """A distance that is not symmetric: of the first lengths, and how often it was asked."""

    def matrix(self, a: StepTable, b: StepTable, *, threads: int = 1) -> npt.NDArray[np.float64]:
        asked.append(a.pairs.size * b.pairs.size * threads)
        return a.length[:, :1] - 10.0 * b.length[:, 0]


asked: list[int] = []


@pytest.mark.parametrize("rows", [1, 2, 3, 7, 8])
def test_every_two_rows_meet_once_in_order(rows: int) -> None:
    asked.clear()
    lengths = np.arange(1.0, rows + 1)
    table = StepTable(lengths[:, None], 0 * lengths[:, None], np.ones(rows, dtype=np.int64))
    found = distances_among(Recorder(), table, threads=3)
    assert found.tolist() == [a - 10 * b for a, b in itertools.combinations(lengths, 2)]
    assert sum(asked) == 3 * rows * (rows - 1) // 2
