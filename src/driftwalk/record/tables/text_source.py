"""A table in a text file: its delimiter, the row that names its columns, and the units below it.

The header may stand below titles.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from driftwalk.core.errors import FormatError, InputError, naming_its_file
from driftwalk.record.bad_row import decoded_line, is_number, split_fields
from driftwalk.record.column_names import quantity_of
from driftwalk.record.raw import MISSING, ReadOptions, TableLayout
from driftwalk.record.tables.columns import read_columns
from driftwalk.record.tables.date_stamps import StampForm, stamp_form
from driftwalk.record.tables.in_memory import TABLE, MemorySource
from driftwalk.record.text import Table, header_rows, read_head, read_table
from driftwalk.record.unit_and_column_words import NO_UNIT, UNITS

_COMMA_DECIMAL = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_DELIMITER_LINE = re.compile(r"sep=(.)\s*", re.IGNORECASE)
"""First line that states the delimiter to a spreadsheet."""
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
"""Bytes that no text file holds."""


def first_lines(head: bytes, count: int = 5) -> list[str]:
    """Return the first whole lines of a file's start; bytes that are not UTF-8 are replaced.

    Nothing is returned when the bytes cannot be text.
    """
    if not _is_text(head):
        return []
    lines = head.split(b"\n", count)
    return [line.decode("utf-8", "replace").rstrip("\r") for line in lines[:count] if line.strip()]


@lru_cache(maxsize=1)
def _is_text(head: bytes) -> bool:
    # One loader after the other asks of the same head.
    return _CONTROL.search(head) is None


def first_line(head: bytes) -> str:
    """Return the first line of a file's start, ``""`` when it is blank or cannot be text."""
    return next(iter(first_lines(head, 1)), "")


def first_names(head: bytes) -> list[str]:
    """Return the fields between the commas of the first line of a file's start."""
    return split_fields(first_line(head), ",")


def detect_delimiter(lines: list[str]) -> str:
    """Return the character that separates the fields of the first lines; a blank when none does.

    A tab or semicolon wins over a comma, since a comma may also be a decimal sign; blanks come
    last, since they stand in names, but before a comma that is the decimal sign of every field.
    """
    fields = [field for line in lines[:2] for field in line.split()]
    if len(fields) > len(lines[:2]) and all(_COMMA_DECIMAL.fullmatch(field) for field in fields):
        return " "
    in_all = [one for one in "\t;," if lines and all(one in line for line in lines[:2])]
    in_first = [one for one in "\t;," if lines and one in lines[0]]
    return next(iter(in_all + in_first), " ")


def is_numeric_row(fields: list[str]) -> bool:
    """Whether a row is data: each field is a number, a time or missing, and one at least is not."""
    known = [field for field in fields if field not in MISSING]
    return bool(known) and all(_is_numeric(field) or stamp_form(field) for field in known)


@naming_its_file
def read_header(
    path: Path, *, delimiter: str | None = None, header_line: int | None = None
) -> tuple[list[str], str, int, bool]:
    """Return (names of the columns, delimiter, lines before the data, whether there is a header).

    The header is line `header_line`, from 1, where that is given. Otherwise lines that start with
    ``#`` before it are comments; a header may start with ``#`` or ``%`` itself when it is the last
    of them and has as many fields as the data.

    Raises
    ------
    FormatError
        When the file is empty, ends before its header, or its first lines are not UTF-8 text.
    """
    if header_line is not None:
        return _header_at(path, header_line, delimiter)
    head = read_head(path)
    if b"\0" in head:
        raise FormatError("is not a text file")
    raw = head.split(b"\n")
    stated = _DELIMITER_LINE.fullmatch(raw[0].decode("utf-8", "replace"))
    begin = 1 if stated else 0
    rows = (number for number in range(begin, len(raw)) if raw[number].strip())
    if (at := next((one for one in rows if not raw[one].startswith(b"#")), None)) is None:
        raise FormatError("the file is empty")
    lines = [decoded_line(line, number) for number, line in enumerate(raw[: at + 2], start=1)]
    separator = delimiter or (stated[1] if stated else detect_delimiter(lines[at : at + 2]))
    fields = _without_trailing(split_fields(lines[at], separator))
    if not is_numeric_row(fields):
        return fields, separator, at + 1, True
    if previous := [line for line in lines[begin:at] if line.strip()]:
        commented = _without_trailing(split_fields(previous[-1].lstrip("# "), separator))
        if len(commented) == len(fields) > 1:
            return commented, separator, at, True
    return [""] * len(fields), separator, at, False


def first_row(path: Path, delimiter: str = ",") -> list[str]:
    """Return the fields of the first line of a table, however long, [] where there is none.

    Raises
    ------
    FormatError
        When it is no text.
    """
    return split_fields(next(iter(header_rows(path, 1)), ""), delimiter)


def _without_trailing(fields: list[str]) -> list[str]:
    """Drop one empty field that a delimiter at the end of a line leaves."""
    return fields[:-1] if len(fields) > 1 and not fields[-1] else fields


