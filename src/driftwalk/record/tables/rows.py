"""A recording of a table with one row per sample; bodies side by side, stacked, or one alone."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError, argument_text, listed
from driftwalk.record.cleaning.clean import order_in_body, split_bodies
from driftwalk.record.convert_units import scale_wanted
from driftwalk.record.pose import angle_between
from driftwalk.record.raw import (
    ANGLE_UNITS,
    CLOCK_UNITS,
    MISSING,
    Array,
    RawBody,
    RawRecording,
    ReadOptions,
    TableLayout,
)
from driftwalk.record.space import body_in_plane, on_the_ground, plane_of_columns
from driftwalk.record.tables.boxes import box_angle, box_centre
from driftwalk.record.tables.columns import read_columns
from driftwalk.record.tables.date_stamps import DAY, count_days
from driftwalk.record.tables.in_memory import TableSource
from driftwalk.record.tables.named_columns import TableReading
from driftwalk.record.tables.row_order import body_columns, other_order
from driftwalk.record.text import Table
from driftwalk.record.unit_and_column_words import words

_FULL_TURN: Final = 6.3
"""A full turn in radians, with room for rounding; chosen by hand."""
_FLAGS: Final = {**dict.fromkeys(words("yes"), 1.0), **dict.fromkeys(words("no"), 0.0)}
"""Words of a column that says yes or no, as numbers."""
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
    reading = columns_of(source, options)
    labels = [column.name for column in reading.columns]
    if reading.clock is None:
        if (found := other_order(source, reading, labels)) is not None:
            raise source.error(found)
        if options.frame_rate_hz is None:
            scale = scale_wanted(reading.length_unit, bare_is_si=False, options=options)
            raise source.error(NAME_THE_CLOCK + (f"; {scale}" if scale else ""))
    table = _read(source, reading, labels)
    clock = _clock(table, reading)
    notes = [*reading.notes, *_unread_angles(reading)]
    body = reading.body_column
    if "body" not in options.columns and _numbers_the_rows(table, body, clock):
        notes.append(f"column '{labels[body or 0]}' numbers the rows: one body")
        reading.columns[body or 0].role, reading.body_column = "", None
        reading.columns[body or 0].why = "it numbers the rows"
    codes = None if reading.body_column is None else table.codes[reading.body_column]
    if reading.clock is None:
        alone = codes is None or int(codes.max()) == 0
        clock = clock if alone or codes is None else order_in_body(codes)
        counts = "counts as a frame" if alone else "of a body counts as a frame, from its first on"
        notes.insert(0, f"the table has no column of times or frames: every row {counts}")
    if table.calendar == DAY:
        count_days(clock, codes)
    bodies, against = _bodies(table, reading, clock, options)
    doubts = _doubted_confidences(table, reading, options)
    if codes is not None:
        # From here on the bodies alone hold the columns.
        del clock
        table.numbers.clear()
        bodies = split_bodies(bodies[0], codes, table.labels[reading.body_column or 0])
    on_globe = any("lon" in places for places in reading.bodies.values())
    if on_globe:
        notes.append(on_the_ground(bodies))
    notes += doubts
    plane = next(iter(reading.planes.values()), None)
    bare = reading.bare_clock and bool(reading.numbers)
    return RawRecording(
        bodies=bodies,
        clock_unit=reading.clock_unit if len(reading.numbers) < 2 else "ns",
        clock_origin=table.clock_origin,
        calendar=table.calendar,
        length_unit="m" if on_globe else reading.length_unit,
        angle_unit=reading.angle_unit or "rad",
        bare_clock=labels[reading.numbers[0]] if bare else None,
        bare_angle=not reading.angle_unit and plane is None and reading.parts is None,
        plane="" if plane is None else plane.describe(),
        y_axis="up" if on_globe else "",
        body_columns=partial(body_columns, source, reading, labels),
        # Bare `x, y` next to a time in seconds is SI; next to frame numbers it may be pixels.
        bare_length_is_si=reading.bare and reading.clock_unit != "frame",
        has_confidence=bool(reading.confidences),
        rows=table.rows,
        notes=[*notes, *against],
        columns=[column.described() for column in reading.columns],
    )


def columns_of(source: TableSource, options: ReadOptions) -> TableReading:
    """Return what the columns of a table are, and the planes that bodies are laid into.

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
    if not source.has_header and not options.columns:
        raise source.error(
            f"the table has {len(source.names)} columns and no header: name them with `columns`, "
            'such as `columns={"t": "1", "x": "2", "y": "3"}`' + _detector_advice(source)
        )
    try:
        reading = read_columns(source, options)
        for name, places in reading.bodies.items():
            plane = plane_of_columns(places, options.up)
            if plane is not None and "x" in places:
                reading.planes[name] = plane
        return reading
    except FormatError:
        raise
    except InputError as error:
        raise source.error(str(error)) from error


