"""Tracktor CSV: ``,frame,pos_x,pos_y[,id]``, pixels."""

from __future__ import annotations

from driftwalk.record.tables.headed import HeadedFormat

LOADER = HeadedFormat(
    name="tracktor",
    description="Tracktor CSV (frame, pos_x, pos_y[, id]; pixels)",
    header=("", "frame", "pos_x", "pos_y"),
    columns={"frame": "frame", "x": "pos_x", "y": "pos_y", "body": "id"},
    length_unit="px",
)
