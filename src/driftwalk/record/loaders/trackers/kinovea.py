"""Kinovea's text of trajectories: rows of T X Y, and a line with ``#`` above each track.

Until 2019 its times were ``h:mm:ss:cc``, and ``h:mm:ss:mmm`` above 100 frames per second
(``TimeHelper.MillisecondsToTimecode`` of Kinovea 0.8), so the last part counts no frames.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.loaders.json_formats import bounded_text, column_of
from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.tables.in_memory import MemorySource
from driftwalk.record.tables.rows import recording_of

_START: Final = b"#Kinovea Trajectory"
_CLOCK: Final = re.compile(r"(\d+:\d\d:\d\d):(\d\d\d?)")


class KinoveaLoader:
    """Each track is a body; a number as time has the unit that was chosen in Kinovea."""

    name = "kinovea"
    description = "Kinovea text of trajectories (T X Y; h:mm:ss:cc; no unit of length)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the first line."""
        return 0.95 if head.startswith(_START) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every track."""
        rows: list[list[str]] = []
        track = ""
        for number, line in enumerate(bounded_text(path).decode("utf-8", "replace").split("\n"), 1):
            fields = line.split()
            if line.startswith("#"):  # several tracks may have one name
                name, known = line.strip("# \r"), {row[3] for row in rows}
                others = (f"{name} {at}" for at in range(2, len(known) + 3))
                track = next(one for one in (name, *others) if one not in known)
            elif len(fields) == 3:
                rows.append([_CLOCK.sub(r"\1.\2", fields[0]), *fields[1:], track])
            elif fields:
                raise FormatError(f"expected T X Y, got {len(fields)} fields", line=number)
        columns = [column_of([*column]) for column in zip(*rows, strict=True)] or [np.zeros(0)] * 4
        raw = recording_of(MemorySource("the tracks", ["t", "x", "y", "body"], columns), options)
        return replace(raw, bare_length_is_si=False, y_axis="up")


LOADER = KinoveaLoader()
