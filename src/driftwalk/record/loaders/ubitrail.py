"""UbiTrail CSV: a line of R metadata, then ``Area,Territory,X,Y,time,L``; often in gzip."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.cleaning.stacked import split_bodies
from driftwalk.record.raw import RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import read_head, read_table
from driftwalk.record.text_head import first_lines

NAMES = ["Area", "Territory", "X", "Y", "time", "L"]
_AREAS = re.compile(
    r"Areas=matrix\(c\(([\d.,\s-]+)\),4,\d+,dimname=list\(c\([^)]*\),c\(([^)]*)\)\)\)"
)


class UbiTrailLoader:
    """One body per area. X and Y count widths of the area, which the metadata give in pixels."""

    name = "ubitrail"
    description = "UbiTrail CSV (R metadata, then Area,Territory,X,Y,time,L; time in ms)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the second line."""
        lines = first_lines(head, 2)
        return 0.95 if len(lines) == 2 and lines[1].split(",") == NAMES else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every area and turn widths of the area into pixels."""
        widths = _area_widths(path)
        table = read_table(path, TableLayout(",", NAMES, 2, (2, 3, 4), (0,)))
        areas = table.labels[0]
        unknown = [area for area in areas if area not in widths]
        if unknown:
            raise FormatError(
                f"the metadata give no width for area {unknown[0]}", path=path, line=1
            )
        scale = np.array([widths[area] for area in areas])[table.codes[0]]
        with np.errstate(over="ignore"):  # an infinite position is a gap
            x, y = (table.numbers[column] * scale for column in (2, 3))
        bodies = split_bodies(table.codes[0], areas, clock=table.numbers[4], x=x, y=y)
        # An area is a body. The clock, of a video's file, often says the same of two frames.
        return RawRecording(
            bodies,
            clock_unit="ms",
            length_unit="px",
            separate=True,
            rows=table.rows,
            attrs={"bodies_apart": "yes"},
        )


def _area_widths(path: Path) -> dict[str, float]:
    """Return the width of each area in pixels, from the first line."""
    lines = first_lines(read_head(path), 1)
    match = _AREAS.search(lines[0]) if lines else None
    if match is None:
        raise FormatError("the metadata hold no matrix of areas (W, H, X, Y)", path=path, line=1)
    try:
        numbers = [float(text) for text in match.group(1).split(",")]
    except ValueError as error:
        raise FormatError(f"the matrix of areas is damaged: {error}", path=path, line=1) from error
    names = [text.strip().strip('"') for text in match.group(2).split(",")]
    return dict(zip(names, numbers[::4], strict=False))


LOADER = UbiTrailLoader()
