"""Texts of tracking programs: AnimalTA, DLTdv, smarticles, ToxTrac, UbiTrail, yupi, Kinovea.

DLTdv: ``pt1_cam1_X,pt1_cam1_Y,...``, pixels, one row per frame. Smarticles: eleven columns without
header: sync pulse, time, then x, y, theta of three robots. ToxTrac: image space without header
(pixels), or real space with one (seconds, mm). UbiTrail: a line of R metadata, then
``Area,Territory,X,Y,time,L``; often in gzip. yupi: rows of its settings, then ``x,y,t`` (or
``x,y,z,t``) and what else; version 2 begins with ``v2,N``, N rows before the data, version 1 with
name, interval, dimensions. Kinovea: rows of T X Y, and a line with ``#`` above each track.
Programs with one header line are descriptions for `HeadedFormat`.

AnimalTA: semicolons, pixels, ``Frame;Time`` and the targets. They stand side by side,
``X_Arena0_Ind0;Y_Arena0_Ind0``, where their number is fixed, and stacked, ``Arena;Ind;X;Y``, where
it varies. A target is named by its arena where there are several.
"""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.cleaning.clean import codes_in_arenas, number_codes, split_bodies
from driftwalk.record.cleaning.jumps import PART
from driftwalk.record.column_names import unit_of_name
from driftwalk.record.loaders.json_formats import bounded_text, column_of
from driftwalk.record.loaders.plain import HeadedFormat, described, side_by_side
from driftwalk.record.raw import Array, Marks, RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.tables.in_memory import MemorySource
from driftwalk.record.tables.rows import recording_of
from driftwalk.record.tables.text_source import (
    first_line,
    first_lines,
    first_row,
    is_numeric_row,
    read_header,
)
from driftwalk.record.text import header_rows, read_head, read_table

ANIMALTA: Final = ("Frame", "Time", "Arena", "Ind", "X", "Y")
HALF_DIGIT_S: Final = 0.0051
"""Times are rounded to 0.01 s."""
_PLACE: Final = re.compile(r"(?P<axis>[XY])_Arena(?P<arena>\d+)_(?P<body>.+)")


class AnimalTALoader:
    """Pixels; the frame rate comes of frames and times, which are rounded."""

    name = "animalta"
    description = "AnimalTA coordinates (Frame;Time;X_Arena0_Ind0;... or Frame;Time;Arena;Ind;X;Y)"
    marks = (
        Marks("table", ("Frame", "Time", "X_Arena0_Ind0", "Y_Arena0_Ind0")),
        Marks("table", ANIMALTA),
    )

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        names = first_line(head).split(";")
        beside = names[:2] == ["Frame", "Time"] and any(map(_PLACE.fullmatch, names))
        return 0.95 if beside or tuple(names[:6]) == ANIMALTA else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every target."""
        names, _, skip, _ = read_header(path, delimiter=";")
        if names[:2] != ["Frame", "Time"]:
            raise FormatError("the first columns are not Frame and Time", line=1)
        if tuple(names[:6]) == ANIMALTA:
            table = read_table(path, TableLayout(";", names, skip, (0, 1, 4, 5), (2, 3)))
            targets = table.codes[3], [f"Ind{label}" for label in table.labels[3]]
            named = codes_in_arenas((table.codes[2], table.labels[2]), targets)
            frame, time, x, y = (table.numbers[column] for column in (0, 1, 4, 5))
            bodies = [RawBody("", frame, x, y)]
        else:
            bodies, columns = side_by_side(path, _PLACE, ";")
            frame, time, named = columns["Frame"], columns["Time"], None
        rate = None if options.frame_rate_hz is not None else _rate_of_frames(frame, time)
        timed = rate is None and options.frame_rate_hz is None
        bodies = [replace(one, clock=time if timed else frame) for one in bodies]
        if named is not None:
            bodies = split_bodies(bodies[0], *named)
        return RawRecording(bodies, "s" if timed else "frame", "px", frame_rate_hz=rate)


def _rate_of_frames(frame: Array, time: Array) -> float | None:
    """Return the rate that agrees with all rounded times, None where there is none.

    The whole number that is nearest is taken where it agrees as well: times are short of digits.
    """
    known = np.isfinite(frame) & np.isfinite(time)
    if not known.all():
        frame, time = frame[known], time[known]
    if frame.size < 2 or np.ptp(time) <= 0.0:
        return None
    exact = float(np.ptp(frame) / np.ptp(time))
    if exact * 2 * HALF_DIGIT_S > 0.5 * np.ptp(time):
        return None  # too short a recording: several whole numbers agree
    parts = [slice(start, start + PART) for start in range(0, time.size, PART)]
    for rate in filter(None, (float(round(exact)), exact)):
        apart = (time[part] - time[0] - (frame[part] - frame[0]) / rate for part in parts)
        if all((np.abs(one) < 2 * HALF_DIGIT_S).all() for one in apart):
            return rate
    return None


_DLTDV = re.compile(r"(?P<body>pt\d+_cam\d+)_(?P<axis>[XY])", re.IGNORECASE)


class DltdvLoader:
    """Points seen by a camera. Versions differ in the direction of y: taken as an image's, down."""

    name = "dltdv"
    description = "DLTdv xypts.csv (pt1_cam1_X, pt1_cam1_Y, ...; pixels, no clock)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        return 0.95 if _DLTDV.match(first_line(head).lstrip('"')) else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every point of every camera as a body."""
        bodies, _ = side_by_side(path, _DLTDV)
        notes = [
            'DLTdv versions differ in the direction of y: if yours counts up, add `y_axis="up"`'
        ]
        return RawRecording(bodies, length_unit="px", notes=notes)


