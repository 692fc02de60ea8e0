"""A table in a text file: its delimiter, the names of its columns, and the units below them."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import split_fields
from driftwalk.record.raw import MISSING, ReadOptions, TableLayout
from driftwalk.record.tables.heading import header_advice, heading_of, is_data, units_below
from driftwalk.record.tables.source import TABLE
from driftwalk.record.tables.stamps import StampForm, stamp_form
from driftwalk.record.text import Table, header_rows, read_table
from driftwalk.record.text_head import detect_delimiter, read_header


class TextSource:
    """A table in a text file, whose header is found or, by a layout, known."""

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
        stated = options.header_line is not None
        count = 3 if stated else TABLE.heading_rows
        lines = header_rows(self._path, begin + count)[begin:]
        below = self._fields(lines[1:])
        if stated:
            if len(below) > 1 and (units := units_below(self.names, below[0], options)):
                self.units, self._skip = units, begin + 2
            return
        for at, line in enumerate(lines):
            if not line.strip():
                continue
            here = self._delimiter if not at else None
            delimiter = options.delimiter or here or detect_delimiter(lines[at : at + 2])
            below_at = [n for n in range(at + 1, len(lines)) if lines[n].strip()][:2]
            texts = [line.lstrip("# ").removeprefix("% "), *(lines[n] for n in below_at)]
            rows = [split_fields(one, delimiter) for one in texts]
            found = heading_of(rows, options)
            if found is not None:
                if at or found.rows > 1 or line.startswith("% "):
                    self.names, self.units, self._delimiter = found.names, found.units, delimiter
                    self._skip = begin + [at, *below_at][found.rows - 1] + 1
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
