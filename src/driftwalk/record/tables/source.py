"""Interface of a table to the reader: names, units, first rows, and columns to read."""

from __future__ import annotations

from typing import Protocol

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import TableLayout
from driftwalk.record.tables.stamps import StampForm
from driftwalk.record.text import Table


class TableSource(Protocol):
    """A table with one row per sample."""

    @property
    def names(self) -> list[str]:
        """Names of the columns, ``""`` where there is none."""

    @property
    def units(self) -> list[str]:
        """Units in a row below the names; empty where there is no such row."""

    @property
    def has_header(self) -> bool:
        """Whether the columns have names."""

    def sample(self) -> list[list[str]]:
        """Return the first rows as texts."""

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
