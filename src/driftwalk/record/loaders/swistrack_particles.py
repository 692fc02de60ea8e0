"""SwisTrack ``particles.csv`` (since 2022): all particles of all frames, without a track id.

Tab-separated despite its name: frame, ISO time, image x, y, world x, y, area, orientation,
compactness; the header has commas and starts with ``%``.
"""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.cleaning.stacked import order_in_frame, split_bodies
from driftwalk.record.raw import Array, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import Table, read_table
from driftwalk.record.text_head import first_lines

NAMES = ["frame", "time", "x (image)", "y (image)", "x (world)", "y (world)"]
NAMES = [*NAMES, "area", "orientation", "compactness"]


class SwisTrackParticlesLoader:
    """Bodies are distinguished by their order within a frame, since the file has no identities."""

    name = "swistrack-particles"
    description = "SwisTrack particles.csv (2022 and later; no identities)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        lines = first_lines(head, 1)
        header = lines[0].lower() if lines else ""
        known = header.startswith("%") and "frame number" in header and "time" in header
        return 0.93 if known and header.find("time") < header.find("x (image)") else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every particle; world coordinates where the run was calibrated."""
        table = read_table(path, TableLayout("\t", NAMES, 1, (0, 2, 3, 4, 5, 7), (1,)))
        numbers = table.numbers
        calibrated = bool(numbers[4].any() or numbers[5].any())
        world = calibrated and options.metres_per_pixel is None
        order = order_in_frame(numbers[0])
        count = int(order.max()) + 1
        timed = options.frame_rate_hz is None
        bodies = split_bodies(
            order,
            [str(index) for index in range(count)],
            clock=_times(table, path) if timed else numbers[0],
            x=numbers[4 if world else 2],
            y=numbers[5 if world else 3],
            theta=numbers[7],
        )
        note = (
            "particles.csv holds no identities: bodies are distinguished by their order in a frame"
        )
        return RawRecording(
            bodies,
            clock_unit="s" if timed else "frame",
            length_unit="m" if world else "px",
            y_axis="up" if world else "down",
            theta_axis="down",
            rows=table.rows,
            notes=[note] if count > 1 else [],
        )


def _times(table: Table, path: Path) -> Array:
    """Return seconds since 1970 of the ISO time stamps."""
    try:
        stamps = np.array([_since_1970(label) for label in table.labels[1]], dtype=np.float64)
    except (ValueError, OverflowError) as error:
        raise FormatError(
            f"a time stamp is not an ISO date ({error}); give `frame_rate` to use frame numbers",
            path=path,
        ) from error
    seconds: Array = stamps[table.codes[1]]
    return seconds


def _since_1970(stamp: str) -> float:
    """Return the seconds of an ISO time stamp; one that names no zone is taken as UTC."""
    time = datetime.fromisoformat(stamp)
    return (time if time.tzinfo is not None else time.replace(tzinfo=UTC)).timestamp()


LOADER = SwisTrackParticlesLoader()
