"""Columns of unknown names that count frames or name bodies, by the order of their values.

Slow and plain: it runs only on a table without a known clock, or one that has been refused.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Codes
from driftwalk.core.errors import argument_text
from driftwalk.record.bad_row import is_number
from driftwalk.record.cleaning.clean import LARGEST_SHARE, order_in_frame
from driftwalk.record.column_names import quantity_of
from driftwalk.record.raw import Array, TableLayout
from driftwalk.record.tables.date_stamps import RowError
from driftwalk.record.tables.in_memory import TableSource, as_numbers, objects
from driftwalk.record.tables.named_columns import LEFT_OUT, TableReading
from driftwalk.record.text import Table
from driftwalk.record.unit_and_column_words import ALLOWED, UNITS


class UnevenClockPolicy(NamedTuple):
    """Which unnamed column counts up like a clock, and which one tells bodies apart."""

    even: float = 0.1
    """Relative difference of a camera's intervals from their median, but for missing rows;
    chosen by hand."""
    skipped: float = 1.5
    """Median intervals from which on an interval lacks a row; chosen by hand."""
    own: float = 0.9
    """Share of the rows in which a clock has different values; chosen by hand."""
    fewest: int = 3
    """Rows without which a clock is not recognised; chosen by hand."""
    leap: float = 5.0
    """Lengths of the usual step (its 90th percentile) from which on a body cannot have gone from
    one row to the next; chosen by hand."""
    turns: float = 1.5
    """The same where bodies take turns, of medians; chosen by hand."""
    back: float = 0.1
    """Share of the steps that may go back in a column that starts over; chosen by hand."""


_ORDER: Final = UnevenClockPolicy()


def other_order(source: TableSource, reading: TableReading, names: list[str]) -> str | None:
    """Return why rows of a table without a known clock cannot be frames of one body, or None.

    Parameters
    ----------
    source : TableSource
        The table.
    reading : TableReading
        How it was read.
    names : list of str
        Names of all columns.
    """
    used = {at for places in reading.bodies.values() for at in places.values()}
    used |= {at for at, column in enumerate(reading.columns) if column.why == LEFT_OUT}
    stacked = [] if reading.body_column is None else [reading.body_column]
    free = [at for at in range(len(names)) if at not in (*used, *stacked)]
    x, y = _position(reading)
    if not free:
        return None
    for at in free:
        unit = UNITS.get(names[at].strip().lower(), "")
        if unit in ("ms", "us", "ns"):
            return (
                f"no column is known to hold times or frames, but '{names[at]}' may hold times: "
                f"add {argument_text('columns', {'t': f'{names[at]}:{unit}'})}"
            )
    # The first rows are enough: what skips none in 4 MiB is no clock with missing rows.
    wanted = TableLayout("", names, numbers=tuple(sorted({x, y})), texts=(*free, *stacked))
    table = source.read(wanted, head=True)
    counters = {at: values for at in free if (values := _numbers(table, at)) is not None}
    for at, values in counters.items() if reading.body_column is None else ():
        own = len(table.labels[at]) >= _ORDER.own * table.rows
        if own and _skips_rows(values):
            frame, time = (argument_text("columns", {what: names[at]}) for what in ("frame", "t"))
            return (
                f"no column is known to hold times or frames, but '{names[at]}' counts up and "
                f"skips some: add {frame} if it counts frames, {time} if it holds times"
            )
    if (apart := _tracks(table, counters, free, reading)) is not None:
        body, counter = apart
        what, columns = f"'{names[counter]}' counts frames", {"frame": names[counter]}
        if body is not None and body != reading.body_column:
            what += f" and '{names[body]}' names bodies"
            columns["body"] = names[body]
        return (
            f"no column is known to hold times or frames, but it seems that {what}: add "
            f"{argument_text('columns', columns)}"
        )
    for at in free if reading.body_column is None else ():
        if _leaps(table.codes[at], table.numbers[x], table.numbers[y]):
            add, skip = (argument_text("columns", {one: names[at]}) for one in ("body", "skip"))
            return (
                f"rows seem to be of several bodies, or runs, which '{names[at]}' names: add "
                f"{add} if so, {skip} if it is one body, whose rows are its frames"
            )
    return None


def _position(reading: TableReading) -> tuple[int, int]:
    """Return two columns that move with the body."""
    places = next(iter(reading.bodies.values()))
    x, y = (places.get(axis, places.get(f"{axis}1", min(places.values()))) for axis in "xy")
    return x, y


def _numbers(table: Table, column: int) -> Array | None:
    """Return the values of a column of texts in each row, None where one is no number."""
    try:
        values = as_numbers(objects(table.labels[column]), "")
    except RowError:
        return None
    return np.asarray(values[table.codes[column]])


def _skips_rows(values: Array) -> bool:
    """Whether values count up evenly and leave some out."""
    steps = np.diff(values[np.isfinite(values)])
    steps = steps[steps != 0.0]
    if steps.size < _ORDER.fewest or not (np.isfinite(steps).all() and (steps > 0).all()):
        return False
    usual = float(np.median(steps))
    even = np.abs(steps - usual) <= _ORDER.even * usual
    return bool(2 * even.sum() >= steps.size and (steps > _ORDER.skipped * usual).any())


def _tracks(
    table: Table, counters: dict[int, Array], free: list[int], reading: TableReading
) -> tuple[int | None, int] | None:
    """Return the columns of body and frame of a table whose frames repeat or start over."""
    body = reading.body_column
    found: list[tuple[int, int | None, int]] = []
    for frame, values in counters.items():
        whole = np.isfinite(values).all() and not (values % 1.0 != 0.0).any()
        one = body is None and (np.diff(values) > 0).all()  # a body, row by row
        if not whole or one or table.rows < 4 or np.unique(values).size < 3:
            continue
        for other in free if body is None else [body]:
            bodies = len(table.labels[other])
            few = (2 if body is None else 1) <= bodies <= table.rows // 2
            if few and other != frame and _counts_each(table.codes[other], values, body):
                found.append((bodies, other, frame))
        if not found and body is None:
            repeated = (np.diff(values) >= 0).all() and _leaps(
                order_in_frame(values), *(table.numbers[at] for at in _position(reading))
            )
            if repeated or _starts_over(values):
                found.append((table.rows, None, frame))
    return min(found, key=lambda entry: entry[0])[1:] if found else None


def _counts_each(codes: Codes, values: Array, body: int | None) -> bool:
    """Whether values count up, mostly one by one, in the rows of each body."""
    (steps,) = _within(codes, values)
    if not steps.size or not (steps > 0).all() or np.median(steps) != 1.0:
        return False
    firsts = values[np.unique(codes, return_index=True)[1]]
    # Of known bodies that all begin with the same number, counting the rows says the same.
    return body is None or not ((steps == 1.0).all() and np.unique(firsts).size == 1)


def _within(codes: Codes, *columns: Array) -> list[Array]:
    """Return the steps of columns from each row to the next of the same code."""
    order = np.argsort(codes, kind="stable")
    same = codes[order][1:] == codes[order][:-1]
    return [np.diff(column[order])[same] for column in columns]


def _starts_over(values: Array) -> bool:
    """Whether values count up one by one, and start over or stay the same for several bodies."""
    _, counts = np.unique(values, return_counts=True)
    steps = np.diff(values)
    back = steps < 0
    if not back.any():
        return bool(counts[0] > 1 and (counts == counts[0]).all() and steps.max() == 1.0)
    return bool((steps[~back] == 1.0).mean() > _ORDER.own and back.mean() < _ORDER.back)


def _leaps(codes: Codes, x: Array, y: Array) -> bool:
    """Whether codes tell bodies, or runs, apart: the position leaps wherever they change."""
    labels = int(codes.max(initial=-1)) + 1
    changes = codes[1:] != codes[:-1]
    if labels < 2 or labels > codes.size // 4 or not changes.any():
        return False
    counts = np.bincount(codes)
    turns = np.arange(codes.size) % labels
    if (counts == counts[0]).all() and (changes.sum() == labels - 1 or (codes == turns).all()):
        return True  # as many rows of each, one after the other or in turns
    within = np.hypot(*_within(codes, x, y))
    leaps = np.hypot(*(np.diff(axis)[changes] for axis in (x, y)))
    within = within[np.isfinite(within) & (within > 0)]
    leaps = leaps[np.isfinite(leaps)]
    if not within.size or not leaps.size:
        return False
    if 2 * changes.sum() >= changes.size:
        # Bodies take turns: of one body the like values would be farther apart.
        return bool(np.median(leaps) > _ORDER.turns * np.median(within))
    least = np.median(leaps) if changes.sum() >= labels else leaps.min()
    return bool(least > _ORDER.leap * np.percentile(within, 90.0))


def body_columns(
    source: TableSource, reading: TableReading, names: list[str], in_order: bool
) -> list[str]:
    """Return the columns that, taken as the body, leave it in one place at a time.

    Parameters
    ----------
    source : TableSource
        The table.
    reading : TableReading
        How it was read.
    names : list of str
        Names of all columns.
    in_order : bool
        Whether the times of each body have to be in order, too.

    Returns
    -------
    list of str
        At most three names, that with the fewest bodies first.
    """
    if reading.clock is None:
        return []
    place = _position(reading)
    numbers = {*place, *reading.numbers[:1]}
    taken = {*numbers, *reading.numbers, *reading.stamps, reading.body_column}
    # "min" next to "sec" names no body, and neither does a column of another known meaning.
    named = {at: name for at, name in enumerate(names) if quantity_of(name) in ("", "body")}
    units = {at: UNITS.get(name.strip().lower()) for at, name in named.items()}
    free = tuple(at for at in named if at not in taken and units[at] not in ALLOWED["t"])
    # The first rows tell the columns of measurements, which have another value in every row.
    wanted = TableLayout("", names, 0, tuple(sorted(numbers)), free, stamps=reading.stamps)
    head = source.read(wanted, head=True)
    free = tuple(index for index in free if 2 * len(head.labels[index]) <= max(head.rows, 2))
    table = source.read(replace(wanted, texts=free))
    times, x, y = (table.numbers[index] for index in (reading.clock, *place))
    fitting = [
        index
        for index in free
        if _are_names(table.labels[index], rows=table.rows)
        and _tells_apart(table.codes[index], times, x, y, in_order=in_order)
    ]
    return [names[at] for at in sorted(fitting, key=lambda at: len(table.labels[at]))[:3]]


def _are_names(labels: list[str], *, rows: int) -> bool:
    """Whether the values of a column could name bodies that are seen several times each."""
    broken = (is_number(label) and float(label) % 1.0 for label in labels)
    return 1 < len(labels) <= rows // 2 and not any(broken)


def _tells_apart(codes: Codes, clock: Array, x: Array, y: Array, *, in_order: bool) -> bool:
    """Whether hardly a body is in two places at one time, and none goes back in time if asked."""
    present = np.isfinite(clock) & np.isfinite(x) & np.isfinite(y)
    codes, clock, x, y = codes[present], clock[present], x[present], y[present]
    if in_order and (_within(codes, clock)[0] < 0).any():
        return False
    rows = np.argsort(clock, kind="stable")
    steps, along, across = _within(codes[rows], clock[rows], x[rows], y[rows])
    again = steps == 0
    elsewhere = again & ((along != 0) | (across != 0))
    return int(elsewhere.sum()) <= LARGEST_SHARE * (rows.size - int(again.sum()))
