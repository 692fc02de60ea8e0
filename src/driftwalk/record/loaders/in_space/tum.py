"""TUM trajectories: ``timestamp tx ty tz qx qy qz qw``, blanks between, seconds and metres."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Final

import numpy as np

from driftwalk.record.raw import RawRecording, ReadOptions, TableLayout
from driftwalk.record.space.flat import SpaceTrack, lay_flat
from driftwalk.record.space.plane import plane_of
from driftwalk.record.space.turns import QUATERNION, Turns
from driftwalk.record.text import header_rows, read_table
from driftwalk.record.text_head import first_lines, is_numeric_row

_NAMES: Final = ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]
_UP: Final = "z"


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
        return 0.9 if named or all(_is_unit(row[4:]) for row in rows) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the one body."""
        comments = takewhile(lambda line: line.startswith("#"), header_rows(path, 20))
        layout = TableLayout(" ", _NAMES, len(list(comments)), tuple(range(len(_NAMES))))
        table = read_table(path, layout)
        values = np.column_stack([table.numbers[column] for column in range(1, len(_NAMES))])
        track = SpaceTrack("0", table.numbers[0], values[:, :3], Turns(values[:, 3:], QUATERNION))
        return replace(
            lay_flat([track], plane_of(options.up or _UP)),
            clock_unit="s",
            length_unit="m",
            rows=table.rows,
        )


def _is_unit(fields: list[str]) -> bool:
    try:
        return abs(math.hypot(*map(float, fields)) - 1.0) < 0.02
    except ValueError:
        return False


LOADER = TumLoader()
