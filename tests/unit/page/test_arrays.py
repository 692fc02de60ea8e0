"""Arrays of pages: what goes in comes out, by driftwalk's decoder and by the documented rule."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from page_reading import values

from driftwalk.core.errors import FormatError, InputError
from driftwalk.page import decode_array, encode_array
from driftwalk.page.arrays import SHORT, nice_step, number, numbers, plain_list
from driftwalk.page.parts import settings_of

SHAPES = array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=9)
FLOATS = st.floats(-1e9, 1e9) | st.just(np.nan)
RESOLUTIONS = st.sampled_from([1e-6, 5e-5, 0.01, 1.0, 30.0])


def through_json(encoded: dict[str, Any]) -> dict[str, Any]:
    return json.loads(json.dumps(encoded, allow_nan=False))


@pytest.mark.slow
@given(arrays(np.float64, SHAPES, elements=st.floats(allow_infinity=False)))
def test_doubles_come_back_bit_for_bit(array: np.ndarray) -> None:
    encoded = through_json(encode_array(array, dtype="f8"))
    np.testing.assert_array_equal(decode_array(encoded), array)
    np.testing.assert_array_equal(values(encoded), array)


@pytest.mark.slow
@given(arrays(np.float32, SHAPES, elements=st.floats(width=32, allow_infinity=False)))
def test_floats_come_back_bit_for_bit(array: np.ndarray) -> None:
    encoded = through_json(encode_array(array, dtype="f4"))
    np.testing.assert_array_equal(decode_array(encoded), array.astype(np.float64))
    np.testing.assert_array_equal(values(encoded), array.astype(np.float64))


@pytest.mark.slow
@given(arrays(np.float64, SHAPES, elements=FLOATS), RESOLUTIONS, st.booleans())
def test_rounded_numbers_are_half_a_step_off_at_most(
    array: np.ndarray, resolution: float, delta: bool
) -> None:
    encoded = through_json(encode_array(array, dtype="i2", resolution=resolution, delta=delta))
    found = decode_array(encoded)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(array))
    known = ~np.isnan(array)
    assert (np.abs(found - array)[known] <= 0.5 * encoded["scale"] * (1 + 1e-6) + 1e-6).all()
    np.testing.assert_array_equal(values(encoded), found)
    if known.any() and np.ptp(array[known]) < 60_000 * resolution:
        assert encoded["scale"] == resolution


@pytest.mark.slow
@given(arrays(np.int64, SHAPES, elements=st.integers(-32767, 32767)))
def test_whole_numbers_come_back(array: np.ndarray) -> None:
    encoded = through_json(encode_array(array, dtype="i2"))
    np.testing.assert_array_equal(decode_array(encoded), array)
    np.testing.assert_array_equal(values(encoded), array)
    small = through_json(encode_array(array % 256, dtype="u1"))
    np.testing.assert_array_equal(values(small), array % 256)


def test_a_range_beyond_16_bits_takes_32() -> None:
    encoded = encode_array([0.0, 1800.0], dtype="i2", resolution=1e-4)
    assert encoded["dtype"] == "i4"
    assert decode_array(encoded).tolist() == [0.0, 1800.0]


def test_infinity_is_no_number() -> None:
    assert np.isnan(decode_array(encode_array([np.inf, -np.inf], dtype="f4"))).all()


def test_differences_make_paths_small() -> None:
    path = 0.1 * np.sin(np.linspace(0.0, 300.0, 20_000))
    plain, small = (
        len(encode_array(path, dtype="i2", resolution=1e-5, delta=delta)["data"])
        for delta in (False, True)
    )
    assert small < 0.8 * plain


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"dtype": "i8"}, "dtype is one of"),
        ({"dtype": "i2", "resolution": 0.0}, "positive"),
        ({"dtype": "u1"}, "whole numbers from 0 to 255"),
        ({"dtype": "i2"}, "whole numbers"),
    ],
)
def test_what_cannot_be_encoded_is_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        encode_array([0.5, 300.0], **options)


@pytest.mark.parametrize(
    "damage",
    [
        {"dtype": "c8"}, {"dtype": None}, {"data": "!"}, {"data": ""}, {"shape": [7]},
        {"packed": "deflate"}, {"shape": "abc"},
    ],
)  # fmt: skip
def test_a_damaged_array_is_refused(damage: dict[str, Any]) -> None:
    encoded = encode_array([1.0, 2.0])
    assert encoded["packed"] == "none"
    with pytest.raises(FormatError):
        decode_array(encoded | damage)


def test_short_arrays_are_lists() -> None:
    assert numbers([1.0, np.nan, np.inf]) == [1.0, None, None]
    assert plain_list([[0.5]]) == [[0.5]]
    long = np.arange(float(SHORT))
    assert values(numbers(long)).tolist() == long.tolist()
    assert number(np.nan) is None


@given(st.floats(1e-9, 1e9), st.sampled_from([100.0, 5000.0]))
def test_a_nice_step_is_round_and_fine_enough(extent: float, parts: float) -> None:
    step = nice_step(extent, parts)
    assert step <= extent / parts * (1 + 1e-6)
    assert step > 0.3 * extent / parts
    assert f"{step:e}"[0] in "125"
    assert float(f"{step:.0e}") == step


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
