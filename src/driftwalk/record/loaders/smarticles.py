"""Smarticle CSV: eleven columns without header: sync pulse, time, then x, y, theta of 3 robots."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import read_table
from driftwalk.record.text_head import first_lines, is_numeric_row, read_header

NAMES = ["sync", "t", *(f"{name}{robot}" for robot in range(1, 4) for name in ("x", "y", "theta"))]


class SmarticlesLoader:
    """Seconds, pixels and unwrapped radians of three robots side by side."""

    name = "smarticles"
    description = "smarticle CSV (sync, t, then x, y, theta of three robots; pixels, no header)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise eleven numbers of which the second grows and the positions are pixels."""
        rows = [line.split(",") for line in first_lines(head)]
        if len(rows) < 2 or any(len(row) != len(NAMES) or not is_numeric_row(row) for row in rows):
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
        names, delimiter, skip, has_header = read_header(path, delimiter=options.delimiter)
        if has_header or len(names) != len(NAMES):
            raise FormatError("expected eleven columns without a header", path=path, line=1)
        table = read_table(path, TableLayout(delimiter, NAMES, skip, tuple(range(1, len(NAMES)))))
        bodies = [
            RawBody(
                str(robot + 1),
                table.numbers[1],
                *(table.numbers[2 + 3 * robot + offset] for offset in range(3)),
            )
            for robot in range(3)
        ]
        return RawRecording(
            bodies, clock_unit="s", bare_clock="", separate=True, length_unit="px", rows=table.rows
        )


LOADER = SmarticlesLoader()
