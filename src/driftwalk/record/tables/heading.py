"""Header detection: which row of a table names its columns, below titles and above units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from driftwalk.core.errors import InputError
from driftwalk.record.bad_row import is_number
from driftwalk.record.column_names import map_columns, unit_of_name
from driftwalk.record.raw import MISSING, ReadOptions
from driftwalk.record.text_head import is_numeric_row


class TablePolicy(NamedTuple):
    """How much of a table is looked at before it is read."""

    heading_rows: int = 12
    """Rows among which are the names of the columns and the first row of data; chosen by hand."""
    sample_rows: int = 50
    """Rows by which a table is recognised; chosen by hand."""
    first_rows: int = 100_000
    """Rows that are read where only the first ones are needed; chosen by hand."""


TABLE: Final = TablePolicy()


class Heading(NamedTuple):
    """The names of the columns, and how many rows they are in."""

    names: list[str]
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
    Heading(names=['t [ms]', 'x [cm]', 'y [cm]'], rows=2)
    """
    if rows and rows[0][:1] == ["coords"]:
        # The lowest level of DeepLabCut's header: those above it name the body parts.
        return None
    if len(rows) > 1 and _holds_positions(rows[0], rows[1], options):
        return Heading(rows[0], 1)
    if len(rows) > 2 and (units := _units(rows[1])):
        pairs = zip(rows[0], units + [""] * len(rows[0]), strict=False)
        names = [f"{name} [{unit}]" if name and unit else name for name, unit in pairs]
        if _holds_positions(names, rows[2], options):
            return Heading(names, 2)
    return None


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


def _units(row: list[str]) -> list[str]:
    """Return the units of a row that holds nothing else, [] where it holds more."""
    units = [unit_of_name(f"_ {field}") if field else "" for field in row]
    stated = [unit for unit, field in zip(units, row, strict=True) if field]
    return units if stated and all(stated) else []


def _holds_positions(names: list[str], below: list[str], options: ReadOptions) -> bool:
    """Whether some names are those of positions, and a row holds a position below them."""
    try:
        columns = map_columns(
            names,
            options.columns,
            use_frames=options.frame_rate_hz is not None,
            in_space=options.up is not None,
        )
    except InputError:
        return False
    cells = [
        below[places[axis]] if places[axis] < len(below) else ""
        for places in columns.bodies.values()
        for axis in "xy"
    ]
    known = [cell for cell in cells if cell not in MISSING]
    numeric = all(is_number(cell) or is_number(cell, decimal=",") for cell in known)
    return numeric and any(below)  # a body that is not seen yet has a row without a position
