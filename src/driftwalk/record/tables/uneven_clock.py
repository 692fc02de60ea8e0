"""Columns of a plain table that increase like a clock, for a table without a recognised clock."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from driftwalk.record.bad_row import is_number
from driftwalk.record.column_names import ColumnMap
from driftwalk.record.raw import MISSING, TableLayout
from driftwalk.record.tables.source import TableSource


class UnevenClockPolicy(NamedTuple):
    """Which unnamed column counts up like a clock."""

    even: float = 0.1
    """Relative difference of a camera's intervals from their median, but for missing rows;
    chosen by hand."""
    skipped: float = 1.5
    """Median intervals from which on an interval lacks a row; chosen by hand."""
    own: float = 0.9
    """Share of the rows in which a clock has different values; chosen by hand."""
    fewest: int = 3
    """Rows without which a clock is not recognised; chosen by hand."""


_UNEVEN: Final = UnevenClockPolicy()


def uneven_clock(source: TableSource, columns: ColumnMap, names: list[str]) -> str | None:
    """Return the column that goes up like a clock and skips rows, so that rows are no frames.

    Where every row has its frame, counting the rows is right, and nothing is returned.

    Parameters
    ----------
    source : TableSource
        The table.
    columns : ColumnMap
        How it was read.
    names : list of str
        Names of all columns.
    """
    used = {index for places in columns.bodies.values() for index in places.values()}
    free = tuple(index for index in range(len(names)) if index not in (*used, columns.body_column))
    if not free or columns.body_column is not None:
        return None
    # The first rows are enough: what skips none in 4 MiB is no clock with missing rows.
    table = source.read(TableLayout("", names, texts=free), head=True)
    own = [index for index in free if len(table.labels[index]) >= _UNEVEN.own * table.rows]
    return next((names[index] for index in own if _skips_rows(table.labels[index])), None)


def _skips_rows(values: list[str]) -> bool:
    """Whether the different values of a column, in order of appearance, are such a clock."""
    known = [value.replace(",", ".") for value in values if value not in MISSING]
    if len(known) <= _UNEVEN.fewest or not all(is_number(value) for value in known):
        return False
    steps = np.diff(np.array(known, dtype=np.float64))
    usual = float(np.median(steps))
    if not (np.isfinite(steps).all() and (steps > 0).all()):
        return False
    even = np.abs(steps - usual) <= _UNEVEN.even * usual
    return bool(2 * even.sum() >= steps.size and (steps > _UNEVEN.skipped * usual).any())
