"""yupi's trajectories as CSV: rows of its settings, then ``x,y,t`` (or ``x,y,z,t``) and what else.

Version 2 begins with ``v2,N``, N rows before the data; version 1 with name, interval, dimensions.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.raw import RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.text import header_rows, read_table
from driftwalk.record.text_head import first_lines

AXES: Final = ("x", "y", "z")


class YupiLoader:
    """One body; seconds, and no unit of length."""

    name = "yupi"
    description = "yupi CSV, versions 1 and 2 (settings, then x, y, t; no unit of length)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the rows of settings."""
        rows = [split_fields(line, ",") for line in first_lines(head, 4)]
        if rows and rows[0][0] == "v2" and len(rows[0]) == 2 and rows[0][1].isdecimal():
            return 0.95
        known = (
            len(rows) > 2
            and [len(row) for row in rows[:2]] == [3, 3]
            and rows[0][2] in ("2", "3")
            and all(field.isdecimal() for field in rows[1])
            and all(len(row) == 1 + int(rows[0][2]) for row in rows[2:])
            and not is_number(rows[0][0])
        )
        return 0.9 if known else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read the trajectory."""
        rows = [split_fields(line, ",") or [""] for line in header_rows(path, 20)]
        second = bool(rows) and rows[0][0] == "v2"
        try:
            skip = int(rows[0][1]) if second else 2
            name, _, dimensions = rows[1 if second else 0]
            axes = AXES[: int(dimensions)]
            further = rows[5] if second else []
        except (ValueError, IndexError) as error:
            raise FormatError(f"the rows of settings are damaged: {error}", path=path) from error
        if len(axes) < 2:
            raise FormatError(
                f"has {len(axes)} dimensions, and a path in the plane needs two", path=path
            )
        names = [*axes, "t", *(one for one in further if one)]
        table = read_table(path, TableLayout(",", names, skip, (0, 1, len(axes))))
        body = RawBody(name or "0", table.numbers[len(axes)], table.numbers[0], table.numbers[1])
        return RawRecording([body], clock_unit="s", bare_clock="", rows=table.rows)


LOADER = YupiLoader()
