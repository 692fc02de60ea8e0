"""JSON: points, an object per line and sample, boxes of COCO; and folders of YOLO's text files."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.text_files import MIB, MOST_JSON_BYTES, parse_json
from driftwalk.record.bad_row import is_number
from driftwalk.record.raw import Array, RawBody, RawRecording, ReadOptions
from driftwalk.record.tables.in_memory import MemorySource, objects
from driftwalk.record.tables.rows import recording_of
from driftwalk.record.text import header_rows, open_binary
from driftwalk.record.unit_and_column_words import words

_MOST_NUMBERS: Final = 16
"""Length of a list up to which each of its numbers becomes a column; chosen by hand."""
_POINTS: Final = words("points")


class JsonPointsLoader:
    """One body, one point a frame; ``null`` and ``[-1, -1]`` are frames without a detection."""

    name = "json"
    description = "JSON list of points, one per frame ([-1, -1] and null: not detected)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise a list of lists or of objects."""
        start = head[:64].translate(None, b" \t\r\n")
        return 0.9 if start.startswith((b"[[", b"[{", b"[null")) else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read the points. Objects may have ``t`` [s] and ``theta`` [rad]."""
        points = parse_json(bounded_text(path), path=path)
        if not isinstance(points, list) or not points:
            raise FormatError("expected a list with one point per frame")
        rows = np.array([_point(point, index) for index, point in enumerate(points)])
        x, y, theta, t = np.ascontiguousarray(rows.T)
        undetected = (x == -1.0) & (y == -1.0)
        x[undetected] = y[undetected] = np.nan
        timed = bool(np.isfinite(t).any())
        clock: Array = t if timed else np.arange(x.size, dtype=np.float64)
        body = RawBody("0", clock, x, y, theta if np.isfinite(theta).any() else None)
        return RawRecording([body], clock_unit="s" if timed else "frame", bare_clock="")


def bounded_text(path: Path) -> bytes:
    """Return the contents of a file, or refuse more than JSON is read of."""
    with open_binary(path) as file:
        text = file.read(MOST_JSON_BYTES + 1)
    if len(text) > MOST_JSON_BYTES:
        raise FormatError(
            f"holds more than {MOST_JSON_BYTES / MIB:g} MiB of JSON: store it as CSV, which is "
            "read piece by piece"
        )
    return text


def _point(point: Any, index: int) -> list[float]:
    """Return (x, y, theta, t) of one entry, NaN for what it does not have."""
    if point is None:
        return [np.nan] * 4
    values: list[Any] = []
    if isinstance(point, dict) and {"x", "y"} <= set(point):
        values = [point.get(key) for key in ("x", "y", "theta", "t")]
    elif isinstance(point, list) and 2 <= len(point) <= 3:
        values = [*point, None, None][:4]
    if not values or not _numbers(values) or any(isinstance(one, bool) for one in values):
        raise FormatError(
            f'entry {index + 1} is {str(point)[:40]!r}, expected [x, y] or {{"x": .., "y": ..}}'
        )
    return [np.nan if value is None else float(value) for value in values]


class JsonLinesLoader:
    """Keys are read as the names of columns; ``pose.x`` for an x inside a pose."""

    name = "jsonl"
    description = "JSON lines, one object per sample (keys as the columns of a plain table)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise an object in the first line, and none that goes on in the second."""
        first, *rest = head.split(b"\n")
        if rest and rest[0].strip() and not rest[0].lstrip().startswith(b"{"):
            return 0.0
        try:
            return 0.6 if isinstance(json.loads(first), dict) else 0.0
        except (ValueError, RecursionError):
            return 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the lines; a list of objects in one makes a row of each, for several bodies."""
        rows: list[dict[str, Any]] = []
        for number, line in enumerate(bounded_text(path).splitlines(), start=1):
            if not line.strip():
                continue
            try:
                entry = parse_json(line, path=path)
            except FormatError as error:
                raise FormatError(error.reason, line=number) from error
            if not isinstance(entry, dict):
                raise FormatError("expected an object in each line", line=number)
            rows += _rows(entry, number)
        names = list(dict.fromkeys(name for row in rows for name in row))
        columns = [column_of([row.get(name) for row in rows]) for name in names]
        return recording_of(MemorySource("the lines", names, columns), options)


def _rows(entry: dict[str, Any], number: int) -> list[dict[str, Any]]:
    """Return a line as rows: one, or one for each object of the list that it holds."""
    flat = _flat(entry)
    lists = {
        name: value
        for name, value in flat.items()
        if isinstance(value, list) and all(isinstance(one, dict) for one in value)
    }
    if len(lists) > 1:
        raise FormatError(f"holds several lists of objects: {', '.join(lists)}", line=number)
    shared = {name: value for name, value in flat.items() if not isinstance(value, list)}
    inner: list[dict[str, Any]] = next(iter(lists.values()), [{}])
    return [shared | _flat(one) for one in inner]


def _numbers(value: list[Any]) -> bool:
    return all(one is None or isinstance(one, int | float) for one in value)


def _flat(entry: dict[str, Any], before: str = "") -> dict[str, Any]:
    """Return the values of an object, those inside, and numbers of a list, with their path."""
    found: dict[str, Any] = {}
    for name, value in entry.items():
        if isinstance(value, list) and 1 < len(value) <= _MOST_NUMBERS and _numbers(value):
            axes = "xyz" if len(value) < 4 and name.lower() in _POINTS else range(len(value))
            value = {str(axis): one for axis, one in zip(axes, value, strict=False)}
        if isinstance(value, dict):
            found |= _flat(value, f"{before}{name}.")
        else:
            found[f"{before}{name}"] = value
    return found


def column_of(values: list[Any]) -> np.ndarray[Any, Any]:
    """Return numbers as float64, NaN where one is missing; whole ones and words as they are."""
    if all(isinstance(one, int) and abs(one) < 1 << 63 for one in values):
        return np.array(values, dtype=np.int64)
    if _numbers(values):
        return np.array([np.nan if one is None else float(one) for one in values])
    return objects(values)


_NAMES: Final = ("frame", "class", "x", "y", "w", "h", "confidence", "track_id")
_IDENTITY: Final = ("track_id", "instance_id", "object_id")
_NUMBER: Final = re.compile(r"\d+$")
_MOST_BOXES: Final = 10_000
"""Boxes of one frame at most; chosen by hand."""


class CocoLoader:
    """The number at the end of an image's name is its frame, else its id."""

    name = "coco"
    description = "COCO JSON, annotations or results (boxes; pixels, no clock)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the keys of images, or of results."""
        start = head[:64].translate(None, b" \t\r\n")
        whole = start.startswith(b"{") and b'"images"' in head and b'"file_name"' in head
        return 0.95 if whole or (start.startswith(b"[{") and b'"bbox"' in head) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every box."""
        found = parse_json(bounded_text(path), path=path)
        whole = isinstance(found, dict)
        try:
            images = found["images"] if whole else []
            frames = _frames({one["id"]: Path(one["file_name"]).stem for one in images})
            rows = [
                [
                    frames.get(one["image_id"], one["image_id"]),
                    one.get("category_id"),
                    *map(float, one["bbox"]),
                    one.get("score"),
                    next((one[name] for name in _IDENTITY if name in one), None),
                ]
                for one in (found["annotations"] if whole else found)
            ]
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise FormatError(f"is no COCO JSON of boxes: {error!r}") from error
        return _recording(rows, "the boxes", replace(options, box="xywh"))


class YoloFolderLoader:
    """Rows of class, centre and size as shares of the image; confidence and identity may follow."""

    name = "yolo"
    description = "folder of YOLO text files, one a frame (`box` states the size of the image)"

    def sniff(self, _head: bytes, path: Path) -> float:
        """Recognise the shares in one of the first files."""
        try:
            files = _files(path)[:100] if path.is_dir() else []
            return 0.5 if any(_shares("".join(header_rows(file, 1))) for file in files) else 0.0
        except FormatError:
            return 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the files in the order of their numbers."""
        if options.box is None:
            raise InputError(
                "the boxes are shares of the image, and the files do not hold its size: state it "
                'in pixels, as in `box="cxcywh@1920x1080"`'
            )
        frames = _frames({file: file.stem for file in _files(path)})
        if not frames:
            raise FormatError("the names of its files do not end in numbers of frames")
        rows = []
        for file, frame in frames.items():
            for number, line in enumerate(header_rows(file, _MOST_BOXES), start=1):
                row = _shares(line)
                if line.strip() and not row:
                    what = "expected class, centre x and y, width, height as shares of the image"
                    raise FormatError(what, path=file, line=number)
                if row:
                    rows.append([frame, *row])
        sixth = [row[6] for row in rows if row[6] is not None]
        if all(row[7] is None for row in rows) and any(one > 1.0 for one in sixth):
            rows = [[*row[:6], None, row[6]] for row in rows]  # tracked, without confidences
        return _recording(rows, "the folder", options)


