"""Plain tables of text and workbooks, of programs with one header line; matrices of coordinates."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError, damaged_as
from driftwalk.record.containers import ZIP, refuse_huge_zip, zip_names
from driftwalk.record.raw import Array, Marks, RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.tables.in_memory import TABLE, MemorySource, objects, text_of_cell
from driftwalk.record.tables.rows import recording_of, the_one_that_fits
from driftwalk.record.tables.text_source import (
    TextSource,
    first_lines,
    first_names,
    first_row,
    header_advice,
    heading_of,
    is_data,
    is_numeric_row,
    read_header,
    units_below,
)
from driftwalk.record.text import read_table
from driftwalk.schema.stores.netcdf import file_start


class PlainLoader:
    """A table with one row per sample; bodies side by side, stacked, or one alone."""

    name = "csv"
    description = (
        "plain CSV, TSV or blank-separated table, columns recognised or named by `columns`"
    )

    def sniff(self, head: bytes, _path: Path) -> float:
        """Accept any text, so weakly that every other format wins."""
        lines = first_lines(head, 2)
        return 0.1 if lines and not lines[0].lstrip().startswith(("[", "{", "$", "<")) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the table as its header and `columns` describe it."""
        return recording_of(TextSource(path, options), options)


@dataclass
class HeadedFormat:
    """A format with one header line, which is recognised by its first names."""

    name: str
    description: str
    header: tuple[str, ...]
    """Names that the header begins with."""
    columns: Mapping[str, str]
    """From a quantity to its column, as `columns` of `load` has it; those that are absent are left
    out."""
    length_unit: str = ""

    @property
    def marks(self) -> tuple[Marks, ...]:
        """Names that a nearly readable file has."""
        return (Marks("table", tuple(filter(None, self.header))),)

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        return 0.95 if tuple(first_names(head)[: len(self.header)]) == self.header else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every body, in the format's own unit of length."""
        names = first_row(path)
        if tuple(names[: len(self.header)]) != self.header:
            raise FormatError(f"the first columns are not {', '.join(self.header)}", line=1)
        own = {key: one for key, one in self.columns.items() if one.partition(":")[0] in names}
        rate = None if "t" in own else options.frame_rate_hz
        stated = replace(options, delimiter=",", frame_rate_hz=rate)
        return described(path, stated, own, length_unit=self.length_unit)


def described(
    path: Path,
    options: ReadOptions,
    columns: Mapping[str, str],
    layout: TableLayout | None = None,
    **facts: Any,
) -> RawRecording:
    """Return the recording of a table of a known format.

    Parameters
    ----------
    path : Path
        Text file.
    options : ReadOptions
        What the user knows about it.
    columns : mapping
        From a quantity to its column, as `columns` of `load` has it; empty: as their names say.
    layout : TableLayout, optional
        Names of all columns and lines before the data; None: the header is in the file.
    **facts
        What the `RawRecording` says besides.
    """
    stated = replace(
        options, columns=dict(columns), columns_stated_by="a column of this format", box="none"
    )
    raw = recording_of(TextSource(path, stated, layout), stated)
    known = {"bare_length_is_si": False, "bare_angle": False, "body_columns": None}
    return replace(raw, **(known | facts))


def side_by_side(
    path: Path, pattern: re.Pattern[str], delimiter: str | None = None
) -> tuple[list[RawBody], dict[str, Array]]:
    """Return the bodies whose names stand in those of their columns, and all columns by name.

    Each row counts as a frame.

    Parameters
    ----------
    path : Path
        Text file with a header.
    pattern : re.Pattern
        Names of columns of positions, with the groups ``axis``, ``body`` and perhaps ``arena``.
    delimiter : str, optional
        None: recognised.

    Raises
    ------
    FormatError
        When no column, or one of an axis alone, has such a name.
    """
    names, delimiter, skip, _ = read_header(path, delimiter=delimiter)
    found: dict[tuple[str, str], dict[str, int]] = {}
    for at, match in enumerate(map(pattern.fullmatch, names)):
        if match is not None:
            place = found.setdefault((match.groupdict().get("arena", ""), match["body"]), {})
            place[match["axis"].lower()] = at
    lacking = [name for (_, name), place in found.items() if len(place) < 2]
    if lacking or not found:
        what = f"'{lacking[0]}'" if lacking else "any body"
        raise FormatError(f"no column of x or of y for {what}", line=skip)
    table = read_table(path, TableLayout(delimiter, names, skip, tuple(range(len(names)))))
    frame = np.arange(table.rows, dtype=np.float64)
    several = len({arena for arena, _ in found}) > 1
    bodies = []
    for (arena, name), place in found.items():
        x, y = (table.numbers[place[axis]] for axis in "xy")
        bodies.append(RawBody(f"{arena}/{name}" if several else name, frame, x, y))
    return bodies, {name: table.numbers[at] for at, name in enumerate(names)}


