"""Meaning of a column's name: which quantity, of which body, in which unit."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import pairwise

from driftwalk.core.errors import InputError, argument_text

_ROOTS: dict[str, str] = {
    **dict.fromkeys(("t", "time", "timestamp", "datetime", "seconds"), "t"),
    "date": "date",
    **dict.fromkeys(
        ("frame", "frames", "framenumber", "frameno", "frameid", "frameindex"), "frame"
    ),
    **dict.fromkeys(("x", "posx", "xpos", "cx", "xc"), "x"),
    **dict.fromkeys(("y", "posy", "ypos", "cy", "yc"), "y"),
    **dict.fromkeys(("z", "posz", "zpos", "cz", "zc"), "z"),
    **{part: part for part in ("qx", "qy", "qz", "qw")},
    **dict.fromkeys(("theta", "heading", "orientation", "angle", "yaw"), "theta"),
    **dict.fromkeys(
        ("body", "id", "track", "trackid", "robot", "robotid", "individual", "animal", "name"),
        "body",
    ),
    **dict.fromkeys(("particle", "agent", "subject", "fish", "mouse", "rat", "bot"), "body"),
    **dict.fromkeys(("particleid", "agentid", "objectid", "tagid", "uid", "tracklet"), "body"),
}
# These name bodies only together with "id": an object or a tag by itself may be a class or a
# state, which changes while the body stays the same.
_WITH_ID = frozenset({"object", "obj", "cell", "marker", "tag", "target", "blob", "instance"})
_UNITS: dict[str, str] = {
    **{unit: unit for unit in ("m", "cm", "mm", "um", "km", "s", "ms", "us", "ns", "min", "px")},
    **{"µm": "um", "μm": "um", "µs": "us", "μs": "us", "metres": "m", "meters": "m"},
    **dict.fromkeys(("pix", "pixel", "pixels"), "px"),
    **dict.fromkeys(("micron", "microns"), "um"),
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("msec", "milliseconds"), "ms"),
    **dict.fromkeys(("rad", "radian", "radians"), "rad"),
    **dict.fromkeys(("deg", "degree", "degrees", "°"), "deg"),
}
_ALLOWED: dict[str, frozenset[str]] = {
    "t": frozenset({"s", "ms", "us", "ns", "min"}),
    "date": frozenset(),
    "frame": frozenset(),
    "x": frozenset({"m", "cm", "mm", "um", "km", "px"}),
    "y": frozenset({"m", "cm", "mm", "um", "km", "px"}),
    "z": frozenset({"m", "cm", "mm", "um", "km", "px"}),
    "theta": frozenset({"rad", "deg"}),
    **dict.fromkeys(("qx", "qy", "qz", "qw"), frozenset[str]()),
    "body": frozenset(),
}
_QUATERNION = ("qx", "qy", "qz", "qw")
_OF_BODY = ("x", "y", "z", "theta", *_QUATERNION)
"""Quantities that a table may have once for each body."""
# Words before x, y, z or w that make them a part of a quaternion: "orientation.x", "q_w".
_QUATERNION_WORDS = frozenset({"q", "quat", "quaternion", "orientation"})
# Words next to x or y that do not name a body. They hint at an image, so a length next to
# them is not taken for metres.
_IMAGE_WORDS = frozenset({"pos", "position", "center", "centre", "centroid", "image", "coord"})
# Words next to x or y that rule out a position.
_NO_POSITION = frozenset(
    {"velocity", "vel", "speed", "acceleration", "acc", "accel", "force", "err", "error"}
    | {"std", "sigma", "var", "variance", "min", "max", "confidence", "likelihood", "score"}
)
_FRAME_WORDS = frozenset({"number", "no", "index", "stamp", "col", "num"})
_BRACKETS = re.compile(r"^(.*?)\s*[\[(]\s*([^\])]*)\s*[\])]\s*$")


@dataclass(frozen=True)
class ColumnMeaning:
    """Meaning of a column."""

    quantity: str
    """``"t"``, ``"date"``, ``"frame"``, ``"x"``, ``"y"``, ``"z"``, ``"theta"``, ``"qx"`` to
    ``"qw"`` or ``"body"``."""
    unit: str = ""
    """Unit in the name, ``""`` when there is none."""
    body: str = ""
    """Name of the body in the name, ``""`` when there is none."""
    bare: bool = True
    """Whether the name is the quantity's plain symbol, without a word that hints at an image."""


