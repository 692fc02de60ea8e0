"""Workbooks of Excel (``.xlsx``): the sheet that holds positions, row by row."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.errors import FormatError, InputError, damaged_as
from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.stores.npz import ZIP, refuse_huge_zip, zip_names
from driftwalk.record.tables.rows import recording_of, the_one_that_fits
from driftwalk.record.tables.sheet import SheetSource
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
        _refuse_other(path)
        with _opened(path) as book:
            titles = [sheet.title for sheet in book.worksheets]
        sources = [SheetSource(partial(_rows, path, title), title, options) for title in titles]
        filled = {one.sheet: one for one in sources if one.names}
        return recording_of(the_one_that_fits(filled, options, "sheet"), options)


def _refuse_other(path: Path) -> None:
    """Refuse workbooks of other formats, by name."""
    if file_start(path).startswith(_OLD):
        raise FormatError(
            "is a workbook of Excel before 2007 (.xls), or one with a password: save it as "
            ".xlsx without a password, or as CSV"
        )
    members = zip_names(path)
    if _WORKBOOK not in members:
        advice = next((text for name, text in _OTHERS.items() if name in members), None)
        raise FormatError(advice or "is no Excel workbook, or a damaged one")


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


LOADER = ExcelLoader()
