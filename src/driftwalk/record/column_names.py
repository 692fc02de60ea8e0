"""Meaning of a column's name: which quantity, of which body, in which unit."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Final

from driftwalk.record.unit_and_column_words import (
    ALLOWED,
    IMAGE_WORDS,
    NO_UNIT,
    ROOTS,
    UNITS,
    words,
)

QUATERNION: Final = ("qx", "qy", "qz", "qw")
OF_BODY: Final = ("x", "y", "z", "theta", *QUATERNION, "lon", "lat", "confidence")
"""Quantities that a table may have once for each body."""
_P = re.compile(r"[pP]\d*")
_BRACKETS = re.compile(r"^(.*?)\s*[\[(]\s*([^\])]*)\s*[\])]\s*$")
_JOINED = re.compile(r"(position|cent(?:er|re|roid)|head|nose|tail)([xy])\b", re.IGNORECASE)


@dataclass(frozen=True)
class ColumnMeaning:
    """Meaning of a column."""

    quantity: str
    """A key of `ALLOWED`, or ``"t+"``: a fraction of the time in another column."""
    unit: str = ""
    """Unit in the name, ``""`` when there is none."""
    body: str = ""
    """Name of the body in the name, ``""`` when there is none."""
    bare: bool = True
    """Whether the name is the quantity's plain symbol, without a word that hints at an image."""
    unknown: str = ""
    """Text in the place of a unit that is no known unit."""
    rank: int = 1
    """Of several columns of a quantity that a table has once, the one of the lowest rank counts."""
    ending: str = ""
    """The word of the body's name that ends the name of the column, where a unit may stand."""


def words_of(name: str) -> list[str]:
    """Return the words of a column's name."""
    return [token for token in re.split(r"[\s_.\-/:]+", name) if token]


@lru_cache(maxsize=4096)
def column_meaning(name: str, unit_below: str = "") -> ColumnMeaning | None:
    """Return what a column of that name holds, or None when the name says nothing known.

    A unit may stand in a row below the names.

    Examples
    --------
    >>> column_meaning("x_mm")
    ColumnMeaning(quantity='x', unit='mm', body='', bare=True, unknown='', rank=2, ending='')
    >>> column_meaning("robot2 theta (deg)").body
    'robot2'
    """
    text, inside = split_brackets(name)
    inside = inside or unit_below.strip("[]() ").lower()
    unit, unknown = UNITS.get(inside, ""), "" if inside in UNITS else inside
    tokens = _join_quaternion(words_of(_JOINED.sub(r"\1_\2", text)))
    last = tokens[-1].lower() if len(tokens) > 1 else ""
    if (stamp := _stamp(tokens, unit)) is not None:
        return stamp
    index, quantity, number = _quantity(tokens[:-1] if last in UNITS or last in NO_UNIT else tokens)
    units = ALLOWED[quantity] if quantity and not inside else None
    if units is not None and (last in units or UNITS.get(last) in units):
        unit = UNITS[tokens.pop().lower()]
    elif units is not None and (last in NO_UNIT or _scaled(last) in units):
        unknown = tokens.pop() if units else ""
    else:
        index, quantity, number = _quantity(tokens)
    if not quantity:
        return None
    if quantity in OF_BODY and not (inside or unit or unknown):
        inner = _inner_unit(tokens, index, quantity)
        if inner is not None and UNITS.get(last) in ALLOWED["t"]:
            return None  # "x_mm_s" is a velocity
        if inner is not None:
            unit = UNITS[tokens.pop(inner).lower()]
            index -= inner < index
    rest = [token for position, token in enumerate(tokens) if position != index]
    lower = {token.lower() for token in rest}
    root = tokens[index].lower()
    with_id = words("with_id") if root == "id" else frozenset()
    allowed = IMAGE_WORDS | words("time") | {"id"} | with_id
    allowed |= {word.lower() for word in words_of(text.rpartition(": ")[0])}  # "Latest: Time"
    if quantity not in OF_BODY and lower - allowed - ({"date"} if quantity == "t" else set()):
        return None
    if quantity in OF_BODY and lower & words("no_position"):
        return None
    if quantity in ("x", "y", "z") and lower & words("directions") and not unit:
        return None
    if (unit and unit not in ALLOWED[quantity]) or (unknown and not ALLOWED[quantity]):
        return None
    image = lower & IMAGE_WORDS
    names = [token for token in rest if token.lower() not in IMAGE_WORDS | words("frame")]
    return ColumnMeaning(
        quantity=quantity,
        unit=unit or ("s" if root == "seconds" else ""),
        body="_".join([*names, number] if number else names) if quantity in OF_BODY else "",
        bare=not image and root.rstrip("0123456789") in ("x", "y", "z", "theta", "t"),
        unknown=unknown,
        rank=1 if root in words("first") and not lower - words("frame") - {"id"} else 2,
        ending=tokens[-1] if not unit and tokens[-1] in names else "",
    )