def _detector_advice(source: TableSource) -> str:
    """Return how to name the columns of rows without a header that are those of a detector."""
    try:
        rows = np.atleast_2d([[float(one) for one in row] for row in source.sample()])
    except ValueError:
        return ""
    width, sides = rows.shape[1], rows[:, 1:5]
    shares = bool(((sides >= 0.0) & (sides <= 1.0)).all())
    if width in (9, 10) and not (rows[:, :2] % 1.0).any() and (rows[:, 4:6] > 0.0).all():
        program = "MOT (frame, identity, left, top, width, height, confidence)"
        names, first, box = "frame body x y w h confidence", 1, "xywh"
    elif width in (5, 6, 7) and shares and not (rows[:, 0] % 1.0).any():
        program = "YOLO (class, centre, size as shares of the image; state its pixels)"
        names, first, box = "x y w h", 2, "cxcywh@1920x1080"
    else:
        return ""
    named = {name: str(at) for at, name in enumerate(names.split(), start=first)}
    return f'; if they are those of {program}, {argument_text("columns", named)} and `box="{box}"`'


def _read(source: TableSource, reading: TableReading, labels: list[str]) -> Table:
    used = {index for places in reading.bodies.values() for index in places.values()}
    used.update(reading.numbers)
    flags = [at for at in reading.confidences if _holds_flags(source, at)]
    body = [] if reading.body_column is None else [reading.body_column]
    texts = tuple(dict.fromkeys([*body, *flags]))
    numbers, clock = tuple(sorted(used - set(texts))), next(iter(reading.numbers), None)
    table = source.read(TableLayout("", labels, 0, numbers, texts, clock, reading.stamps))
    for at, factor in reading.factors.items():
        table.numbers[at] *= factor
    for at in flags:
        said = [label.lower() for label in table.labels[at]]
        if unknown := set(said) - MISSING - set(_FLAGS):
            what = f"'{min(unknown)}' in column '{labels[at]}'"
            raise source.error(f"{what} is neither a yes nor a no")
        marks = np.array([_FLAGS.get(word, np.nan) for word in said])
        table.numbers[at] = marks[table.codes[at]]
    return table


def _holds_flags(source: TableSource, column: int) -> bool:
    """Whether the first values of a column are words for yes and no."""
    found = {row[column].lower() for row in source.sample() if len(row) > column}
    found -= MISSING - set(_FLAGS)
    return bool(found) and found <= set(_FLAGS)


def _clock(table: Table, reading: TableReading) -> Array:
    """Return the clock of all rows; without one every row counts as a frame."""
    if reading.clock is None:
        return np.arange(table.rows, dtype=np.float64)
    clock: Array = table.numbers[reading.clock]
    if len(reading.numbers) == 2:
        # Nanoseconds from the first second on: since 1970 they are beyond float64.
        second, part = reading.numbers
        ticks = CLOCK_UNITS["ns"] / CLOCK_UNITS[reading.columns[part].unit or "ns"]
        known = clock[np.isfinite(clock)]
        origin = float(known[0]) if known.size else 0.0
        unit = CLOCK_UNITS["ns"] / CLOCK_UNITS[reading.columns[second].unit or "s"]
        clock = (clock - origin) * unit + table.numbers[part] * ticks
        table.clock_origin = int((table.clock_origin + int(origin)) * unit)
    return clock


def _unread_angles(reading: TableReading) -> list[str]:
    """Say which columns look like the orientation by their unit alone, where none was found."""
    unread = [column for column in reading.columns if not column.role]
    angles = [column.name for column in unread if column.unit in ANGLE_UNITS]
    if not angles or any({"theta", "qw"} & set(places) for places in reading.bodies.values()):
        return []
    argument = argument_text("columns", {"theta": angles[0]})
    return [f"no orientation is read: add {argument} if that column holds it"]


def _doubted_confidences(table: Table, reading: TableReading, options: ReadOptions) -> list[str]:
    """Say so where `min_confidence` is a share of 1 and the confidences are not."""
    least = options.min_confidence
    for at in reading.confidences:
        known = table.numbers[at][np.isfinite(table.numbers[at])]
        if least is not None and least <= 1.0 and known.size and np.median(known) > 2.0:
            return [
                f"the confidences in column '{reading.columns[at].name}' go up to "
                f"{known.max():.6g}, and {least:g} is compared with these numbers: give "
                "`min_confidence` on their scale"
            ]
    return []


def _numbers_the_rows(table: Table, column: int | None, clock: Array) -> bool:
    """Whether what seems to name the body counts up row by row, over more than one moment."""
    if column is None or table.rows < 3 or len(table.labels[column]) != table.rows:
        return False
    first = table.labels[column][0]
    if not first.isdecimal() or (clock == clock[0]).all():
        return False
    return table.labels[column][1:] == [str(int(first) + at) for at in range(1, table.rows)]