def numbers_by_name(
    path: Path, names: list[str] | None = None, used: Iterable[str] = (), *, skip: int = 1
) -> dict[str, Array]:
    """Return columns of numbers of a table with commas, all of them or those that are used.

    Parameters
    ----------
    path : Path
        Text file.
    names : list of str, optional
        Names of all its columns; None: as its first line has them.
    used : iterable of str
        Some of the names; empty: all.
    skip : int
        Lines before the first row of data.
    """
    names = first_row(path) if names is None else names
    places = {name: names.index(name) for name in used or names}
    table = read_table(path, TableLayout(",", names, skip, tuple(sorted(places.values()))))
    return {name: table.numbers[at] for name, at in places.items()}


class MatricesLoader:
    """Metres and radians unless another unit is given; the frame rate has to be given."""

    name = "matrices"
    description = "one matrix per coordinate (`x`, `y` and, if there is one, `theta`); metres"

    def sniff(self, _head: bytes, _path: Path) -> float:
        """Never claim a file: `x` and `y` choose this format."""
        return 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the matrices; names are relative to the recording's folder."""
        folder = path if path.is_dir() else path.parent
        x_file = options.x or (None if path.is_dir() else path)
        if x_file is None or options.y is None:
            raise InputError(
                "one matrix per coordinate needs `x` and `y` (and `theta` if there is)"
            )
        given = {"x": x_file, "y": options.y, "theta": options.theta}
        found = {at: _matrix(_place(one, folder)) for at, one in given.items() if one is not None}
        x, names = found["x"]
        for name, (values, _) in found.items():
            if [v.size for v in values] != [v.size for v in x]:
                raise InputError(
                    f"the matrices disagree: `x` has {x[0].size} rows and {len(x)} columns, "
                    f"`{name}` has {values[0].size} rows and {len(values)} columns"
                )
        frame = np.arange(x[0].size, dtype=np.float64)
        columns = zip(*(values for values, _ in found.values()), strict=True)
        bodies = [RawBody(name, frame, *of) for name, of in zip(names, columns, strict=True)]
        return RawRecording(bodies, bare_length_is_si=True)


def _place(name: Path, folder: Path) -> Path:
    """Return the file in the recording's folder, or the path as given if there is none."""
    beside = folder / name
    path = beside if beside.exists() else name
    if not path.is_file():
        raise FormatError("there is no such file", path=path)
    return path


def _matrix(path: Path) -> tuple[list[Array], list[str]]:
    """Return the columns of a matrix and their names."""
    names, delimiter, skip, has_header = read_header(path)
    labels = names if has_header else [str(index) for index in range(len(names))]
    table = read_table(path, TableLayout(delimiter, labels, skip, tuple(range(len(names)))))
    return [table.numbers[column] for column in range(len(names))], labels


_OLD: Final = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
"""Start of Excel's format before 2007, in which workbooks with a password are stored as well."""
_WORKBOOK: Final = "xl/workbook.xml"
_OTHERS: Final = {
    "xl/workbook.bin": "is a binary workbook (.xlsb): save it as .xlsx or CSV",
    "content.xml": "is an OpenDocument file: save it as .xlsx or CSV",
}
"""Members of zip files of other spreadsheets, and what to do."""