def _files(folder: Path) -> list[Path]:
    """Return the files of the frames in a folder, without that of the names of classes."""
    return sorted(one for one in folder.glob("*.txt") if one.name != "classes.txt")


def _shares(line: str) -> list[float | None]:
    """Return class, shares, confidence and identity of a row; nothing of any other text."""
    fields = line.split()
    if not 5 <= len(fields) <= 7 or not all(map(is_number, fields)):
        return []
    row = [float(field) for field in fields]
    return [*row, *[None] * (7 - len(row))] if all(0.0 <= one <= 1.0 for one in row[1:5]) else []


def _frames(names: dict[Any, str]) -> dict[Any, int]:
    """Return the numbers at the ends of names, none where they are not all different."""
    found = {key: int(end[0]) for key, name in names.items() if (end := _NUMBER.search(name))}
    return found if len(set(found.values())) == len(names) else {}


def _recording(rows: list[list[Any]], what: str, options: ReadOptions) -> RawRecording:
    """Return the recording of rows of `_NAMES`, in the order of their frames."""
    if any(len(row) != len(_NAMES) for row in rows) or not rows:
        raise FormatError("has no boxes of four numbers")
    rows.sort(key=lambda row: float(row[0]))
    columns = dict(zip(_NAMES, zip(*rows, strict=True), strict=True))
    known = {name: column_of([*one]) for name, one in columns.items() if one.count(None) < len(one)}
    raw = recording_of(MemorySource(what, [*known], [*known.values()]), options)
    return replace(raw, length_unit="px")


LOADERS = (JsonPointsLoader(), JsonLinesLoader(), CocoLoader(), YoloFolderLoader())
