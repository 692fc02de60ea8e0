"""TSI Insight ``.vec``: a Tecplot header with units and the time between images, then rows."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.flow.readers.table import read_text
from driftwalk.flow.readers.text import masked_rows, read_rows
from driftwalk.flow.readers.units import RawField

_NAMES: Final = re.compile(r'VARIABLES\s*=\s*((?:"[^"]*"\s*,?\s*)+)', re.IGNORECASE)
_INTERVAL: Final = re.compile(r'MicrosecondsPerDeltaT\s*=\s*"([\d.eE+-]+)"')
_ROW: Final = re.compile(r"\s*[-+.\d]")


def sniff(head: str, _path: Path) -> bool:
    """Recognise the header."""
    return head.lstrip().upper().startswith("TITLE") and '"CHC"' in head[:4000].upper()


def read(path: Path) -> RawField:
    """Read the rows; a CHC of zero or less says that a velocity is none. Insight's y points up.

    Raises
    ------
    FormatError
        When the header names no units, or a row cannot be read.
    """
    lines = list(enumerate(read_text(path).splitlines(), 1))
    rows = [(number, line) for number, line in lines if _ROW.match(line)]
    start = rows[0][0] if rows else len(lines) + 1
    header = " ".join(line for number, line in lines if number < start)
    match = _NAMES.search(header)
    names = re.findall(r'"([^"]*)"', match[1]) if match else []
    columns = [name.partition(" ") for name in names]
    if [name.upper() for name, *_ in columns][:5] != ["X", "Y", "U", "V", "CHC"]:
        raise FormatError(
            f"the header names the columns {', '.join(names) or 'not at all'}: expected X, Y, U, "
            "V with their units, and CHC",
            path=path,
            line=1,
        )
    units = [unit.strip() for *_, unit in columns]
    if units[0] != units[1] or units[2] != units[3]:
        raise FormatError(f"the columns have different units: {', '.join(names[:4])}", path=path)
    line, values = read_rows(rows, delimiter=",", width=len(columns), path=path)
    return RawField(
        masked_rows(line, values, ~(values[:, 4] > 0.0), path),
        length_unit=units[0],
        velocity_unit=units[2],
        frame_interval=_interval(header),
    )


def _interval(header: str) -> float | None:
    """Return the time between the two images [s], None when the header does not hold it."""
    match = _INTERVAL.search(header)
    try:
        interval = float(match[1]) * 1e-6 if match else 0.0
    except ValueError:
        return None
    return interval if interval > 0.0 else None
