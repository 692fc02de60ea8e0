"""How long the rest takes, and where the words go."""

from __future__ import annotations

import io
import sys

import pytest

from driftwalk.cli.terminal.progress import ProgressReporter
from driftwalk.core.run_stages import WHOLE

RECORDED = (
    *((0.0, 0), (0.4, 0), (0.7, 19), (1.0, 38), (1.4, 58), (1.7, 77), (2.1, 96), (2.4, 116)),
    *((3.1, 135), (3.7, 154), (5.2, 192), (5.4, 221), (6.0, 260), (7.7, 318), (10.5, 522)),
)


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_shares_stand_without_their_thousandths_and_the_time_left_with_them() -> None:
    stream, clock = io.StringIO(), Clock()
    with ProgressReporter("fit", stream=stream, seconds_between_lines=0.0, clock=clock) as progress:
        progress(0, WHOLE, "likelihood")
        clock.now = 10.0
        progress(250, WHOLE, "check")
        clock.now = 20.0
        assert progress.left == "20 s left"
    assert stream.getvalue() == "fit: 0 %: likelihood\nfit: 25 %, 30 s left: check\n"


def test_what_an_earlier_run_did_is_no_work_of_this_one() -> None:
    clock = Clock()
    progress = ProgressReporter("map", stream=io.StringIO(), clock=clock)
    progress(900, WHOLE)
    clock.now = 10.0
    progress(950, WHOLE)
    assert progress.left_s == pytest.approx(10.0)


def test_answers_are_no_part_of_the_bar_where_stdout_is_a_file(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    answer, terminal = io.StringIO(), Terminal()
    monkeypatch.setattr(sys, "stdout", answer)
    with ProgressReporter("fit", stream=terminal) as progress:
        progress(1, WHOLE)
        print("drag coefficient 0.39")
    assert answer.getvalue() == "drag coefficient 0.39\n"
    assert "0.39" not in terminal.getvalue()
