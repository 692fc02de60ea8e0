"""Header detection: which row of a table names its columns, below titles and above units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.record.bad_row import is_number
from driftwalk.record.column_names import column_meaning
from driftwalk.record.raw import MISSING, ReadOptions
from driftwalk.record.tables.columns import read_columns
from driftwalk.record.tables.in_memory import MemorySource
from driftwalk.record.text_head import is_numeric_row
from driftwalk.record.vocabulary import NO_UNIT, UNITS


class Heading(NamedTuple):
    """The names of the columns, their units, and how many rows they are in."""

    names: list[str]
    units: list[str]
    rows: int


def heading_of(rows: Sequence[list[str]], options: ReadOptions) -> Heading | None:
    """Return the names that the first of some rows has, with the units of the second, if any.

    Parameters
    ----------
    rows : sequence of list of str
        Three rows that follow each other.
    options : ReadOptions
        What is known about the table.

    Returns
    -------
    Heading or None
        None unless they name positions, and the row below holds them.

    Examples
    --------
    >>> rows = [["t", "x", "y"], ["[ms]", "[cm]", "[cm]"], ["0", "1.5", "2"]]
    >>> heading_of(rows, ReadOptions())
    Heading(names=['t', 'x', 'y'], units=['ms', 'cm', 'cm'], rows=2)
    """
    if rows and rows[0][:1] == ["coords"]:
        # The lowest level of DeepLabCut's header: those above it name the body parts.
        return None
    if len(rows) > 1 and _holds_positions(rows[0], [], rows[1], options):
        return Heading(rows[0], [], 1)
    if len(rows) > 2 and (units := units_below(rows[0], rows[1], options)):
        names = rows[0][: len(units)]
        if _holds_positions(names, units, rows[2], options):
            return Heading(names, units, 2)
    return None


def units_below(names: list[str], row: list[str], options: ReadOptions) -> list[str]:
    """Return what a row of units says of each column, [] where it is none.

    Columns that are not read may have any unit, such as cm/s.
    """
    fields = [field.strip("[]() ") for field in row[: len(names)]]
    fields += [""] * (len(names) - len(fields))
    chosen = set(options.columns.values())
    known = 0
    for name, field in zip(names, fields, strict=True):
        if not field or field in MISSING:
            continue
        if field.lower() in UNITS or field.lower() in NO_UNIT:
            known += 1
        elif (
            is_number(field)
            or name in chosen
            or ((meaning := column_meaning(name)) is not None and meaning.quantity != "body")
        ):
            return []
    return ["" if field in MISSING else field for field in fields] if known else []


def is_data(first: list[str], below: Sequence[list[str]], options: ReadOptions) -> bool:
    """Whether a first row that holds a text is data, and no header.

    Parameters
    ----------
    first : list of str
        Its fields.
    below : sequence of list of str
        The rows below it.
    options : ReadOptions
        Columns that are named by their numbers are to hold numbers.
    """
    second = below[0] if below else []
    numeric = [
        _is_numeric(field) and at < len(second) and _is_numeric(second[at])
        for at, field in enumerate(first)
    ]
    if not any(numeric) or len(second) != len(first):
        return False
    references = [one.rpartition(":")[0] or one for one in options.columns.values()]
    if options.columns:
        return not any(one in first and not one.isdecimal() for one in references)
    known = [meaning.quantity for name in first if (meaning := column_meaning(name)) is not None]
    return not {"x", "y"} <= set(known)


def _is_numeric(field: str) -> bool:
    return field not in MISSING and (is_number(field) or is_number(field, decimal=","))


def header_advice(rows: Sequence[list[str]], first: int) -> str:
    """Return what to say where no row was found to name the columns; empty where the first may.

    Parameters
    ----------
    rows : sequence of list of str
        The first rows.
    first : int
        Line of the first of them, from 1.
    """
    data = next((at for at, row in enumerate(rows) if is_numeric_row(row)), None)
    if data is None or data < 2:
        return ""
    return (
        f"; line {first + data} is the first of numbers: if line {first + data - 1} names the "
        f"columns, add `header_line={first + data - 1}`"
    )


def _holds_positions(
    names: list[str], units: list[str], below: list[str], options: ReadOptions
) -> bool:
    """Whether some names are those of positions, and a row holds a position below them."""
    try:
        source = MemorySource("the names", names, [np.zeros(0)] * len(names), units=units)
        reading = read_columns(source, options, lenient=True)
    except InputError:
        return False
    columns = [
        at
        for places in reading.bodies.values()
        for quantity, at in places.items()
        if quantity != "theta"
    ]
    if any(_is_numeric(names[at]) for at in columns):
        return False  # a row of data
    cells = [below[at] if at < len(below) else "" for at in columns]
    numeric = all(cell in MISSING or _is_numeric(cell) for cell in cells)
    return numeric and any(below)  # a body that is not seen yet has a row without a position
