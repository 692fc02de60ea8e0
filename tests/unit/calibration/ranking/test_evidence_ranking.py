"""Who is asked about the summaries of the motion, and whom they name."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.calibration.held_out.held_out_score import HeldOutScore, without_error
from driftwalk.calibration.held_out.law_findings import Discrepancy
from driftwalk.calibration.ranking.model_evidence import (
    EVIDENCE,
    Evidence,
    EvidenceRanking,
    Shortlist,
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
