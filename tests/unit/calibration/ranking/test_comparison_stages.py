"""Whose summaries are asked, one after the other."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.held_out.law_findings import Discrepancy
from driftwalk.calibration.problem import in_memory
from driftwalk.calibration.ranking import compare
from driftwalk.calibration.ranking.compare import Stages
from driftwalk.calibration.ranking.model_evidence import Evidence, Shortlist


@pytest.mark.parametrize(
    ("tied", "giving", "wanted"),
    [
        (2, set(), [3, 0, 2]),
        (2, {3}, [3, 0]),
        (1, {3}, [3]),
        (1, {0}, [3, 0]),
        (3, {3, 0}, [3, 0, 2]),
        # The third has fewer numbers than the one that gives the summaries.
        (1, {1}, [1, 2]),
    ],
)
def test_others_than_those_that_tie_are_asked_until_one_gives_the_summaries(
    tied: int, giving: set[int], wanted: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    order, numbers = ((3, 0, 2), [5] * 4) if wanted[0] == 3 else ((1, 0, 2), [7, 6, 5, 5])

    def answer(entry: int, *_: Any, **__: Any) -> Evidence:
        return Evidence(Discrepancy(100.0 if entry in giving else 500.0, 90.0, 140.0), 0.0)

    monkeypatch.setattr(compare, "shortlist_models", lambda *_: Shortlist(order, tied))
    monkeypatch.setattr(compare, "most_settings", lambda *_: 4)
    monkeypatch.setattr(Stages, "_matched", lambda _, number, index, point, before: answer(index))
    entries = [SimpleNamespace(ranges=("a",), baseline=False, numbers=k) for k in numbers]
    work: Any = SimpleNamespace(entries=entries, costs=lambda: [1] * 4)
    judged: Any = [SimpleNamespace(point=np.zeros(1))] * 4
    made = Stages(work, 20, in_memory, None, lambda *_: None)
    assert list(made.evidence(judged)) == wanted
    # With fewer than two recordings that could judge a discrepancy nobody is asked.
    assert Stages(work, 0, in_memory, None, lambda *_: None).evidence(judged) == {}


@pytest.mark.parametrize(("reproduced", "wanted"), [(True, [0, 1]), (False, [0])])
def test_a_walk_that_the_distances_do_not_reject_is_asked_where_a_model_gives_the_summaries(
    reproduced: bool, wanted: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two walks, the second is rejected by its distances."""
    entries = [SimpleNamespace(ranges=(), baseline=number > 0) for number in range(3)]
    work: Any = SimpleNamespace(entries=entries, motion=None, costs=lambda: [1] * 3)
    rejected: Any = {0: [], 1: [], 2: ["place near the wall"]}
    judged: Any = [SimpleNamespace(point=np.zeros(0), number=number) for number in range(3)]
    discrepancy = 100.0 if reproduced else 500.0
    monkeypatch.setattr(compare, "shortlist_models", lambda *_: Shortlist((0,), 1))
    monkeypatch.setattr(compare, "held_out_differences", lambda one, _: rejected[one.number])
    monkeypatch.setattr(
        Stages, "_matched", lambda *_: Evidence(Discrepancy(discrepancy, 90.0, 140.0), 0.0)
    )
    assert list(Stages(work, 20, in_memory, None, lambda *_: None).evidence(judged)) == wanted


@pytest.mark.parametrize(
    ("executor", "threaded", "wanted"),
    [("far", True, "far"), ("far", False, "far"), (None, True, "pool"), (None, False, None)],
)
def test_summaries_are_matched_where_a_model_may_be_simulated(
    executor: Any, threaded: bool, wanted: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A user's own model is asked by one thread alone; the progress goes with the root."""
    told: list[tuple[float, float, str]] = []
    asked: dict[str, Any] = {}

    def estimate(entry: Any, motion: Any, answer: Any, **how: Any) -> str:
        asked.update(how)
        how["tell"](25, 100)
        return "evidence"

    monkeypatch.setattr(compare, "estimate_evidence", estimate)
    monkeypatch.setattr(compare, "runs_in_threads", lambda _: threaded)
    monkeypatch.setattr(compare, "most_settings", lambda *_: 4)
    entries = [SimpleNamespace(model=SimpleNamespace(name="own"), ranges=(), baseline=False)]
    work: Any = SimpleNamespace(
        entries=entries, motion=None, fingerprint=lambda: {"seed": 1}, costs=lambda: [1]
    )
    kept: list[tuple[str, dict[str, Any]]] = []
    pool: Any = "pool"
    made = Stages(work, 20, lambda *what: kept.append(what), executor, lambda *_: None, pool=pool)
    staged = SimpleNamespace(stage=lambda _: lambda *what: told.append(what))
    monkeypatch.setattr(Stages, "staged_progress", staged)
    assert made._matched(2, 0, np.array([0.25]), 3) == "evidence"  # type: ignore[comparison-overlap]
    assert asked["executor"] == wanted
    ((name, fingerprint),) = kept
    assert name == "summaries-2"
    assert fingerprint == {"seed": 1, "asked": 0, "answer": [0.25], "worlds": 20}
    assert told == [(2.5, 3, "summaries of own")]
