"""A recording of a table with one row per sample; bodies side by side, stacked, or one alone."""

from __future__ import annotations

from functools import partial

import numpy as np

from driftwalk.core.errors import FormatError, InputError, argument_text
from driftwalk.record.cleaning.stacked import split_bodies
from driftwalk.record.column_names import ColumnMap, map_columns, unit_of_name
from driftwalk.record.convert_units import scale_wanted
from driftwalk.record.raw import ANGLE_UNITS, Array, RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.space.columns import body_in_plane, plane_of_columns
from driftwalk.record.space.plane import Plane
from driftwalk.record.tables.body_columns import body_columns
from driftwalk.record.tables.clock import TableClock, clock_of
from driftwalk.record.tables.midnights import count_days
from driftwalk.record.tables.source import TableSource
from driftwalk.record.tables.stamps import DAY
from driftwalk.record.tables.uneven_clock import uneven_clock
from driftwalk.record.text import Table

NO_CLOCK = "the table has no column of times or frames: every row counts as a frame"
NAME_THE_CLOCK = (
    'no column is known to hold times or frames: name it with `columns={"t": "NAME:s"}` or '
    '`columns={"frame": "NAME"}`; if there is none, give `frame_rate`, and every row counts as '
    "a frame"
)


def recording_of(source: TableSource, options: ReadOptions) -> RawRecording:
    """Return the recording that a table holds, as its header and `columns` describe it.

    Parameters
    ----------
    source : TableSource
        The table.
    options : ReadOptions
        What is known about it.

    Raises
    ------
    FormatError
        When it has no positions, or a row or field cannot be read.
    """
    columns, planes = columns_of(source, options)
    labels = [name or str(index) for index, name in enumerate(source.names, start=1)]
    clock_columns = clock_of(source, columns)
    if clock_columns.column is None:
        _require_rows_are_frames(source, columns, labels, options)
    table = _read(source, columns, clock_columns, labels)
    clock: Array = (
        np.arange(table.rows, dtype=np.float64)
        if clock_columns.column is None
        else table.numbers[clock_columns.column]
    )
    notes = [] if clock_columns.column is not None else [NO_CLOCK]
    notes += _unread_angles(columns, labels)
    if "body" not in options.columns and _numbers_the_rows(table, columns.body_column, clock):
        notes.append(f"column '{labels[columns.body_column or 0]}' numbers the rows: one body")
        columns.body_column = None
    bodies, against = _bodies(table, columns, clock, planes, source)
    if table.calendar == DAY:
        codes = None if columns.body_column is None else table.codes[columns.body_column]
        bodies = count_days(bodies, clock, codes)
    plane = next((one for one in planes if one is not None), None)
    bare = columns.bare_clock and not clock_columns.stamps and clock_columns.column is not None
    return RawRecording(
        bodies=bodies,
        clock_unit=clock_columns.unit,
        clock_origin=table.clock_origin,
        calendar=table.calendar,
        length_unit=columns.length_unit,
        angle_unit=columns.angle_unit or "rad",
        bare_clock=labels[columns.clock or 0] if bare else None,
        bare_angle=not columns.angle_unit and plane is None,
        plane="" if plane is None else plane.describe(),
        body_columns=partial(_body_columns, source, columns, clock_columns, labels),
        # Bare `x, y` next to a time in seconds is SI; next to frame numbers it may be pixels.
        bare_length_is_si=columns.bare and clock_columns.unit != "frame",
        rows=table.rows,
        notes=[*notes, *against],
    )


def columns_of(source: TableSource, options: ReadOptions) -> tuple[ColumnMap, list[Plane | None]]:
    """Return what the columns of a table are, and for each body the plane that it is laid into.

    Parameters
    ----------
    source : TableSource
        The table.
    options : ReadOptions
        Columns that the user has named.

    Raises
    ------
    FormatError
        When columns are missing or ambiguous.
    """
    names = source.names
    if not source.has_header and not options.columns:
        raise source.error(
            f"the table has {len(names)} columns and no header: name them with `columns`, such as "
            '`columns={"t": "1", "x": "2", "y": "3"}`'
        )
    try:
        columns = map_columns(
            names,
            options.columns,
            use_frames=options.frame_rate_hz is not None,
            in_space=options.up is not None,
        )
        return columns, [plane_of_columns(of, options.up) for of in columns.bodies.values()]
    except InputError as error:
        raise source.error(str(error)) from error


