"""The table of random streams."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from driftwalk.core.random_streams import (
    WORK,
    CheckStream,
    MotionStream,
    Purpose,
    RecoveryStream,
    VideoStream,
    trial_in,
)

ROOT = Path(__file__).parents[3]


def test_purposes_are_those_of_the_native_core():
    header = (ROOT / "cpp/include/driftwalk/random/purpose.hpp").read_text()
    native = {name.upper(): int(number) for name, number in re.findall(r"(\w+) = (\d+),", header)}
    assert native == {purpose.name: purpose.value for purpose in Purpose}


def test_no_number_stands_for_two_streams():
    for table in (Purpose, CheckStream, RecoveryStream, MotionStream, VideoStream):
        assert len(table.__members__) == len(set(table))  # a second name of a number is an alias
    assert len(set(WORK.values())) == len(WORK)


def test_trials_of_two_works_never_meet():
    ends = sorted((int(trial_in(work, 0)), int(trial_in(work, 2**40 - 1))) for work in WORK)
    assert all(last < first for (_, last), (first, _) in pairwise(ends))
    assert trial_in("surface", np.arange(3)).tolist() == [3 * 2**40 + k for k in range(3)]
