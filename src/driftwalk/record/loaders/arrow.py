"""Parquet and Feather, where pyarrow is there: columns as in a plain table."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from driftwalk.core.errors import FormatError, InputError, reason_of
from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.tables.in_memory import table_in_memory
from driftwalk.record.tables.rows import recording_of

_PARQUET: Final = b"PAR1"
_FEATHER: Final = (b"ARROW1", b"FEA1")


class ArrowLoader:
    """Columns, times and units as in a DataFrame."""

    name = "arrow"
    description = "Parquet and Feather (columns as in a plain table; needs pyarrow)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the first letters."""
        return 0.9 if head.startswith((_PARQUET, *_FEATHER)) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the columns."""
        table = table_in_memory(_frame(path))
        if table is None:
            raise FormatError("holds no table", path=path)
        return recording_of(table, options)


def _frame(path: Path) -> Any:
    """Return the columns as a DataFrame of pandas."""
    try:
        from pyarrow import feather, parquet
    except ImportError as error:
        raise InputError(
            "Parquet and Feather need pyarrow: pip install 'driftwalk[arrow]', or save CSV"
        ) from error
    try:
        with path.open("rb") as file:
            read = parquet.read_table if file.read(4) == _PARQUET else feather.read_table
        return read(path).to_pandas()
    except Exception as error:
        # On a damaged file the library fails with whatever the damage leads it to.
        raise FormatError(f"cannot be read by pyarrow: {reason_of(error)}", path=path) from error


LOADER = ArrowLoader()
