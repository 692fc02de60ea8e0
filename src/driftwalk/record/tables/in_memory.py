"""Columns in memory as a table: data frames, arrays, a mapping of columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record.raw import TableLayout
from driftwalk.record.tables.cells import (
    CellError,
    Values,
    as_names,
    as_numbers,
    as_ticks,
    form_of,
    text_of_cell,
)
from driftwalk.record.tables.source import TABLE
from driftwalk.record.tables.stamps import (
    StampError,
    StampForm,
    StampReader,
    calendar_of,
    clock_of_stamps,
)
from driftwalk.record.text import Table, far_origin

TAKEN: Final = "a path, a DataFrame of pandas or polars, an array or a mapping of columns"


class MemorySource:
    """A table whose columns are arrays; none of them is changed.

    Parameters
    ----------
    what : str
        The table in words, for errors.
    names : list of str
        Names of its columns.
    columns : list of array, shape (n,)
        Their values.
    has_header : bool
        Whether the columns have names.
    zoned : set of int
        Columns of times of NumPy that are in UTC.
    matrices : bool
        Whether numbers after x and y count the columns of matrices, each of which is a body.
    units : sequence of str
        Their units; empty where none are known.
    """

    def __init__(
        self,
        what: str,
        names: list[str],
        columns: list[Values],
        *,
        has_header: bool = True,
        zoned: frozenset[int] = frozenset(),
        matrices: bool = False,
        units: Sequence[str] = (),
    ) -> None:
        self.what = what
        self.names = names
        self.units = list(units)
        self.has_header = has_header
        self.matrices = matrices
        self._columns = columns
        self._zoned = zoned

    @property
    def rows(self) -> int:
        """Number of samples."""
        return self._columns[0].size if self._columns else 0

    def column(self, at: int) -> Values:
        """Return the values of a column, which must not be changed."""
        return self._columns[at]

    def sample(self) -> list[list[str]]:
        """Return the first rows as texts."""
        texts = [
            [text_of_cell(cell) for cell in column[: TABLE.sample_rows].tolist()]
            for column in self._columns
        ]
        return [list(row) for row in zip(*texts, strict=True)]

    def stamps(self, column: int) -> StampForm | None:
        """Return how the first time stamp of a column is written, None where it has none."""
        return form_of(self._columns[column])

    def read(self, wanted: TableLayout, *, head: bool = False) -> Table:
        """Read columns."""
        if not self.rows:
            raise FormatError("holds no rows of data")
        taken = slice(TABLE.first_rows if head else None)
        used = {*wanted.numbers, *wanted.texts, *wanted.stamps}
        try:
            return table_of({at: self._columns[at][taken] for at in used}, wanted, self._zoned)
        except (CellError, StampError) as error:
            raise FormatError(f"{error} (row {error.row}, counted from 0)") from error

    def error(self, message: str) -> FormatError:
        """Return an error about the table."""
        return FormatError(message)


def table_of(
    columns: Mapping[int, Values], wanted: TableLayout, zoned: frozenset[int] = frozenset()
) -> Table:
    """Return the numbers, names and times of columns.

    Raises
    ------
    CellError, StampError
        At the first value that is not of the kind that its column has to be of.
    """
    origin, numbers = 0, {}
    if wanted.clock is not None:
        origin = far_origin(np.asarray(columns[wanted.clock]))
    for at in wanted.numbers:
        values = columns[at] - origin if origin and at == wanted.clock else columns[at]
        numbers[at] = as_numbers(values, wanted.names[at])
    names = {at: as_names(columns[at]) for at in wanted.texts}
    calendar = ""
    if wanted.stamps:
        readers = [StampReader() for _ in wanted.stamps]
        pairs = zip(wanted.stamps, readers, strict=True)
        ticks = [as_ticks(columns[at], reader) for at, reader in pairs]
        for at, reader in zip(wanted.stamps, readers, strict=True):
            reader.zoned |= at in zoned
        numbers[wanted.stamps[0]], first = clock_of_stamps(ticks, None)
        origin, calendar = first or 0, calendar_of(readers)
    return Table(
        rows=next(iter(columns.values())).size,
        numbers=numbers,
        codes={at: codes for at, (codes, _) in names.items()},
        labels={at: found for at, (_, found) in names.items()},
        clock_origin=origin,
        calendar=calendar,
    )


def table_in_memory(data: Any) -> MemorySource | None:
    """Return a table of what a caller in Python holds, None of a path.

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
    if isinstance(data, str) or hasattr(data, "__fspath__"):
        return None
    if hasattr(data, "data_vars"):
        raise InputError("this is a dataset: a recording is loaded of " + TAKEN)
    if isinstance(data, np.ndarray):
        return _of_array(data)
    if hasattr(data, "iloc") and hasattr(data, "columns"):
        return _of_pandas(data)
    if hasattr(data, "get_column") and hasattr(data, "columns"):
        return _of_polars(data)
    if isinstance(data, Mapping):
        columns = [
            np.ma.asarray(one) if np.ma.isMA(one) else np.asarray(one) for one in data.values()
        ]
        return _checked("the mapping of columns", [str(name) for name in data], columns)
    lazy = ": collect() it first" if hasattr(data, "collect_schema") else ""
    raise InputError(f"a recording is {TAKEN}; got {type(data).__name__}{lazy}")


def _checked(
    what: str, names: list[str], columns: list[Values], zoned: frozenset[int] = frozenset()
) -> MemorySource:
    """Return a table whose columns have one length."""
    for name, column in zip(names, columns, strict=True):
        if column.ndim != 1:
            raise InputError(f"{what}: column '{name}' has {column.ndim} axes, and has to have one")
        if column.size != columns[0].size:
            raise InputError(
                f"{what}: column '{name}' has {column.size} rows, and '{names[0]}' has "
                f"{columns[0].size}"
            )
    return MemorySource(what, names, columns, zoned=zoned)


def _of_array(data: Values) -> MemorySource:
    if data.dtype.names is not None:
        if data.ndim != 1:
            raise InputError(f"the structured array has {data.ndim} axes, and has to have one")
        names = list(data.dtype.names)
        return _checked("the structured array", names, [data[name] for name in names])
    if data.ndim != 2:
        raise InputError(
            "an array has a row per sample and a column per quantity, and this one has the shape "
            f"{data.shape}: separate columns go into a mapping of names to columns"
        )
    columns = [data[:, at] for at in range(data.shape[1])]
    return MemorySource("the array", [""] * len(columns), columns, has_header=False)


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
    values = [_of_series(one) for one in columns]
    return _checked("the DataFrame", names, values, zoned)


def _of_series(series: Any) -> Values:
    """Return the values of a column of pandas, times with a zone in UTC."""
    kind = series.dtype
    if getattr(kind, "tz", None):
        series = series.dt.tz_convert("UTC").dt.tz_localize(None)
    missing = hasattr(kind, "na_value") and getattr(kind, "kind", "") in "iuf" and series.hasnans
    return np.asarray(
        series.to_numpy(np.float64, na_value=np.nan) if missing else series.to_numpy()
    )


def _of_polars(frame: Any) -> MemorySource:
    names = list(frame.columns)
    columns = [frame.get_column(name) for name in names]
    zoned = frozenset(at for at, one in enumerate(columns) if getattr(one.dtype, "time_zone", None))
    return _checked("the DataFrame", names, [np.asarray(one.to_numpy()) for one in columns], zoned)
