"""Tables: their interface to the reader, and columns in memory with numbers, names or time stamps.

Data frames, arrays, a mapping of columns.
"""

from __future__ import annotations

import contextlib
import datetime
import math
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Codes
from driftwalk.core.errors import FormatError, InputError
from driftwalk.record.bad_row import is_number
from driftwalk.record.raw import MISSING, Array, TableLayout
from driftwalk.record.tables.date_stamps import (
    MOMENT,
    OF_DAY,
    RowError,
    StampForm,
    StampReader,
    Ticks,
    calendar_of,
    clock_of_stamps,
    stamp_form,
)
from driftwalk.record.text import Table, far_origin


class TablePolicy(NamedTuple):
    """How much of a table is looked at before it is read."""

    heading_rows: int = 100
    """Rows among which are the names of the columns and the first row of data; chosen by hand."""
    sample_rows: int = 50
    """Rows by which a table is recognised; chosen by hand."""
    first_rows: int = 100_000
    """Rows that are read where only the first ones are needed; chosen by hand."""


TABLE: Final = TablePolicy()


class TableSource(Protocol):
    """A table with one row per sample."""

    names: list[str]
    """Names of the columns, ``""`` where there is none."""
    units: list[str]
    """Units in a row below the names; empty where there is no such row."""
    has_header: bool
    """Whether the columns have names."""
    matrices: bool
    """Whether numbers after x and y count the columns of matrices, each of which is a body."""

    def sample(self) -> list[list[str]]:
        """Return the first rows as texts."""

    def stamps(self, column: int, /) -> StampForm | None:
        """Return how the first time stamp of a column is written, None where it has none."""

    def read(self, wanted: TableLayout, /, *, head: bool = False) -> Table:
        """Read the columns that a layout names; of the `head` no more than the first rows.

        Raises
        ------
        FormatError
            When a row or a field cannot be read.
        """

    def error(self, message: str, /) -> FormatError:
        """Return an error about the header, or the table where it has none."""


Values = npt.NDArray[Any]

_PLAIN: Final = frozenset({int, float, type(None)})


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
    RowError
        At the first value that is no number.

    Examples
    --------
    >>> as_numbers(np.array([1, None, "2,5"], dtype=object), "x").tolist()
    [1.0, nan, 2.5]
    """
    masked = isinstance(values, np.ma.MaskedArray)
    if values.dtype.kind in "fiu" and not masked:
        return np.array(values, dtype=np.float64)
    cells = values.tolist() if masked or values.dtype.kind in "OUS" else list(values)
    if set(map(type, cells)) <= _PLAIN:
        with contextlib.suppress(OverflowError):
            return np.array(cells, dtype=np.float64)
    plain = [_plain(cell) for cell in cells]
    texts = [cell for cell in plain if isinstance(cell, str)]
    decimal = "," if "," in "".join(texts) and "." not in "".join(texts) else "."
    found = np.empty(len(cells))
    for row, cell in enumerate(plain):
        if isinstance(cell, str):
            if not is_number(cell, decimal=decimal):
                raise RowError(row, f"'{cell:.40}' in column '{name}' is not a number")
            cell = cell.replace(decimal, ".")
        found[row] = float(cell)
    return found


def _plain(cell: Any) -> float | str:
    """Return a value as a number or a text, NaN where it is missing."""
    if isinstance(cell, (bool, np.bool_)):
        return str(cell)
    duration = isinstance(cell, np.timedelta64)  # an integer to Python
    if not duration and (isinstance(cell, numbers.Real) or hasattr(cell, "as_integer_ratio")):
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
    if isinstance(cell, (np.datetime64, np.timedelta64, datetime.time, datetime.timedelta)):
        return StampForm(MOMENT if isinstance(cell, np.datetime64) else OF_DAY)
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
    RowError
        At a value that is no stamp like the first.
    """
    if values.dtype.kind in "Mm":
        reader.kind = MOMENT if values.dtype.kind == "M" else OF_DAY
        # Where NumPy has no time its nanoseconds are those of `NO_TIME`.
        return np.asarray(values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64))
    return reader.read(objects([text_of_cell(cell) for cell in values.tolist()]))


TAKEN: Final = "a path, a DataFrame of pandas or polars, an array or a mapping of columns"