def _header_at(path: Path, number: int, delimiter: str | None) -> tuple[list[str], str, int, bool]:
    """Return what `read_header` does, with the header in a line that the user names."""
    lines = header_rows(path, number + 1)
    if len(lines) <= number or not lines[number].strip():
        raise FormatError(f"has no rows of data below line {number}, its header")
    separator = delimiter or detect_delimiter(lines[number - 1 :])
    names, data = (split_fields(line.lstrip("# "), separator) for line in lines[number - 1 :])
    # A delimiter at the end of a line leaves a field without a name, in the header or in the data.
    names += [""] * (len(data) - len(names))
    return (_without_trailing(names) if len(data) < len(names) else names), separator, number, True


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
    known = 0
    for name, field in zip(names, fields, strict=True):
        if field.lower() in UNITS or field.lower() in NO_UNIT:
            known += 1
        elif field not in MISSING and (
            is_number(field)
            or name in options.columns.values()
            or quantity_of(name) not in ("", "body")
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
    if not below or len(below[0]) != len(first):
        return False
    pairs = zip(first, below[0], strict=True)
    if not any(_is_numeric(field) and _is_numeric(under) for field, under in pairs):
        return False
    references = [one.rpartition(":")[0] or one for one in options.columns.values()]
    if options.columns:
        return not any(one in first and not one.isdecimal() for one in references)
    return not {"x", "y"} <= set(map(quantity_of, first))


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
    found = [one for places in reading.bodies.values() for one in places.items()]
    columns = [at for quantity, at in found if quantity != "theta"]
    if any(_is_numeric(names[at]) for at in columns):
        return False  # a row of data
    cells = [below[at] for at in columns if at < len(below)]
    numeric = all(cell in MISSING or _is_numeric(cell) for cell in cells)
    return numeric and any(below)  # a body that is not seen yet has a row without a position


class TextSource:
    """A table in a text file, whose header is found or, by a layout, known."""

    matrices = False

    def __init__(self, path: Path, options: ReadOptions, layout: TableLayout | None = None) -> None:
        self._path, self._advice = path, ""
        self.units: list[str] = []
        if layout is not None:
            self.names, self._delimiter = layout.names, layout.delimiter
            self._skip, self.has_header = layout.skip_lines, True
            return
        self.names, self._delimiter, self._skip, self.has_header = read_header(
            path, delimiter=options.delimiter, header_line=options.header_line
        )
        if self.has_header:
            # A line that is no text is refused when the table is read.
            with contextlib.suppress(FormatError):
                self._find_header(options)

    def _find_header(self, options: ReadOptions) -> None:
        """Take the first line that names positions for the header, with the units below it."""
        begin = self._skip - 1
        count = TABLE.heading_rows if options.header_line is None else 3
        lines = header_rows(self._path, begin + count)[begin:]
        below = self._fields(lines[1:])
        if options.header_line is not None:
            if len(below) > 1 and (units := units_below(self.names, below[0], options)):
                self.units, self._skip = units, begin + 2
            return
        filled = [at for at, line in enumerate(lines) if line.strip()]
        for number, at in enumerate(filled):
            here = self._delimiter if not at else None
            delimiter = options.delimiter or here or detect_delimiter(lines[at : at + 2])
            first, *others = (lines[one] for one in filled[number : number + 3])
            texts = [first.lstrip("# ").removeprefix("% "), *others]
            found = heading_of([split_fields(one, delimiter) for one in texts], options)
            if found is not None:
                if at or found.rows > 1 or first.startswith("% "):
                    self.names, self.units, self._delimiter = found.names, found.units, delimiter
                    self._skip = begin + filled[number + found.rows - 1] + 1
                # LabVIEW names a last column "Comment" and leaves it out.
                if self.names[-1:] == ["Comment"] and len(self._rows[0]) == len(self.names) - 1:
                    self.names = self.names[:-1]
                return
        if is_data(self.names, below, options):
            self.names, self._skip = [""] * len(self.names), begin
            self.has_header = False
            return
        rows = [split_fields(line, options.delimiter or detect_delimiter([line])) for line in lines]
        self._advice = header_advice(rows, begin + 1)

    def _fields(self, lines: list[str]) -> list[list[str]]:
        """Return the fields of the lines that are not blank."""
        return [split_fields(line, self._delimiter) for line in lines if line.strip()]

    @cached_property
    def _rows(self) -> list[list[str]]:
        return self._fields(header_rows(self._path, self._skip + TABLE.sample_rows)[self._skip :])

    def sample(self) -> list[list[str]]:
        """Return the first rows as texts."""
        return self._rows

    def stamps(self, column: int) -> StampForm | None:
        """Return how the first time stamp of a column is written, None where it has none."""
        fields = (row[column] for row in self._rows if len(row) > column)
        return next((stamp_form(field) for field in fields if field not in MISSING), None)

    def read(self, wanted: TableLayout, *, head: bool = False) -> Table:
        """Read columns, in blocks of the file."""
        layout = replace(wanted, delimiter=self._delimiter, skip_lines=self._skip)
        try:
            return read_table(self._path, layout, blocks=1 if head else None)
        except FormatError as error:
            if not self._advice:
                raise
            raise FormatError(error.reason + self._advice, line=error.line) from error

    def error(self, message: str) -> FormatError:
        """Return an error about the header, or the file where it has none."""
        line = (self._skip or None) if self.has_header else None
        return FormatError(message + self._advice, line=line)