SMARTICLES = ["sync", "t", *(f"{name}{at}" for at in (1, 2, 3) for name in ("x", "y", "theta"))]
"""Columns of the robots' file, which has no header."""


class SmarticlesLoader:
    """Seconds, pixels and unwrapped radians of three robots side by side."""

    name = "smarticles"
    description = "smarticle CSV (sync, t, then x, y, theta of three robots; pixels, no header)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise eleven numbers of which the second grows and the positions are pixels."""
        rows = [line.split(",") for line in first_lines(head)]
        if len(rows) < 2 or not all(len(row) == 11 and is_numeric_row(row) for row in rows):
            return 0.0
        try:
            times = [float(row[1]) for row in rows]
            pixels = [float(row[index]) for row in rows for index in (2, 3, 5, 6, 8, 9)]
        except ValueError:
            return 0.0
        grows = all(later > earlier for earlier, later in pairwise(times))
        return 0.8 if grows and min(pixels) > 1.0 else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the three robots."""
        layout = TableLayout(options.delimiter or ",", SMARTICLES)
        own = {"bare_clock": "", "separate": True, "length_unit": "px"}
        return described(path, options, {}, layout, **own)


TOXTRAC: Final = ["frame", "arena", "track", "x", "y", "label"]
REAL_SPACE: Final = ("Time", "Arena", "Track", "Pos. X", "Pos. Y", "Label")
"""Names of the columns in real space; units follow in brackets."""


class ToxTracLoader:
    """One row per frame and track; a body is a track, or arena/track where there are arenas."""

    name = "toxtrac"
    description = "ToxTrac text (frame or time, arena, track, x, y, label; tabs; pixels or mm)"
    marks = (
        Marks("table", ("Time (sec)", "Arena", "Track", "Pos. X (mm)", "Pos. Y (mm)", "Label")),
    )

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header of real space, or six numbers of which four are whole."""
        rows = [line.split("\t") for line in first_lines(head)]
        if rows and _is_real_space(rows[0]):
            return 0.95
        if not rows or any(len(row) != 6 or not is_numeric_row(row) for row in rows):
            return 0.0
        whole = all(row[index].strip().isdecimal() for row in rows for index in (0, 1, 2, 5))
        return 0.9 if whole else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every track."""
        header = first_row(path, "\t")
        real = _is_real_space(header)
        layout = TableLayout("\t", header if real else TOXTRAC, int(real), numbers=tuple(range(6)))
        table = read_table(path, layout)
        clock, arena, track, x, y, label = (table.numbers[column] for column in range(6))
        if not (np.isfinite(arena) & np.isfinite(track)).all():
            raise FormatError("a row names no arena or no track")
        codes, labels = codes_in_arenas(number_codes(arena), number_codes(track))
        bodies = split_bodies(RawBody("", clock, x, y), codes, labels)
        # Label 0 is a position that was predicted, not seen.
        predicted = int((label == 0.0).sum())
        note = f"positions that ToxTrac predicted, not seen: {predicted}"
        units = [unit_of_name(header[at]) for at in (0, 3)] if real else ["frame", "px"]
        notes = [note] if predicted else []
        return RawRecording(bodies, units[0], units[1], y_axis="down", notes=notes)


def _is_real_space(row: list[str]) -> bool:
    return tuple(name.partition("(")[0].strip() for name in row) == REAL_SPACE


UBITRAIL = ["Area", "Territory", "X", "Y", "time", "L"]
_AREAS = re.compile(
    r"Areas=matrix\(c\(([\d.,\s-]+)\),4,\d+,dimname=list\(c\([^)]*\),c\(([^)]*)\)\)\)"
)


class UbiTrailLoader:
    """One body per area. X and Y count widths of the area, which the metadata give in pixels."""

    name = "ubitrail"
    description = "UbiTrail CSV (R metadata, then Area,Territory,X,Y,time,L; time in ms)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the second line."""
        lines = first_lines(head, 2)
        return 0.95 if len(lines) == 2 and lines[1].split(",") == UBITRAIL else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every area and turn widths of the area into pixels."""
        widths = _area_widths(path)
        columns = {"t": "time:ms", "x": "X", "y": "Y", "body": "Area"}
        # An area is a body. The clock, of a video's file, often says the same of two frames.
        own = {"length_unit": "px", "separate": True, "attrs": {"bodies_apart": "yes"}}
        raw = described(path, options, columns, TableLayout(",", UBITRAIL, 2), **own)
        for body in raw.bodies:
            if body.name not in widths:
                raise FormatError(f"the metadata give no width for area {body.name}", line=1)
            with np.errstate(over="ignore"):  # an infinite position is a gap
                body.x, body.y = (axis * widths[body.name] for axis in (body.x, body.y))
        return raw


def _area_widths(path: Path) -> dict[str, float]:
    """Return the width of each area in pixels, from the first line."""
    match = _AREAS.search(first_line(read_head(path)))
    if match is None:
        raise FormatError("the metadata hold no matrix of areas (W, H, X, Y)", line=1)
    try:
        numbers = [float(text) for text in match.group(1).split(",")]
    except ValueError as error:
        raise FormatError(f"the matrix of areas is damaged: {error}", line=1) from error
    names = [text.strip().strip('"') for text in match.group(2).split(",")]
    return dict(zip(names, numbers[::4], strict=False))


class YupiLoader:
    """One body; seconds, and no unit of length."""

    name = "yupi"
    description = "yupi CSV, versions 1 and 2 (settings, then x, y, t; no unit of length)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the rows of settings."""
        rows = [split_fields(line, ",") for line in first_lines(head, 4)]
        if rows and rows[0][0] == "v2" and len(rows[0]) == 2 and rows[0][1].isdecimal():
            return 0.95
        known = (
            len(rows) > 2
            and [len(row) for row in rows[:2]] == [3, 3]
            and rows[0][2] in ("2", "3")
            and all(field.isdecimal() for field in rows[1])
            and all(len(row) == 1 + int(rows[0][2]) for row in rows[2:])
            and not is_number(rows[0][0])
        )
        return 0.9 if known else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the trajectory."""
        rows = [split_fields(line, ",") or [""] for line in header_rows(path, 20)]
        second = bool(rows) and rows[0][0] == "v2"
        try:
            skip = int(rows[0][1]) if second else 2
            name, _, dimensions = rows[1 if second else 0]
            axes = "xyz"[: int(dimensions)]
            further = rows[5] if second else []
        except (ValueError, IndexError) as error:
            raise FormatError(f"the rows of settings are damaged: {error}") from error
        if len(axes) < 2:
            raise FormatError(f"has {len(axes)} dimensions, and a path in the plane needs two")
        names = [*axes, "t", *(one for one in further if one)]
        columns = {"t": "t:s", "x": "x", "y": "y"}
        layout = TableLayout(",", names, skip)
        raw = described(path, options, columns, layout, bare_clock="", length_unit="")
        raw.bodies[0].name = name or "0"
        return raw


_KINOVEA: Final = b"#Kinovea Trajectory"
_HUNDREDTHS: Final = re.compile(r"(\d+:\d\d:\d\d):(\d\d\d?)")


class KinoveaLoader:
    """Each track is a body; a number as time has the unit that was chosen in Kinovea.

    Until 2019 its times were ``h:mm:ss:cc``, and ``h:mm:ss:mmm`` above 100 frames per second
    (``TimeHelper.MillisecondsToTimecode`` of Kinovea 0.8), so the last part counts no frames.
    """

    name = "kinovea"
    description = "Kinovea text of trajectories (T X Y; h:mm:ss:cc; no unit of length)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the first line."""
        return 0.95 if head.startswith(_KINOVEA) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every track."""
        rows: list[list[str]] = []
        track, known = "", set[str]()
        again: dict[str, int] = defaultdict(lambda: 1)
        for number, line in enumerate(bounded_text(path).decode("utf-8", "replace").split("\n"), 1):
            fields = line.split()
            if line.startswith("#"):  # several tracks may have one name
                name = line.strip("# \r")
                # The first of a name has no number.
                while (track := f"{name} {again[name]}".removesuffix(" 1")) in known:
                    again[name] += 1
            elif len(fields) == 3:
                rows.append([_HUNDREDTHS.sub(r"\1.\2", fields[0]), *fields[1:], track])
                known.add(track)
            elif fields:
                raise FormatError(f"expected T X Y, got {len(fields)} fields", line=number)
        columns = [column_of([*column]) for column in zip(*rows, strict=True)] or [np.zeros(0)] * 4
        raw = recording_of(MemorySource("the tracks", ["t", "x", "y", "body"], columns), options)
        return replace(raw, bare_length_is_si=False, y_axis="up")


LOADERS = (
    HeadedFormat(
        name="tracktor",
        description="Tracktor CSV (frame, pos_x, pos_y[, id]; pixels)",
        header=("", "frame", "pos_x", "pos_y"),
        columns={"frame": "frame", "x": "pos_x", "y": "pos_y", "body": "id"},
        length_unit="px",
    ),
    HeadedFormat(
        name="traja",
        description="traja CSV (Frame, Time, TrackId, x, y; seconds, no unit of length)",
        header=("Frame", "Time", "TrackId", "x", "y"),
        columns={"t": "Time:s", "x": "x", "y": "y", "body": "TrackId"},
    ),
    AnimalTALoader(),
    DltdvLoader(),
    SmarticlesLoader(),
    ToxTracLoader(),
    UbiTrailLoader(),
    YupiLoader(),
    KinoveaLoader(),
)