@dataclass
class MemorySource:
    """A table whose columns are arrays; none of them is changed."""

    what: str
    """The table in words, for errors."""
    names: list[str]
    """Names of its columns."""
    columns: list[Values]
    """Their values, each of shape (n,)."""
    _: KW_ONLY
    has_header: bool = True
    """Whether the columns have names."""
    zoned: frozenset[int] = frozenset()
    """Columns of times of NumPy that are in UTC."""
    matrices: bool = False
    """Whether numbers after x and y count the columns of matrices, each of which is a body."""
    units: list[str] = field(default_factory=list)
    """Their units; empty where none are known."""

    def __post_init__(self) -> None:
        for name, column in zip(self.names, self.columns, strict=True):
            where = f"{self.what}: column '{name}'"
            if column.ndim != 1:
                raise InputError(f"{where} has {column.ndim} axes, and has to have one")
            if column.size != self.columns[0].size:
                first = f"'{self.names[0]}' has {self.columns[0].size}"
                raise InputError(f"{where} has {column.size} rows, and {first}")

    @property
    def rows(self) -> int:
        """Number of samples."""
        return self.columns[0].size if self.columns else 0

    def sample(self) -> list[list[str]]:
        """Return the first rows as texts."""
        texts = [
            [text_of_cell(cell) for cell in column[: TABLE.sample_rows].tolist()]
            for column in self.columns
        ]
        return [list(row) for row in zip(*texts, strict=True)]

    def stamps(self, column: int) -> StampForm | None:
        """Return how the first time stamp of a column is written, None where it has none."""
        return form_of(self.columns[column])

    def read(self, wanted: TableLayout, *, head: bool = False) -> Table:
        """Read columns."""
        if not self.rows:
            raise self.error("holds no rows of data")
        taken = slice(TABLE.first_rows if head else None)
        used = {*wanted.numbers, *wanted.texts, *wanted.stamps}
        columns = {at: self.columns[at][taken] for at in used}
        origin, calendar, numbers = 0, "", {}
        if wanted.clock is not None:
            origin = far_origin(np.asarray(columns[wanted.clock]))
        try:
            for at in wanted.numbers:
                values = columns[at] - origin if origin and at == wanted.clock else columns[at]
                numbers[at] = as_numbers(values, wanted.names[at])
            readers = [StampReader(zoned=at in self.zoned) for at in wanted.stamps]
            ticks = list(map(as_ticks, (columns[at] for at in wanted.stamps), readers))
            if wanted.stamps:
                numbers[wanted.stamps[0]], first = clock_of_stamps(ticks, None)
                origin, calendar = first or 0, calendar_of(readers)
        except RowError as error:
            raise self.error_in_row(str(error), error.row) from error
        names = {at: as_names(columns[at]) for at in wanted.texts}
        return Table(
            rows=next(iter(columns.values())).size,
            numbers=numbers,
            codes={at: codes for at, (codes, _) in names.items()},
            labels={at: found for at, (_, found) in names.items()},
            clock_origin=origin,
            calendar=calendar,
        )

    def error_in_row(self, message: str, row: int) -> FormatError:
        """Return an error about a row, from 0."""
        return FormatError(f"{message} (row {row}, counted from 0)")

    def error(self, message: str) -> FormatError:
        """Return an error about the table."""
        return FormatError(message)


def table_in_memory(data: Any) -> MemorySource:
    """Return a table of what a caller in Python holds.

    Parameters
    ----------
    data : object
        A DataFrame of pandas or polars, a structured array, an array with a column per quantity, or
        a mapping of names to columns.

    Raises
    ------
    InputError
        When it is something else, or has no columns of one length.

    Examples
    --------
    >>> table_in_memory({"t": [0.0, 0.1], "x": [1.0, 2.0], "y": [0.0, 0.0]}).names
    ['t', 'x', 'y']
    """
    if hasattr(data, "data_vars"):
        raise InputError("this is a dataset: a recording is loaded of " + TAKEN)
    what = "the mapping of columns"
    if isinstance(data, np.ndarray) and data.dtype.names is not None:
        what, data = "the structured array", {name: data[name] for name in data.dtype.names}
    if isinstance(data, np.ndarray):
        if data.ndim != 2:
            raise InputError(
                "an array has a row per sample and a column per quantity, and this one has the "
                f"shape {data.shape}: separate columns go into a mapping of names to columns"
            )
        return MemorySource("the array", [""] * data.shape[1], [*data.T], has_header=False)
    if hasattr(data, "iloc") and hasattr(data, "columns"):
        return _of_pandas(data)
    if hasattr(data, "get_column") and hasattr(data, "columns"):
        series = [data.get_column(name) for name in data.columns]
        zoned = {at for at, one in enumerate(series) if getattr(one.dtype, "time_zone", None)}
        columns = [np.asarray(one.to_numpy()) for one in series]
        return MemorySource("the DataFrame", list(data.columns), columns, zoned=frozenset(zoned))
    if isinstance(data, Mapping):
        columns = [*map(np.asanyarray, data.values())]  # some may be masked
        return MemorySource(what, [str(name) for name in data], columns)
    lazy = ": collect() it first" if hasattr(data, "collect_schema") else ""
    raise InputError(f"a recording is {TAKEN}; got {type(data).__name__}{lazy}")


def _of_pandas(frame: Any) -> MemorySource:
    """Return the columns of a DataFrame, and its index where that has a name or holds times."""
    # Of a column with several levels those count that have a name.
    parts = [name if isinstance(name, tuple) else (name,) for name in frame.columns]
    names = [" ".join(filter(None, map(str, one))) for one in parts]
    columns = [frame.iloc[:, at] for at in range(len(names))]
    for level in range(frame.index.nlevels):
        index = frame.index.get_level_values(level)
        name = index.name or ("time" if index.dtype.kind in "Mm" else None)
        if name is not None and str(name) not in names:
            names.append(str(name))
            columns.append(index.to_series())
    zoned = frozenset(at for at, one in enumerate(columns) if getattr(one.dtype, "tz", None))
    return MemorySource("the DataFrame", names, [_of_series(one) for one in columns], zoned=zoned)


def _of_series(series: Any) -> Values:
    """Return the values of a column of pandas, times with a zone in UTC."""
    kind = series.dtype
    if getattr(kind, "tz", None):
        series = series.dt.tz_convert("UTC").dt.tz_localize(None)
    missing = hasattr(kind, "na_value") and getattr(kind, "kind", "") in "iuf" and series.hasnans
    return np.asarray(
        series.to_numpy(np.float64, na_value=np.nan) if missing else series.to_numpy()
    )
