"""Arrays of pages: what goes in comes out, by driftwalk's decoder and by the documented rule."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from page_reading import values

from driftwalk.core.errors import FormatError, InputError
from driftwalk.page import decode_array, encode_array
from driftwalk.page.arrays import SHORT, binary_step, number, numbers, plain_list
from driftwalk.page.parts import settings_of

SHAPES = array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=9)
FLOATS = st.floats(-1e9, 1e9) | st.just(np.nan)
STEPS = st.sampled_from([0.0, 2.0**-20, 5e-5, 0.01, 1.0, 32.0])


def through_json(encoded: dict[str, Any]) -> dict[str, Any]:
    return json.loads(json.dumps(encoded, allow_nan=False))


@pytest.mark.slow
@given(arrays(np.float32, SHAPES, elements=st.floats(width=32, allow_infinity=False)))
def test_floats_come_back_bit_for_bit(array: np.ndarray) -> None:
    encoded = through_json(encode_array(array))
    np.testing.assert_array_equal(decode_array(encoded), array.astype(np.float64))
    np.testing.assert_array_equal(values(encoded), array.astype(np.float64))


@pytest.mark.slow
@given(arrays(np.float64, SHAPES, elements=FLOATS), STEPS, st.floats(-1e9, 1e9))
def test_rounded_numbers_are_half_a_step_off_at_most(
    array: np.ndarray, step: float, offset: float
) -> None:
    encoded = through_json(encode_array(array, step=step, offset=offset))
    found = decode_array(encoded)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(array))
    known = ~np.isnan(array)
    # What float32 itself rounds, and doubles as large as the offset.
    within = 0.5 * step + 2.0**-24 * np.abs(array - offset) + 2.0**-50 * abs(offset) + 1e-30
    assert (np.abs(found - array)[known] <= 1.01 * within[known]).all()
    np.testing.assert_array_equal(values(encoded), found)


def test_times_on_a_clock_keep_their_fractions() -> None:
    clock = 1.7e9 + np.arange(100) / 60.0
    found = decode_array(encode_array(clock, step=2.0**-14, offset=clock[0]))
    np.testing.assert_allclose(found - clock[0], np.arange(100) / 60.0, rtol=0, atol=2.0**-15)


@pytest.mark.parametrize("step", [0.0, 2.0**-16])
def test_positions_far_from_the_origin_keep_their_shape(step: float) -> None:
    x = 5e5 + np.linspace(-0.15, 0.15, 1000)
    x[7] = np.nan
    encoded = through_json(encode_array(x, step=step))
    np.testing.assert_allclose(decode_array(encoded), x, rtol=0.0, atol=0.5 * step + 1e-8)
    np.testing.assert_array_equal(values(encoded), decode_array(encoded))
    assert encode_array([0.1, 0.2], step=step)["offset"] == 0.0


def test_infinity_is_no_number() -> None:
    assert np.isnan(decode_array(encode_array([np.inf, -np.inf, 1e39]))).all()


def test_a_power_of_two_makes_paths_small() -> None:
    path = 0.1 * np.sin(np.linspace(0.0, 300.0, 20_000))
    plain, small = (len(encode_array(path, step=step)["data"]) for step in (0.0, 2.0**-15))
    assert small < 0.7 * plain


@pytest.mark.parametrize("step", [-1.0, np.nan, np.inf])
def test_a_step_that_is_none_is_refused(step: float) -> None:
    with pytest.raises(InputError, match="step of an array"):
        encode_array([0.5, 300.0], step=step)


@pytest.mark.parametrize(
    "damage",
    [
        {"data": "!"},
        {"data": ""},
        {"data": "AAAA"},
        {"shape": [7]},
        {"shape": "abc"},
        {"offset": None},
    ],
)
def test_a_damaged_array_is_refused(damage: dict[str, Any]) -> None:
    with pytest.raises(FormatError):
        decode_array(encode_array([1.0, 2.0]) | damage)


def test_short_arrays_are_lists() -> None:
    assert numbers([1.0, np.nan, np.inf]) == [1.0, None, None]
    assert plain_list([[0.5]]) == [[0.5]]
    long = np.arange(float(SHORT))
    assert values(numbers(long)).tolist() == long.tolist()
    assert number(np.nan) is None


@given(st.floats(1e-9, 1e9), st.sampled_from([100.0, 5000.0]))
def test_a_binary_step_is_fine_enough(extent: float, parts: float) -> None:
    step = binary_step(extent, parts)
    assert 0.5 * extent / parts < step <= extent / parts * (1 + 1e-12)
    assert math.frexp(step)[0] == 0.5
    assert binary_step(0.0, parts) == binary_step(np.nan, parts) == 0.0


def test_a_list_longer_than_any_axis_is_refused_before_it_is_made() -> None:
    """A damaged file may declare an axis of any length; a list takes thirty times its memory."""
    assert len(plain_list(np.zeros(100_000))) == 100_000
    with pytest.raises(InputError, match="100001 numbers in one list"):
        plain_list(np.zeros(100_001))


def test_combinations_of_settings_are_those_of_nested_loops() -> None:
    assert settings_of("ab", [1, 2], (True,)) == [(a, b, True) for a in "ab" for b in (1, 2)]
    # Four axes of a million values each: what makes them all would never come back.
    with pytest.raises(InputError, match="settings are more than the 50000 that a page shows"):
        settings_of(*[range(10**6)] * 4)
