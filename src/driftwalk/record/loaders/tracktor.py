"""Tracktor CSV: ``,frame,pos_x,pos_y[,id]``, pixels."""

from __future__ import annotations

from pathlib import Path

from driftwalk.record.cleaning.stacked import split_bodies
from driftwalk.record.raw import RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import read_table
from driftwalk.record.text_head import first_lines, read_header


class TracktorLoader:
    """Frame numbers and pixels; several bodies are stacked and named by the last column."""

    name = "tracktor"
    description = "Tracktor CSV (frame, pos_x, pos_y[, id]; pixels)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        lines = first_lines(head, 1)
        header = lines[0].replace('"', "") if lines else ""
        return 0.95 if header in (",frame,pos_x,pos_y", ",frame,pos_x,pos_y,id") else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every body."""
        names, delimiter, skip, _ = read_header(path)
        layout = TableLayout(delimiter, names, skip, (1, 2, 3), (4,) if len(names) > 4 else ())
        table = read_table(path, layout)
        frame, x, y = (table.numbers[column] for column in (1, 2, 3))
        bodies = (
            split_bodies(table.codes[4], table.labels[4], clock=frame, x=x, y=y)
            if layout.texts
            else [RawBody("0", frame, x, y)]
        )
        return RawRecording(bodies, length_unit="px", rows=table.rows)


LOADER = TracktorLoader()
