"""How long the rest takes, and where the words go."""

from __future__ import annotations

import io
import sys

import pytest

from driftwalk.cli.terminal.progress import ProgressReporter
from driftwalk.core.progress import WHOLE

# What a fit reported of the bundled recording, and when [s of a processor]; then its end.
RECORDED = {
    "300 s": (
        [
            (0.0, 0),
            (0.17, 0),
            (0.35, 19),
            (0.63, 38),
            (0.92, 58),
            (1.23, 77),
            (1.51, 96),
            (1.81, 116),
            (2.1, 135),
            (2.32, 154),
            (2.77, 188),
            (2.81, 221),
            (3.19, 260),
            (5.01, 318),
            (7.96, 522),
            (11.42, 793),
        ],
        14.57,
    ),
    "1800 s": (
        [
            (0.0, 0),
            (0.19, 0),
            (0.52, 12),
            (0.97, 23),
            (1.31, 34),
            (1.75, 46),
            (2.25, 57),
            (2.73, 69),
            (3.18, 80),
            (3.97, 121),
            (4.69, 162),
            (5.98, 202),
            (7.27, 244),
            (9.96, 302),
            (10.16, 346),
            (12.41, 427),
            (16.82, 550),
            (23.33, 765),
            (27.53, 898),
        ],
        31.05,
    ),
}


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


@pytest.mark.parametrize("name", RECORDED)
def test_the_time_left_of_a_fit_is_right_within_a_factor_of_two(name: str) -> None:
    """From the first third of the time on."""
    told, end = RECORDED[name]
    clock = Clock()
    progress = ProgressReporter("fit", stream=io.StringIO(), clock=clock)
    judged = 0
    for now, done in told:
        clock.now = now
        progress(done, WHOLE)
        if now >= end / 3.0:
            assert progress.left_s is not None
            assert 0.5 < progress.left_s / (end - now) < 2.0
            judged += 1
    assert judged >= 3
