"""Numbers in the sentences of a page: with SI prefixes, as many digits as they deserve."""

from __future__ import annotations

import math
from typing import Final

_PREFIXES: Final = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M"}
_PREFIXED: Final = ("m", "s", "N", "m/s", "Hz")
_RAISED: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def quantity(value: float, unit: str = "1", *, digits: int = 4) -> str:
    """Return a number and its unit as a sentence has it.

    Parameters
    ----------
    value : float
        The number, in SI.
    unit : str
        Its SI unit, "1" for none.
    digits : int
        Significant digits.

    Examples
    --------
    >>> quantity(0.000665, "N"), quantity(0.3825), quantity(1800.0, "s"), quantity(0.3, "m")
    ('0.665 mN', '0.3825', '30 min', '30 cm')
    >>> quantity(7.076e-9, "N² s"), quantity(0.0042, "m2"), quantity(0.3, "rad2/s")
    ('7.076×10⁻⁹ N² s', '0.0042 m²', '0.3 rad²/s')
    """
    if not math.isfinite(value):
        return "unknown"
    if unit == "1":
        return _digits(value, digits)
    if unit == "s" and value >= 120.0:
        return f"{_digits(value / 60.0, digits)} min"
    if unit == "m" and 0.01 <= abs(value) < 1.0:
        return f"{_digits(100.0 * value, digits)} cm"
    if unit == "m/s" and 0.001 <= abs(value) < 1.0:
        return f"{_digits(100.0 * value, digits)} cm/s"
    if unit == "N" and 1e-5 <= abs(value) < 1.0:
        return f"{_digits(1e3 * value, digits)} mN"
    if unit not in _PREFIXED or value == 0.0:
        return f"{_digits(value, digits)} {unit.translate(_RAISED)}"
    power = 3 * math.floor(math.log10(abs(value)) / 3.0 + 1e-12)
    power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
    return f"{_digits(value / 10.0**power, digits)} {_PREFIXES[power]}{unit}"


def percent(share: float) -> str:
    """Return a share as a percentage.

    Examples
    --------
    >>> percent(0.9), percent(0.0025)
    ('90 %', '0.25 %')
    """
    return f"{100.0 * share:.3g} %"


def count(number: int, word: str) -> str:
    """Return "1 run" or "2 runs".

    Examples
    --------
    >>> count(1, "run"), count(400, "run")
    ('1 run', '400 runs')
    """
    return f"{number} {word}{'' if number == 1 else 's'}"


def with_interval(
    value: float, ends: tuple[float, float] | None, unit: str = "1", confidence: float | None = None
) -> str:
    """Return an estimate with its interval, or with the remark that it has none.

    Examples
    --------
    >>> with_interval(0.39, (0.38, 0.4), confidence=0.9)
    '0.39 (90 % interval 0.38 to 0.4)'
    >>> with_interval(0.39, None)
    '0.39 (no interval)'
    """
    if ends is None:
        return f"{quantity(value, unit)} (no interval)"
    words = "interval" if confidence is None else f"{percent(confidence)} interval"
    return (
        f"{quantity(value, unit)} ({words} {quantity(ends[0], unit)} to {quantity(ends[1], unit)})"
    )


def cell(value: float, unit: str) -> str:
    """Return a number and its unit as a cell of a table has it: a dash where there is none.

    Parameters
    ----------
    value : float
        The number, in SI.
    unit : str
        Its SI unit, "1" for none.

    Examples
    --------
    >>> cell(0.0382, "m"), cell(float("nan"), "m")
    ('3.82 cm', '–')
    """
    return quantity(float(value), unit, digits=3) if math.isfinite(value) else "–"


def _digits(value: float, digits: int) -> str:
    """Return a number with so many significant digits, powers of ten written as such."""
    text = f"{value:.{digits}g}"
    mantissa, _, power = text.partition("e")
    return f"{mantissa}×10{str(int(power)).translate(_RAISED)}" if power else text
