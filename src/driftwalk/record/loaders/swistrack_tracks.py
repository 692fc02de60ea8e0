"""SwisTrack track files: one per track, tab-separated, a header that starts with ``%``.

2009 to 2022 (``track_00000003.txt``): frame, image x, y, world x, y, area, orientation,
compactness, time stamp in ms since 1970 or -1. Since 2022 (``track00000003.csv``): frame, x, y in
image pixels.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import Table, read_head, read_table
from driftwalk.record.text_head import first_lines

OLD = ["frame", "x (image)", "y (image)", "x (world)", "y (world)", "area", "orientation"]
OLD = [*OLD, "compactness", "time stamp"]
NEW = ["frame", "x", "y"]
_FILE_NAME = re.compile(r"(?:.*_)?(?:track_?)?(\d{8})\.(?:txt|csv)")


class SwisTrackTracksLoader:
    """A body per track: give one file, or the run folder for all of its tracks."""

    name = "swistrack-tracks"
    description = "SwisTrack track files (track_00000003.txt of 2009-2022, track00000003.csv since)"

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the header, or a folder that holds track files."""
        if path.is_dir():
            return 0.7 if _track_files(path) else 0.0
        return 0.95 if _columns(head) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read one track, or every track of a folder.

        World coordinates are used when the run was calibrated, unless `metres_per_pixel` asks
        for the image. Angles are measured in the image in either case.
        """
        files = _track_files(path) if path.is_dir() else [path]
        if not files:
            raise FormatError("the folder holds no track files (track_00000000.txt)", path=path)
        tables = {_track_name(file): _read_one(file) for file in files}
        first = next(iter(tables.values()))
        if any(set(table.numbers) != set(first.numbers) for table in tables.values()):
            raise FormatError("the folder mixes track files of two SwisTrack versions", path=path)
        rows = sum(table.rows for table in tables.values())
        if len(first.numbers) == len(NEW):
            bodies = [
                RawBody(name, *(table.numbers[column] for column in range(3)))
                for name, table in tables.items()
            ]
            return RawRecording(bodies, length_unit="px", rows=rows)
        return _old_recording(tables, options, rows=rows)


def _old_recording(tables: dict[str, Table], options: ReadOptions, *, rows: int) -> RawRecording:
    calibrated = any(table.numbers[column].any() for table in tables.values() for column in (3, 4))
    world = calibrated and options.metres_per_pixel is None
    timed = options.frame_rate_hz is None and all(
        (table.numbers[8] >= 0).all() for table in tables.values()
    )
    x, y = (3, 4) if world else (1, 2)
    bodies = [
        RawBody(
            name,
            table.numbers[8 if timed else 0],
            table.numbers[x],
            table.numbers[y],
            table.numbers[6],
        )
        for name, table in tables.items()
    ]
    return RawRecording(
        bodies,
        clock_unit="ms" if timed else "frame",
        length_unit="m" if world else "px",
        y_axis="up" if world else "down",
        theta_axis="down",
        rows=rows,
    )


def _columns(head: bytes) -> list[str]:
    """Return the columns that the header announces, [] when it is not SwisTrack's."""
    lines = first_lines(head, 1)
    header = [field.strip().lower() for field in lines[0].lstrip("% ").split("\t")] if lines else []
    if not lines or not lines[0].startswith("%") or not header[0].startswith("frame number"):
        return []
    if len(header) == 1:  # the newer versions write the header with commas above tabs
        header = [field.strip() for field in header[0].split(",") if field.strip()]
    if len(header) == len(OLD) and "image" in header[1] and "time" in header[8]:
        return OLD
    return NEW if header[1:] == ["x", "y"] else []


def _read_one(path: Path) -> Table:
    columns = _columns(read_head(path))
    if not columns:
        raise FormatError("the header is not that of a SwisTrack track file", path=path, line=1)
    table = read_table(path, TableLayout("\t", columns, 1, tuple(range(len(columns)))))
    if np.isnan(table.numbers[0]).any():
        raise FormatError("a row has no frame number", path=path)
    return table


def _track_files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if _FILE_NAME.fullmatch(file.name))


def _track_name(path: Path) -> str:
    match = _FILE_NAME.fullmatch(path.name)
    return str(int(match.group(1))) if match else "0"


LOADER = SwisTrackTracksLoader()
