"""Who is asked about the summaries of the motion, and whom they name."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.held_out.candidates import Contestant
from driftwalk.calibration.held_out.held_out_score import Judged, without_error
from driftwalk.calibration.ranking.evidence_ranking import (
    EVIDENCE,
    Asked,
    Naming,
    Summarised,
    asked_models,
    naming,
    said_of,
    tie_sentence,
)
from driftwalk.calibration.ranking.result import answer_sentence
from driftwalk.calibration.ranking.verdict import Verdict

ERROR = 0.05


def entry(numbers: int, *, baseline: bool = False) -> Contestant:
    like: Any = None
    model: Any = SimpleNamespace(name=f"with {numbers}")
    ranges: Any = () if baseline else ("a parameter",) * numbers
    return Contestant(model, like, ranges, numbers, baseline)


def judged(score: float, *, sign: float = 1.0) -> Judged:
    """Return a score whose differences from others have a known error, but for the first's."""
    without = score + sign * ERROR * np.array([1.0, -1.0] * 5) / np.sqrt(9.0)
    nothing = np.empty(0)
    return Judged(nothing, nothing, nothing, score, without, nothing, nothing, 0)


def test_the_error_of_a_score_is_the_jackknife_s() -> None:
    assert without_error(judged(1.0).without) == pytest.approx(ERROR)


def test_models_about_as_close_as_the_closest_are_asked_in_any_case() -> None:
    # Differences between the two signs have twice the error.
    near, far = (1.0 + 2 * ERROR * (EVIDENCE.tied_sigmas + off) for off in (-0.1, 0.1))
    scores = [judged(far, sign=-1.0), judged(1.0), judged(near, sign=-1.0)]
    assert asked_models([entry(3)] * 3, scores) == Asked((1, 2, 0), 2)


def test_one_that_ties_comes_before_a_closer_one_that_does_not() -> None:
    # The second differs from the first by little, but in the same way in every block.
    scores = [judged(1.0), judged(1.1), judged(1.2, sign=-1.0)]
    assert asked_models([entry(3)] * 3, scores) == Asked((0, 2, 1), 2)


def test_of_one_model_nobody_is_asked() -> None:
    assert asked_models([entry(3)], [judged(1.0)]) == Asked((), 0)


def test_walks_are_never_asked_even_where_they_are_the_closest() -> None:
    entries = [entry(18, baseline=True), entry(3), entry(9)]
    scores = [judged(1.0), judged(1.01, sign=-1.0), judged(1.02)]
    assert asked_models(entries, scores) == Asked((1, 2), 2)


def test_no_more_than_a_handful_are_asked() -> None:
    scores = [judged(1.0 + 0.001 * k, sign=-1.0 if k else 1.0) for k in reversed(range(9))]
    assert asked_models([entry(3)] * 9, scores) == Asked((8, 7, 6, 5, 4), EVIDENCE.most_models)
    assert EVIDENCE.most_models == 5


def said(misfit: float, unlikely: float) -> Summarised:
    return Summarised(misfit, 100.0, 140.0, unlikely)


ENTRIES = [entry(9), entry(3), entry(12)]


def test_a_model_that_gives_the_summaries_is_named_before_a_likelier_that_does_not() -> None:
    assert naming(ENTRIES, {0: said(300.0, -500.0), 2: said(120.0, -400.0)}) == Naming(2, ())


def test_of_those_that_give_them_the_likeliest_is_named() -> None:
    found = naming(ENTRIES, {k: said(120.0, -400.0 - 2 * EVIDENCE.rival * k) for k in range(3)})
    assert found == Naming(2, ())


def test_of_those_that_are_not_told_apart_the_one_with_the_fewest_numbers_is_named() -> None:
    found = naming(ENTRIES, {k: said(120.0, -400.0 - 0.4 * EVIDENCE.rival * k) for k in range(3)})
    assert found == Naming(1, (0, 2))


def test_nobody_is_named_where_no_model_gives_the_summaries() -> None:
    assert naming(ENTRIES, {0: said(300.0, 1.0), 1: said(200.0, 2.0)}) == Naming(None, ())
    assert naming(ENTRIES, {}) == Naming(None, ())


def test_the_sentence_says_whom_and_why() -> None:
    names = ["nine", "three", "twelve"]
    all_of = {0: said(812.4, 0.0), 1: said(101.0, -400.0), 2: said(99.0, -401.0)}
    assert tie_sentence(names, all_of, naming(ENTRIES, all_of)) == (
        "three is named by the summaries of the motion: a misfit of 101, that of its own "
        "recordings is below 140; no clear difference from twelve, with as many numbers or more; "
        "less likely are nine 812"
    )
    none = {0: said(812.4, 0.0), 1: said(201.0, -400.0)}
    assert tie_sentence(names, none, naming(ENTRIES, none)) == (
        "The summaries of the motion tell nothing more, for no model gives them: the misfits are "
        "nine 812, three 201, those of the models' own recordings below 140"
    )


def test_a_model_that_does_not_give_them_is_told_by_how_much() -> None:
    assert said_of(said(139.0, 0.0)) is None
    assert "a misfit of 300" in str(said_of(said(300.0, 0.0)))


@pytest.mark.parametrize(
    ("explained", "named", "sentence"),
    [
        ({0}, None, "nine explains the recording"),
        ({0, 1}, 1, "three explains the recording; so do others, but no better: nine"),
        ({2}, 1, "twelve explains the recording"),
        (set(), 1, "No model explains the recording; the best one is three"),
        (set(), None, "No model explains the recording; the best one is nine"),
    ],
)
def test_the_answer_names_one_model(explained: set[int], named: int | None, sentence: str) -> None:
    verdicts = [Verdict(k in explained, "" if k in explained else "far off") for k in range(3)]
    names = ["nine", "three", "twelve"]
    assert answer_sentence(names, verdicts, 0, Naming(named, ())) == sentence
