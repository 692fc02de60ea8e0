"""OpenPIV text: ``# x y u v flags mask``, or rows without a header; units are never named."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from driftwalk.flow.readers.table import read_text
from driftwalk.flow.readers.text import masked_rows, read_rows
from driftwalk.flow.readers.units import RawField

_FIRST: Final = ["x", "y", "u", "v"]
_MARKS: Final = ("flags", "mask")
_WIDTHS: Final = range(4, 8)


def sniff(head: str, _path: Path) -> bool:
    """Recognise the header, or rows of four numbers and more along a line of a grid."""
    lines = [line for line in head.splitlines()[:3] if line.strip()]
    if not lines:
        return False
    if _header(lines[0]) is not None:
        return True
    rows = [line.split() for line in lines[:2]]
    if len(rows) < 2 or not all(
        len(row) == len(rows[0]) in _WIDTHS and _numbers(row) for row in rows
    ):
        return False
    return rows[0][0] == rows[1][0] or rows[0][1] == rows[1][1]


def has_header(path: Path) -> bool:
    """Return whether the first line names the columns."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        return _header(file.readline(1000)) is not None


def read(path: Path) -> RawField:
    """Read the rows; flags and mask that are not zero make a velocity missing.

    Rows go from the top of the image to its bottom. Where the first one has the smallest y, y
    counts downwards: OpenPIV has not turned its coordinates.

    Raises
    ------
    FormatError
        When a row cannot be read.
    """
    lines = [(n, line) for n, line in enumerate(read_text(path).splitlines(), 1) if line.strip()]
    names = _header(lines[0][1])
    rows = [(n, line) for n, line in lines if not line.lstrip().startswith("#")]
    width = len(names) if names is not None else len(rows[0][1].split())
    line, values = read_rows(rows, delimiter=None, width=width, path=path)
    marks = [names.index(name) for name in _MARKS if name in names] if names is not None else []
    missing = (values[:, marks] != 0.0).any(axis=1)
    notes = []
    if names is None and width > len(_FIRST):
        notes.append(f"columns beyond x, y, u, v have no name and are not read: {width - 4}")
    y = values[:, 1]
    return RawField(
        masked_rows(line, values, missing, path),
        down=bool(np.isfinite(y[[0, -1]]).all() and y[0] < y[-1]),
        notes=notes,
    )


def _header(line: str) -> list[str] | None:
    """Return the names of the columns, None when the line is none of OpenPIV's headers."""
    names = line.lstrip("# ").lower().split()
    return names if line.lstrip().startswith("#") and names[:4] == _FIRST else None


def _numbers(fields: list[str]) -> bool:
    try:
        return bool([float(field) for field in fields])
    except ValueError:
        return False
