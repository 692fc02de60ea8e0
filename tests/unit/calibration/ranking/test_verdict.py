"""When a model explains a recording, and how it is said where it does not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from driftwalk.calibration.held_out.held_out_score import (
    HELD_OUT_REPLICATES,
    HeldOutScore,
    checks_off,
    held_out_verdict,
)
from driftwalk.calibration.held_out.recorded import CHECKS

NAMES = ("steps", "steps_3", "steps_9", "frame", "wall", "memory")


def motion() -> Any:
    """Return a recording with distances of 0.1 from itself, and facts of 1."""
    return SimpleNamespace(
        own=np.full(6, 0.1), held=SimpleNamespace(names=NAMES), recorded_checks=np.ones(8)
    )


def judged(held: float = 0.12, facts: float = 1.0) -> HeldOutScore:
    """Return a model at the same distance in every aspect, with facts around a number."""
    around = np.linspace(0.9, 1.1, HELD_OUT_REPLICATES)[:, None] * facts
    return HeldOutScore(
        point=np.empty(0),
        trained=np.full(6, held),
        held=np.full(6, held),
        score=1.0,
        without=np.ones(10),
        checks=np.repeat(around, len(CHECKS), axis=1),
        optimum_scores=np.empty(0),
        evaluations=0,
    )


def test_a_model_as_near_as_the_recording_itself_explains_it() -> None:
    found = held_out_verdict(judged(), motion(), baseline=False)
    assert found.explains
    assert found.reasons == ()


def test_a_walk_of_recorded_steps_is_never_explained() -> None:
    found = held_out_verdict(judged(held=0.0), motion(), baseline=True)
    assert not found.explains
    assert found.reasons[0].startswith("it repeats recorded steps")


def test_a_model_that_another_one_clearly_beats_explains_nothing() -> None:
    found = held_out_verdict(judged(), motion(), baseline=False, clearly_behind="run_rest")
    assert not found.explains
    assert found.reasons == ("run_rest is clearly closer",)


def test_the_worst_aspect_is_named_first() -> None:
    one = judged()
    far = one._replace(held=np.array([0.12, 0.21, 0.12, 0.12, 0.3, 0.12]))
    found = held_out_verdict(far, motion(), baseline=False)
    assert not found.explains
    assert found.reasons == (
        "place near the wall: D = 0.300, the recording's own parts 0.100",
        "steps of 3 intervals: D = 0.210, the recording's own parts 0.100",
    )


def test_facts_that_were_not_fitted_count() -> None:
    """One far beyond all worlds may be chance; two are not."""
    for off, explained in ((1, True), (2, False)):
        recorded = SimpleNamespace(**{**vars(motion()), "recorded_checks": np.ones(8)})
        recorded.recorded_checks[:off] = 2.0
        found = held_out_verdict(judged(), recorded, baseline=False)
        assert found.explains == explained
    assert "over 1 step interval, mean squared displacement over 3" in found.reasons[0]


def test_a_fact_is_far_off_by_a_factor_and_a_share_by_a_tenth() -> None:
    """The worlds lie between 1 and 2, those of the shares between 0.3 and 0.4."""
    worlds = np.tile([[1.0], [2.0]], (HELD_OUT_REPLICATES // 2, len(CHECKS)))
    worlds[:, -2:] = worlds[:, -2:] / 10.0 + 0.2
    recorded = np.array([0.6, 0.7, 1.5, 2.9, 3.1, np.nan, 0.21, 0.51])
    expected = [True, False, False, False, True, False, False, True]
    assert checks_off(worlds, recorded).tolist() == expected
    worlds[:, 2] = np.nan
    assert checks_off(worlds, recorded)[2]