def column_meaning(name: str) -> ColumnMeaning | None:
    """Return what a column of that name holds, or None when the name says nothing known.

    Examples
    --------
    >>> column_meaning("x_mm")
    ColumnMeaning(quantity='x', unit='mm', body='', bare=True)
    >>> column_meaning("robot2 theta (deg)").body
    'robot2'
    """
    text, unit = _split_brackets(name.strip().strip("\"'").strip().lstrip("#%").strip())
    if unit is None:
        return None
    tokens = _join_quaternion([token for token in re.split(r"[\s_.\-/]+", text) if token])
    if not unit and len(tokens) > 1 and tokens[-1].lower() in _UNITS:
        unit = _UNITS[tokens.pop().lower()]
    found = [(index, *_root(token)) for index, token in enumerate(tokens)]
    found = [entry for entry in found if entry[1]]
    if len(found) == 2 and found[0][1] == "body" and found[1][1] in _OF_BODY:
        found = found[1:]  # "robot x", "id_1_x": the body's own name, then the quantity
    elif len(found) == 2 and found[0][1] == found[1][1] == "body":
        found = found[:1]  # "track id"
    elif len(found) == 2 and found[0][1] in _OF_BODY and found[1][1] == "body":
        found = found[:1]  # "x_fish"
    elif len(found) == 2 and found[0][1] == "frame" and found[1][1] == "body":
        found = found[:1]  # "frame id"
    elif [entry[1] for entry in found] == ["date", "t"]:
        found = found[1:]  # "date time"
    if len(found) != 1:
        return None
    index, quantity, number = found[0]
    rest = [token for position, token in enumerate(tokens) if position != index]
    lower = {token.lower() for token in rest}
    words = _IMAGE_WORDS | _FRAME_WORDS
    allowed = words | {"id"} | (_WITH_ID if tokens[index].lower() == "id" else frozenset())
    if quantity in ("t", "date", "frame", "body") and lower - allowed - {"date"}:
        return None
    if quantity in _OF_BODY and lower & _NO_POSITION:
        return None
    if unit and unit not in _ALLOWED[quantity]:
        return None
    image = lower & _IMAGE_WORDS
    names = [token for token in rest if token.lower() not in words]
    return ColumnMeaning(
        quantity=quantity,
        unit=unit or ("s" if tokens[index].lower() == "seconds" else ""),
        body="_".join([*names, number] if number else names) if quantity in _OF_BODY else "",
        bare=not image
        and tokens[index].lower().rstrip("0123456789") in ("x", "y", "z", "theta", "t"),
    )


def _join_quaternion(tokens: list[str]) -> list[str]:
    """Return the words of a name with those of a part of a quaternion as one."""
    for at, (first, second) in enumerate(pairwise(tokens)):
        if first.lower() in _QUATERNION_WORDS and second.lower() in ("x", "y", "z", "w"):
            return [*tokens[:at], f"q{second.lower()}", *tokens[at + 2 :]]
    return tokens


def unit_of_name(name: str) -> str:
    """Return the unit that the name of any column ends in, ``""`` where there is none.

    Examples
    --------
    >>> unit_of_name("Winkel [°]")
    'deg'
    """
    text, unit = _split_brackets(name.strip().strip("\"'").strip())
    last = re.split(r"[\s_.\-/]+", text)[-1].lower()
    return unit or (_UNITS.get(last, "") if last != text.lower() else "")


def _split_brackets(name: str) -> tuple[str, str | None]:
    """Split ``"x (mm)"`` into name and unit; the unit is None when it is not one that is known."""
    match = _BRACKETS.match(name)
    if match is None:
        return name, ""
    return match.group(1), _UNITS.get(match.group(2).strip().lower())


def _root(token: str) -> tuple[str, str]:
    """Return (quantity, number of the body) of one word, ("", "") when it is none."""
    match = re.fullmatch(r"(.*?)(\d*)", token.lower())
    stem, number = match.groups() if match else (token.lower(), "")
    quantity = _ROOTS.get(stem, "")
    if number and quantity not in _OF_BODY:
        return "", ""
    return quantity, number


@dataclass
class ColumnMap:
    """Which column (from 0) holds what."""

    clock: int | None = None
    """Times or frame numbers; None: the row number is the frame number."""
    clock_unit: str = "frame"
    bare_clock: bool = False
    """Whether the clock has times of an unnamed unit."""
    date: int | None = None
    """Dates, which count where the clock has times of day, or where there is none."""
    bodies: dict[str, dict[str, int]] = field(default_factory=dict)
    """Body to quantity (x, y, theta, and of a pose in space z, qx, qy, qz, qw) to column."""
    body_column: int | None = None
    length_unit: str = ""
    angle_unit: str = ""
    bare: bool = True


