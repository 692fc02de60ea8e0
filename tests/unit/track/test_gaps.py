"""Frames that are missing, counted from the times between frames while they come."""

from __future__ import annotations

import statistics
from itertools import pairwise

import pytest
from hypothesis import given, strategies as st

from driftwalk.track.frames import FrameGaps


def running(gaps: list[float]) -> list[int]:
    """Return how many frames are said to be missing after each gap, and at the end."""
    count, found = FrameGaps(), []
    for gap in gaps:
        count.add(gap)
        found.append(count.missing)
    count.settle()
    return [*found, count.missing]


def by_definition(gaps: list[float]) -> int:
    """Return what is missing by the median of all gaps."""
    usual = statistics.median(gaps)
    return sum(round(gap / usual) - 1 for gap in gaps if gap > 1.5 * usual)


@given(st.lists(st.floats(1e-3, 10.0), min_size=2, max_size=80))
def test_the_final_count_is_that_of_the_median_gap(gaps: list[float]) -> None:
    assert running(gaps)[-1] == by_definition(gaps)


@given(st.lists(st.integers(1, 5), max_size=60), st.integers(-30, 30))
def test_at_a_steady_rate_each_gap_is_counted_as_it_comes(steps: list[int], late: int) -> None:
    """Times to the millisecond, as most files have them, at a rate of 30 a second or so."""
    steps = [1] * (8 + len(steps)) + steps
    period = 0.033 + late * 1e-4
    times = [0.0]
    for step in steps:
        times.append(times[-1] + step * period)
    shown = [round(time, 3) for time in times]
    gaps = [after - before for before, after in pairwise(shown)]
    told = running(gaps)
    missing = 0
    for step, now in zip(steps, told, strict=False):
        missing += step - 1
        assert now == missing
    assert told[-1] == missing


def test_nothing_is_said_before_the_usual_gap_is_known() -> None:
    told = running([0.1, 0.5, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.2])
    assert told == [0, 0, 0, 0, 0, 0, 0, 4, 5, 5]


def test_a_short_file_is_counted_at_its_end() -> None:
    assert running([0.1, 0.1, 0.4]) == [0, 0, 0, 3]
    # One gap alone says nothing about the usual one.
    assert running([7.0]) == [0, 0]


def test_a_usual_gap_that_was_learnt_wrongly_is_learnt_anew() -> None:
    """Every second frame is missing at first: that is seen when most gaps are short."""
    told = running([0.2] * 10 + [0.1] * 20)
    assert told[:19] == [0] * 19
    assert told[20:] == [10] * 11


def test_many_long_gaps_take_no_time() -> None:
    """Steps of 1 and 2 frames by turns, and a rate that wavers: gaps are seldom counted anew."""
    count = FrameGaps()
    anew = []
    whole = FrameGaps._count_anew
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            FrameGaps, "_count_anew", lambda self, usual: (anew.append(usual), whole(self, usual))
        )
        for number in range(20_000):
            count.add(0.1 * (1 + (number % 5 == 0)) * (1 + 1e-3 * (number * 37 % 11)))
    assert count.missing == 4000
    assert len(anew) < 20
