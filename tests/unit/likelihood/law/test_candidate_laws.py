"""The table of numbers that a fit may open: each is within its bounds, and a search can move it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from driftwalk.likelihood.filter.difference_pairs import difference_of
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series, corrected, strength_of
from driftwalk.likelihood.law.candidate_laws import (
    CHANGES,
    DRAGS,
    INTENSITIES,
    NUMBERS,
    PULSES,
    STRENGTHS,
)

POINT = Point(np.zeros((2, 1, 1)), 0.0, 0.0, 0.0)


def tried_from(name: str, value: float) -> tuple[float, float]:
    """Return the two values for the derivative where the number is closed at a value."""
    difference = difference_of(replace(POINT, fixed={name: value}), name)
    low = value if difference.low is None else difference.low
    assert difference.step == difference.high - low
    return low, difference.high


@pytest.mark.parametrize("name", sorted(NUMBERS))
def test_a_number_can_be_moved_within_its_bounds(name: str) -> None:
    number = NUMBERS[name]
    # A memory of nothing is a white force, which no memory above its least one is.
    assert number.low <= number.model <= number.high or name == "force_memory"
    assert 0.0 < number.step < 0.1 * number.prior_std
    assert 0.0 < number.most <= number.high - number.low
    # The prior is weak: it reaches a good part of the range, and does not go far beyond it.
    assert number.prior_std <= number.high - number.low
    low, high = tried_from(name, number.model)
    assert number.low <= low < high <= number.high
    elsewhere = 0.5 * (number.model + number.high)
    assert tried_from(name, elsewhere) == (elsewhere, elsewhere + number.step)


def test_numbers_of_one_kind_have_one_prior() -> None:
    """Both parts of a pulse, both coordinates of a marker, and all flows."""
    for names in (PULSES, ("marker_x", "marker_y"), INTENSITIES):
        assert len({NUMBERS[name] for name in names}) == 1
    # Of the strengths the faster ones are weaker, as the spectrum of a bounded change is.
    stds = [NUMBERS[name].prior_std for name in STRENGTHS]
    assert stds[0] == stds[1]
    assert stds[1:] == pytest.approx([stds[0] / k for k in range(1, 7)])
    assert len({NUMBERS[name]._replace(prior_std=1.0) for name in STRENGTHS}) == 1


def test_the_model_s_values_are_the_model() -> None:
    """All numbers at them change neither what the camera says nor how strong the flow is."""
    time = np.linspace(0.0, 9.0, 10)
    series = Series(time, time, time, time, time, np.zeros(10, np.uint8), angle=time, span=9.0)
    named = {name: number.model for name, number in NUMBERS.items()}
    opened = Point(POINT.coefficients, 0.0, 0.0, 0.0, opened=named)
    assert strength_of(series, opened) is None
    assert all(one is time for one in corrected(series, opened))
    assert opened.layers == 1


def test_changes_go_from_one_end_to_the_other() -> None:
    time = np.linspace(0.0, 60.0, 61)
    series = Series(time, time, time, time, time, np.zeros(61, np.uint8), span=60.0)
    for name in STRENGTHS:
        strength = strength_of(series, POINT.with_extra(name, 0.1))
        assert strength is not None
        assert strength[0] == pytest.approx(1.1)
        assert strength[-1] == pytest.approx(0.9 if name in CHANGES else 1.1)


def test_each_drag_is_of_its_name() -> None:
    assert set(DRAGS) == {"quadratic", "linear", "mixed", "power"}
    for name, drag in DRAGS.items():
        numbers = {**drag.opened, **drag.fixed}
        point = Point(POINT.coefficients, 0.0, 0.0, 0.0, opened=drag.opened, fixed=drag.fixed)
        share, power = point.number("linear_share"), point.number("drag_power")
        assert (share == 1.0) == (name == "linear")
        assert (0.0 < share < 1.0) == (name == "mixed")
        assert (1.0 < power < 2.0) == (name == "power")
        assert (power == 2.0) == (name != "power")
        assert len(numbers) == (0 if name == "quadratic" else 1)


def test_a_marker_that_is_off_is_taken_back() -> None:
    theta = np.linspace(0.0, 3.0, 10)
    place = 0.1 * np.exp(1j * theta)
    seen = place + (2e-3 + 1e-3j) * np.exp(1j * theta)
    series = Series(
        theta, seen.real, seen.imag, theta + 0.2, theta, np.zeros(10, np.uint8), angle=theta
    )
    off = {"marker_x": 2e-3, "marker_y": 1e-3, "angle_offset": 0.2}
    x, y, angle = corrected(series, Point(POINT.coefficients, 0.0, 0.0, 0.0, opened=off))
    np.testing.assert_allclose(x + 1j * y, place, atol=1e-15)
    np.testing.assert_allclose(angle, theta, atol=1e-15)
