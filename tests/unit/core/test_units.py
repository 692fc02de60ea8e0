"""Numbers with units."""

from __future__ import annotations

import math

import pytest

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.units import parse_quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.55mN", "N", 0.00055),
        ("16ms", "s", 0.016),
        ("30cm", "m", 0.30),
        ("30 cm", "m", 0.30),
        ("11.6g", "kg", 0.0116),
        ("0.0116 kg", "kg", 0.0116),
        ("30min", "s", 1800.0),
        ("0.5h", "s", 1800.0),
        ("250 µm", "m", 0.00025),
        ("250 μm", "m", 0.00025),
        ("250um", "m", 0.00025),
        ("1g/cm3", "kg/m3", 1000.0),
        ("998 kg/m³", "kg/m3", 998.0),
        ("998 kg m^-3", "kg/m3", 998.0),
        ("0.89 mPa s", "Pa s", 0.00089),
        ("1cm/s", "m/s", 0.01),
        ("10Hz", "Hz", 10.0),
        ("10 1/s", "Hz", 10.0),
        ("1 kg*m/s**2", "N", 1.0),
        ("0.3", "m", 0.3),
        (" 3e-1 ", "m", 0.3),
        (".5", "1", 0.5),
        ("-2 mm", "m", -0.002),
        (2, "m", 2.0),
        (0.25, "m", 0.25),
    ],
)
def test_value_is_the_decimal_that_was_written(text: str | float, unit: str, value: float) -> None:
    assert parse_quantity(text, unit) == value


def test_degrees_become_radians() -> None:
    assert parse_quantity("180deg", "rad") == pytest.approx(math.pi, rel=1e-15)
    assert parse_quantity("90°", "rad") == pytest.approx(math.pi / 2, rel=1e-15)
    assert parse_quantity("1rad", "rad") == 1.0


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("12px", "m", "a pixel is not a unit; give its size in metres"),
        ("1,5mm", "m", "decimal point"),
        ("5s", "m", "'s' measures something else"),
        ("5", "m", None),
        ("10 hz", "Hz", "did you mean 'Hz'"),
        ("5 sec", "s", "did you mean 's'"),
        ("5 furlong", "m", "unknown unit 'furlong'"),
        ("abc", "m", "got 'abc'"),
        ("", "m", "got ''"),
        ("nan", "m", "got 'nan'"),
        ("1e999", "m", "not finite"),
        ("1e308 km", "m", "not finite"),
        ("3m99", "m", "exponent 99"),
        ("3/m", "m", "cannot read the unit"),
        ("3 m//s", "m/s", "cannot read the unit"),
        (True, "m", "got True"),
        (None, "m", "got None"),
        (math.inf, "m", "not finite"),
        (10**400, "m", "not finite"),
    ],
)
def test_refusal_names_what_was_given_and_what_is_expected(
    text: object, unit: str, words: str | None
) -> None:
    if words is None:
        assert parse_quantity(text, unit) == 5.0  # type: ignore[arg-type]
        return
    with pytest.raises(ConfigurationError) as caught:
        parse_quantity(text, unit)  # type: ignore[arg-type]
    assert words in str(caught.value)
    assert f"expected a number in {unit}" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_minute_is_not_a_milli_inch_and_a_metre_is_not_a_milli() -> None:
    assert parse_quantity("1min", "s") == 60.0
    assert parse_quantity("1m", "m") == 1.0
    assert parse_quantity("1ms", "s") == 0.001


def test_a_number_without_dimension_takes_no_unit() -> None:
    with pytest.raises(ConfigurationError, match=r"expected a number, got '0\.5m'"):
        parse_quantity("0.5m", "1")


def test_a_mistaken_unit_of_the_caller_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="unknown unit 'foo'"):
        parse_quantity("1m", "foo")
