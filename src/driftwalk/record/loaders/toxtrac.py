"""ToxTrac text: image space without header (pixels), or real space with one (seconds, mm)."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.cleaning.stacked import split_bodies
from driftwalk.record.column_names import unit_of_name
from driftwalk.record.raw import Marks, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import read_table
from driftwalk.record.text_head import first_lines, first_row, is_numeric_row

NAMES: Final = ["frame", "arena", "track", "x", "y", "label"]
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
        layout = TableLayout("\t", header if real else NAMES, int(real), numbers=tuple(range(6)))
        table = read_table(path, layout)
        clock, arena, track, x, y, label = (table.numbers[column] for column in range(6))
        if not (np.isfinite(arena) & np.isfinite(track)).all():
            raise FormatError("a row names no arena or no track", path=path)
        pairs, codes = np.unique(np.stack([arena, track]), axis=1, return_inverse=True)
        several = np.unique(pairs[0]).size > 1
        labels = [
            f"{place:g}/{number:g}" if several else f"{number:g}"
            for place, number in pairs.T.tolist()
        ]
        bodies = split_bodies(codes.ravel().astype(np.int32), labels, clock=clock, x=x, y=y)
        # Label 0 is a position that was predicted, not seen.
        predicted = int((label == 0.0).sum())
        return RawRecording(
            bodies,
            clock_unit=unit_of_name(header[0]) if real else "frame",
            length_unit=unit_of_name(header[3]) if real else "px",
            y_axis="down",
            rows=table.rows,
            notes=[f"positions that ToxTrac predicted, not seen: {predicted}"] if predicted else [],
        )


def _is_real_space(row: list[str]) -> bool:
    return tuple(name.partition("(")[0].strip() for name in row) == REAL_SPACE


LOADER = ToxTracLoader()
