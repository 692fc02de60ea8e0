"""MATLAB files (``.mat``): structs of arrays, vectors, matrices."""

from __future__ import annotations

from pathlib import Path

from driftwalk.core.errors import FormatError
from driftwalk.record.column_names import listed
from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.stores.matlab import matlab_variables_of
from driftwalk.record.tables.choose import the_one_that_fits
from driftwalk.record.tables.matlab import matlab_tables, only_matlab
from driftwalk.record.tables.rows import recording_of
from driftwalk.schema.stores.matlab import HDF5_BASED, OLD


class MatlabLoader:
    """Fields and variables are named as the columns of a plain table."""

    name = "matlab"
    description = "MATLAB .mat, versions 5 and 7.3 (struct or vectors t, x, y; `sheet` names one)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the first words."""
        return 0.5 if head.startswith((OLD, HDF5_BASED)) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the variable that holds positions."""
        with matlab_variables_of(path) as variables:
            tables = matlab_tables(variables, path)
            unread = only_matlab(variables)
            if not tables:
                has = listed(list(variables)) or "nothing"
                reason = unread or f"has no struct, vectors or matrix of numbers, only {has}"
                raise FormatError(reason, path=path)
            try:
                return recording_of(the_one_that_fits(tables, options, path, "variable"), options)
            except FormatError as error:
                also = f"; {unread}" if unread else ""
                raise FormatError(f"{error.reason}{also}", path=path) from error


LOADER = MatlabLoader()
