"""Which columns of a table are its clock: numbers, time stamps, dates and times of day, or none."""

from __future__ import annotations

from dataclasses import dataclass

from driftwalk.record.column_names import ColumnMap
from driftwalk.record.tables.source import TableSource
from driftwalk.record.tables.stamps import OF_DAY


@dataclass(frozen=True)
class TableClock:
    """The columns of a clock; neither numbers nor stamps where every row counts as a frame."""

    number: int | None = None
    stamps: tuple[int, ...] = ()
    unit: str = "frame"

    @property
    def column(self) -> int | None:
        """The column whose values are the clock's once the table is read."""
        return self.stamps[0] if self.stamps else self.number


def clock_of(source: TableSource, columns: ColumnMap) -> TableClock:
    """Return the clock of a table by what its columns hold.

    Parameters
    ----------
    source : TableSource
        The table.
    columns : ColumnMap
        What its columns are by their names.
    """
    clock, date = columns.clock, columns.date
    form = None if clock is None or columns.clock_unit == "frame" else source.stamps(clock)
    if clock is not None and form is None:
        return TableClock(number=clock, unit=columns.clock_unit)
    date_form = None if date is None else source.stamps(date)
    if clock is None:
        return TableClock() if date is None or date_form is None else _stamps(date)
    if form is not None and form.kind == OF_DAY and date is not None and date_form is not None:
        # A date that has its own time of day says all.
        return _stamps(date) if date_form.kind and date_form.has_time else _stamps(date, clock)
    return _stamps(clock)


def _stamps(*columns: int) -> TableClock:
    return TableClock(stamps=columns, unit="ns")
