"""Workbooks of Excel (``.xlsx``): the sheet that holds positions, row by row."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.errors import FormatError, InputError, damaged_as
from driftwalk.record.raw import RawRecording, ReadOptions, TableLayout
from driftwalk.record.stores.npz import ZIP, refuse_huge_zip, zip_names
from driftwalk.record.tables.heading import header_advice, heading_of, is_data, units_below
from driftwalk.record.tables.in_memory import CellError, form_of, objects, table_of, text_of_cell
from driftwalk.record.tables.rows import recording_of, the_one_that_fits
from driftwalk.record.tables.source import TABLE
from driftwalk.record.tables.stamps import StampError, StampForm
from driftwalk.record.text import Table
from driftwalk.record.text_head import is_numeric_row
from driftwalk.schema.stores.netcdf import file_start

if TYPE_CHECKING:
    from openpyxl import Workbook

_OLD: Final = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
"""Start of Excel's format before 2007, in which workbooks with a password are stored as well."""
_NAMED: Final = (".xlsx", ".xlsm")
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
        if head.startswith(_OLD):
            return 0.9
        if not head.startswith(ZIP):
            return 0.0
        if path.suffix.lower() in _NAMED:
            return 0.9
        return 0.9 if {_WORKBOOK, *_OTHERS} & zip_names(path) else 0.0

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
        with _opened(path) as book:
            titles = [sheet.title for sheet in book.worksheets]
        sources = [SheetSource(path, title, options) for title in titles]
        filled = {one.sheet: one for one in sources if one.names}
        return recording_of(the_one_that_fits(filled, options, "sheet"), options)


@contextmanager
def _opened(path: Path) -> Iterator[Workbook]:
    """Open a workbook; what goes wrong inside becomes a `FormatError`."""
    try:
        import openpyxl
    except ImportError as error:
        raise InputError("a workbook needs openpyxl: pip install 'driftwalk[excel]'") from error
    with damaged_as("as an Excel workbook", path):
        refuse_huge_zip(path)
        with _unremarked():
            book = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
        with closing(book):
            yield book


def _rows(path: Path, title: str) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of a sheet, whatever size the sheet declares."""
    with _opened(path) as book:
        sheet = book[title]
        sheet.reset_dimensions()
        rows = iter(sheet.iter_rows(values_only=True))
        while True:
            with _unremarked():
                piece = list(islice(rows, 500))
            if not piece:
                return
            yield from piece


@contextmanager
def _unremarked() -> Iterator[None]:
    """Leave out what the library remarks on styles and rules, which have no part in the numbers."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


Row = Sequence[Any]


class SheetSource:
    """A table in a sheet; the first row that names positions is its header, if there is one."""

    def __init__(self, path: Path, sheet: str, options: ReadOptions) -> None:
        self._path, self.sheet = path, sheet
        begin = options.header_line or 1
        below = (entry for entry in _numbered(_rows(path, sheet)) if entry[0] >= begin)
        lines, texts = [], []
        for line, row in islice(below, TABLE.heading_rows):
            lines.append(line)
            texts.append(_texts(row))
        stated = options.header_line is not None and lines[:1] == [options.header_line]
        first = texts[0] if texts and (stated or options.header_line is None) else []
        self.has_header = stated or (bool(first) and not is_numeric_row(first))
        self.names = first if self.has_header else [""] * len(first)
        self.units: list[str] = []
        self._header, self._advice = (lines[0] if lines else 0), ""
        if stated and len(texts) > 2 and (units := units_below(first, texts[1], options)):
            self.units, self._header = units, lines[1]
        if self.has_header and not stated:
            for at in range(len(texts)):
                found = heading_of(texts[at : at + 3], options)
                if found is not None:
                    self.names, self.units = found.names, found.units
                    self._header = lines[at + found.rows - 1]
                    break
            else:
                if is_data(first, texts[1:], options):
                    self.has_header, self.names = False, [""] * len(first)
                self._advice = header_advice(texts, lines[0])

    @cached_property
    def _first(self) -> list[Row]:
        return [row for _, row in islice(self._data(), TABLE.sample_rows)]

    def sample(self) -> list[list[str]]:
        """Return the first rows as texts."""
        return [_texts(row) for row in self._first]

    def stamps(self, column: int) -> StampForm | None:
        """Return how the first time stamp of a column is written, None where it has none."""
        cells = [row[column] if column < len(row) else None for row in self._first]
        return form_of(objects(cells))

    def read(self, wanted: TableLayout, *, head: bool = False) -> Table:
        """Read columns, row by row."""
        used = {*wanted.numbers, *wanted.texts, *wanted.stamps}
        cells: dict[int, list[Any]] = {at: [] for at in used}
        lines: list[int] = []
        for line, row in islice(self._data(), TABLE.first_rows if head else None):
            lines.append(line)
            for at, column in cells.items():
                column.append(row[at] if at < len(row) else None)
        if not lines:
            raise self.error("holds no rows of data")
        try:
            return table_of({at: objects(column) for at, column in cells.items()}, wanted)
        except (CellError, StampError) as error:
            raise FormatError(
                f"{error} (sheet '{self.sheet}'){self._advice}",
                line=lines[error.row],
            ) from error

    def error(self, message: str) -> FormatError:
        """Return an error about the sheet."""
        return FormatError(f"sheet '{self.sheet}': {message}{self._advice}")

    def _data(self) -> Iterator[tuple[int, Row]]:
        """Yield the rows below the header that are not blank, with their numbers from 1."""
        last = self._header if self.has_header else self._header - 1
        return (row for row in _numbered(_rows(self._path, self.sheet)) if row[0] > last)


def _texts(row: Row) -> list[str]:
    """Return the cells of a row as texts, up to the last that is filled."""
    texts = [text_of_cell(cell) for cell in row]
    while texts and not texts[-1]:
        texts.pop()
    return texts


def _numbered(rows: Iterator[Row]) -> Iterator[tuple[int, Row]]:
    """Yield the rows that are not blank with their numbers from 1, until too many blank ones."""
    blank = 0
    for line, row in enumerate(rows, start=1):
        if any(cell is not None and cell != "" for cell in row):
            blank = 0
            yield line, row
        else:
            blank += 1
            # A sheet has no more rows, so a row of a higher number is damage.
            if blank >= 1 << 20:
                return


LOADER = ExcelLoader()
