"""Golden samples: an independent oracle, agreed with by R's fasano.franceschini.test and others."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from driftwalk.comparison import ks_compare, ks_distance

GOLDEN = Path(__file__).resolve().parents[1] / "data" / "ks_golden.json"
DATASETS: list[dict[str, Any]] = json.loads(GOLDEN.read_text())["datasets"]
LIMITS = "numpy oracle 'limits' (max over the four open/closed choices per axis), (D1+D2)/2"
PEACOCK = "numpy Peacock, all pooled (x,y) grid"

# Two of the golden samples are made of ties, and say so.
pytestmark = pytest.mark.filterwarnings("ignore::driftwalk.comparison.ComparisonWarning")


@pytest.mark.parametrize("case", DATASETS, ids=lambda case: case["name"])
class TestGolden:
    def test_integers_are_exact(self, case: dict[str, Any]) -> None:
        result = ks_compare(case["A"], case["B"])
        assert (result.difference_a, result.difference_b) == (case["d1_int"], case["d2_int"])
        assert result.n_a * result.n_b == case["denominator"]

    def test_distance(self, case: dict[str, Any]) -> None:
        assert ks_distance(case["A"], case["B"]) == pytest.approx(case["D"], abs=1e-12)

    def test_peers_with_strict_quadrants(self, case: dict[str, Any]) -> None:
        for peer, value in case["strict_peers"].items():
            assert ks_distance(case["A"], case["B"]) == pytest.approx(value, abs=1e-12), peer

    def test_limits(self, case: dict[str, Any]) -> None:
        expected = case["other_conventions"][LIMITS]
        distance = ks_distance(case["A"], case["B"], ties="limits")
        assert distance == pytest.approx(expected, abs=1e-12)

    def test_peacock(self, case: dict[str, Any]) -> None:
        expected = case["other_conventions"][PEACOCK]
        distance = ks_distance(case["A"], case["B"], method="peacock")
        if case["name"] == "integers_30x25":
            # The golden value takes open quadrants at the grid's points; a cut between the points
            # parts the plane without leaving any out, and cannot find less.
            assert distance >= expected
        else:
            assert distance == pytest.approx(expected, abs=1e-12)


def test_golden_samples_are_there() -> None:
    assert len(DATASETS) == 5
    assert all(np.shape(case["A"]) == (case["n"], 2) for case in DATASETS)
