"""AnimalTA's coordinates: semicolons, pixels, ``Frame;Time`` and the targets.

They stand side by side, ``X_Arena0_Ind0;Y_Arena0_Ind0``, where their number is fixed, and stacked,
``Arena;Ind;X;Y``, where it varies. A target is named by its arena where there are several.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.cleaning.several_bodies import codes_in_arenas, split_bodies
from driftwalk.record.loaders.plain import side_by_side
from driftwalk.record.raw import Array, Marks, RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import read_table
from driftwalk.record.text_head import first_line, read_header

STACKED: Final = ("Frame", "Time", "Arena", "Ind", "X", "Y")
HALF_DIGIT_S: Final = 0.0051
"""Times are rounded to 0.01 s."""
_PLACE: Final = re.compile(r"(?P<axis>[XY])_Arena(?P<arena>\d+)_(?P<body>.+)")


class AnimalTALoader:
    """Pixels; the frame rate comes of frames and times, which are rounded."""

    name = "animalta"
    description = "AnimalTA coordinates (Frame;Time;X_Arena0_Ind0;... or Frame;Time;Arena;Ind;X;Y)"
    marks = (
        Marks("table", ("Frame", "Time", "X_Arena0_Ind0", "Y_Arena0_Ind0")),
        Marks("table", STACKED),
    )

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        names = first_line(head).split(";")
        known = names[:2] == ["Frame", "Time"] and (
            tuple(names[:6]) == STACKED or any(map(_PLACE.fullmatch, names[2:]))
        )
        return 0.95 if known else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every target."""
        names, _, skip, _ = read_header(path, delimiter=";")
        if names[:2] != ["Frame", "Time"]:
            raise FormatError("the first columns are not Frame and Time", line=1)
        stacked = tuple(names[:6]) == STACKED
        if stacked:
            bodies, frame, time = _stacked(path, names, skip)
        else:
            bodies, columns = side_by_side(path, _PLACE, ";", clock=0)
            frame, time = columns["Frame"], columns["Time"]
        rate = None if options.frame_rate_hz is not None else _rate(frame, time)
        timed = rate is None and options.frame_rate_hz is None
        if timed:
            order = np.argsort(frame, kind="stable")
            for one in bodies:
                places = np.searchsorted(frame[order], one.clock).clip(0, frame.size - 1)
                one.clock = time[order][places]
        return RawRecording(
            bodies,
            clock_unit="s" if timed else "frame",
            length_unit="px",
            frame_rate_hz=rate,
            rows=frame.size,
        )


def _stacked(path: Path, names: list[str], skip: int) -> tuple[list[RawBody], Array, Array]:
    table = read_table(path, TableLayout(";", names, skip, (0, 1, 4, 5), (2, 3)))
    targets = [f"Ind{label}" for label in table.labels[3]]
    codes, labels = codes_in_arenas((table.codes[2], table.labels[2]), (table.codes[3], targets))
    frame, time, x, y = (table.numbers[column] for column in (0, 1, 4, 5))
    bodies = split_bodies(codes, labels, clock=frame, x=x, y=y)
    return bodies, frame.copy(), time


def _rate(frame: Array, time: Array) -> float | None:
    """Return the rate that agrees with all rounded times, None where there is none.

    The whole number that is nearest is taken where it agrees as well: times are short of digits.
    """
    known = np.isfinite(frame) & np.isfinite(time)
    frame, time = frame[known], time[known]
    if frame.size < 2 or np.ptp(time) <= 0.0:
        return None
    exact = float(np.ptp(frame) / np.ptp(time))
    if exact * 2 * HALF_DIGIT_S > 0.5 * np.ptp(time):
        return None  # too short a recording: several whole numbers agree
    for rate in (float(round(exact)), exact):
        if (
            rate > 0.0
            and (np.abs(time - time[0] - (frame - frame[0]) / rate) < 2 * HALF_DIGIT_S).all()
        ):
            return rate
    return None


LOADER = AnimalTALoader()
