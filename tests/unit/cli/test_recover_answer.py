"""What the recovery study prints: doubts where they are due, and none where not."""

from __future__ import annotations

import numpy as np
import pytest
from recovery_worlds import synthetic_recovery

from driftwalk.likelihood.score import add_summary
from driftwalk.schema.answers.parts import length_text
from driftwalk.schema.answers.recovery import recovery_answer


def test_counts_and_warnings_of_what_is_left_out() -> None:
    found = synthetic_recovery(recordings=30)
    found["status"].values[1, 0, 1:3] = 1
    found["used"].values[1, 0, 1:3] = 0
    found["message"].values[1, 0, 2] = "only 3 of 9 intervals"
    part = recovery_answer(found).facts["results"][2]
    assert (part["duration_s"], part["angle"]) == (2400.0, "given")
    counted = {key: part[key] for key in ("recordings", "used", "at_the_wall", "without_fit")}
    assert counted == {"recordings": 30, "used": 27, "at_the_wall": 1, "without_fit": 2}
    said = [
        text for text in recovery_answer(found).warnings if text.startswith("40 min, angle given")
    ]
    assert "1 of 30 recordings have more than 30 % of their intervals at the wall" in said[0]
    assert "2 of 30 recordings could not be fitted: only 3 of 9 intervals" in said[1]


def test_a_study_as_it_should_be_has_no_doubts() -> None:
    """Drawn without bias; the three conditions are at 3, 2.5 and 2 sd: the seed is a good one."""
    found = synthetic_recovery(recordings=60, durations=(900.0,), seed=3)
    assert [text for text in recovery_answer(found).warnings if "wall" not in text] == []


def test_a_bias_is_said() -> None:
    """0.3 in ln C_d at all lengths; drawn with a spread of 0.12 and 0.06, 0.1 stated."""
    found = synthetic_recovery(recordings=30)
    off = np.log(found["drag_coefficient"] / 0.4) + 0.3
    found["drag_coefficient_error"].values[...] = np.expm1(off)
    found["drag_coefficient_z"].values[...] = off / 0.1
    found["drag_coefficient_covered"].values[...] = abs(off) < 0.1645
    names = [name for name in found if "parameter" in found[name].dims]
    text = " ".join(recovery_answer(add_summary(found.drop_vars([*names, "parameter"]))).warnings)
    assert "40 min, angle given: C_d is off by +3" in text
    assert "hold the truth in" in text
    assert "times what the square root of the length gives" in text


@pytest.mark.parametrize(
    ("seconds", "text"), [(60, "1 min"), (90, "1 min 30 s"), (3600, "1 h"), (30, "30 s")]
)
def test_lengths_in_words(seconds: float, text: str) -> None:
    assert length_text(seconds) == text
