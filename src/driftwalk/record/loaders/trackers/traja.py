"""Table of a video tracker as traja's tests have it: ``Frame,Time,TrackId,x,y,ValueChanged``."""

from __future__ import annotations

from driftwalk.record.tables.headed import HeadedFormat

LOADER = HeadedFormat(
    name="traja",
    description="traja CSV (Frame, Time, TrackId, x, y; seconds, no unit of length)",
    header=("Frame", "Time", "TrackId", "x", "y"),
    columns={"t": "Time:s", "x": "x", "y": "y", "body": "TrackId"},
)
