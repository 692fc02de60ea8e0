"""Values of a column in memory, of any type, as numbers, names or time stamps."""

from __future__ import annotations

import contextlib
import datetime
import math
import numbers
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Codes
from driftwalk.record.bad_row import is_number
from driftwalk.record.raw import MISSING, Array
from driftwalk.record.tables.stamps import (
    MOMENT,
    OF_DAY,
    StampForm,
    StampReader,
    Ticks,
    stamp_form,
)

Values = npt.NDArray[Any]

_PLAIN: Final = frozenset({int, float, type(None)})
_MOMENTS: Final = (datetime.datetime, datetime.date, np.datetime64)
_TIMES: Final = (datetime.time, datetime.timedelta, np.timedelta64)


class CellError(ValueError):
    """Raised by a value that is not of the kind that its column has to be of."""

    def __init__(self, row: int, reason: str) -> None:
        super().__init__(reason)
        self.row = row
        """Row of the column, from 0."""


def objects(cells: Sequence[Any]) -> Values:
    """Return cells as a column of objects."""
    values = np.empty(len(cells), dtype=object)
    values[:] = cells
    return values


def as_numbers(values: Values, name: str) -> Array:
    """Return the values of a column as a new float64 array, NaN where one is missing.

    Parameters
    ----------
    values : array, shape (n,)
        Numbers, or objects: numbers, texts of numbers, None.
    name : str
        Name of the column, for the error.

    Raises
    ------
    CellError
        At the first value that is no number.

    Examples
    --------
    >>> as_numbers(np.array([1, None, "2,5"], dtype=object), "x").tolist()
    [1.0, nan, 2.5]
    """
    if isinstance(values, np.ma.MaskedArray):
        hidden = np.ma.getmaskarray(values)
        found = as_numbers(np.asarray(values.data), name)
        found[hidden] = np.nan
        return found
    if values.dtype.kind in "fiu":
        return np.array(values, dtype=np.float64)
    cells = values.tolist() if values.dtype.kind in "OUS" else list(values)
    if set(map(type, cells)) <= _PLAIN:
        with contextlib.suppress(OverflowError):
            return np.array(cells, dtype=np.float64)
    return _of_cells(cells, name)


def _of_cells(cells: list[Any], name: str) -> Array:
    """Return the numbers of values that are not all numbers."""
    plain = [_plain(cell) for cell in cells]
    texts = [cell for cell in plain if isinstance(cell, str)]
    comma = any("," in text for text in texts) and not any("." in text for text in texts)
    decimal = "," if comma else "."
    found = np.empty(len(cells))
    for row, cell in enumerate(plain):
        if isinstance(cell, str):
            if not is_number(cell, decimal=decimal):
                raise CellError(row, f"'{cell:.40}' in column '{name}' is not a number")
            cell = cell.replace(decimal, ".")
        found[row] = float(cell)
    return found


def _plain(cell: Any) -> float | str:
    """Return a value as a number or a text, NaN where it is missing."""
    if isinstance(cell, (bool, np.bool_)):
        return str(cell)
    if isinstance(cell, numbers.Real) or hasattr(cell, "as_integer_ratio"):
        try:
            return float(cell)
        except OverflowError:  # infinite, as a text of it would be
            return math.inf if cell > 0 else -math.inf
    text = text_of_cell(cell)
    return float("nan") if text in MISSING else text


def text_of_cell(cell: Any) -> str:
    """Return a value as a text file has it, ``""`` where it is missing.

    Examples
    --------
    >>> text_of_cell(7.0), text_of_cell(None), text_of_cell(datetime.time(12, 30))
    ('7', '', '12:30:00')
    """
    if cell is None or cell is np.ma.masked or type(cell).__name__ in ("NAType", "NaTType"):
        return ""
    if isinstance(cell, bytes):
        return cell.decode("utf-8", "replace").strip()
    if isinstance(cell, (float, np.floating)):
        if np.isnan(cell):
            return ""
        return str(int(cell)) if float(cell).is_integer() else str(float(cell))
    if isinstance(cell, datetime.timedelta):
        return _duration(cell)
    if isinstance(cell, (datetime.datetime, datetime.date, datetime.time)):
        return cell.isoformat()
    return str(cell).strip()


def _duration(cell: datetime.timedelta) -> str:
    seconds, micro = divmod(round(cell / datetime.timedelta(microseconds=1)), 1_000_000)
    sign = "-" if seconds < 0 else ""
    minutes, second = divmod(abs(seconds), 60)
    return f"{sign}{minutes // 60:02d}:{minutes % 60:02d}:{second:02d}.{micro:06d}"


def as_names(values: Values) -> tuple[Codes, list[str]]:
    """Return the index of each value in the distinct ones, and those as texts, as they come.

    Parameters
    ----------
    values : array, shape (n,)
        Names, numbers, or anything that has a text.

    Examples
    --------
    >>> as_names(np.array([3.0, 1.0, 3.0]))[1]
    ['3', '1']
    """
    import pandas as pd

    if values.dtype.kind in "OUSMm" or isinstance(values, np.ma.MaskedArray):
        values = np.array([text_of_cell(cell) for cell in values.tolist()], dtype=object)
    codes, found = pd.factorize(values, use_na_sentinel=False)
    return codes.astype(np.int32), [text_of_cell(value) for value in found]


def form_of(values: Values) -> StampForm | None:
    """Return how the first time stamp of a column is written, None where it has none.

    Parameters
    ----------
    values : array, shape (n,)
        Anything.
    """
    if values.dtype.kind in "Mm":
        dates = values.dtype.kind == "M" and bool((values == values.astype("datetime64[D]")).all())
        return StampForm(MOMENT if values.dtype.kind == "M" else OF_DAY, has_time=not dates)
    if values.dtype.kind not in "OUS":
        return None
    cell = next((cell for cell in values if text_of_cell(cell) not in MISSING), None)
    if isinstance(cell, datetime.date):
        # A workbook has no dates without a time: they are those of midnight.
        midnight = not isinstance(cell, datetime.datetime) or cell.time() == datetime.time()
        return StampForm(MOMENT, has_time=not midnight)
    if isinstance(cell, (*_MOMENTS, *_TIMES)):
        return StampForm(MOMENT if isinstance(cell, _MOMENTS) else OF_DAY)
    return stamp_form(text_of_cell(cell))


def as_ticks(values: Values, reader: StampReader) -> Ticks:
    """Return the time stamps of a column in nanoseconds.

    Parameters
    ----------
    values : array, shape (n,)
        Times of NumPy or Python, or texts.
    reader : StampReader
        Knows what kind of stamps the column has.

    Raises
    ------
    StampError
        At a value that is no stamp like the first.
    """
    if values.dtype.kind in "Mm":
        reader.kind = MOMENT if values.dtype.kind == "M" else OF_DAY
        unit = "datetime64[ns]" if values.dtype.kind == "M" else "timedelta64[ns]"
        # Where NumPy has no time its nanoseconds are those of `NO_TIME`.
        ticks: Ticks = values.astype(unit).astype(np.int64)
        return ticks
    texts = np.array([text_of_cell(cell) for cell in values.tolist()], dtype=object)
    return reader.read(texts)
