"""TrackMate's spots as CSV: names, titles, short titles and units in four rows, then the spots.

Before version 7 there was one row of names, and no units.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.cleaning.stacked import number_codes, split_bodies
from driftwalk.record.column_names import unit_of_name
from driftwalk.record.raw import LENGTH_UNITS, Marks, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import header_rows, read_table
from driftwalk.record.text_head import first_lines

NEEDED: Final = ("TRACK_ID", "POSITION_X", "POSITION_Y", "POSITION_T", "FRAME")
OUTSIDE: Final = "spots outside the tracks, left out: {}"


class TrackMateLoader:
    """One body per track, in the unit of the image."""

    name = "trackmate"
    description = "TrackMate spots CSV (TRACK_ID, POSITION_X, ...; units in the fourth row)"
    marks = (Marks("table", NEEDED),)

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the names of the spots' columns."""
        lines = first_lines(head, 1)
        names = set(split_fields(lines[0], ",")) if lines else set()
        return 0.95 if {"TRACK_ID", "POSITION_X", "POSITION_Y"} <= names else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every track; `frame_rate` counts frames in place of the file's times."""
        rows = [split_fields(line, ",") for line in header_rows(path, 5)]
        names = rows[0] if rows else []
        missing = [name for name in NEEDED if name not in names]
        if missing:
            raise FormatError(
                f"no column {', '.join(missing)} as TrackMate has it", path=path, line=1
            )
        places = {name: names.index(name) for name in NEEDED}
        header = _rows_of_header(rows, places["POSITION_X"])
        units = rows[3] if header == 4 and len(rows[3]) == len(names) else [""] * len(names)
        length = stated_unit(units[places["POSITION_X"]], path)
        timed = _is_timed(units[places["POSITION_T"]], options)
        clock = "POSITION_T" if timed else "FRAME"
        wanted = {name: places[name] for name in ("TRACK_ID", "POSITION_X", "POSITION_Y", clock)}
        layout = TableLayout(",", names, header, tuple(sorted(wanted.values())))
        table = read_table(path, layout)
        track, x, y, time = (table.numbers[place] for place in wanted.values())
        inside = np.isfinite(track)
        if not inside.any():
            raise FormatError("no spot belongs to a track", path=path)
        codes, labels = number_codes(track[inside])
        bodies = split_bodies(codes, labels, clock=time[inside], x=x[inside], y=y[inside])
        outside = int((~inside).sum())
        return RawRecording(
            bodies,
            clock_unit=unit_of_name(f"t {units[places['POSITION_T']]}") if timed else "frame",
            length_unit=length,
            y_axis="down",
            rows=table.rows,
            notes=[OUTSIDE.format(outside)] if outside else [],
        )


def _rows_of_header(rows: list[list[str]], place: int) -> int:
    """Return how many rows there are before the first spot."""
    for at, row in enumerate(rows[1:], start=1):
        if place < len(row) and is_number(row[place]):
            return at
    return len(rows)


def _is_timed(unit: str, options: ReadOptions) -> bool:
    """Whether the times of the file are used, and not its frames."""
    return options.frame_rate_hz is None and unit_of_name(f"t {unit}") in ("s", "ms", "us", "min")


def stated_unit(text: str, path: Path) -> str:
    """Return the unit of length that TrackMate states, ``""`` where it states none.

    Raises
    ------
    FormatError
        When it is none that is read.

    Examples
    --------
    >>> stated_unit("(micron)", Path("spots.csv"))
    'um'
    """
    unit = unit_of_name(f"x {text}") if text else ""
    if text.strip("() ") and not unit:
        raise FormatError(
            f"the positions are in '{text.strip('() ')}': give the image one of the units "
            f"{', '.join(LENGTH_UNITS)} or pixel, and export again",
            path=path,
        )
    return unit


LOADER = TrackMateLoader()
