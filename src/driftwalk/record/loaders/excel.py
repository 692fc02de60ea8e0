"""Workbooks of Excel (``.xlsx``): the sheet that holds positions, row by row."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Any, Final

from driftwalk.core.errors import FormatError, InputError, damaged_as
from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.stores.npz import ZIP, refuse_huge_zip, zip_names
from driftwalk.record.tables.in_memory import TABLE, MemorySource, objects, text_of_cell
from driftwalk.record.tables.rows import recording_of, the_one_that_fits
from driftwalk.record.tables.text_source import (
    header_advice,
    heading_of,
    is_data,
    is_numeric_row,
    units_below,
)
from driftwalk.schema.stores.netcdf import file_start

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
        stated = options.header_line is not None and [line for line, _ in found[:1]] == [begin]
        names = texts[0] if texts and (stated or options.header_line is None) else []
        has_header = stated or (bool(names) and not is_numeric_row(names))
        units: list[str] = []
        above = int(has_header)
        if stated and len(texts) > 2 and (units := units_below(names, texts[1], options)):
            above = 2
        if has_header and not stated:
            for at in range(len(texts)):
                heading = heading_of(texts[at : at + 3], options)
                if heading is not None:
                    names, units, above = heading.names, heading.units, at + heading.rows
                    break
            else:
                if is_data(names, texts[1:], options):
                    has_header, above = False, 0
                self._advice = header_advice(texts, found[0][0])
        self._lines = [line for line, _ in found[above:]]
        columns = [
            objects([row[at] if at < len(row) else None for _, row in found[above:]])
            for at in range(len(names))
        ]
        names = names if has_header else [""] * len(names)
        super().__init__(f"sheet '{sheet}'", names, columns, has_header=has_header, units=units)

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


LOADER = ExcelLoader()
