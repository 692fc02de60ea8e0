"""Layout of a text table: columns, skipped lines and missing values."""

from __future__ import annotations

from dataclasses import dataclass

MISSING = frozenset(
    {"", "#N/A", "NaN", "nan", "NAN", "NA", "N/A", "null", "NULL", "None", "none", "-nan"}
)
"""Words that trackers write for a missing number."""


@dataclass(frozen=True)
class TableLayout:
    """Where the numbers stand in a text file."""

    delimiter: str
    """One character, or ``" "`` for any run of blanks."""
    names: list[str]
    """Names of all columns, in order (for error messages)."""
    skip_lines: int = 0
    """Lines before the first row of data."""
    numbers: tuple[int, ...] = ()
    """Columns (from 0) to read as numbers."""
    texts: tuple[int, ...] = ()
    """Columns (from 0) to read as text."""
    clock: int | None = None
    """The one of the numbers whose whole values may be beyond those that float64 holds exactly."""
    stamps: tuple[int, ...] = ()
    """Columns (from 0) of time stamps; of several the sum counts, as of a date and a time of day.
    It becomes the numbers of the first of them."""