def _read(source: TableSource, columns: ColumnMap, clock: TableClock, labels: list[str]) -> Table:
    used = {index for places in columns.bodies.values() for index in places.values()}
    if clock.number is not None:
        used.add(clock.number)
    texts = () if columns.body_column is None else (columns.body_column,)
    wanted = TableLayout(
        "",
        labels,
        numbers=tuple(sorted(used - set(texts))),
        texts=texts,
        stamps=clock.stamps,
        clock=clock.number,
    )
    return source.read(wanted)


def _require_rows_are_frames(
    source: TableSource, columns: ColumnMap, labels: list[str], options: ReadOptions
) -> None:
    """Refuse a table without a known clock whose rows cannot, or need not, be frames."""
    found = uneven_clock(source, columns, labels)
    if found is not None:
        frame, time = (argument_text("columns", {what: found}) for what in ("frame", "t"))
        raise source.error(
            f"no column is known to hold times or frames, but '{found}' counts up and skips some: "
            f"add {frame} if it counts frames, {time} if it holds times"
        )
    if options.frame_rate_hz is None:
        scale = scale_wanted(columns.length_unit, bare_is_si=False, options=options)
        raise source.error(NAME_THE_CLOCK + (f"; {scale}" if scale else ""))


def _unread_angles(columns: ColumnMap, labels: list[str]) -> list[str]:
    """Say which columns look like the orientation by their unit alone, where none was found."""
    if any({"theta", "qw"} & set(places) for places in columns.bodies.values()):
        return []
    angles = [name for name in labels if unit_of_name(name) in ANGLE_UNITS]
    if len(angles) != 1:
        return []
    argument = argument_text("columns", {"theta": angles[0]})
    return [f"no orientation is read: add {argument} if that column holds it"]


def _numbers_the_rows(table: Table, column: int | None, clock: Array) -> bool:
    """Whether what seems to name the body counts up row by row, over more than one moment."""
    if column is None or table.rows < 3 or len(table.labels[column]) != table.rows:
        return False
    first, *rest = table.labels[column]
    if not first.isdecimal() or (clock == clock[0]).all():
        return False
    return all(label == str(int(first) + at) for at, label in enumerate(rest, start=1))


def _body_columns(
    source: TableSource,
    columns: ColumnMap,
    clock: TableClock,
    labels: list[str],
    in_order: bool,
) -> list[str]:
    return body_columns(source, columns, labels, clock=clock, in_order=in_order)


def _bodies(
    table: Table,
    columns: ColumnMap,
    clock: Array,
    planes: list[Plane | None],
    source: TableSource,
) -> tuple[list[RawBody], list[str]]:
    """Return the bodies, and what speaks against the planes that they were laid into."""
    if columns.body_column is not None and len(columns.bodies) > 1:
        raise FormatError(
            "has several columns of x and also a column that names the body: choose one layout "
            "with `columns`",
            path=source.error("").path,
        )
    found, notes = [], []
    for (name, places), plane in zip(columns.bodies.items(), planes, strict=True):
        body, against = _body(table.numbers, places, clock, plane)
        body.name = name or "0"
        found.append(body)
        notes += against
    if columns.body_column is None:
        return found, notes
    codes, labels = table.codes[columns.body_column], table.labels[columns.body_column]
    one = found[0]
    return split_bodies(codes, labels, clock=clock, x=one.x, y=one.y, theta=one.theta), notes


def _body(
    values: dict[int, Array], places: dict[str, int], clock: Array, plane: Plane | None
) -> tuple[RawBody, list[str]]:
    """Return the body of some columns, and what speaks against its plane."""
    if plane is not None:
        return body_in_plane(values, places, clock, plane)
    theta = values[places["theta"]] if "theta" in places else None
    return RawBody("0", clock, values[places["x"]], values[places["y"]], theta), []
