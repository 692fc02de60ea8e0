"""idTracker (2014) text: tab-separated ``X1 Y1 ProbId1 X2 ...``, pixels, one row per frame."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import read_table
from driftwalk.record.text_head import first_lines, read_header

_HEADER = re.compile(r"X1\s+Y1\s+ProbId1\b", re.ASCII)


class IdTrackerLoader:
    """Positions in pixels without a clock: the frame rate and the scale have to be given."""

    name = "idtracker"
    description = "idTracker trajectories.txt (X1 Y1 ProbId1 ..., pixels, no clock)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        lines = first_lines(head, 1)
        return 0.95 if lines and _HEADER.match(lines[0]) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every individual; ``ProbId`` -1 and -2 mark positions that idTracker estimated."""
        names, delimiter, skip, _ = read_header(path, delimiter=options.delimiter)
        places = {name: index for index, name in enumerate(names)}
        individuals = [
            name[1:] for name in names if re.fullmatch(r"X\d+", name) and f"Y{name[1:]}" in places
        ]
        if not individuals:
            raise FormatError("no columns X1, Y1 as idTracker writes them", path=path, line=skip)
        table = read_table(path, TableLayout(delimiter, names, skip, tuple(range(len(names)))))
        frame = np.arange(table.rows, dtype=np.float64)
        bodies = [
            RawBody(
                name, frame, table.numbers[places[f"X{name}"]], table.numbers[places[f"Y{name}"]]
            )
            for name in individuals
        ]
        estimated = sum(
            int((table.numbers[places[f"ProbId{name}"]] < 0).sum())
            for name in individuals
            if f"ProbId{name}" in places
        )
        notes = (
            [f"{estimated} positions were estimated by idTracker, not seen"] if estimated else []
        )
        return RawRecording(bodies, length_unit="px", rows=table.rows, notes=notes)


LOADER = IdTrackerLoader()
