"""Options that vary a setting: ``NAME=VALUES``, with lists and ranges of numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Final

from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.units import parse_quantity, share_unit

MOST_VALUES: Final = 1_000_000
"""Values of a range at most: a mistyped step is refused before memory runs out; chosen by hand."""


def read_varied(
    given: Sequence[str], names: Mapping[str, str], read: Callable[[str, list[str]], Any]
) -> dict[str, Any]:
    """Return what the options say, by the key of each name.

    Parameters
    ----------
    given : sequence of str
        Such as ``"blocks=2,3,4"``; values with commas of their own are parted by semicolons;
        magnets also by the comma after ``none`` or a remanence in T.
    names : mapping of str to str
        Keys by the names that an option may have.
    read : callable
        Called as ``read(key, words)``; returns the values of the words.

    Raises
    ------
    InputError
        When there is no such name, it is named twice, or a value cannot be read.
    """
    found: dict[str, Any] = {}
    for text in given:
        word, sign, values = text.partition("=")
        word = word.strip()
        key = names.get(word) or names.get(word.replace("_", "-"))
        if key is None or not sign:
            raise InputError(
                f"--vary {text}: expected NAME=VALUES with a name out of {', '.join(names)}"
            )
        if key in found:
            raise InputError(f"--vary {text}: {word} is varied twice; name all values at once")
        # The values of magnets, and of faces, have commas of their own: "none; 3x3x1mm,1.2T".
        comma = "(?<=none),|(?<=T)," if word == "magnets" else ","
        words = [one.strip() for one in re.split(";" if ";" in values else comma, values)]
        try:
            if not all(words):
                raise ConfigurationError(f"a value is missing after '{word}='")
            found[key] = read(key, words)
        except ConfigurationError as error:
            raise InputError(f"--vary {text}: {error}") from error
    return found


def listed(words: Sequence[str], unit: str, *, known: Collection[str] = ()) -> list[Any]:
    """Return the numbers of words, each a number or FROM:TO:STEP; known words stay.

    Examples
    --------
    >>> listed(["none", "0", "0.2", "1:1.5:0.5mN"], "N", known=["none"])
    ['none', 0.0, 0.0002, 0.001, 0.0015]
    """
    found: list[Any] = []
    numbers = iter(parted_numbers([word for word in words if word not in known], unit))
    for word in words:
        own = [word] if word in known else next(numbers)
        if len(own) == 3:
            own = _range(*own, unit="" if unit == "1" else f" {unit}")
        elif len(own) != 1:
            raise ConfigurationError(f"expected a number or FROM:TO:STEP, got '{word}'")
        found += own
    return found


def parted_numbers(words: Sequence[str], unit: str) -> list[list[float]]:
    """Return the numbers of each word between its colons; a unit holds for those before it.

    Examples
    --------
    >>> parted_numbers(["0.2:1.2mN"], "N")
    [[0.0002, 0.0012]]
    """
    parts = [word.split(":") for word in words]
    shared = iter(share_unit([part for one in parts for part in one]))
    return [[parse_quantity(next(shared), unit) for _ in one] for one in parts]


def _range(first: float, last: float, step: float, *, unit: str) -> list[float]:
    """Return the numbers of a range, end included, rounded to the decimals of the step."""
    if not (step > 0 and last >= first):
        raise ConfigurationError(
            f"no value from {first:g}{unit} to {last:g}{unit} in steps of {step:g}{unit}"
        )
    steps = (last - first) / step
    if steps > MOST_VALUES:
        raise ConfigurationError(f"a step of {step:g}{unit} gives more than {MOST_VALUES} values")
    return [float(f"{first + k * step:.12g}") for k in range(math.floor(steps + 1e-6) + 1)]
