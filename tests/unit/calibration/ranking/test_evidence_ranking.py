"""Who is asked about the summaries of the motion, and whom they name."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.estimation.summaries import SummaryObjective
from driftwalk.calibration.estimation.synthetic_likelihood import SyntheticLikelihood
from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.calibration.held_out.held_out_score import HeldOutScore, without_error
from driftwalk.calibration.held_out.law_findings import Discrepancy
from driftwalk.calibration.ranking import model_evidence
from driftwalk.calibration.ranking.model_evidence import (
    EVIDENCE,
    Evidence,
    EvidenceRanking,
    Shortlist,
    estimate_evidence,
    most_settings,
    rank_by_evidence,
    ranking_sentence,
    shortlist_models,
)

ERROR = 0.05


def entry(numbers: int, *, baseline: bool = False) -> Candidate:
    like: Any = None
    model: Any = SimpleNamespace(name=f"with {numbers}")
    ranges: Any = () if baseline else ("a parameter",) * numbers
    return Candidate(model, like, ranges, numbers, baseline)


def judged(score: float, *, sign: float = 1.0) -> HeldOutScore:
    """Return a score whose differences from others have a known error, but for the first's."""
    without = score + sign * ERROR * np.array([1.0, -1.0] * 5) / np.sqrt(9.0)
    nothing = np.empty(0)
    return HeldOutScore(nothing, nothing, nothing, score, without, nothing, nothing, 0)


def test_the_error_of_a_score_is_the_jackknife_s() -> None:
    assert without_error(judged(1.0).without) == pytest.approx(ERROR)


def test_models_about_as_close_as_the_closest_are_asked_in_any_case() -> None:
    # Differences between the two signs have twice the error.
    near, far = (1.0 + 2 * ERROR * (EVIDENCE.tied_sigmas + off) for off in (-0.1, 0.1))
    scores = [judged(far, sign=-1.0), judged(1.0), judged(near, sign=-1.0)]
    assert shortlist_models([entry(3)] * 3, scores) == Shortlist((1, 2, 0), 2)


def test_one_that_ties_comes_before_a_closer_one_that_does_not() -> None:
    # The second differs from the first by little, but in the same way in every block.
    scores = [judged(1.0), judged(1.1), judged(1.2, sign=-1.0)]
    assert shortlist_models([entry(3)] * 3, scores) == Shortlist((0, 2, 1), 2)


def test_one_model_alone_is_asked_as_well() -> None:
    assert shortlist_models([entry(3)], [judged(1.0)]) == Shortlist((0,), 1)


def test_walks_are_never_asked_even_where_they_are_the_closest() -> None:
    entries = [entry(18, baseline=True), entry(3), entry(9)]
    scores = [judged(1.0), judged(1.01, sign=-1.0), judged(1.02)]
    assert shortlist_models(entries, scores) == Shortlist((1, 2), 2)


def test_no_more_than_a_handful_are_asked() -> None:
    scores = [judged(1.0 + 0.001 * k, sign=-1.0 if k else 1.0) for k in reversed(range(9))]
    assert shortlist_models([entry(3)] * 9, scores) == Shortlist(
        (8, 7, 6, 5, 4), EVIDENCE.most_models
    )
    assert EVIDENCE.most_models == 5


def test_a_walk_is_never_named() -> None:
    entries = [entry(18, baseline=True), entry(3)]
    evidence = {0: said(100.0, -900.0), 1: said(120.0, -400.0)}
    assert rank_by_evidence(entries, evidence) == EvidenceRanking(1, ())


def said(discrepancy: float, deviance: float) -> Evidence:
    return Evidence(Discrepancy(discrepancy, 100.0, 140.0), deviance)


ENTRIES = [entry(9), entry(3), entry(12)]


def test_a_model_that_gives_the_summaries_is_named_before_a_likelier_that_does_not() -> None:
    assert rank_by_evidence(
        ENTRIES, {0: said(300.0, -500.0), 2: said(120.0, -400.0)}
    ) == EvidenceRanking(2, ())


def test_of_those_that_give_them_the_likeliest_is_named() -> None:
    found = rank_by_evidence(
        ENTRIES, {k: said(120.0, -400.0 - 2 * EVIDENCE.not_rejected_within * k) for k in range(3)}
    )
    assert found == EvidenceRanking(2, ())


def test_of_those_that_are_not_told_apart_the_one_with_the_fewest_numbers_is_named() -> None:
    found = rank_by_evidence(
        ENTRIES, {k: said(120.0, -400.0 - 0.4 * EVIDENCE.not_rejected_within * k) for k in range(3)}
    )
    assert found == EvidenceRanking(1, (0, 2))


def test_nobody_is_named_where_no_model_gives_the_summaries() -> None:
    assert rank_by_evidence(ENTRIES, {0: said(300.0, 1.0), 1: said(220.0, 2.0)}) == EvidenceRanking(
        None, ()
    )
    assert rank_by_evidence(ENTRIES, {}) == EvidenceRanking(None, ())


