"""DLTdv digitising CSV: ``pt1_cam1_X,pt1_cam1_Y,...``, pixels, one row per frame."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import read_table
from driftwalk.record.text_head import first_lines, read_header

_COLUMN = re.compile(r"(pt\d+_cam\d+)_X", re.IGNORECASE)


class DltdvLoader:
    """Points seen by a camera. Versions differ in the direction of y: taken as an image's, down."""

    name = "dltdv"
    description = "DLTdv xypts.csv (pt1_cam1_X, pt1_cam1_Y, ...; pixels, no clock)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        lines = first_lines(head, 1)
        return 0.95 if lines and _COLUMN.match(lines[0].lstrip('"')) else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every point of every camera as a body."""
        names, delimiter, skip, _ = read_header(path)
        lower = [name.lower() for name in names]
        points = [match.group(1) for name in names if (match := _COLUMN.fullmatch(name))]
        missing = [point for point in points if f"{point}_y".lower() not in lower]
        if missing or not points:
            raise FormatError(f"no column of y for {missing or 'any point'}", path=path, line=skip)
        table = read_table(path, TableLayout(delimiter, names, skip, tuple(range(len(names)))))
        frame = np.arange(table.rows, dtype=np.float64)
        bodies = [
            RawBody(
                point,
                frame,
                table.numbers[lower.index(f"{point}_x".lower())],
                table.numbers[lower.index(f"{point}_y".lower())],
            )
            for point in points
        ]
        notes = [
            'DLTdv versions differ in the direction of y: if yours counts up, add `y_axis="up"`'
        ]
        return RawRecording(bodies, length_unit="px", rows=table.rows, notes=notes)


LOADER = DltdvLoader()
