"""Which answer counts, the search's or that of the summaries, with stages that are made up."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.estimation import run
from driftwalk.calibration.estimation.estimate import MATCHING
from driftwalk.calibration.estimation.run import Estimation, estimate
from driftwalk.calibration.held_out.law_findings import Discrepancy
from driftwalk.schema import Parameter

RANGES = (Parameter("a", "1", 0.0, 1.0), Parameter("b", "1", 0.0, 1.0))
POINTS = {
    "searched": np.array([0.1, 0.1]),
    "matched": np.array([0.2, 0.2]),
    "even": np.array([0.3, 0.3]),
    "longer": np.array([0.4, 0.4]),
}


class Made:
    """Stages with stated scores, and a discrepancy of the summaries; None without them."""

    def __init__(
        self,
        monkeypatch: pytest.MonkeyPatch,
        scores: dict[str, float],
        discrepancy: float | None,
        *,
        undetermined: bool = False,
    ) -> None:
        self.scores = scores
        self.discrepancy = discrepancy
        self.undetermined = undetermined
        self.asked: list[str] = []
        self.judged: list[list[float]] = []
        self.best: np.ndarray | None = None
        self.even = SimpleNamespace(simulated=lambda at, count, *, stage: (at.tolist(), stage))
        self.order = lambda settings: settings
        monkeypatch.setattr(run, "_Stages", lambda *_: self)
        monkeypatch.setattr(run, "require_numbers", lambda _: None)
        monkeypatch.setattr(run, "bout_distances", lambda _, worlds: worlds)

        def judge(even: Any, motion: Any, at: np.ndarray) -> Any:
            self.judged.append(at.tolist())
            return "judged"

        monkeypatch.setattr(run, "score_setting", judge)

    def optima(self) -> None:
        self.asked.append("search")
        self.best = POINTS["searched"]

    def longer(self) -> np.ndarray:
        self.asked.append("longer")
        return POINTS["longer"]

    def matched(self) -> Any:
        self.asked.append("summaries")
        assert self.discrepancy is not None
        sample = np.column_stack([np.linspace(0.3, 0.32, 50), np.linspace(0.4, 0.42, 50)])
        return SimpleNamespace(
            discrepancy=Discrepancy(self.discrepancy, 3.0, 5.0),
            point=POINTS["matched"],
            even_point=POINTS["even"],
            sample=sample,
            ambiguous=np.array([False, True]),
            unsettled=np.array([False, False]),
            undetermined=self.undetermined,
        )

    def weighed(self, answers: dict[str, np.ndarray]) -> dict[str, float]:
        for name, point in answers.items():
            np.testing.assert_array_equal(point, POINTS[name])
        return {name: self.scores[name] for name in answers}

    def found(self) -> Estimation:
        calibration = SimpleNamespace(confidence=0.9)
        motion: Any = SimpleNamespace(
            replicates=1 if self.discrepancy is None else 50,
            study=SimpleNamespace(calibration=calibration),
        )
        entry: Any = SimpleNamespace(ranges=RANGES)
        told: list[Any] = []
        how: Any = SimpleNamespace(tell=lambda *what: told.append(what))
        found = estimate(entry, motion, how)
        assert told == [("judged", 0, 1)]
        # The length of bouts is looked at where the answer is.
        assert found.bouts == ([found.point.tolist()], "judged")
        return found


SCORES = {"searched": 1.0, "matched": 1.1, "even": 1.2, "longer": 0.9}


def test_summaries_that_are_usual_need_no_search(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Made(monkeypatch, SCORES, 4.9)
    found = made.found()
    assert made.asked == ["summaries"]
    assert found.point.tolist() == POINTS["matched"].tolist()
    assert found.searched is None
    # The odd blocks judge the answer of the even ones.
    assert made.judged == [POINTS["even"].tolist()]
    assert found.known is not None
    assert found.known.determined.tolist() == [True, False]
    assert found.known.interval[0] == pytest.approx([0.301, 0.319])


@pytest.mark.parametrize(("worse", "counts"), [(1.24, True), (1.26, False)])
def test_unusual_summaries_count_where_they_are_as_close(
    monkeypatch: pytest.MonkeyPatch, worse: float, counts: bool
) -> None:
    """Up to a quarter farther in the six distances than the search; else that is made longer."""
    assert MATCHING.as_close == 1.25
    made = Made(monkeypatch, {**SCORES, "matched": worse}, 5.1)
    found = made.found()
    assert made.asked == ["summaries", "search", *([] if counts else ["longer"])]
    if counts:
        assert found.point.tolist() == POINTS["matched"].tolist()
        # The better one of those that have not seen the odd blocks.
        assert made.judged == [POINTS["searched"].tolist()]
        assert found.known is not None
        return
    assert found.point.tolist() == POINTS["longer"].tolist()
    assert found.searched is not None
    assert found.searched.tolist() == POINTS["longer"].tolist()
    assert found.scores["searched"] == 0.9
    assert made.judged == [POINTS["longer"].tolist()]
    assert found.known is None


def test_the_even_blocks_answer_is_judged_where_it_is_better(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = Made(monkeypatch, {**SCORES, "even": 0.8}, 5.1)
    made.found()
    assert made.judged == [POINTS["even"].tolist()]


def test_a_longer_search_that_finds_nothing_better_changes_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = Made(monkeypatch, {**SCORES, "matched": 2.0, "longer": 1.0}, 5.1)
    found = made.found()
    assert found.searched is not None
    assert found.searched.tolist() == POINTS["searched"].tolist()
    assert found.point.tolist() == POINTS["searched"].tolist()


def test_without_summaries_the_search_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Made(monkeypatch, SCORES, None)
    found = made.found()
    assert made.asked == ["search"]
    assert found.point.tolist() == POINTS["searched"].tolist()
    assert found.matched is None
    assert found.known is None
    assert made.judged == [POINTS["searched"].tolist()]


def test_of_summaries_that_are_far_off_nothing_is_determined(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = Made(monkeypatch, SCORES, 5.1, undetermined=True).found()
    assert found.known is not None
    assert not found.known.determined.any()
