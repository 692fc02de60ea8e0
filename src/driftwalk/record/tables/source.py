"""Interface of a table to the reader: names, units, first rows, and columns to read."""

from __future__ import annotations

from typing import Final, NamedTuple, Protocol

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import TableLayout
from driftwalk.record.tables.stamps import StampForm
from driftwalk.record.text import Table


class TablePolicy(NamedTuple):
    """How much of a table is looked at before it is read."""

    heading_rows: int = 100
    """Rows among which are the names of the columns and the first row of data; chosen by hand."""
    sample_rows: int = 50
    """Rows by which a table is recognised; chosen by hand."""
    first_rows: int = 100_000
    """Rows that are read where only the first ones are needed; chosen by hand."""


TABLE: Final = TablePolicy()


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
