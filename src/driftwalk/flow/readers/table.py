"""Text tables of a velocity field: numbers line by line, with an error that names the place."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError
from driftwalk.flow.rows import FieldRows

Array = npt.NDArray[np.float64]

_SI_NAMES = {
    "x": ("x", "x_m"),
    "y": ("y", "y_m"),
    "u": ("u", "u_m_s"),
    "v": ("v", "v_m_s"),
}


def read_text(path: Path) -> str:
    """Return the text of a file, or raise `FormatError`."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError("is not UTF-8 text", path=path) from error


def read_csv(path: Path) -> FieldRows:
    """Read a CSV table with the columns x, y, u, v in m and m/s.

    The header may also say x_m, y_m, u_m_s, v_m_s; further columns are not read. Fields are
    separated by commas, semicolons or tabs; empty lines and lines that begin with # are skipped.

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
    columns = []
    for wanted, accepted in _SI_NAMES.items():
        at = [index for index, name in enumerate(names) if name in accepted]
        if len(at) != 1:
            raise FormatError(
                f"the header needs one column '{wanted}' (x and y in m, u and v in m/s), "
                f"got {', '.join(names)}",
                path=path,
                line=header_line,
            )
        columns.append(at[0])
    if not rest:
        raise FormatError("there is no row under the header", path=path, line=header_line)
    fields = [(number, split(line)) for number, line in rest]
    values = read_numbers(fields, columns, width=len(names), path=path)
    x, y, u, v = values.T
    line = np.array([number for number, _ in fields], dtype=np.intp)
    return FieldRows(line, x, y, u, v)


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
