"""Quantities with a standard deviation, such as ``11.6±0.2 g``."""

from __future__ import annotations

from typing import Final, NamedTuple

SIGNS: Final = ("±", "+-", "+/-")


class Uncertain(NamedTuple):
    """A value and its standard deviation, numbers or texts with a unit."""

    value: float | str
    std: float | str


def split_uncertain(text: str) -> Uncertain | None:
    """Return the two quantities of a text; nothing where it states no standard deviation.

    A unit at the end is that of both.

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
            unit = std.lstrip("0123456789.eE+-").strip()
            has_unit = value.lstrip("0123456789.eE+-").strip() != ""
            return Uncertain(value if has_unit or not unit else f"{value} {unit}", std)
    return None
