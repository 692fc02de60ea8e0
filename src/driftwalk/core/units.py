"""Numbers with units: ``"0.55mN"`` read as 0.00055 N. Plain Python, no numpy.

A quantity is a number followed by a unit: base symbols with SI prefixes, joined by a space, ``*``
or ``/``, with exponents as ``m2``, ``m^2``, ``m**2`` or ``m²``. A number without a unit is in the
unit that is asked for, which in driftwalk is always SI.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Final, NamedTuple

from driftwalk.core.errors import ConfigurationError

Dimension = tuple[int, ...]


class _Unit(NamedTuple):
    scale: Fraction
    """Factor to SI."""
    dimension: Dimension
    """Exponents of metre, kilogram, second, radian."""


_NONE: Final[Dimension] = (0, 0, 0, 0)
"""Dimension of a bare number."""
# Symbols that take SI prefixes. The gram is here, and not the kilogram, because "kg" is k + g.
_PREFIXABLE: Final[dict[str, _Unit]] = {
    "m": _Unit(Fraction(1), (1, 0, 0, 0)),
    "g": _Unit(Fraction(1, 1000), (0, 1, 0, 0)),
    "s": _Unit(Fraction(1), (0, 0, 1, 0)),
    "rad": _Unit(Fraction(1), (0, 0, 0, 1)),
    "Hz": _Unit(Fraction(1), (0, 0, -1, 0)),
    "N": _Unit(Fraction(1), (1, 1, -2, 0)),
    "Pa": _Unit(Fraction(1), (-1, 1, -2, 0)),
    "J": _Unit(Fraction(1), (2, 1, -2, 0)),
}
_DEGREE: Final = Fraction(math.pi) / 180
"""Radians of a degree."""
_FIXED: Final[dict[str, _Unit]] = {
    "1": _Unit(Fraction(1), _NONE),
    "min": _Unit(Fraction(60), (0, 0, 1, 0)),
    "h": _Unit(Fraction(3600), (0, 0, 1, 0)),
    "deg": _Unit(_DEGREE, (0, 0, 0, 1)),
    "°": _Unit(_DEGREE, (0, 0, 0, 1)),
}
"""Symbols that take no prefix."""
# Both code points of mu are in use: the micro sign of keyboards and the Greek letter.
_PREFIXES: Final[dict[str, Fraction]] = {
    symbol: Fraction(10) ** power
    for symbol, power in (
        *(("G", 9), ("M", 6), ("k", 3), ("h", 2), ("d", -1), ("c", -2)),
        *(("m", -3), ("u", -6), ("µ", -6), ("μ", -6), ("n", -9), ("p", -12)),
    )
}
_NUMBER: Final = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.ASCII)
_FACTOR: Final = re.compile(
    r"\s*([*·/]?)\s*([A-Za-zµμ]+|°|1)\s*(?:(?:\^|\*\*)?(-?\d+)|([²³]))?", re.ASCII
)
_SUPERSCRIPTS: Final = {"²": 2, "³": 3}
"""Powers as they are typed in one character."""
RAISED: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
"""From signs and digits to those of a power."""


def parse_quantity(text: str | float, unit: str) -> float:
    """Read a number with an optional unit, and return it in the unit asked for.

    Parameters
    ----------
    text : str or float
        Such as ``"0.55mN"``, ``"16 ms"``, ``"30cm"``, ``"0.5deg"``, ``"1.2 g/cm3"``; a bare number
        (or a string that holds one) is taken to be in `unit` already.
    unit : str
        The unit of the result: ``"m"``, ``"N"``, ``"kg/m3"``, ``"Pa s"``, ..., or ``"1"`` for a
        number without a dimension.

    Returns
    -------
    float
        The value in `unit`, finite.

    Raises
    ------
    ConfigurationError
        When the text is not a number, the unit is unknown or measures something else, or the value
        is not finite. Pixels are not a unit: how many metres one is belongs to the recording.

    Examples
    --------
    >>> parse_quantity("0.55mN", "N")
    0.00055
    """
    if isinstance(text, bool) or not isinstance(text, (str, int, float)):
        raise _refusal(unit, repr(text))
    value = _parse_text(text, unit) if isinstance(text, str) else _to_float(text)
    if not math.isfinite(value):
        raise _refusal(unit, f"{text!r}, which is not finite")
    return value


def _to_float(number: float | Fraction) -> float:
    try:
        return float(number)
    except OverflowError:
        return math.inf


def _parse_text(text: str, unit: str) -> float:
    match = _NUMBER.fullmatch(text)
    if match is None or match[2].startswith(","):
        hint = "; use a decimal point" if re.search(r"\d,\d", text) else ""
        raise _refusal(unit, f"'{text}'{hint}")
    number, symbol = float(match[1]), match[2]
    if not symbol:
        return number
    if symbol.startswith("/") and unit.startswith("1/"):
        symbol = f"1{symbol}"
    given, wanted = _parse_unit(symbol, text, unit), _parse_unit(unit, text, unit)
    if given.dimension != wanted.dimension:
        raise _refusal(unit, f"'{text}': '{symbol}' measures something else")
    if not math.isfinite(number):
        return number
    # Exact fractions, rounded once: 0.55 mN is the float that 0.00055 N is.
    return _to_float(Fraction(repr(number)) * given.scale / wanted.scale)


def _parse_unit(symbol: str, text: str, unit: str) -> _Unit:
    """Return the scale and dimension of a product of units."""
    scale, dimension = Fraction(1), _NONE
    position = 0
    while position < len(symbol):
        match = _FACTOR.match(symbol, position)
        if match is None or (position == 0 and match[1]):
            raise _refusal(unit, f"'{text}': cannot read the unit '{symbol}'")
        # A slash divides by the factor after it alone, as in "kg/m s" written by hand.
        sign = -1 if match[1] == "/" else 1
        power = sign * int(match[3] or _SUPERSCRIPTS.get(match[4] or "", 1))
        if abs(power) > 9:
            raise _refusal(unit, f"'{text}': the exponent {power} is out of range")
        factor = _lookup(match[2], text, unit)
        scale *= factor.scale**power
        pairs = zip(dimension, factor.dimension, strict=True)
        dimension = tuple(before + power * own for before, own in pairs)
        position = match.end()
    return _Unit(scale, dimension)


def _lookup(symbol: str, text: str, unit: str) -> _Unit:
    """Return one unit; an exact symbol comes before a prefix, so that "min" is a minute."""
    if exact := _FIXED.get(symbol) or _PREFIXABLE.get(symbol):
        return exact
    prefix, base = symbol[:1], symbol[1:]
    if prefix in _PREFIXES and base in _PREFIXABLE:
        return _Unit(_PREFIXES[prefix] * _PREFIXABLE[base].scale, _PREFIXABLE[base].dimension)
    if symbol.lower() in ("px", "pixel", "pixels"):
        advice = "; give its size in metres (`metres_per_pixel`)" if unit == "m" else ""
        raise _refusal(unit, f"'{text}': a pixel is not a unit{advice}")
    raise _refusal(unit, f"'{text}': unknown unit '{symbol}'{_suggestion(symbol)}")


def _suggestion(symbol: str) -> str:
    words = {"sec": "s", "ms": "ms", "minutes": "min", "degrees": "deg", "newton": "N", "hr": "h"}
    known = {**{name.lower(): name for name in (*_PREFIXABLE, *_FIXED)}, **words}
    found = known.get(symbol.lower()) or known.get(symbol.lower().rstrip("s"))
    return f"; did you mean '{found}'?" if found else ""


_EXAMPLES: Final = {
    "m": "3cm",
    "s": "16ms",
    "N": "0.55mN",
    "kg": "11.6g",
    "rad": "0.5deg",
    "Hz": "10Hz",
    "m/s": "1cm/s",
    "1/s": "0.01/s",
    "kg/m3": "1g/cm3",
    "Pa s": "0.89mPa s",
}


def _refusal(unit: str, got: str) -> ConfigurationError:
    """Return the error of a text that is no quantity in a unit."""
    example = f" such as '{_EXAMPLES[unit]}'" if unit in _EXAMPLES else ""
    expected = "a number" if unit == "1" else f"a number in {unit} or a quantity{example}"
    return ConfigurationError(f"expected {expected}, got {got}")


def percent(share: Any) -> str:
    """Return a share as a percentage with three digits at most.

    Examples
    --------
    >>> percent(0.954), percent(0.95), percent(0.0025)
    ('95.4 %', '95 %', '0.25 %')
    """
    return f"{100.0 * float(share):.3g} %"


def in_percent(share: float, *, decimals: int = 0, sign: bool = False) -> str:
    """Return a share as a percentage, with so many decimals, and with "+" if it may be negative.

    Examples
    --------
    >>> in_percent(0.9), in_percent(0.0025, decimals=2), in_percent(0.1, sign=True)
    ('90 %', '0.25 %', '+10 %')
    """
    return f"{100.0 * share:{'+' if sign else ''}.{decimals}f} %"


def raised_powers(unit: str) -> str:
    """Return a unit as print has it, with its powers raised.

    Examples
    --------
    >>> raised_powers("rad2/s"), raised_powers("s-1"), raised_powers("1/s")
    ('rad²/s', 's⁻¹', '1/s')
    """
    return re.sub(r"(?<=[^\W\d])-?\d+", lambda power: power[0].translate(RAISED), unit)


def share_unit(words: Sequence[str]) -> list[str]:
    """Return quantities in which a bare number has the unit of the next one that has a unit.

    Raises
    ------
    ConfigurationError
        When a number that is not 0 has no unit, and one before it does.

    Examples
    --------
    >>> share_unit(["0.2", "0.55", "1.2 mN", "0"])
    ['0.2 mN', '0.55 mN', '1.2 mN', '0']
    """
    found: list[str] = []
    units = [match[2] if (match := _NUMBER.fullmatch(word)) else None for word in words]
    for at, (word, own) in enumerate(zip(words, units, strict=True)):
        unit = next((one for one in units[at:] if one), "")
        if own == "" and not unit and any(units) and float(word):
            raise ConfigurationError(f"'{word}' has no unit, and a number before it has one")
        found.append(f"{word} {unit}" if own == "" and unit else word)
    return found


SIGNS: Final = ("±", "+-", "+/-")


class Uncertain(NamedTuple):
    """A value and its standard deviation, numbers or texts with a unit."""

    value: float | str
    std: float | str


def split_uncertain(text: str) -> Uncertain | None:
    """Return the two quantities of a text; nothing where it states no standard deviation.

    A unit at the end belongs to both.

    Examples
    --------
    >>> split_uncertain("11.6±0.2 g")
    Uncertain(value='11.6 g', std='0.2 g')
    >>> split_uncertain("11.6 g") is None
    True
    """
    for sign in SIGNS:
        value, found, std = (part.strip() for part in text.partition(sign))
        if found:
            return Uncertain(*share_unit([value, std]))
    return None
