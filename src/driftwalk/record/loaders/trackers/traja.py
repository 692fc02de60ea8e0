"""Table of a video tracker as traja's tests have it: ``Frame,Time,TrackId,x,y,ValueChanged``."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import split_fields
from driftwalk.record.cleaning.stacked import split_bodies
from driftwalk.record.raw import Marks, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import read_table
from driftwalk.record.text_head import first_lines, first_row

NEEDED: Final = ("Frame", "Time", "TrackId", "x", "y")


class TrajaLoader:
    """Seconds; the file does not say the unit of its positions."""

    name = "traja"
    description = "traja CSV (Frame, Time, TrackId, x, y; seconds, no unit of length)"
    marks = (Marks("table", NEEDED),)

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        lines = first_lines(head, 1)
        return 0.95 if lines and tuple(split_fields(lines[0], ",")[:5]) == NEEDED else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every track."""
        names = first_row(path)
        if tuple(names[:5]) != NEEDED:
            raise FormatError(f"the first columns are not {', '.join(NEEDED)}", path=path, line=1)
        table = read_table(path, TableLayout(",", names, 1, (1, 3, 4), (2,)))
        time, x, y = (table.numbers[column] for column in (1, 3, 4))
        bodies = split_bodies(table.codes[2], table.labels[2], clock=time, x=x, y=y)
        return RawRecording(bodies, clock_unit="s", rows=table.rows)


LOADER = TrajaLoader()
