"""Which columns of a plain table count up like a clock, where none was recognised as one."""

from __future__ import annotations

import numpy as np

from driftwalk.record.bad_row import is_number
from driftwalk.record.column_names import ColumnMap
from driftwalk.record.layout import MISSING, TableLayout
from driftwalk.record.tables.source import TableSource

_EVEN = 0.1
"""A camera's intervals differ from their median by less than this share, but for missing rows."""
_SKIPPED = 1.5
"""An interval of so many medians lacks a row."""
_OWN = 0.9
"""A clock has a value of its own in this share of the rows at least."""
_FEWEST = 3


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
    own = [index for index in free if len(table.labels[index]) >= _OWN * table.rows]
    return next((names[index] for index in own if _skips_rows(table.labels[index])), None)


def _skips_rows(values: list[str]) -> bool:
    """Whether the different values of a column, in order of appearance, are such a clock."""
    known = [value.replace(",", ".") for value in values if value not in MISSING]
    if len(known) <= _FEWEST or not all(is_number(value) for value in known):
        return False
    steps = np.diff(np.array(known, dtype=np.float64))
    usual = float(np.median(steps))
    if not (np.isfinite(steps).all() and (steps > 0).all()):
        return False
    even = np.abs(steps - usual) <= _EVEN * usual
    return bool(2 * even.sum() >= steps.size and (steps > _SKIPPED * usual).any())
