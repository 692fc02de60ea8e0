"""Plain tables: CSV, TSV, semicolons or blanks, with or without header, columns named or mapped."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from driftwalk.core.argument_text import argument_text
from driftwalk.core.errors import FormatError, InputError
from driftwalk.record.body_columns import body_columns
from driftwalk.record.clock_columns import uneven_clock
from driftwalk.record.column_names import ColumnMap, map_columns, unit_of_name
from driftwalk.record.head import first_lines, read_header
from driftwalk.record.layout import TableLayout
from driftwalk.record.raw import ANGLE_UNITS, Array, RawBody, RawRecording, ReadOptions
from driftwalk.record.space.columns import body_in_plane, plane_of_columns
from driftwalk.record.space.plane import Plane
from driftwalk.record.stacked import split_bodies
from driftwalk.record.text import Table, read_table

NO_CLOCK = "the table has no column of times or frames: every row counts as a frame"
NAME_THE_CLOCK = (
    'no column is known to hold times or frames: name it with `columns={"t": "NAME:s"}` or '
    '`columns={"frame": "NAME"}`; if there is none, give `frame_rate`, and every row counts as '
    "a frame"
)


class PlainLoader:
    """A table with one row per sample; bodies side by side, stacked, or one alone."""

    name = "csv"
    description = (
        "plain CSV, TSV or blank-separated table, columns recognised or named by `columns`"
    )

    def sniff(self, head: bytes, _path: Path) -> float:
        """Accept any text, so weakly that every other format wins."""
        lines = first_lines(head, 2)
        return 0.1 if lines and not lines[0].lstrip().startswith(("[", "{", "$", "<")) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the table as its header and `columns` describe it."""
        names, delimiter, skip, has_header = read_header(
            path, delimiter=options.delimiter, header_line=options.header_line
        )
        if not has_header and not options.columns:
            raise FormatError(
                f"the file has {len(names)} columns and no header: name them with `columns`, "
                'such as `columns={"t": "1", "x": "2", "y": "3"}`',
                path=path,
            )
        try:
            columns = map_columns(
                names,
                options.columns,
                use_frames=options.frame_rate_hz is not None,
                in_space=options.up is not None,
            )
            planes = [plane_of_columns(of, options.up) for of in columns.bodies.values()]
        except InputError as error:
            raise FormatError(str(error), path=path, line=skip if has_header else None) from error
        labels = [name or str(index) for index, name in enumerate(names, start=1)]
        if columns.clock is None:
            _require_rows_are_frames(path, columns, labels, options, delimiter, skip)
        table = read_table(path, _layout(columns, labels, delimiter=delimiter, skip=skip))
        clock: Array = (
            np.arange(table.rows, dtype=np.float64)
            if columns.clock is None
            else table.numbers[columns.clock]
        )
        notes = [] if columns.clock is not None else [NO_CLOCK]
        notes += _unread_angles(columns, labels)
        if "body" not in options.columns and _numbers_the_rows(table, columns.body_column, clock):
            notes.append(f"column '{labels[columns.body_column or 0]}' numbers the rows: one body")
            columns.body_column = None
        bodies, against = _bodies(table, columns, clock, planes, path=path)
        plane = next((one for one in planes if one is not None), None)
        return RawRecording(
            bodies=bodies,
            clock_unit=columns.clock_unit,
            clock_origin=table.clock_origin,
            length_unit=columns.length_unit,
            angle_unit=columns.angle_unit or "rad",
            bare_clock=_bare_clock(columns, labels),
            bare_angle=not columns.angle_unit and plane is None,
            plane="" if plane is None else plane.describe(),
            body_columns=lambda in_order: body_columns(
                path, columns, labels, delimiter=delimiter, skip=skip, in_order=in_order
            ),
            # Bare `x, y` next to a time in seconds is SI; next to frame numbers it may be pixels.
            bare_length_is_si=columns.bare and columns.clock_unit != "frame",
            rows=table.rows,
            notes=[*notes, *against],
        )


def _require_rows_are_frames(
    path: Path,
    columns: ColumnMap,
    labels: list[str],
    options: ReadOptions,
    delimiter: str,
    skip: int,
) -> None:
    """Refuse a table without a known clock whose rows cannot, or need not, be frames."""
    found = uneven_clock(path, columns, labels, delimiter=delimiter, skip=skip)
    if found is not None:
        frame, time = (argument_text("columns", {what: found}) for what in ("frame", "t"))
        raise FormatError(
            f"no column is known to hold times or frames, but '{found}' counts up and skips some: "
            f"add {frame} if it counts frames, {time} if it holds times",
            path=path,
        )
    if options.frame_rate_hz is None:
        raise FormatError(NAME_THE_CLOCK, path=path)


def _unread_angles(columns: ColumnMap, labels: list[str]) -> list[str]:
    """Say which columns look like the orientation by their unit alone, where none was found."""
    if any({"theta", "qw"} & set(places) for places in columns.bodies.values()):
        return []
    angles = [name for name in labels if unit_of_name(name) in ANGLE_UNITS]
    if len(angles) != 1:
        return []
    argument = argument_text("columns", {"theta": angles[0]})
    return [f"no orientation is read: add {argument} if that column holds it"]


def _bare_clock(columns: ColumnMap, labels: list[str]) -> str | None:
    if columns.clock is None or not columns.bare_clock:
        return None
    return labels[columns.clock]


def _numbers_the_rows(table: Table, column: int | None, clock: Array) -> bool:
    """Whether what seems to name the body counts up row by row, over more than one moment."""
    if column is None or table.rows < 3 or len(table.labels[column]) != table.rows:
        return False
    first, *rest = table.labels[column]
    if not first.isdecimal() or (clock == clock[0]).all():
        return False
    return all(label == str(int(first) + at) for at, label in enumerate(rest, start=1))


def _layout(columns: ColumnMap, names: list[str], *, delimiter: str, skip: int) -> TableLayout:
    used = {index for places in columns.bodies.values() for index in places.values()}
    if columns.clock is not None:
        used.add(columns.clock)
    texts = () if columns.body_column is None else (columns.body_column,)
    return TableLayout(
        delimiter=delimiter,
        names=names,
        skip_lines=skip,
        numbers=tuple(sorted(used - set(texts))),
        texts=texts,
        clock=columns.clock,
    )


def _bodies(
    table: Table, columns: ColumnMap, clock: Array, planes: list[Plane | None], *, path: Path
) -> tuple[list[RawBody], list[str]]:
    """Return the bodies, and what speaks against the planes that they were laid into."""
    if columns.body_column is not None and len(columns.bodies) > 1:
        raise FormatError(
            "has several columns of x and also a column that names the body: choose one layout "
            "with `columns`",
            path=path,
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


LOADER = PlainLoader()
