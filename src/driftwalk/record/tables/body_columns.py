"""Candidate columns for the body's name, where rows of several bodies were read as one.

Slow and plain: it runs only on a table that has already been refused.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from driftwalk.record.bad_row import is_number
from driftwalk.record.cleaning.several_bodies import LARGEST_SHARE
from driftwalk.record.column_names import ColumnMap, column_meaning
from driftwalk.record.raw import Array, TableLayout
from driftwalk.record.tables.clock import TableClock
from driftwalk.record.tables.source import TableSource


def body_columns(
    source: TableSource,
    columns: ColumnMap,
    names: list[str],
    *,
    clock: TableClock,
    in_order: bool,
) -> list[str]:
    """Return the columns that, taken as the body, leave it in one place at a time.

    Parameters
    ----------
    source : TableSource
        The table.
    columns : ColumnMap
        How it was read.
    names : list of str
        Names of all columns.
    clock : TableClock
        Its clock.
    in_order : bool
        Whether the times of each body have to be in order, too.

    Returns
    -------
    list of str
        At most three names, that with the fewest bodies first.
    """
    if clock.column is None:
        return []
    places = next(iter(columns.bodies.values()))
    numbers = {places["x"], places["y"]} | ({clock.number} if clock.number is not None else set())
    taken = {*numbers, *clock.stamps, columns.body_column}
    free = tuple(
        index for index, name in enumerate(names) if index not in taken and _may_be_a_name(name)
    )
    # The first rows tell the columns of measurements, which have another value in every row.
    wanted = TableLayout("", names, numbers=tuple(sorted(numbers)), texts=free, stamps=clock.stamps)
    head = source.read(wanted, head=True)
    free = tuple(index for index in free if 2 * len(head.labels[index]) <= max(head.rows, 2))
    table = source.read(replace(wanted, texts=free))
    times, x, y = (table.numbers[index] for index in (clock.column, places["x"], places["y"]))
    found = {
        index: len(table.labels[index])
        for index in free
        if _are_names(table.labels[index], rows=table.rows)
        and _tells_apart(table.codes[index], times, x, y, in_order=in_order)
    }
    return [names[index] for index in sorted(found, key=lambda index: found[index])[:3]]


def _may_be_a_name(column: str) -> bool:
    meaning = column_meaning(column)
    return meaning is None or meaning.quantity == "body"


def _are_names(labels: list[str], *, rows: int) -> bool:
    """Whether the values of a column could name bodies that are seen several times each."""
    if not 1 < len(labels) <= rows // 2:
        return False
    return not any(is_number(label) and float(label) % 1.0 for label in labels)


def _tells_apart(
    codes: npt.NDArray[np.int32], clock: Array, x: Array, y: Array, *, in_order: bool
) -> bool:
    """Whether hardly a body is in two places at one time, and none goes back in time if asked."""
    present = np.flatnonzero(np.isfinite(clock) & np.isfinite(x) & np.isfinite(y))
    if in_order:
        rows = present[np.argsort(codes[present], kind="stable")]
        same = codes[rows][1:] == codes[rows][:-1]
        if (same & (np.diff(clock[rows]) < 0)).any():
            return False
    rows = present[np.lexsort((clock[present], codes[present]))]
    again = (codes[rows][1:] == codes[rows][:-1]) & (np.diff(clock[rows]) == 0)
    elsewhere = again & ((np.diff(x[rows]) != 0) | (np.diff(y[rows]) != 0))
    return int(elsewhere.sum()) <= LARGEST_SHARE * (rows.size - int(again.sum()))
