"""ToxTrac text: tab-separated without header ``frame, arena, track, x, y, label``, pixels."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from driftwalk.record.head import first_lines, is_numeric_row
from driftwalk.record.layout import TableLayout
from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.stacked import split_bodies
from driftwalk.record.text import read_table

NAMES = ["frame", "arena", "track", "x", "y", "label"]


class ToxTracLoader:
    """One row per frame and track; a body is a track, or arena/track where there are arenas."""

    name = "toxtrac"
    description = "ToxTrac text (frame, arena, track, x, y, label; tabs, no header, pixels)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise six tab-separated numbers of which four are whole."""
        rows = [line.split("\t") for line in first_lines(head)]
        if not rows or any(len(row) != 6 or not is_numeric_row(row) for row in rows):
            return 0.0
        whole = all(row[index].strip().isdecimal() for row in rows for index in (0, 1, 2, 5))
        return 0.9 if whole else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every track."""
        table = read_table(path, TableLayout("\t", NAMES, numbers=(0, 1, 2, 3, 4)))
        frame, arena, track, x, y = (table.numbers[column] for column in range(5))
        pairs, codes = np.unique(np.stack([arena, track]), axis=1, return_inverse=True)
        several = np.unique(pairs[0]).size > 1
        labels = [
            f"{place:g}/{number:g}" if several else f"{number:g}"
            for place, number in pairs.T.tolist()
        ]
        bodies = split_bodies(codes.ravel().astype(np.int32), labels, clock=frame, x=x, y=y)
        return RawRecording(bodies, length_unit="px", rows=table.rows)


LOADER = ToxTracLoader()
