"""Text tables of a velocity field: numbers line by line, with an error that names the place."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError
from driftwalk.flow.readers.units import RawField
from driftwalk.flow.rows import FieldRows

Array = npt.NDArray[np.float64]

_NAMES: Final = re.compile(
    r"([xyuv])(?:_(m)|_(m)_(s)|\s*[\[(]\s*([^\])]+?)\s*[\])])?", re.IGNORECASE
)
"""A column's name, with a unit in the name of SI or any unit in brackets."""


def read_text(path: Path) -> str:
    """Return the text of a file, or raise `FormatError`."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError("is not UTF-8 text", path=path) from error


def read(path: Path) -> RawField:
    """Read a CSV table with the columns x, y, u, v in m and m/s, or in units in brackets.

    The header may also say x_m, y_m, u_m_s, v_m_s, or ``x [mm]``, ``u (cm/s)``; further columns are
    not read. Fields are separated by commas, semicolons or tabs; empty lines and lines that begin
    with # are skipped.

    Raises
    ------
    FormatError
        When a column is missing, or a field is not a finite number; with line and column.
    """
    lines = list(content_lines(read_text(path)))
    if not lines:
        raise FormatError("the file is empty", path=path)
    (header_line, header), *rest = lines
    split = next((re.compile(mark).split for mark in (",", ";", "\t") if mark in header), str.split)
    names = [name.strip().strip('"').lower() for name in split(header)]
    columns, units = [], []
    for wanted in "xyuv":
        unit = "m" if wanted in "xy" else "m/s"
        at = [(index, found) for index, name in enumerate(names) if (found := _unit(name, wanted))]
        if len(at) != 1:
            raise FormatError(
                f"the header needs one column '{wanted}' (x and y in m, u and v in m/s), "
                f"got {', '.join(names)}",
                path=path,
                line=header_line,
            )
        columns.append(at[0][0])
        units.append(unit if at[0][1] == wanted else at[0][1])
    if units[0] != units[1] or units[2] != units[3]:
        raise FormatError(
            f"x, y, u, v have the units {', '.join(units)}: name those of x and y alike, and those "
            "of u and v",
            path=path,
            line=header_line,
        )
    if not rest:
        raise FormatError("there is no row under the header", path=path, line=header_line)
    fields = [(number, split(line)) for number, line in rest]
    values = read_numbers(fields, columns, width=len(names), path=path)
    x, y, u, v = values.T
    line = np.array([number for number, _ in fields], dtype=np.intp)
    return RawField(FieldRows(line, x, y, u, v), length_unit=units[0], velocity_unit=units[2])


def is_field_table(path: Path) -> bool:
    """Return whether a text file begins with a header of x, y, u, v and names no time."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        start = file.read(4096)
    header = next((line for _, line in content_lines(start)), "")
    names = [name.strip().strip('"').lower() for name in re.split(r"[,;\t]|\s+(?![\[(])", header)]
    timed = {"t", "t_s", "time", "time_s", "frame"} & set(names)
    return not timed and all(any(_unit(name, wanted) for name in names) for wanted in "xyuv")


def _unit(name: str, wanted: str) -> str:
    """Return the unit in a column's name, `wanted` itself when it has none, ``""`` for others."""
    match = _NAMES.fullmatch(name)
    if match is None or match[1].lower() != wanted:
        return ""
    if match[2] or match[3]:
        return wanted if bool(match[3]) == (wanted in "uv") else ""
    return match[4 + 1] or wanted


def content_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield the lines that are neither empty nor a comment, with their numbers from 1."""
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, line


def read_numbers(
    fields: Sequence[tuple[int, Sequence[str]]], columns: Sequence[int], *, width: int, path: Path
) -> Array:
    """Return chosen columns of split lines as finite numbers, shape (rows, columns).

    Raises
    ------
    FormatError
        When a line has not `width` fields, or a field is not a finite number.
    """
    values = np.empty((len(fields), len(columns)))
    for row, (line, texts) in enumerate(fields):
        if len(texts) != width:
            raise FormatError(f"expected {width} fields, got {len(texts)}", path=path, line=line)
        for k, column in enumerate(columns):
            values[row, k] = _number(texts[column], path, line, column + 1)
    return values


def _number(text: str, path: Path, line: int, column: int) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FormatError(
            f"expected a finite number, got '{text.strip()}'", path=path, line=line, column=column
        )
    return value