class ExcelLoader:
    """Columns as in a plain table; times may be dates, times of day or numbers."""

    name = "excel"
    description = "Excel workbook, .xlsx (columns as in a plain table; `sheet` names the sheet)"

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise a workbook, also one that is refused with the advice to save it as .xlsx."""
        named = path.suffix.lower() in (".xlsx", ".xlsm")
        inside = {_WORKBOOK, *_OTHERS}
        known = head.startswith(ZIP) and (named or inside & zip_names(path))
        return 0.9 if known or head.startswith(_OLD) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the sheet that holds positions."""
        if file_start(path).startswith(_OLD):
            raise FormatError(
                "is a workbook of Excel before 2007 (.xls), or one with a password: save it as "
                ".xlsx without a password, or as CSV"
            )
        members = zip_names(path)
        if _WORKBOOK not in members:
            advice = next((text for name, text in _OTHERS.items() if name in members), None)
            raise FormatError(advice or "is no Excel workbook, or a damaged one")
        try:
            from openpyxl import load_workbook
        except ImportError as error:
            raise InputError("a workbook needs openpyxl: pip install 'driftwalk[excel]'") from error
        with damaged_as("as an Excel workbook", path), warnings.catch_warnings():
            # What the library remarks on styles and rules has no part in the numbers.
            warnings.simplefilter("ignore")
            refuse_huge_zip(path)
            book = load_workbook(path, read_only=True, data_only=True, keep_links=False)
            with closing(book):
                sources = [SheetSource(one.title, _rows(one), options) for one in book.worksheets]
        filled = {one.sheet: one for one in sources if one.names}
        return recording_of(the_one_that_fits(filled, options, "sheet"), options)


Row = Sequence[Any]


def _rows(sheet: Any) -> list[tuple[int, Row]]:
    """Return the rows of a sheet that are not blank with their numbers from 1.

    The size that the sheet declares may be wrong.
    """
    sheet.reset_dimensions()
    # A sheet has no more rows, so a row of a higher number is damage.
    rows = enumerate(islice(sheet.iter_rows(values_only=True), 1 << 20), start=1)
    return [one for one in rows if any(cell is not None and cell != "" for cell in one[1])]


class SheetSource(MemorySource):
    """A table in a sheet; the first row that names positions is its header, if there is one."""

    def __init__(self, sheet: str, rows: list[tuple[int, Row]], options: ReadOptions) -> None:
        self.sheet, self._advice = sheet, ""
        begin = options.header_line or 1
        found = [entry for entry in rows if entry[0] >= begin]
        texts = [_texts(row) for _, row in found[: TABLE.heading_rows]]
        names: list[str] = texts[0] if texts else []
        units: list[str] = []
        above = 1
        if options.header_line is not None:
            names = names if found and found[0][0] == begin else []
            if len(texts) > 2 and (units := units_below(names, texts[1], options)):
                above = 2
        elif not names or is_numeric_row(names):
            above = 0
        else:
            for at in range(len(texts)):
                if (heading := heading_of(texts[at : at + 3], options)) is not None:
                    names, units, above = heading.names, heading.units, at + heading.rows
                    break
            else:
                above = 0 if is_data(names, texts[1:], options) else 1
                self._advice = header_advice(texts, found[0][0])
        self._lines = [line for line, _ in found[above:]]
        columns = [
            objects([row[at] if at < len(row) else None for _, row in found[above:]])
            for at in range(len(names))
        ]
        names = names if above else [""] * len(names)
        super().__init__(f"sheet '{sheet}'", names, columns, has_header=above > 0, units=units)

    def error_in_row(self, message: str, row: int) -> FormatError:
        """Return an error about a row of the table, from 0."""
        return FormatError(f"{message} ({self.what}){self._advice}", line=self._lines[row])

    def error(self, message: str) -> FormatError:
        """Return an error about the sheet."""
        return FormatError(f"{self.what}: {message}{self._advice}")


def _texts(row: Row) -> list[str]:
    """Return the cells of a row as texts, up to the last that is filled."""
    texts = [text_of_cell(cell) for cell in row]
    while texts and not texts[-1]:
        texts.pop()
    return texts


LOADERS = (PlainLoader(), MatricesLoader(), ExcelLoader())
