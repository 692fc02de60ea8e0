"""Properties of reading quantities."""

from __future__ import annotations

import math
from decimal import Decimal

import pytest
from hypothesis import example, given, settings, strategies as st

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.units import parse_quantity

PREFIXES = {"G": 9, "M": 6, "k": 3, "h": 2, "": 0, "d": -1, "c": -2, "m": -3, "u": -6, "n": -9}
NUMBERS = st.decimals(-(10**6), 10**6, places=6)


@settings(deadline=None, max_examples=200)
@given(
    number=NUMBERS,
    prefix=st.sampled_from(sorted(PREFIXES)),
    unit=st.sampled_from(["m", "s", "N", "Pa", "Hz", "rad"]),
    space=st.sampled_from(["", " ", "  "]),
)
def test_prefix_is_a_power_of_ten_without_rounding(
    number: Decimal, prefix: str, unit: str, space: str
) -> None:
    value = parse_quantity(f"{number}{space}{prefix}{unit}", unit)
    exact = Decimal(repr(float(number))) * Decimal(10) ** PREFIXES[prefix]
    assert value == float(exact)


@settings(deadline=None, max_examples=100)
@given(number=st.floats(allow_nan=False, allow_infinity=False))
def test_bare_number_is_itself(number: float) -> None:
    assert parse_quantity(repr(number), "N") == number
    assert parse_quantity(number, "N") == number


@settings(deadline=None, max_examples=300)
@given(
    text=st.text(alphabet="0123456789.eE+-, mskgNPaHzradminh°µ*/^²³1px", max_size=16),
    unit=st.sampled_from(["m", "s", "kg/m3", "1", "rad"]),
)
@example(text="1e-99999999999mm", unit="m")
@example(text="9" * 5000 + "mm", unit="m")
@example(text="0e99999999mm", unit="m")
@example(text="1²", unit="m")
@example(text="١m", unit="m")
def test_any_text_gives_a_finite_number_or_a_readable_refusal(text: str, unit: str) -> None:
    try:
        message, value = "", parse_quantity(text, unit)
    except ConfigurationError as error:
        message, value = str(error), 0.0
    assert math.isfinite(value)
    assert not message or message.startswith("expected a number")


@settings(deadline=None, max_examples=100)
@given(number=st.floats(1e-3, 1e3), other=st.sampled_from(["s", "kg", "N", "rad", "m2", "1/m"]))
def test_another_dimension_is_refused(number: float, other: str) -> None:
    with pytest.raises(ConfigurationError, match="something else"):
        parse_quantity(f"{number!r} {other}", "m")
