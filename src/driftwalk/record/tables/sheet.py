"""A sheet of a workbook as a table, read row by row."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import ReadOptions, TableLayout
from driftwalk.record.tables.cells import (
    CellError,
    Values,
    as_names,
    as_numbers,
    as_ticks,
    form_of,
    text_of_cell,
)
from driftwalk.record.tables.growing import GrowingColumn
from driftwalk.record.tables.heading import TABLE, header_advice, heading_of, is_data, units_below
from driftwalk.record.tables.stamps import (
    StampError,
    StampForm,
    StampReader,
    calendar_of,
    clock_of_stamps,
)
from driftwalk.record.text import Table
from driftwalk.record.text_head import is_numeric_row

Row = Sequence[Any]


class SheetSource:
    """A table in a sheet; the first row that names positions is its header, if there is one.

    Parameters
    ----------
    rows : callable
        Returns an iterator over the rows of the sheet.
    path : Path
        The workbook.
    sheet : str
        Name of the sheet, for errors.
    options : ReadOptions
        What is known about the table: the row, from 1, that names the columns.
    """

    def __init__(
        self,
        rows: Callable[[], Iterator[Row]],
        path: Path,
        sheet: str,
        options: ReadOptions,
    ) -> None:
        self._rows = rows
        self._path = path
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

    @property
    def is_blank(self) -> bool:
        """Whether the sheet has no header."""
        return not self.names

    def sample(self) -> list[list[str]]:
        """Return the first rows as texts."""
        return [_texts(row) for _, row in islice(self._data(), TABLE.sample_rows)]

    def stamps(self, column: int) -> StampForm | None:
        """Return how the first time stamp of a column is written, None where it has none."""
        rows = [row for _, row in islice(self._data(), TABLE.sample_rows)]
        return form_of(_column(rows, column))

    def read(self, wanted: TableLayout, *, head: bool = False) -> Table:
        """Read columns, some thousands of rows at a time."""
        reading = _Reading(wanted)
        data = self._data()
        if head:
            data = islice(data, TABLE.first_rows)
        while piece := list(islice(data, 20_000)):
            lines = [line for line, _ in piece]
            try:
                reading.add([row for _, row in piece])
            except (CellError, StampError) as error:
                raise FormatError(
                    f"{error} (sheet '{self.sheet}'){self._advice}",
                    path=self._path,
                    line=lines[error.row],
                ) from error
        if not reading.rows:
            raise self.error("holds no rows of data")
        return reading.table()

    def error(self, message: str) -> FormatError:
        """Return an error about the sheet."""
        return FormatError(f"sheet '{self.sheet}': {message}{self._advice}", path=self._path)

    def _data(self) -> Iterator[tuple[int, Row]]:
        """Yield the rows below the header that are not blank, with their numbers from 1."""
        last = self._header if self.has_header else self._header - 1
        return (row for row in _numbered(self._rows()) if row[0] > last)


class _Reading:
    """Columns of a sheet as far as it is read."""

    def __init__(self, wanted: TableLayout) -> None:
        self.rows = 0
        self._wanted = wanted
        self._numbers = {
            at: GrowingColumn(np.float64) for at in (*wanted.numbers, *wanted.stamps[:1])
        }
        self._codes = {at: GrowingColumn(np.int32) for at in wanted.texts}
        self._labels: dict[int, dict[str, int]] = {at: {} for at in wanted.texts}
        self._stamps = {at: StampReader() for at in wanted.stamps}
        self._origin: int | None = None

    def add(self, rows: list[Row]) -> None:
        """Read some rows."""
        names = self._wanted.names
        for at in self._wanted.numbers:
            self._numbers[at].append(as_numbers(_column(rows, at), names[at]))
        for at, seen in self._labels.items():
            codes, found = as_names(_column(rows, at))
            index = np.array([seen.setdefault(name, len(seen)) for name in found], dtype=np.int32)
            self._codes[at].append(index[codes])
        if self._stamps:
            ticks = [as_ticks(_column(rows, at), reader) for at, reader in self._stamps.items()]
            clock, self._origin = clock_of_stamps(ticks, self._origin)
            self._numbers[self._wanted.stamps[0]].append(clock)
        self.rows += len(rows)

    def table(self) -> Table:
        """Return what was read."""
        return Table(
            rows=self.rows,
            numbers={at: values.take() for at, values in self._numbers.items()},
            codes={at: values.take() for at, values in self._codes.items()},
            labels={at: list(seen) for at, seen in self._labels.items()},
            clock_origin=self._origin or 0,
            calendar=calendar_of(list(self._stamps.values())),
        )


def _texts(row: Row) -> list[str]:
    """Return the cells of a row as texts, up to the last that is filled."""
    texts = [text_of_cell(cell) for cell in row]
    while texts and not texts[-1]:
        texts.pop()
    return texts


def _column(rows: list[Row], column: int) -> Values:
    """Return the cells of a column; rows end with their last cell."""
    cells = np.empty(len(rows), dtype=object)
    cells[:] = [row[column] if column < len(row) else None for row in rows]
    return cells


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