def map_columns(
    names: list[str], chosen: dict[str, str], *, use_frames: bool, in_space: bool = False
) -> ColumnMap:
    """Find the columns of a table by their names and by what the user says.

    Parameters
    ----------
    names : list of str
        Names of the columns; ``""`` where there is none.
    chosen : dict
        Quantity to the name or the number (from 1) of its column, ``":unit"`` may follow.
    use_frames : bool
        Whether a frame rate was given, so that frame numbers are the clock where there are any.
    in_space : bool
        Whether columns of z are read, because an axis was said to be up.

    Raises
    ------
    InputError
        When a column is missing, named twice, or does not exist.
    """
    meanings = {
        index: meaning for index, name in enumerate(names) if (meaning := column_meaning(name))
    }
    for quantity, reference in chosen.items():
        index, unit = _find(reference, names, quantity)
        if unit and unit not in _ALLOWED[quantity]:
            raise InputError(
                f"{argument_text('columns', {quantity: reference})}: '{unit}' is not a unit of "
                f"{quantity}"
            )
        known = meanings.get(index)
        meanings = {
            other: meaning
            for other, meaning in meanings.items()
            if meaning.quantity != quantity and other != index
        }
        stated = unit_of_name(names[index])
        inferred = stated if stated in _ALLOWED[quantity] else ""
        meanings[index] = ColumnMeaning(quantity, unit or inferred, "", bool(known and known.bare))
    meanings = {
        index: meaning
        for index, meaning in meanings.items()
        if (in_space or meaning.quantity != "z")
        and (meaning.quantity not in _QUATERNION or _is_turned(meaning.body, meanings, chosen))
    }
    return _collect(meanings, names, use_frames=use_frames)


def _is_turned(body: str, meanings: dict[int, ColumnMeaning], chosen: dict[str, str]) -> bool:
    """Whether a body has a quaternion and no angle; half of a chosen quaternion is refused."""
    own = [meaning.quantity for meaning in meanings.values() if meaning.body == body]
    whole = all(own.count(part) == 1 for part in _QUATERNION)
    if not whole and any(part in chosen for part in _QUATERNION):
        raise InputError(
            'an orientation in space has four parts: name each with `columns={"qx": "NAME"}`, qy, '
            "qz and qw"
        )
    return whole and "theta" not in own


def _find(reference: str, names: list[str], quantity: str) -> tuple[int, str]:
    if quantity not in _ALLOWED:
        raise InputError(
            f"{argument_text('columns', {quantity: reference})}: unknown quantity; name "
            f"{', '.join(_ALLOWED)}"
        )
    for text, unit in ((reference, ""), reference.rpartition(":")[::2]):
        if text in names:
            return names.index(text), _UNITS.get(unit.lower(), unit)
        if text.isdecimal() and 1 <= int(text) <= len(names):
            return int(text) - 1, _UNITS.get(unit.lower(), unit)
    shown = ", ".join(repr(name) for name in names[:12]) + (", …" if len(names) > 12 else "")
    raise InputError(
        f"{argument_text('columns', {quantity: reference})}: no such column; the file has "
        f"{len(names)}: {shown}"
    )


def _collect(
    meanings: dict[int, ColumnMeaning], names: list[str], *, use_frames: bool
) -> ColumnMap:
    """Turn what each column means into one map, and refuse what is ambiguous."""
    single: dict[str, int] = {}
    result = ColumnMap()
    for index, meaning in sorted(meanings.items()):
        if meaning.quantity in _OF_BODY:
            place = result.bodies.setdefault(meaning.body, {})
        else:
            place = single
        if meaning.quantity in place:
            raise InputError(
                f"columns '{names[place[meaning.quantity]]}' and '{names[index]}' could both be "
                f"{meaning.quantity}: name one with "
                f"{argument_text('columns', {meaning.quantity: 'NAME'})}"
            )
        place[meaning.quantity] = index
    _require_positions(result, names)
    result.body_column = single.get("body")
    result.date = single.get("date")
    wanted = [meaning for meaning in meanings.values() if meaning.quantity in ("x", "y", "z")]
    result.length_unit = _agreed([meaning.unit for meaning in wanted], "positions")
    angles = [meaning.unit for meaning in meanings.values() if meaning.quantity == "theta"]
    result.angle_unit = _agreed(angles, "angles") if angles else ""
    result.bare = all(meaning.bare for meaning in wanted)
    if "frame" in single and ("t" not in single or use_frames):
        result.clock = single["frame"]
    elif "t" in single:
        result.clock = single["t"]
        result.clock_unit = meanings[result.clock].unit or "s"
        result.bare_clock = not meanings[result.clock].unit
    return result


def _require_positions(result: ColumnMap, names: list[str]) -> None:
    bodies = {
        body: columns for body, columns in result.bodies.items() if {"x", "y"} <= set(columns)
    }
    if not bodies:
        shown = ", ".join(repr(name) for name in names[:12]) + (", …" if len(names) > 12 else "")
        raise InputError(
            f"no columns of x and y among {shown}: name them with "
            '`columns={"x": "NAME", "y": "NAME"}` (or their numbers, from 1)'
        )
    if len(bodies) == 1:
        # "x1, y1, heading": an orientation without the body's number belongs to the only body.
        only = next(iter(bodies.values()))
        loose = [
            columns["theta"]
            for body, columns in result.bodies.items()
            if body not in bodies and "theta" in columns
        ]
        if "theta" not in only and len(loose) == 1:
            only["theta"] = loose[0]
    result.bodies = bodies


def _agreed(units: list[str], what: str) -> str:
    distinct = sorted(set(units))
    if len(distinct) > 1:
        shown = ", ".join(unit or "none" for unit in distinct)
        raise InputError(f"the columns of {what} name different units ({shown}): name them alike")
    return distinct[0] if distinct else ""