def _bodies(
    table: Table, reading: TableReading, clock: Array, options: ReadOptions
) -> tuple[list[RawBody], list[str]]:
    """Return the bodies that have columns, and what speaks against the planes of these."""
    if reading.body_column is not None and len(reading.bodies) > 1 and reading.parts is None:
        raise FormatError(
            "has several columns of x and also a column that names the body: choose one layout "
            "with `columns`",
        )
    found, notes = {}, []
    for name, places in reading.bodies.items():
        if name in reading.planes:
            body, against = body_in_plane(table.numbers, places, clock, reading.planes[name])
        else:
            body, against = _body(table, reading, places, clock, options)
        body.name = name or "0"
        if "confidence" in places and options.min_confidence is not None:
            body.blank(table.numbers[places["confidence"]] < options.min_confidence)
        found[name] = body
        notes += against
    if reading.parts is not None:
        middle, start, end = (found[name] for name in reading.parts)
        middle.name = "0"
        middle.theta = angle_between((start.x, start.y), (end.x, end.y))
        found = {"": middle}
    return list(found.values()), notes


def _body(
    table: Table,
    reading: TableReading,
    places: dict[str, int],
    clock: Array,
    options: ReadOptions,
) -> tuple[RawBody, list[str]]:
    """Return the body of some columns that lie in one plane, and what is to be said of its box."""
    values, box = table.numbers, reading.box
    theta = values[places["theta"]] if "theta" in places else None
    if box is None:
        x, y = (values[places[axis]] for axis in (("x", "y") if "x" in places else ("lon", "lat")))
        return RawBody("0", clock, x, y, theta), []
    sides = [values[at][np.isfinite(values[at])] for at in box.sides.values()]
    if box.image is not None and any(one.max(initial=0.0) > max(box.image) for one in sides):
        raise FormatError("the sides of the boxes are no shares of an image: leave its size out")
    shares = all(one.size and one.min() >= 0.0 and one.max() <= 1.0 for one in sides)
    if shares and options.metres_per_pixel is not None and not reading.length_unit:
        raise FormatError(
            "the sides of the boxes are between 0 and 1, shares of the image as YOLO writes them: "
            'state its size in pixels, as in `box="cxcywh@1920x1080"`'
        )
    if theta is not None and not reading.angle_unit and (np.abs(theta) > _FULL_TURN).any():
        raise FormatError(
            "the angles of the boxes name no unit, and as radians they exceed a full turn: "
            'name it, as in `columns={"theta": "NAME:deg"}`'
        )
    turn = 2.0 * np.pi / ANGLE_UNITS[reading.angle_unit or "rad"]
    codes = None if reading.body_column is None else table.codes[reading.body_column]
    followed = box_angle(box, values, theta, codes, turn)
    note = "the box looks the same after a half or quarter turn: its angle is unwrapped"
    notes = [note] if theta is not None and followed is not theta else []
    return RawBody("0", clock, *box_centre(box, values), followed), notes


def the_one_that_fits(
    tables: Mapping[str, TableSource], options: ReadOptions, what: str
) -> TableSource:
    """Return the table that the user names, or the only one that holds positions.

    Parameters
    ----------
    tables : mapping
        Tables by their names.
    options : ReadOptions
        `sheet` names one, by its name or its number from 1.
    what : str
        What such a table is called, "sheet" or "variable".

    Raises
    ------
    FormatError
        When there is none, or several.
    """
    if not tables:
        raise FormatError(f"has no {what} that is a table")
    if (wanted := options.sheet) is not None:
        number = int(wanted) if wanted.isdecimal() and wanted not in tables else 0
        if wanted not in tables and not 1 <= number <= len(tables):
            raise FormatError(
                f"{argument_text('sheet', wanted)}: no such {what}; it has {listed(list(tables))}"
            )
        return [*tables.values()][number - 1] if number else tables[wanted]
    if len(tables) == 1:
        return next(iter(tables.values()))
    fitting: list[str] = []
    reasons: list[str] = []
    for name, table in tables.items():
        try:
            columns_of(table, options)
            fitting.append(name)
        except InputError as error:
            reasons.append(error.reason if isinstance(error, FormatError) else str(error))
    if not fitting:
        among = listed(list(tables))
        raise FormatError(f"has no {what} with positions among {among}; {reasons[0]}")
    if len(fitting) > 1:
        choice = argument_text("sheet", fitting[0])
        raise FormatError(
            f"holds positions in more than one {what}, {listed(fitting)}: name it, as in {choice}"
        )
    return tables[fitting[0]]
