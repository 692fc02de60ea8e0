"""Whose summaries are asked, one after the other."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.problem import in_memory
from driftwalk.calibration.ranking import comparison_stages
from driftwalk.calibration.ranking.comparison_stages import Stages
from driftwalk.calibration.ranking.model_evidence import Evidence, Shortlist


@pytest.mark.parametrize(
    ("tied", "giving", "wanted"),
    [
        (2, set(), [3, 0, 2]),
        (2, {3}, [3, 0]),
        (1, {3}, [3]),
        (1, {0}, [3, 0]),
        (3, {3, 0}, [3, 0, 2]),
    ],
)
def test_others_than_those_that_tie_are_asked_until_one_gives_the_summaries(
    tied: int, giving: set[int], wanted: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    def answer(entry: int, *_: Any, **__: Any) -> Evidence:
        return Evidence(100.0 if entry in giving else 500.0, 90.0, 140.0, 0.0)

    monkeypatch.setattr(
        comparison_stages, "shortlist_models", lambda *_: Shortlist((3, 0, 2), tied)
    )
    monkeypatch.setattr(comparison_stages, "most_settings", lambda *_: 4)
    monkeypatch.setattr(Stages, "_matched", lambda _, number, index, point, before: answer(index))
    entry = SimpleNamespace(ranges=("a",), baseline=False)
    work: Any = SimpleNamespace(entries=[entry] * 4, costs=lambda: [1] * 4)
    judged: Any = [SimpleNamespace(point=np.zeros(1))] * 4
    made = Stages(work, 20, in_memory, None, lambda *_: None)
    assert list(made.evidence(judged)) == wanted
    # With fewer than two recordings that could judge a misfit nobody is asked.
    assert Stages(work, 0, in_memory, None, lambda *_: None).evidence(judged) == {}
