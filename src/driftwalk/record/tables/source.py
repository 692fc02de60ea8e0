"""Interface of a table to its reader, and the reading: what each column was taken for, and why."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, NamedTuple, Protocol

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import TableLayout
from driftwalk.record.tables.boxes import Box
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


_WORDS: Final = {"t": "time", "t+": "fraction of the time", "frame": "frame number", "w": "width"}
_WORDS_MORE: Final = {"h": "height", "theta": "orientation", "body": "name of the body"}


@dataclass
class ColumnReading:
    """Reading of one column."""

    name: str
    role: str = ""
    """A quantity of `ALLOWED`, ``"t+"``, or ``""``: it is not read."""
    body: str = ""
    unit: str = ""
    """Of `UNITS`; ``""`` where nothing names it."""
    why: str = "its name is not known"

    def described(self) -> dict[str, str]:
        """Return the reading for people."""
        words = {**_WORDS, **_WORDS_MORE}.get(self.role, self.role)
        meaning = f"{words} of '{self.body}'" if self.body and words else words
        return {
            "column": self.name,
            "meaning": meaning or "not read",
            "unit": self.unit,
            "why": self.why,
        }


@dataclass
class TableReading:
    """Reading of the columns (from 0) of a table, as the reader executes it."""

    columns: list[ColumnReading]
    bodies: dict[str, dict[str, int]] = field(default_factory=dict)
    """Body to quantity (x, y, theta, ..., sides of a box) to column."""
    numbers: tuple[int, ...] = ()
    """The clock: one column of numbers, or seconds and their fraction; empty: none, or stamps."""
    stamps: tuple[int, ...] = ()
    """The clock: time stamps, or dates and times of day."""
    clock_unit: str = "frame"
    bare_clock: bool = False
    """Whether the clock has times of an unnamed unit."""
    body_column: int | None = None
    length_unit: str = ""
    factors: dict[int, float] = field(default_factory=dict)
    """Columns of positions in another unit than that, and what makes it of them."""
    angle_unit: str = ""
    bare: bool = True
    """Whether the names of positions are plain symbols, which mean metres next to seconds."""
    box: Box | None = None
    parts: tuple[str, str, str] | None = None
    """Bodies that are parts of one: its middle, and those from and to which it points."""
    notes: list[str] = field(default_factory=list)

    @property
    def clock(self) -> int | None:
        """The column whose values are the clock's once the table is read."""
        return next(iter((*self.stamps, *self.numbers)), None)
