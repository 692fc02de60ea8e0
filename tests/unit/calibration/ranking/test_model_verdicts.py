"""The verdict on each compared model and on the comparison as a whole."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.held_out import law_findings
from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.calibration.held_out.held_out_score import HeldOutScore
from driftwalk.calibration.held_out.law_findings import BoutDistance, Discrepancy
from driftwalk.calibration.held_out.recorded import CHECKS
from driftwalk.calibration.held_out.wall_clearance import Clearance
from driftwalk.calibration.ranking.model_evidence import Evidence, rank_by_evidence
from driftwalk.calibration.ranking.result import answer_sentence, model_verdicts
from driftwalk.motion import motion_model
from driftwalk.schema.answers.verdict import CANNOT_TELL, DOES_NOT_EXPLAIN, EXPLAINS, Verdict

NAMES = ("steps", "steps_3", "steps_9", "frame", "wall", "memory")
WALL = NAMES.index("wall")
TYPICAL = Evidence(Discrepancy(80.0, 75.0, 110.0), -400.0)


def motion(**changes: Any) -> Any:
    """Return a recording with distances of 0.1 from itself, and facts of 1."""
    usual: dict[str, Any] = {
        "own": np.full(6, 0.1),
        "held": SimpleNamespace(names=NAMES),
        "recorded_checks": np.where(np.array(CHECKS) == "wall_share", 0.5, 1.0),
        "replicates": 200,
        "clearance": Clearance(0.015, 1e-5),
        "clearance_distance": 0.01,
        "like": SimpleNamespace(flow=None),
    }
    return SimpleNamespace(**usual | changes)


@pytest.fixture(autouse=True)
def _steady(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(law_findings, "unsteady_motion", lambda _: [])


def scored(score: float = 1.0, held: float = 0.12, wall: float = 0.12) -> HeldOutScore:
    """Return a score whose difference from others is known to 1 %."""
    nothing = np.empty(0)
    distances = np.full(6, held)
    distances[WALL] = wall
    without = score + 0.01 * np.array([1.0, -1.0] * 5) / 3.0
    checks = np.linspace(0.9, 1.1, 20)[:, None] * np.ones(len(CHECKS))
    return HeldOutScore(nothing, distances, distances, score, without, checks, nothing, 0)


def candidate(name: str, *, clearance: float = 0.015) -> Candidate:
    like: Any = None
    if " " in name:
        walk: Any = SimpleNamespace(name=name, needs_flow=False)
        return Candidate(walk, like, (), 0, baseline=True)
    model = motion_model(name, clearance=clearance)
    return Candidate(model, like, model.parameters, len(model.parameters), baseline=False)


def verdicts_of(
    names: list[str],
    evidence: dict[int, Evidence],
    *,
    scores: list[HeldOutScore] | None = None,
    recorded: Any = None,
    clearance: float = 0.015,
) -> list[Verdict]:
    entries = [candidate(name, clearance=clearance) for name in names]
    held_out = [
        one._replace(point=np.full(len(entry.ranges), 0.5))
        for one, entry in zip(scores or [scored() for _ in names], entries, strict=True)
    ]
    answer = rank_by_evidence(entries, evidence)
    return model_verdicts(entries, held_out, recorded or motion(), evidence, answer)


def test_a_model_that_passes_every_test_explains() -> None:
    assert verdicts_of(["active"], {0: TYPICAL}) == [Verdict(EXPLAINS, ())]


def test_a_misfit_beyond_its_own_limit_is_against_a_model_even_where_all_miss() -> None:
    """A walk of power-law runs had 388 against 112 and was called explained."""
    (found,) = verdicts_of(
        ["run_tumble"], {0: TYPICAL._replace(discrepancy=Discrepancy(388.0, 75.0, 110.0))}
    )
    assert found.word == DOES_NOT_EXPLAIN
    assert "discrepancy 388, in the model's own recordings below 110" in found.reasons[0]


def test_a_misfit_just_beyond_its_limit_leaves_the_answer_open() -> None:
    """One recording of the true law in twenty has it, and so have some of a law that is near."""
    (found,) = verdicts_of(
        ["run_tumble"], {0: TYPICAL._replace(discrepancy=Discrepancy(130.0, 75.0, 110.0))}
    )
    assert found.word == CANNOT_TELL
    assert "discrepancy 130" in found.reasons[0]


def test_a_motion_that_is_not_steady_leaves_it_open(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(law_findings, "unsteady_motion", lambda _: ["the halves differ"])
    assert verdicts_of(["active"], {0: TYPICAL}) == [Verdict(CANNOT_TELL, ("the halves differ",))]


def test_errors_of_the_flow_are_no_misfit_of_a_model_that_needs_one() -> None:
    """The block in a flow that was extracted from its own recording had 4305 against 140."""
    evidence = {0: TYPICAL._replace(discrepancy=Discrepancy(4305.0, 75.0, 110.0))}
    (found,) = verdicts_of(["active+flow"], evidence)
    assert found.word == CANNOT_TELL
    assert "errors of the flow may do that" in found.reasons[0]
    (far,) = verdicts_of(["active+flow"], evidence, scores=[scored(held=0.3)])
    assert far.word == DOES_NOT_EXPLAIN


def test_a_likelier_model_is_against_one_that_gives_the_summaries_too() -> None:
    likelier = TYPICAL._replace(deviance=-500.0)
    first, second = verdicts_of(["active", "run_tumble"], {0: TYPICAL, 1: likelier})
    assert first == Verdict(
        DOES_NOT_EXPLAIN, ("run_tumble is clearly likelier by the summaries of the motion",)
    )
    assert second.word == EXPLAINS


def test_without_the_summaries_nothing_is_explained() -> None:
    (left_out,) = verdicts_of(["active"], {}, recorded=motion(replicates=0))
    assert left_out.word == CANNOT_TELL
    assert "`bootstrap`" in left_out.reasons[0]
    _, not_asked = verdicts_of(["active", "inertial"], {0: TYPICAL})
    assert not_asked.word == CANNOT_TELL
    assert "compare fewer models" in not_asked.reasons[0]


@pytest.mark.parametrize(
    ("discrepancy", "held", "word"),
    [(80.0, 0.12, CANNOT_TELL), (300.0, 0.12, EXPLAINS), (80.0, 0.25, EXPLAINS)],
)
def test_tests_that_a_walk_of_recorded_steps_passes_have_no_power(
    discrepancy: float, held: float, word: str
) -> None:
    names = ["active", "resampled steps"]
    evidence = {0: TYPICAL, 1: TYPICAL._replace(discrepancy=Discrepancy(discrepancy, 75.0, 110.0))}
    model, walk = verdicts_of(names, evidence, scores=[scored(), scored(held=held)])
    assert model.word == word
    assert walk.word == DOES_NOT_EXPLAIN
    assert walk.reasons[0].startswith("it repeats recorded steps")
    if word == CANNOT_TELL:
        assert "record for longer" in model.reasons[0]


def test_the_place_near_the_wall_may_be_off_by_the_error_of_the_clearance() -> None:
    """The limit is 0.2; the error of the clearance makes 0.01 or 0.05."""
    scores = [scored(wall=0.23)]
    for error, word in ((0.01, DOES_NOT_EXPLAIN), (0.05, EXPLAINS), (0.3, CANNOT_TELL)):
        recorded = motion(clearance_distance=error)
        (found,) = verdicts_of(["active"], {0: TYPICAL}, scores=scores, recorded=recorded)
        assert found.word == word
    assert "state the clearance" in found.reasons[0]
    (stated,) = verdicts_of(
        ["active"], {0: TYPICAL}, scores=scores, recorded=recorded, clearance=0.0151
    )
    assert stated.word == DOES_NOT_EXPLAIN


@pytest.mark.parametrize(
    ("words", "first", "sentence"),
    [
        ("ynn", 0, "run_tumble explains the recording"),
        ("yyn", 1, "active explains the recording; so do others, but no better: run_tumble"),
        ("nny", 1, "burst_coast explains the recording"),
        ("nnn", 1, "No model explains the recording; the best one is active"),
        ("n?n", 0, "Cannot tell whether active explains the recording: longer"),
        ("?yn", 0, "active explains the recording"),
    ],
)  # fmt: skip
def test_the_answer_is_one_sentence(words: str, first: int, sentence: str) -> None:
    entries = [candidate(name) for name in ("run_tumble", "active", "burst_coast")]
    meant = {"y": EXPLAINS, "n": DOES_NOT_EXPLAIN, "?": CANNOT_TELL}
    verdicts = [Verdict(meant[word], () if word == "y" else ("longer",)) for word in words]
    assert answer_sentence(entries, verdicts, first) == sentence


def test_of_models_that_are_as_likely_none_is_rejected_for_its_distance() -> None:
    """Ten blocks of a short recording may prefer the simpler one by two standard errors.

    Which of them it is stays open, unless the other one is likelier by no more than chance.
    """
    evidence = {0: TYPICAL, 1: TYPICAL._replace(deviance=-415.0)}
    scores = [scored(1.0), scored(1.1)]
    names = ["active", "run_tumble"]
    found = verdicts_of(names, evidence, scores=scores)
    assert [one.word for one in found] == [CANNOT_TELL] * 2
    assert found[0].reasons[0].startswith("run_tumble explains it as well")
    entries = [candidate(name) for name in names]
    answer = rank_by_evidence(entries, evidence)
    assert answer.best == 0
    assert answer.as_good(entries, evidence) == [1]
    less_likely = {0: TYPICAL, 1: TYPICAL._replace(deviance=-405.0)}
    assert rank_by_evidence(entries, less_likely).as_good(entries, less_likely) == []
    found = verdicts_of(names, less_likely, scores=scores)
    assert [one.word for one in found] == [EXPLAINS] * 2


def test_a_model_with_more_numbers_that_is_no_likelier_than_one_that_fails_is_left_open() -> None:
    """Two bodies that turn off before the wall were explained by two states: it fits more."""
    unusual = Discrepancy(130.0, 75.0, 110.0)
    evidence = {0: TYPICAL._replace(discrepancy=unusual), 1: TYPICAL._replace(deviance=-405.0)}
    for word, simpler in (
        (CANNOT_TELL, evidence[0]),
        (EXPLAINS, TYPICAL._replace(deviance=-300.0, discrepancy=unusual)),
    ):
        simple, found = verdicts_of(["run_rest", "two_state"], evidence | {0: simpler})
        assert not simple.explains
        assert found.word == word
    left_open = verdicts_of(["run_rest", "two_state"], evidence)[1]
    assert left_open.reasons[0].startswith("run_rest is simpler and as likely")


def test_a_body_that_is_always_at_the_wall_tells_no_law() -> None:
    """An active walker at the wall for 99.4 % of the time was explained by run and rest."""
    always = motion(recorded_checks=np.where(np.array(CHECKS) == "wall_share", 0.994, 1.0))
    for held in (0.12, 0.3):
        (found,) = verdicts_of(
            ["active"], {0: TYPICAL}, scores=[scored(held=held)], recorded=always
        )
        assert found.word == CANNOT_TELL
        assert found.reasons[0].startswith("the body was at the wall for 99.4 % of the time")


def test_a_model_at_the_end_of_its_range_is_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Candidate, "at_range_end", lambda *_: "at the end of its range: speed")
    (found,) = verdicts_of(["active"], {0: TYPICAL})
    assert found == Verdict(CANNOT_TELL, ("at the end of its range: speed",))


def test_bouts_of_another_law_are_against_a_model_that_gives_the_summaries() -> None:
    for distance, tail, word in (
        (0.31, 0.2, DOES_NOT_EXPLAIN), (0.13, 0.4, DOES_NOT_EXPLAIN), (0.13, 0.2, EXPLAINS),
    ):  # fmt: skip
        bouts = (BoutDistance("slow", distance, 0.14, tail, 0.3),)
        (found,) = verdicts_of(["active"], {0: TYPICAL._replace(bouts=bouts)})
        assert found.word == word
