"""A sheet of a workbook as a table, read row by row."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import islice
from typing import Any

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import ReadOptions, TableLayout
from driftwalk.record.tables.cells import CellError, form_of, objects, text_of_cell
from driftwalk.record.tables.heading import header_advice, heading_of, is_data, units_below
from driftwalk.record.tables.in_memory import table_of
from driftwalk.record.tables.source import TABLE
from driftwalk.record.tables.stamps import StampError, StampForm
from driftwalk.record.text import Table
from driftwalk.record.text_head import is_numeric_row

Row = Sequence[Any]


class SheetSource:
    """A table in a sheet; the first row that names positions is its header, if there is one.

    Parameters
    ----------
    rows : callable
        Returns an iterator over the rows of the sheet.
    sheet : str
        Name of the sheet, for errors.
    options : ReadOptions
        What is known about the table: the row, from 1, that names the columns.
    """

    def __init__(
        self,
        rows: Callable[[], Iterator[Row]],
        sheet: str,
        options: ReadOptions,
    ) -> None:
        self._rows = rows
        self.sheet = sheet
        begin = options.header_line or 1
        below = (entry for entry in _numbered(rows()) if entry[0] >= begin)
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
        return (row for row in _numbered(self._rows()) if row[0] > last)


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