def test_the_sentence_says_whom_and_why() -> None:
    names = ["nine", "three", "twelve"]
    all_of = {0: said(812.4, 0.0), 1: said(101.0, -400.0), 2: said(99.0, -401.0)}
    assert ranking_sentence(names, all_of, rank_by_evidence(ENTRIES, all_of)) == (
        "three is named by the summaries of the motion: discrepancy 101, in its own recordings "
        "below 140; no clear difference from twelve, with as many numbers or more; less likely are "
        "nine 812"
    )
    none = {0: said(812.4, 0.0), 1: said(211.0, -400.0)}
    assert ranking_sentence(names, none, rank_by_evidence(ENTRIES, none)) == (
        "No model reproduces the summaries of the motion: the discrepancies are nine 812, three "
        "211, in the models' own recordings below 140"
    )


class Asked:
    """Estimates an evidence from a search and a likelihood that are made up."""

    own = np.linspace(90.0, 140.0, 101)

    def __init__(self, patch: pytest.MonkeyPatch, discrepancy: float) -> None:
        self.worlds = SimpleNamespace(simulated=self.simulated, seed=3)
        self.at: list[np.ndarray] = []
        self.most = 0
        best = SimpleNamespace(setting=np.array([-0.2, 0.3, 1.4]), log_volume=-9.0)
        patch.setattr(model_evidence, "even_blocks", lambda *_: self.worlds)

        def made(objective: Any, worlds: Any, *_: Any, **named: Any) -> None:
            objective.worlds, objective.done = worlds, 0
            objective.recorded = np.array([[1.0, 2.0]])
            self.most = named["most"]

        def summaries(_: Any, settings: np.ndarray, *, parts: int = 1) -> np.ndarray:
            return np.full((len(settings), parts, 2), 5.0)

        # The noise is added in a subclass.
        patch.setattr(SummaryObjective, "__init__", made)
        patch.setattr(SummaryObjective, "__call__", summaries)
        patch.setattr(model_evidence, "label_order", lambda _: None)
        patch.setattr(
            model_evidence, "find_optima", lambda *_, **__: [SimpleNamespace(solution=best)]
        )

        def likelihood(simulate: Any, recorded: Any, setting: Any, replicates: int) -> Any:
            assert recorded.tolist() == [1.0, 2.0]
            assert replicates == 20
            self.at.append(setting)
            self.blurred = simulate(np.zeros((400, len(setting))))
            return SyntheticLikelihood(discrepancy, self.own, 12.5)

        patch.setattr(model_evidence, "synthetic_likelihood_at", likelihood)
        patch.setattr(model_evidence, "score_setting", lambda worlds, motion, at: ("score", at))
        patch.setattr(model_evidence, "bout_distances", lambda motion, worlds: worlds)

    def simulated(self, settings: np.ndarray, replicates: int, *, stage: str) -> Any:
        return (settings.tolist(), replicates, stage)

    def evidence_of(self, entry: Candidate) -> Evidence:
        motion: Any = SimpleNamespace(replicates=20, seed=3)
        nothing: Any = None
        return estimate_evidence(
            entry, motion, np.array([0.5]), executor=None, store=None, tell=nothing
        )


def test_the_evidence_is_laplace_s_integral_over_even_ranges(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """-2 log of exp(-d / 2) / sqrt(det S) times the volume (2 pi)^(p / 2) sqrt(det C)."""
    asked = Asked(monkeypatch, 120.0)
    found = asked.evidence_of(entry(3))
    root = np.exp(0.5 * -9.0)
    integral = np.exp(-60.0) / np.exp(0.5 * 12.5) * (2.0 * np.pi) ** 1.5 * root
    assert found.deviance == pytest.approx(-2.0 * np.log(integral))
    assert found.discrepancy == Discrepancy(120.0, 115.0, pytest.approx(137.5))
    # The likelihood is that of the best setting within the ranges, and so are worlds and score.
    (setting,) = asked.at
    assert setting == pytest.approx([0.0, 0.3, 1.0])
    assert found.matched is not None
    assert found.matched[1] == pytest.approx([0.0, 0.3, 1.0])  # type: ignore[misc]
    assert found.bouts[0] == [pytest.approx([0.0, 0.3, 1.0])]
    assert asked.most == most_settings(3, 20)
    # Summaries get a noise of their own; 800 numbers tell its spread to 2.5 %.
    assert (asked.blurred - 5.0).std() == pytest.approx(EVIDENCE.blur, rel=0.125)


def test_a_model_that_is_clearly_wrong_is_not_judged_further(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = Asked(monkeypatch, 900.0).evidence_of(entry(3))
    assert found.discrepancy.against
    assert found.matched is None
    walk = Asked(monkeypatch, 100.0)
    found = walk.evidence_of(entry(3, baseline=True))
    assert found.matched is None
    # Without parameters there is nothing to search and nothing to integrate over.
    assert walk.at[0].size == 0
    assert found.deviance == pytest.approx(112.5)


def test_a_model_without_numbers_is_simulated_at_one_setting() -> None:
    one, none = most_settings(1, 20), most_settings(0, 20)
    assert most_settings(0, 50) - none == 30
    assert most_settings(1, 50) - one == 30
    assert one > none > 0
