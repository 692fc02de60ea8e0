"""Rows of numbers in text files of PIV programs, with an error that names the place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError
from driftwalk.flow.rows import FieldRows

Array = npt.NDArray[np.float64]


def read_rows(
    lines: Sequence[tuple[int, str]], *, delimiter: str | None, width: int, path: Path
) -> tuple[npt.NDArray[np.intp], Array]:
    """Return the line numbers and the values of rows, shape (n, width); NaN may stand in a file.

    Parameters
    ----------
    lines : sequence of (int, str)
        The rows with their line numbers, none of them empty.
    delimiter : str or None
        Between fields; None: any run of blanks.
    width : int
        Fields of a row.
    path : Path
        The file, for the message.

    Raises
    ------
    FormatError
        When there is no row, a row has another number of fields, or a field is no number.
    """
    if not lines:
        raise FormatError("there is no row of data", path=path)
    values = np.empty((len(lines), width))
    for row, (number, text) in enumerate(lines):
        fields = text.split(delimiter)
        if len(fields) == width + 1 and not fields[-1].strip():
            fields = fields[:-1]
        if len(fields) != width:
            raise FormatError(f"expected {width} fields, got {len(fields)}", path=path, line=number)
        for column, field in enumerate(fields):
            values[row, column] = _number(field, path, number, column + 1)
    return np.array([number for number, _ in lines], dtype=np.intp), values


def _number(text: str, path: Path, line: int, column: int) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.inf
    if math.isinf(value):
        raise FormatError(
            f"expected a number, got '{text.strip():.40}'", path=path, line=line, column=column
        )
    return value


def masked_rows(
    line: npt.NDArray[np.intp], values: Array, missing: npt.NDArray[np.bool_], path: Path
) -> FieldRows:
    """Return rows x, y, u, v whose velocities are NaN where they are missing.

    Raises
    ------
    FormatError
        When a position is missing, or every velocity.
    """
    lost = np.flatnonzero(~np.isfinite(values[:, :2]).all(axis=1))
    if lost.size:
        raise FormatError("a node has no position", path=path, line=int(line[lost[0]]))
    velocity = np.where(missing[:, None], np.nan, values[:, 2:4])
    if not np.isfinite(velocity).all(axis=1).any():
        raise FormatError("every node is masked or missing: there is no velocity", path=path)
    return FieldRows(line, values[:, 0], values[:, 1], velocity[:, 0], velocity[:, 1])
