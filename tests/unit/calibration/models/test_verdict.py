"""When a model explains a recording, and how it is said where it does not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from driftwalk.calibration.models.checks import CHECKS
from driftwalk.calibration.models.judge import JUDGED, Judged
from driftwalk.calibration.models.verdict import checks_off, verdict_of

NAMES = ("steps", "steps_3", "steps_9", "frame", "wall", "memory")


def motion() -> Any:
    """Return a recording with distances of 0.1 from itself, and facts of 1."""
    return SimpleNamespace(
        own=np.full(6, 0.1), held=SimpleNamespace(names=NAMES), recorded_checks=np.ones(8)
    )


def judged(held: float = 0.12, facts: float = 1.0) -> Judged:
    """Return a model at the same distance in every aspect, with facts around a number."""
    around = np.linspace(0.9, 1.1, JUDGED)[:, None] * facts
    return Judged(
        point=np.empty(0),
        trained=np.full(6, held),
        held=np.full(6, held),
        score=1.0,
        without=np.ones(10),
        apart=np.full(6, 0.1),
        checks=np.repeat(around, len(CHECKS), axis=1),
        ends=np.empty(0),
        evaluations=0,
    )


def test_a_model_as_near_as_the_recording_itself_explains_it() -> None:
    found = verdict_of(judged(), motion(), baseline=False)
    assert found.explained
    assert found.text == ""


def test_a_walk_of_recorded_steps_is_never_explained() -> None:
    found = verdict_of(judged(held=0.0), motion(), baseline=True)
    assert not found.explained
    assert found.text.startswith("it repeats recorded steps")


def test_the_worst_aspect_is_named_first() -> None:
    one = judged()
    far = one._replace(held=np.array([0.12, 0.16, 0.12, 0.12, 0.3, 0.12]))
    found = verdict_of(far, motion(), baseline=False)
    assert not found.explained
    assert found.text == (
        "place near the wall: D = 0.300, the recording's own parts 0.100; "
        "steps of 3 intervals: D = 0.160, the recording's own parts 0.100"
    )


def test_a_model_whose_worlds_differ_may_be_farther_but_not_far() -> None:
    """Up to twice the recording's own distance, however vague the model."""
    for held, apart, explained in (
        (0.19, 0.1, False),
        (0.19, 0.18, False),
        (0.19, 0.2, True),
        (0.19, 0.9, True),
        (0.21, 0.9, False),
    ):
        one = judged(held=held)._replace(apart=np.full(6, apart))
        assert verdict_of(one, motion(), baseline=False).explained == explained


def test_facts_that_were_not_fitted_count() -> None:
    """Three beyond all worlds are chance; four are not."""
    facts = np.ones(8)
    for off, explained in ((3, True), (4, False)):
        recorded = SimpleNamespace(**{**vars(motion()), "recorded_checks": facts.copy()})
        recorded.recorded_checks[:off] = 2.0
        assert verdict_of(judged(), recorded, baseline=False).explained == explained


def test_a_fact_that_nobody_knows_is_not_off() -> None:
    worlds = np.tile([1.0, 2.0], (JUDGED, 4))
    recorded = np.array([1.0, np.nan, 1.0, 2.0, 0.9, 2.0, 1.0, 2.0])
    assert checks_off(worlds, recorded).tolist() == [
        False, False, False, False, True, False, False, False,
    ]  # fmt: skip
    worlds[:, 1] = np.nan
    recorded[1] = 1.0
    assert checks_off(worlds, recorded)[1]
