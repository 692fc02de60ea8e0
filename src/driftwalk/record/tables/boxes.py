"""Bounding boxes: which columns are the sides of a box, its centre, and the angle of its axis."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Codes
from driftwalk.core.errors import InputError, argument_text, listed
from driftwalk.record.cleaning.clean import rows_of_bodies
from driftwalk.record.column_names import ColumnMeaning, split_brackets, words_of
from driftwalk.record.raw import Array, ReadOptions, TableLayout
from driftwalk.record.unit_and_column_words import BOXES, LENGTHS, NO_UNIT, UNITS, words

if TYPE_CHECKING:
    from driftwalk.record.tables.in_memory import TableSource

FORMS: Final = ("xyxy", "xywh", "cxcywh", "none")
_STATED: Final = re.compile(
    r"(?P<form>xyxy|xywh|cxcywh)(?:@(?P<w>[1-9]\d{0,5})x(?P<h>[1-9]\d{0,5}))?"
)
_CORNERS: Final = ("x1", "y1", "x2", "y2")
_QUAD: Final = tuple(f"{axis}{corner}" for corner in range(1, 5) for axis in "xy")
"""Corners of a box in turn, as x1, y1 to x4, y4."""
_FROM_ZERO: Final = {"x0": "x1", "y0": "y1", "x1": "x2", "y1": "y2"}
_OF_QUAD: Final = re.compile(r"(?:tag)?(?:c|corner|p|pt)([0-4])([xy])")


class BoxPolicy(NamedTuple):
    """When four numbers are the corners of a box; chosen by hand."""

    spread: float = 0.5
    """Largest range of the sides of a box, as a share of the range of its centre; chosen by
    hand."""
    skew: float = 0.15
    """Largest departure of four corners from a parallelogram, in diagonals; chosen by hand."""
    square: float = 1.25
    """Ratio of the sides up to which a box is a square: it looks the same after a quarter turn;
    chosen by hand."""
    full: float = 1.05
    """Range of an angle, in its periods, beyond which it is the angle of a direction; chosen by
    hand."""


BOX: Final = BoxPolicy()


@dataclass(frozen=True)
class Box:
    """Columns that are sides of a box."""

    form: str
    """One of `FORMS`, or ``"quad"`` of four corners; ``""``: the corners are left out."""
    sides: dict[str, int]
    units: list[str] = field(default_factory=list)
    replaced: tuple[int, ...] = ()
    """Columns that would be bodies by their names."""
    why: str = "a side of a box"
    notes: tuple[str, ...] = ()
    image: tuple[int, int] | None = None
    """Width and height of the image [px], of which the sides are shares."""
    symmetric: bool = True
    """Whether it looks the same after a half or quarter turn, so that its angle may leap by one."""


Meanings = Mapping[int, ColumnMeaning]


class _Sides(NamedTuple):
    """Columns that may be sides of a box."""

    columns: dict[str, int]
    units: dict[str, str]
    plain: bool
    """Whether corners are named by numbers alone."""


def find_box(
    source: TableSource, options: ReadOptions, meanings: Meanings, chosen: Mapping[str, str]
) -> Box | None:
    """Return the columns that are the sides of a box, None where there are none.

    Raises
    ------
    InputError
        When a stated box lacks columns, when the first rows leave open whether columns are a box,
        or when nothing says whether x and y are its corner or its centre.
    """
    if options.box == "none":
        return None
    sides = _sides(source, meanings)
    found = sides.columns
    if options.box is not None:
        match = _STATED.fullmatch(options.box)
        if match is None:
            raise InputError(
                f"`box` is one of {', '.join(FORMS)}, and of shares of the image its size in "
                f"pixels may follow, as in cxcywh@1920x1080; got '{options.box}'"
            )
        box = _stated(match["form"], sides)
        return replace(box, image=(int(match["w"]), int(match["h"]))) if match["w"] else box
    if source.matrices or ({"x", "y"} & set(chosen) and not {"x1", "w"} & set(chosen)):
        return None
    if (quad := _quad(source)) is not None:
        return quad
    if set(_CORNERS) <= set(found):
        return _corners(source, sides, meanings)
    if {"x1", "y1", "w", "h"} <= set(found) and not {"x", "y"} <= set(found):
        return _stated("xywh", sides)
    if not {"x", "y", "w", "h"} <= set(found):
        return None
    names = [source.names[found[side]] for side in ("x", "y", "w", "h")]
    if {word.lower() for name in names[:2] for word in words_of(name)} & words("centre"):
        return _stated("cxcywh", sides)
    raise InputError(
        f"the columns {listed([repr(name) for name in names])} are a box, and nothing says "
        'whether x and y are its corner or its centre: add `box="xywh"` if they are the corner '
        'with the smallest x and y, `box="cxcywh"` if the centre'
    )


def _sides(source: TableSource, meanings: Meanings) -> _Sides:
    found: dict[str, int] = {}
    units: dict[str, str] = {}
    plain = True
    lower = {name.strip().lower() for name in source.names}
    from_zero = set(_FROM_ZERO) <= lower and not {"x2", "y2"} & lower
    for at, name in enumerate(source.names):
        meaning = meanings.get(at)
        if meaning is not None and meaning.quantity in (*_CORNERS, "w", "h"):
            found[meaning.quantity], units[meaning.quantity], plain = at, meaning.unit, False
            continue
        text, inside = split_brackets(name)
        parts = words_of(text.lower())
        last = parts[-1] if len(parts) > 1 else ""
        unit = UNITS.get(last, "")
        below = source.units[at].strip("[]() ").lower() if source.units else ""
        if unit in LENGTHS or last in NO_UNIT:
            parts.pop()
        elif inside or below:
            unit = UNITS.get(inside or below, "")
        word = "".join(parts)
        side = _FROM_ZERO.get(word, "") if from_zero else BOXES.get(word, "")
        if side in ("", "x", "y"):  # then the meaning decides, of a body without a name
            centre = meaning is not None and meaning.quantity in ("x", "y") and not meaning.body
            side = meaning.quantity if meaning is not None and centre else ""
        if side and side not in found:
            found[side], units[side] = at, unit if unit in LENGTHS else ""
            plain = plain and (side not in _CORNERS or from_zero or parts == [side])
    for at, meaning in meanings.items():
        if meaning.rank < 0 and meaning.quantity in ("x", "y"):
            found[meaning.quantity], units[meaning.quantity] = at, meaning.unit
    return _Sides(found, units, plain)


def _stated(form: str, given: _Sides) -> Box:
    """Return the box of a form, or say which columns it lacks."""
    found = given.columns
    names = sides = _CORNERS if form == "xyxy" else ("x", "y", "w", "h")
    if form != "xyxy" and "x1" in found and "x" not in found:
        sides = ("x1", "y1", "w", "h")
    if missing := [side for side in sides if side not in found]:
        wanted = argument_text("columns", dict.fromkeys(sides, "NAME"))
        raise InputError(f"a box of the form '{form}' has no column of {listed(missing)}: {wanted}")
    columns = {name: found[side] for name, side in zip(names, sides, strict=True)}
    replaced = tuple(found[side] for side in sides if side not in ("x", "y"))
    return Box(form, columns, [given.units[side] for side in sides], replaced)


def _corners(source: TableSource, sides: _Sides, meanings: Meanings) -> Box | None:
    """Return the box of two corners; values decide whether x1, y1, x2, y2 are two bodies."""
    found, _, plain = sides
    box = _stated("xyxy", sides)
    numbered = {one.body for one in meanings.values() if one.body.isdecimal()}
    turned = any(one.quantity == "theta" and one.body in numbered for one in meanings.values())
    if plain and (turned or not (numbered <= {"1", "2"} or numbered <= {"0", "1"})):
        return None
    centre = {"x", "y"} <= set(found)
    if not plain and not centre:
        return box
    values = _values(source, [found[side] for side in (*_CORNERS, *("xy" if centre else ""))])
    if not values or not values[0].size:
        return None
    x1, y1, x2, y2 = values[:4]
    if (x2 < x1).any() or (y2 < y1).any():
        return None
    if centre:
        apart = np.hypot(values[4] - 0.5 * (x1 + x2), values[5] - 0.5 * (y1 + y2))
        if (apart <= 0.5 * np.hypot(x2 - x1, y2 - y1) + 1e-9).all():
            return Box("", {}, replaced=box.replaced, why="a corner of the box around x and y")
        return None
    ways = max(np.ptp(x1 + x2), np.ptp(y1 + y2)) / 2.0
    compact = max(np.ptp(x2 - x1), np.ptp(y2 - y1)) <= BOX.spread * ways
    joined = {"".join(words_of(name)).lower() for name in source.names}
    confident = any(one.quantity == "confidence" for one in meanings.values())
    of_detector = bool(joined & words("classes")) or confident
    if not compact and not of_detector:
        return None
    names = listed([repr(source.names[found[side]]) for side in _CORNERS])
    if compact and of_detector:
        note = (
            f"{names} are read as the corners of a box, whose centre is the body: add "
            '`box="none"` if they are two bodies'
        )
        return replace(box, notes=(note,))
    raise InputError(
        f"{names} may be the corners of a box (the second is always beyond the first) or two "
        'bodies: add `box="xyxy"` or `box="none"`'
    )


def _quad(source: TableSource) -> Box | None:
    """Return the box of four corners: c0x, c0y, ... of markers, or x1, ..., y4 of one shape."""
    found: dict[str, int] = {}
    named = True
    joined = ["".join(words_of(name)).lower() for name in source.names]
    first = int({"corner4x", "corner4y"} <= set(joined))  # of p1 ... p4 each may be a body
    for at, word in enumerate(joined):
        if (match := _OF_QUAD.fullmatch(word)) is not None:
            found[f"{match[2]}{int(match[1]) + 1 - first}"] = at
        elif word in _QUAD:
            found[word], named = at, False
    if not set(_QUAD) <= set(found):
        return None
    if not named:
        values = _values(source, [found[side] for side in _QUAD])
        if not values or not values[0].size:
            return None
        x, y = np.array(values[::2]), np.array(values[1::2])
        skew = np.hypot(x[0] - x[1] + x[2] - x[3], y[0] - y[1] + y[2] - y[3])
        if (skew > BOX.skew * np.hypot(x[0] - x[2], y[0] - y[2])).any():
            return None
    sides = {side: found[side] for side in _QUAD}
    return Box("quad", sides, replaced=tuple(sides.values()), symmetric=not named)


def _values(source: TableSource, columns: list[int]) -> list[Array] | None:
    """Return the first rows of columns in which all have a number, None where one has texts."""
    labels = [name or str(at) for at, name in enumerate(source.names, start=1)]
    try:
        table = source.read(TableLayout("", labels, numbers=tuple(sorted(columns))), head=True)
    except InputError:
        return None  # reading it reports what is wrong
    values = table.stack(columns)
    return [*values[np.isfinite(values).all(axis=1)].T]


def box_centre(box: Box, values: Mapping[int, Array]) -> tuple[Array, Array]:
    """Return the centre of a box in each row."""
    side = {name: values[at] for name, at in box.sides.items()}
    with np.errstate(over="ignore", invalid="ignore"):  # an infinite position is a gap
        if box.form == "xyxy":
            return 0.5 * (side["x1"] + side["x2"]), 0.5 * (side["y1"] + side["y2"])
        if box.form == "quad":
            x, y = (np.mean([side[f"{a}{n}"] for n in range(1, 5)], axis=0) for a in "xy")
            return x, y
        if box.form == "xywh":
            return side["x"] + 0.5 * side["w"], side["y"] + 0.5 * side["h"]
    return side["x"], side["y"]


def box_angle(
    box: Box,
    values: Mapping[int, Array],
    theta: Array | None,
    codes: Codes | None,
    turn: float,
) -> Array | None:
    """Return the orientation of a box, unwrapped body by body.

    A square looks the same after a quarter turn, any other box after a half turn.

    Parameters
    ----------
    box : Box
        Its columns.
    values : mapping
        Columns of the table, each of shape (n,).
    theta : array, shape (n,), optional
        The angle in the table.
    codes : array of int32, shape (n,), optional
        Index of each row's body.
    turn : float
        A full turn in the unit of the angle.
    """
    side = {name: values[at] for name, at in box.sides.items()}
    if box.form == "quad" and theta is None:
        a, b, c, d = (np.array([side[f"x{n}"], side[f"y{n}"]]) for n in range(1, 5))
        along, across = b + c - a - d, c + d - a - b
        theta = np.arctan2(along[1], along[0])
        w, h, turn = np.hypot(*along), np.hypot(*across), 2.0 * np.pi
    elif theta is None or "w" not in side:
        return theta
    else:
        w, h = side["w"], side["h"]
    if not box.symmetric:
        return theta
    followed = theta.copy()
    known = np.isfinite(theta) & np.isfinite(w) & np.isfinite(h)
    for of_body in [np.arange(theta.size)] if codes is None else rows_of_bodies(codes):
        rows = of_body[known[of_body]]
        if rows.size:
            followed[rows] = _followed(theta[rows], w[rows], h[rows], turn)
    return followed


def _followed(theta: Array, w: Array, h: Array, turn: float) -> Array:
    ratio = float(np.median(np.maximum(w, h) / np.maximum(np.minimum(w, h), 1e-300)))
    period = turn / 4.0 if ratio < BOX.square else turn / 2.0
    axis = theta if ratio < BOX.square else theta + np.where(h > w, turn / 4.0, 0.0)
    if np.ptp(theta) > BOX.full * period:
        return theta
    return np.asarray(np.unwrap(axis, period=period))
