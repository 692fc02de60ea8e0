"""Ranges of parameters that a recording of given scales can tell apart, by their units."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.held_out.recorded import (
    RecordedMotion,
    Scales,
    recorded_ranges,
    scales_of,
)
from driftwalk.comparison import KsReference
from driftwalk.comparison.aspects import points_distance
from driftwalk.core.errors import InputError
from driftwalk.schema import Parameter, Track

SCALES = Scales(speed=0.1, fastest=0.4, interval=0.2, duration=500.0, size=0.3)
WIDE = {"low": 1e-12, "high": 1e12, "scale": "log"}


@pytest.mark.parametrize(
    ("unit", "low", "high"),
    [
        ("m/s", 0.005, 0.8),  # a twentieth of the speed, twice the fastest
        ("s", 0.1, 50.0),  # half an interval, a tenth of the recording
        ("rad2/s", 0.005, 15.0),  # a thousandth, and three, per step
        ("rad/s", 0.02, 25.0),  # a radian in a tenth of the recording, five per step
        ("m", 0.003, 0.3),
        ("m2/s", 2e-7, 2e-3),  # the square of a step per step, and a ten-thousandth of it
        ("Hz", 0.1, 10.0),
        ("1", 1e-12, 1e12),
    ],
)
def test_a_range_is_what_the_recording_can_tell(unit: str, low: float, high: float) -> None:
    (found,) = recorded_ranges([Parameter("a", unit, step=0.1, **WIDE)], SCALES)  # type: ignore[arg-type]
    assert (found.low, found.high) == (pytest.approx(low), pytest.approx(high))
    # The steps of its grid are those of a parameter with this range.
    usual = Parameter("a", unit, found.low, found.high, scale="log")
    assert found.step == (0.1 if unit == "1" else usual.step)


@pytest.mark.parametrize(("unit", "end"), [("rad/s", 1.5), ("m/s", 0.8), ("m", 0.3), ("Hz", 10.0)])
def test_a_range_of_both_signs_is_even(unit: str, end: float) -> None:
    (found,) = recorded_ranges([Parameter("a", unit, -1e6, 1e6)], SCALES)
    assert (found.low, found.high) == (pytest.approx(-end), pytest.approx(end))


def test_a_parameter_keeps_to_its_own_range() -> None:
    some = [
        Parameter("within", "m", 0.01, 0.1, scale="log", step=0.1),
        Parameter("apart", "m", 0.5, 0.9, step=0.2),
    ]
    within, apart = recorded_ranges(some, SCALES)
    assert (within.low, within.high) == (0.01, 0.1)
    assert apart is some[1]


def test_a_slow_recording_has_a_range_of_speeds_all_the_same() -> None:
    """Where the fastest steps are no faster than the mean speed, twice that is the end."""
    slow = Scales(speed=0.1, fastest=0.05, interval=0.2, duration=500.0, size=0.3)
    (found,) = recorded_ranges([Parameter("a", "m/s", **WIDE)], slow)  # type: ignore[arg-type]
    assert found.high == pytest.approx(0.2)
    # In a short recording a turn in a hundred steps is slow.
    short = Scales(speed=0.1, fastest=0.05, interval=0.2, duration=40.0, size=0.3)
    (found,) = recorded_ranges([Parameter("a", "rad/s", **WIDE)], short)  # type: ignore[arg-type]
    assert found.low == pytest.approx(0.1)


@pytest.mark.parametrize("std", [0.0, 0.004])
def test_an_uncertain_clearance_moves_the_place_near_the_wall(std: float) -> None:
    """By two of its standard errors, inwards or outwards, whichever is farther from itself."""
    wall = np.random.default_rng(1).uniform([0.0, -1.0], [0.05, 1.0], (300, 2))
    some: Any = SimpleNamespace(
        held_aspects=[SimpleNamespace(name="steps"), SimpleNamespace(name="wall", points=wall)],
        clearance=SimpleNamespace(std=std),
    )
    found = RecordedMotion.clearance_distance.func(some)  # type: ignore[attr-defined]
    reference = KsReference(wall)
    moved = [
        points_distance(reference, wall + np.array([sign * 2.0 * std, 0.0])) for sign in (1, -1)
    ]
    assert found == pytest.approx(max(moved))
    assert (found > 0.1) is (std > 0.0)
    none: Any = SimpleNamespace(held_aspects=[SimpleNamespace(name="steps")])
    assert RecordedMotion.clearance_distance.func(none) == 0.0  # type: ignore[attr-defined]


def test_scales_are_those_of_the_track() -> None:
    time = 5.0 + 0.5 * np.arange(9)
    x = np.array([0.0, 0.1, 0.2, 0.3, 0.5, 0.4, 0.3, 0.2, 0.1])
    track = Track(time, x, 0.2 * x, 0.0 * x)
    steps = np.array([0.1, 0.3])
    found = scales_of(track, step_interval=0.5, steps=steps)
    assert found.speed == pytest.approx(0.4)
    assert found.fastest == pytest.approx((0.1 + 0.999 * 0.2) / 0.5)
    assert found.duration == pytest.approx(4.0)
    assert found.size == pytest.approx(0.25)
    assert scales_of(
        Track(time, 0.2 * x, x, 0.0 * x), step_interval=0.5, steps=steps
    ).size == pytest.approx(0.25)
    with pytest.raises(InputError, match="does not move"):
        scales_of(track, step_interval=0.5, steps=np.zeros(3))
