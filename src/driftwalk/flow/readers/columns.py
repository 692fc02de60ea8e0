"""Names of the columns of a velocity field: which quantity, in which unit, which marks."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError

FIELD: Final = ("x", "y", "u", "v")
_FILLERS: Final = frozenset({"mean", "avg", "average"})
"""Words that leave a quantity what it is."""
_PLACES: Final = frozenset(
    ("position", "pos", "coordinate", "coord", "posizione", "posicion", "koordinate", "coordonnee")
)
"""Words next to x and y that name a position."""
_VELOCITIES: Final = frozenset(
    (
        *("velocity", "vel", "component", "displacement", "shift"),
        *("geschwindigkeit", "komponente", "verschiebung", "vitesse", "composante", "deplacement"),
        *("velocidad", "velocita", "componente"),
    )
)
"""Words next to u and v, or x and y, that name a velocity."""
_SYMBOLS: Final = {
    **dict.fromkeys(("x", "posx", "xpos"), "x"),
    **dict.fromkeys(("y", "posy", "ypos"), "y"),
    **dict.fromkeys(("u", "ux", "vx", "dx", "ux1", "velx"), "u"),
    **dict.fromkeys(("v", "uy", "vy", "dy", "uy1", "vely"), "v"),
}
"""From a name without its further words to the quantity."""
MARKS: Final[dict[str, Callable[[Floats], npt.NDArray[np.bool_]]]] = {
    **dict.fromkeys(("flags", "mask", "status"), lambda mark: mark == 0.0),
    **dict.fromkeys(("chc",), lambda mark: mark > 0.0),
    **dict.fromkeys(("isvalid", "is valid", "valid"), lambda mark: mark != 0.0),
    **dict.fromkeys(("vector type", "typevector"), lambda mark: mark == 1.0),
    "fiji flag": lambda mark: (mark != 999.0) & (mark != -1.0),
}
"""Columns that say which velocities were measured, and the values that say so."""
_TIMES: Final = frozenset({"t", "t s", "time", "time s", "frame", "timestamp", "slice"})
_BRACKET: Final = re.compile(r"(.*?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]")
_SUFFIX: Final = re.compile(
    r"([xyuv]|[uv][xy]|vel_?[xy])_(m|cm|mm|um|px|pixel|in|ft)(?:(?:_per_|_|/)(s|min|frame))?",
    re.IGNORECASE,
)
MISSING: Final = frozenset(
    (
        *("", "nan", "-nan", "na", "n/a", "#n/a", "<na>", "null", "none", "-", "--", "."),
        *("nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind", "1.#ind", "missing", "masked"),
    )
)
"""Marks of a velocity that is not there, in small letters."""


class Column(NamedTuple):
    """Quantity and unit in the name of a column."""

    quantity: str
    """x, y, u or v; ``""`` for any other."""
    unit: str
    """As it is written, ``""`` where there is none."""
    base: str
    """The name without its unit, in small letters."""


def column_of(name: str) -> Column:
    """Return what the name of a column says.

    Examples
    --------
    >>> column_of("Velocity u [m/s]")[:2], column_of("X mm")[:2], column_of("v_m_s")[:2]
    (('u', 'm/s'), ('x', 'mm'), ('v', 'm/s'))
    >>> column_of("x (pix)[pix]")[:2], column_of("Vector type [-]").base
    (('x', 'pix'), 'vector type')
    """
    text, unit = name.strip().strip('"').strip(), ""
    if (suffix := _SUFFIX.fullmatch(text)) is not None:
        text, unit = suffix[1].lower(), suffix[2].lower()
        # A position over a time, or a velocity without one, is some other quantity.
        quantity = _quantity([text.replace("_", "")])
        known = bool(suffix[3]) == (quantity in ("u", "v"))
        over = f"/{suffix[3].lower()}" if suffix[3] else ""
        return Column(quantity if known else "", f"{unit}{over}", text)
    while (match := _BRACKET.fullmatch(text)) is not None:
        text, unit = match[1], unit or match[2]
    words = [one for one in re.split(r"[\s_.:-]+", _plain(text)) if one]
    base = " ".join(words)
    # "U pix[pix]" has its unit twice.
    quantity = _quantity([one for one in words if not (unit and one == unit.lower())])
    first, _, rest = text.partition(" ")
    if not quantity and not unit and first.lower() in FIELD:
        return Column(first.lower(), rest.strip(), first.lower())
    return Column(quantity, unit, base)


def _plain(text: str) -> str:
    """Return a text in small letters without accents."""
    return "".join(one for one in unicodedata.normalize("NFKD", text.lower()) if one.isascii())


def _quantity(words: Sequence[str]) -> str:
    """Return the quantity that words name, ``""`` for any other."""
    left = [word for word in words if word not in _FILLERS | _PLACES | _VELOCITIES]
    found = _SYMBOLS.get("".join(left), "") if len(left) <= 2 else ""
    if found in ("x", "y") and set(words) & _VELOCITIES:
        return {"x": "u", "y": "v"}[found] if not set(words) & _PLACES else ""
    return found


def holds_field(names: Sequence[str]) -> bool:
    """Return whether the names of columns belong to a velocity field."""
    return set(FIELD) <= {column_of(name).quantity for name in names}


def names_a_time(names: Sequence[str]) -> bool:
    """Return whether a column is a clock, as a recording has one."""
    return any(column_of(name).base in _TIMES for name in names)


def choose_columns(names: Sequence[str], stated: Mapping[str, str]) -> dict[str, tuple[int, str]]:
    """Return the place and the unit of x, y, u and v; what the user states overrides the names.

    Raises
    ------
    InputError
        When a quantity has no column, or several.
    """
    known = [column_of(name) for name in names]
    if unknown := sorted(set(stated) - set(FIELD)):
        raise InputError(f"`columns` of a flow field are of x, y, u, v; got '{unknown[0]}'")
    found = {}
    for wanted in FIELD:
        if wanted in stated:
            found[wanted] = _stated(stated[wanted], names, known)
            continue
        # A column in metres rather than one in pixels, or without a unit.
        ranks = sorted(
            (not one.unit or one.unit.lower().startswith(("px", "pix")), one.base != wanted, at)
            for at, one in enumerate(known)
            if one.quantity == wanted
        )
        if not ranks or (len(ranks) > 1 and ranks[0][:2] == ranks[1][:2]):
            got = ", ".join(filter(None, names)) or f"{len(names)} columns without names"
            raise InputError(
                f"the header needs one column '{wanted}' (x and y in m, u and v in m/s), got "
                f'{got}: name it with `columns={{"{wanted}": "NAME"}}`'
            )
        found[wanted] = (ranks[0][2], known[ranks[0][2]].unit)
    units = [found[wanted][1] for wanted in FIELD]
    if units[0] != units[1] or units[2] != units[3]:
        raise InputError(
            f"x, y, u, v have the units {', '.join(unit or 'none' for unit in units)}: use one "
            "unit for x and y, and one for u and v"
        )
    return found


def _stated(text: str, names: Sequence[str], known: Sequence[Column]) -> tuple[int, str]:
    """Return the place of a column that the user names, by name or number, and its unit."""
    for name, unit in ((text, ""), (text.rpartition(":")[0], text.rpartition(":")[2])):
        wanted = name.strip().lower()
        same = [at for at, one in enumerate(names) if one.strip().lower() == wanted]
        same = same or [at for at, one in enumerate(known) if one.base and one.base == wanted]
        if not same and wanted.isdecimal() and 1 <= int(wanted) <= len(names):
            same = [int(wanted) - 1]
        if len(same) == 1:
            return same[0], unit.strip() or known[same[0]].unit
    raise InputError(
        f"`columns` names '{text}', and the table has "
        f"{', '.join(filter(None, names)) or f'the columns 1 to {len(names)}'}"
    )


def number(text: str, *, comma: bool) -> float | None:
    """Return a number, NaN where it is marked as missing, None where it is no finite number."""
    shown = text.strip().strip('"')
    try:
        value = float(shown.replace(",", ".") if comma else shown)
    except ValueError:
        return math.nan if shown.lower() in MISSING else None
    return None if math.isinf(value) else value
