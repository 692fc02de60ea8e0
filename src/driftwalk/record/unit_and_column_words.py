"""Words by which the columns of a table are known: quantities, units, and what is no position.

They stand in ``unit_and_column_words.toml``, by language and use.
"""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any, Final

_FILE: Final[dict[str, Any]] = tomllib.loads(
    (files("driftwalk.record") / "unit_and_column_words.toml").read_text(encoding="utf-8")
)


@cache
def words(name: str) -> frozenset[str]:
    """Return the words of one of the lists."""
    return frozenset(_FILE["lists"][name].split())


def _meanings(table: str) -> dict[str, str]:
    return {word: meaning for meaning, words in _FILE[table].items() for word in words.split()}


ROOTS: Final = _meanings("quantities")
UNITS: Final = _meanings("units")
LENGTHS: Final = words("lengths")
ALLOWED: Final[dict[str, frozenset[str]]] = {
    "t": words("times"),
    **dict.fromkeys(("x", "y", "z", "x1", "y1", "x2", "y2", "w", "h"), LENGTHS),
    "theta": words("angles"),
    **dict.fromkeys(("lon", "lat"), frozenset({"deg"})),
    **dict.fromkeys(("date", "frame", "qx", "qy", "qz", "qw", "body", "confidence"), frozenset()),
}
"""Quantities, and the units that each may have."""
NO_UNIT: Final = words("no_unit")
IMAGE_WORDS: Final = words("image")
SETPOINTS: Final = words("setpoints")
VARIANTS: Final = words("variants")
FRONT: Final = words("front")
REAR: Final = words("rear")
MIDDLE: Final = words("middle") | {""}
PARTS: Final = MIDDLE | FRONT | REAR
BOXES: Final = _meanings("sides_of_a_box") | {
    f"{prefix}{side}": side for prefix in ("bbox", "bb", "box") for side in _FILE["sides_of_a_box"]
}
"""From the name of a column, without separators and unit, to the side of a box that it holds."""