def quantity_of(name: str) -> str:
    """Return the quantity of a column of that name, ``""`` when the name says nothing known."""
    meaning = column_meaning(name)
    return "" if meaning is None else meaning.quantity


def _quantity(tokens: list[str]) -> tuple[int, str, str]:
    """Return (index of its word, quantity, number of the body) of a name, if it has one."""
    found = [(index, *_root(token)) for index, token in enumerate(tokens)]
    found = [entry for entry in found if entry[1]]
    kinds = tuple(entry[1] for entry in found)
    if len(found) == 2:
        first, second = kinds
        if first == "body" and second in OF_BODY:
            found = found[1:]  # "robot x", "id_1_x": the body's own name, then the quantity
        elif second == "body" and first in ("body", "frame", *OF_BODY):
            found = found[:1]  # "track id", "x_fish", "frame id"
        elif kinds == ("date", "t"):
            found = found[1:]
        elif kinds == ("theta", "theta"):
            found = found[:1]  # "heading angle"
        elif first == "confidence" and second in OF_BODY and _P.fullmatch(tokens[found[0][0]]):
            found = found[1:]  # "p_RS_R_x" is a position, "p1_x" that of a point
    return found[0] if len(found) == 1 else (-1, "", "")


def _scaled(word: str) -> str:
    """Return the unit of a word such as "10um", ``""`` of any other."""
    stem = word.lstrip("0123456789")
    return UNITS.get(stem, "") if stem != word else ""


def _inner_unit(tokens: list[str], index: int, quantity: str) -> int | None:
    """Return where a unit stands in the middle of a name, None where none does."""
    for at, token in enumerate(tokens):
        word = token.lower()
        after = word == "m" and at == index + 1 < len(tokens) - 1
        if (word in words("inner") or after) and UNITS[word] in ALLOWED[quantity]:
            return at
    return None


def _stamp(tokens: list[str], unit: str) -> ColumnMeaning | None:
    """Return the meaning of the stamp of a message of ROS, or of seconds and their fraction."""
    lower = [token.lower().lstrip("%") for token in tokens]
    known = UNITS.get(lower[-1], "") if lower else ""
    in_header = "header" in lower or lower[:1] == ["stamp"]
    parts = known in ("s", "ns", "us", "ms") and lower[-1] not in ("seconds", "s", "ms", "us", "ns")
    if lower and lower[-1] == "stamp" and "header" in lower:
        return ColumnMeaning("t", unit, rank=0)
    if not parts or set(lower[:-1]) - {"field", "msg", "header", "stamp", "time", "t"}:
        return None
    # "time_sec" is a time with a unit.
    if len(lower) > 1 and not in_header and lower[-1] not in ("nsec", "nsecs", "nanosec"):
        return None
    return ColumnMeaning("t" if known == "s" else "t+", known, rank=0 if in_header else 2)


def _join_quaternion(tokens: list[str]) -> list[str]:
    """Return the words of a name with those of a part of a quaternion as one."""
    for at, (first, second) in enumerate(pairwise(tokens)):
        if first.lower() in words("quaternion") and second.lower() in ("x", "y", "z", "w"):
            return [*tokens[:at], f"q{second.lower()}", *tokens[at + 2 :]]
    return tokens


def unit_of_name(name: str) -> str:
    """Return the unit that the name of any column ends in, ``""`` where there is none.

    Examples
    --------
    >>> unit_of_name("Winkel [°]")
    'deg'
    """
    text, unit = split_brackets(name)
    last = re.split(r"[\s_.\-/]+", text)[-1].lower()
    return UNITS.get(unit, "") if unit else (UNITS.get(last, "") if last != text.lower() else "")


def split_brackets(name: str) -> tuple[str, str]:
    """Split ``"x (mm)"`` into the name and what stands in the brackets, in small letters."""
    name = name.strip().strip("\"'").strip().lstrip("#%").strip()
    # On a long run of blanks the search takes the square of its length.
    match = _BRACKETS.match(name) if name.endswith((")", "]")) else None
    return (name, "") if match is None else (match.group(1), match.group(2).strip().lower())


def _root(token: str) -> tuple[str, str]:
    """Return (quantity, number of the body) of one word, ("", "") when it is none."""
    stem, number, _ = re.split(r"(\d*)$", token.lower(), maxsplit=1)
    quantity = ROOTS.get(stem, "")
    if number and quantity not in OF_BODY:
        return "", ""
    return quantity, number
