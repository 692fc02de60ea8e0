"""A law that was searched on thinned samples, with the modes of all samples."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.fit import _of_all_samples
from driftwalk.likelihood.law.forward_selection import LawResult
from driftwalk.likelihood.newton import FROM_THINNED, Mode
from driftwalk.likelihood.prior import Weights


def mode_at(place: float, *, converged: bool = True) -> Mode:
    point = Point(np.zeros((2, 1, 1)), place, 0.0, 0.0)
    return Mode(point, Weights(1.0, 1.0), np.eye(1), 1, 1, converged, 0.0)


class Search:
    """Ends ten further on; at stated places it does not come to an end, or breaks down."""

    def __init__(self, stuck: tuple[float, ...] = (), broken: tuple[float, ...] = ()) -> None:
        self.stuck, self.broken = stuck, broken

    def find(self, point: Point, weights: Weights, *, held: Any) -> Mode | None:
        assert held is FROM_THINNED
        if point.log_drag in self.broken:
            return None
        return mode_at(point.log_drag + 10.0, converged=point.log_drag not in self.stuck)


def law(base: Mode | None = None) -> LawResult:
    mode = mode_at(1.0)
    return LawResult(
        mode, mode if base is None else base, False, {}, 5.0, None,
        alternatives=(mode_at(2.0), mode_at(3.0)), noted=("one", "two"),
    )  # fmt: skip


def places(found: LawResult) -> list[float]:
    return [one.point.log_drag for one in found.alternatives]


def test_all_modes_are_those_of_all_samples() -> None:
    found = _of_all_samples(law(), Search())  # type: ignore[arg-type]
    assert found is not None
    assert found.mode.point.log_drag == 11.0
    assert found.base is found.mode
    assert places(found) == [12.0, 13.0]
    assert found.noted == ("one", "two")
    other = mode_at(0.5)
    found = _of_all_samples(law(other), Search())  # type: ignore[arg-type]
    assert found is not None
    assert found.base is other


@pytest.mark.parametrize(
    ("search", "left"), [(Search(stuck=(2.0,)), [13.0]), (Search(broken=(3.0,)), [12.0])]
)
def test_an_alternative_without_a_mode_is_left_out_with_what_was_noted(
    search: Any, left: list[float]
) -> None:
    found = _of_all_samples(law(), search)
    assert found is not None
    assert places(found) == left
    assert found.noted == ()


@pytest.mark.parametrize("search", [Search(stuck=(1.0,)), Search(broken=(1.0,))])
def test_a_law_without_a_mode_is_none(search: Any) -> None:
    assert _of_all_samples(law(), search) is None
