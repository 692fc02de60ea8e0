"""Trajectories of visual odometry and SLAM: EuRoC's ground truth, and TUM's text.

EuRoC: CSV with ``p_RS_R_x [m]`` and ``q_RS_w []``, a clock of nanoseconds. TUM: ``timestamp tx ty
tz qx qy qz qw``, blanks between, seconds and metres.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.record.column_names import unit_of_name
from driftwalk.record.loaders.plain import described
from driftwalk.record.raw import CLOCK_UNITS, RawRecording, ReadOptions, TableLayout
from driftwalk.record.space import PARTS
from driftwalk.record.tables.text_source import first_line, first_lines, first_row, is_numeric_row
from driftwalk.record.text import header_rows

_START: Final = re.compile(r"#\s*timestamp\b[^,]*(,\s*p_\w*[xyz]\b[^,]*){3}")
_PART: Final = re.compile(r"([pq])_(?:[A-Za-z]+_)*([wxyz])\s*(?:\[.*\])?")


class EurocLoader:
    """One body; velocities and biases that follow are not read."""

    name = "euroc"
    description = "EuRoC ground truth CSV (#timestamp [ns], p_RS_R_x [m], …, q_RS_w, …; z up)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        return 0.9 if _START.match(first_line(head)) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the one body; its whole nanoseconds stay exact."""
        names = [name.lstrip("# ") for name in first_row(path)]
        columns = {
            "".join(match.groups()).removeprefix("p"): name
            for name in names
            if (match := _PART.fullmatch(name))
        }
        lacking = [axis for axis in "xyz" if axis not in columns]
        if lacking:
            raise FormatError(f"the header names no column of p_…_{lacking[0]}", line=1)
        wanted = ("x", "y", "z", *(PARTS if set(PARTS) <= set(columns) else ()))
        used = {part: columns[part] for part in wanted}
        stated = unit_of_name(names[0])
        unit = stated if stated in CLOCK_UNITS else "ns"
        return _in_space(path, options, used, TableLayout(",", names, 1), unit)


def _in_space(
    path: Path, options: ReadOptions, columns: dict[str, str], layout: TableLayout, unit: str
) -> RawRecording:
    """Return the one body, whose clock is in the first column and has that unit."""
    named = {"t": f"{layout.names[0]}:{unit}", **columns}
    stated = replace(options, up=options.up or "z")
    return described(path, stated, named, layout, length_unit="m", y_axis="up")


_NAMES: Final = ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]


class TumLoader:
    """One body, with its time stamps as they are."""

    name = "tum"
    description = "TUM trajectory (timestamp tx ty tz qx qy qz qw; s, m; z up)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise eight numbers of which the last four make a unit quaternion."""
        lines = first_lines(head, 20)
        rows = [line.split() for line in lines if not line.startswith("#")][:2]
        named = any(line.lstrip("# ").split() == _NAMES for line in lines if line[:1] == "#")
        if not rows or not all(len(row) == len(_NAMES) and is_numeric_row(row) for row in rows):
            return 0.0
        try:
            lengths = [math.hypot(*map(float, row[4:])) for row in rows]
        except ValueError:
            lengths = [0.0]
        return 0.9 if named or all(abs(one - 1.0) < 0.02 for one in lengths) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the one body."""
        comments = takewhile(lambda line: line.startswith("#"), header_rows(path, 20))
        layout = TableLayout(" ", _NAMES, len([*comments]))
        columns = dict(zip(("x", "y", "z", *PARTS), _NAMES[1:], strict=True))
        return _in_space(path, options, columns, layout, "s")


LOADERS = (EurocLoader(), TumLoader())
