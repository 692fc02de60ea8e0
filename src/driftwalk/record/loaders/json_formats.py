"""JSON: a list of points, one per frame, and lines with an object per sample."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.core.files.bounded import MIB
from driftwalk.core.text.json_text import MOST_BYTES, parse_json
from driftwalk.record.raw import Array, RawBody, RawRecording, ReadOptions
from driftwalk.record.tables.in_memory import MemorySource, objects
from driftwalk.record.tables.rows import recording_of
from driftwalk.record.text import open_binary
from driftwalk.record.vocabulary import words

_MOST_NUMBERS: Final = 16
"""Length of a list up to which each of its numbers becomes a column; chosen by hand."""
_POINTS: Final = words("points")

KEYS = ("x", "y", "theta", "t")


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
        rows = np.empty((len(points), len(KEYS)))
        for index, point in enumerate(points):
            rows[index] = _point(point, index)
        x, y, theta, t = (np.ascontiguousarray(rows[:, column]) for column in range(4))
        undetected = (x == -1.0) & (y == -1.0)
        x[undetected] = y[undetected] = np.nan
        timed = bool(np.isfinite(t).any())
        clock: Array = t if timed else np.arange(x.size, dtype=np.float64)
        body = RawBody("0", clock, x, y, theta if np.isfinite(theta).any() else None)
        return RawRecording([body], clock_unit="s" if timed else "frame", bare_clock="")


def bounded_text(path: Path) -> bytes:
    """Return the contents of a file, or refuse more than JSON is read of."""
    with open_binary(path) as file:
        text = file.read(MOST_BYTES + 1)
    if len(text) > MOST_BYTES:
        raise FormatError(
            f"holds more than {MOST_BYTES / MIB:g} MiB of JSON: store it as CSV, which is read "
            "piece by piece"
        )
    return text


def _point(point: Any, index: int) -> list[float]:
    """Return (x, y, theta, t) of one entry, NaN for what it does not have."""
    if point is None:
        return [np.nan] * 4
    if isinstance(point, dict):
        values = [point.get(key) for key in KEYS]
        complete = "x" in point and "y" in point
    elif isinstance(point, list):
        values = [*point, None, None][:4]
        complete = 2 <= len(point) <= 3
    else:
        values, complete = [], False
    if not complete or not _numbers(values) or any(isinstance(one, bool) for one in values):
        raise FormatError(
            f'entry {index + 1} is {str(point)[:40]!r}, expected [x, y] or {{"x": .., "y": ..}}'
        )
    try:
        return [np.nan if value is None else float(value) for value in values]
    except OverflowError as error:
        raise FormatError(f"entry {index + 1} is too large for a number") from error


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
    lists = [
        name
        for name, value in flat.items()
        if isinstance(value, list) and all(isinstance(one, dict) for one in value)
    ]
    if len(lists) > 1:
        raise FormatError(f"holds several lists of objects: {', '.join(lists)}", line=number)
    shared = {name: value for name, value in flat.items() if not isinstance(value, list)}
    if not lists:
        return [shared]
    return [{**shared, **_flat(one)} for one in flat[lists[0]]]


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


LOADERS = (JsonPointsLoader(), JsonLinesLoader())
