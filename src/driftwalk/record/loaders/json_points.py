"""JSON list of points, one per frame: ``[[x, y], ...]`` or ``[{"x": .., "y": ..}, ...]``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.core.files.bounded import MIB
from driftwalk.core.text.json_text import MOST_BYTES, parse_json
from driftwalk.record.raw import Array, RawBody, RawRecording, ReadOptions
from driftwalk.record.text import open_binary

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
        with open_binary(path) as file:
            text = file.read(MOST_BYTES + 1)
        if len(text) > MOST_BYTES:
            raise FormatError(
                f"holds more than {MOST_BYTES / MIB:g} MiB of JSON: store it as CSV, which is read "
                "piece by piece",
                path=path,
            )
        points = parse_json(text, path=path)
        if not isinstance(points, list) or not points:
            raise FormatError("expected a list with one point per frame", path=path)
        rows = np.empty((len(points), len(KEYS)))
        for index, point in enumerate(points):
            rows[index] = _point(point, index, path)
        x, y, theta, t = (np.ascontiguousarray(rows[:, column]) for column in range(4))
        undetected = (x == -1.0) & (y == -1.0)
        x[undetected] = y[undetected] = np.nan
        timed = bool(np.isfinite(t).any())
        clock: Array = t if timed else np.arange(x.size, dtype=np.float64)
        body = RawBody("0", clock, x, y, theta if np.isfinite(theta).any() else None)
        return RawRecording(
            [body], clock_unit="s" if timed else "frame", bare_clock="", rows=x.size
        )


def _point(point: Any, index: int, path: Path) -> list[float]:
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
    if not complete or not all(value is None or _is_number(value) for value in values):
        raise FormatError(
            f'entry {index + 1} is {str(point)[:40]!r}, expected [x, y] or {{"x": .., "y": ..}}',
            path=path,
        )
    try:
        return [np.nan if value is None else float(value) for value in values]
    except OverflowError as error:
        raise FormatError(f"entry {index + 1} is too large for a number", path=path) from error


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


LOADER = JsonPointsLoader()
