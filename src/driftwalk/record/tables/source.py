"""A table that is read column by column, wherever it lies."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Protocol

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import split_fields
from driftwalk.record.head import read_header
from driftwalk.record.layout import MISSING, TableLayout
from driftwalk.record.raw import ReadOptions
from driftwalk.record.tables.stamps import StampForm, stamp_form
from driftwalk.record.text import Table, header_rows, read_table

_ROWS_LOOKED_AT = 50


class TableSource(Protocol):
    """A table with one row per sample."""

    @property
    def names(self) -> list[str]:
        """Names of the columns, ``""`` where there is none."""

    @property
    def has_header(self) -> bool:
        """Whether the columns have names."""

    def stamps(self, column: int, /) -> StampForm | None:
        """Return how the first time stamp of a column is written, None where it has none."""

    def read(self, wanted: TableLayout, /, *, head: bool = False) -> Table:
        """Read the columns that a layout names; of the `head` no more than the first rows.

        Raises
        ------
        FormatError
            When a row or a field cannot be read.
        """

    def error(self, message: str, /) -> FormatError:
        """Return an error about the header, or the table where it has none."""


class TextSource:
    """A table in a text file."""

    def __init__(self, path: Path, options: ReadOptions) -> None:
        self._path = path
        names, self._delimiter, self._skip, self.has_header = read_header(
            path, delimiter=options.delimiter, header_line=options.header_line
        )
        self.names = names

    def stamps(self, column: int) -> StampForm | None:
        """Return how the first time stamp of a column is written, None where it has none."""
        lines = header_rows(self._path, self._skip + _ROWS_LOOKED_AT)[self._skip :]
        rows = (split_fields(line, self._delimiter) for line in lines if line.strip())
        fields = (row[column] for row in rows if len(row) > column)
        return next((stamp_form(field) for field in fields if field not in MISSING), None)

    def read(self, wanted: TableLayout, *, head: bool = False) -> Table:
        """Read columns, in blocks of the file."""
        layout = replace(wanted, delimiter=self._delimiter, skip_lines=self._skip)
        return read_table(self._path, layout, blocks=1 if head else None)

    def error(self, message: str) -> FormatError:
        """Return an error about the header, or the file where it has none."""
        return FormatError(message, path=self._path, line=self._skip if self.has_header else None)
