"""Arrays: ``.npy`` with a row per sample, ``.npz`` and HDF5 by name, Parquet and Feather."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import InputError, damaged_as
from driftwalk.record.column_names import column_meaning
from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.stores.hdf5 import Hdf5Contents, opened_hdf5, text_of
from driftwalk.record.stores.npz import NPY, ZIP, members, opened_npz
from driftwalk.record.tables.in_memory import table_in_memory
from driftwalk.record.tables.matlab import Struct, Value, matlab_tables
from driftwalk.record.tables.rows import recording_of, the_one_that_fits
from driftwalk.record.vocabulary import ALLOWED
from driftwalk.schema.stores.netcdf import HDF5, file_start

_RATES: Final = ("fps", "frame_rate", "framerate", "frame_rate_hz", "frames_per_second")


class ArraysLoader:
    """Names of arrays, or of the fields of a structured one, are read as those of columns."""

    name = "arrays"
    description = "NumPy .npy (`columns` by number), .npz and HDF5 with arrays t, x, y"

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise arrays of numbers, and names of positions."""
        if head.startswith(NPY):
            return 0.4 if b"'|O'" not in head[:200] else 0.0
        if head.startswith(ZIP):
            names = members(path)
            # One array alone is a matrix.
            return 0.3 if _are_positions(names) else 0.2 * (len(names) == 1)
        return 0.3 if head.startswith(HDF5) and _holds_positions(path) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the array, or those that belong together."""
        start = file_start(path)
        if start.startswith(NPY):
            return _of_array(path, options)
        if start.startswith(ZIP):
            with opened_npz(path) as arrays:
                return _of_arrays({name: _value(arrays[name]) for name in arrays}, options)
        with opened_hdf5(path) as contents:
            return _of_arrays(_of_hdf5(contents), options)


def _are_positions(names: set[str]) -> bool:
    meanings = (column_meaning(name) for name in names)
    return {"x", "y"} <= {one.quantity for one in meanings if one is not None}


def _holds_positions(path: Path) -> bool:
    """Whether an HDF5 file holds positions at its top or in a group."""
    try:
        with opened_hdf5(path) as contents:
            if "#refs#" in contents.file:
                # Cells and structs of MATLAB: its own loader knows which of them are recordings.
                return False
            groups = [one for one in contents.file.values() if hasattr(one, "keys")]
            # The axes of a grid are no positions.
            names = (
                {str(name) for name, one in group.items() if not getattr(one, "is_scale", False)}
                for group in (contents.file, *groups)
            )
            return any(map(_are_positions, names))
    except InputError:
        return False


def _of_array(path: Path, options: ReadOptions) -> RawRecording:
    """Return the recording of one array, whose rows are samples."""
    with damaged_as("as .npy", path):
        array = np.load(path, allow_pickle=False)
    if array.ndim == 2 and array.dtype.names is None and array.shape[0] < array.shape[1]:
        # There are more samples than quantities, whichever way they lie.
        array = array.T
    table = table_in_memory(array.ravel() if array.dtype.names is not None else array)
    return recording_of(table, options)


def _of_arrays(variables: dict[str, Value], options: ReadOptions) -> RawRecording:
    """Return the recording of arrays by name, at the frame rate that the file holds."""
    tables = matlab_tables(variables)
    recording = recording_of(the_one_that_fits(tables, options, "array"), options)
    rates = [value for name, value in variables.items() if name.lower() in _RATES]
    if len(rates) == 1 and isinstance(rates[0], np.ndarray) and rates[0].size == 1:
        recording.frame_rate_hz = float(rates[0].ravel()[0])
    return recording


def _value(array: np.ndarray[Any, Any]) -> Value:
    """Return an array in the form of a MATLAB variable: with two axes."""
    if array.dtype.names is not None:
        return Struct([{name: _value(array[name]) for name in array.dtype.names}])
    if array.dtype.kind in "SU":
        return [one.decode() if isinstance(one, bytes) else str(one) for one in array.ravel()]
    if array.dtype.kind == "M":
        array = array.astype("datetime64[ns]").astype(np.int64)
    if array.dtype.kind not in "fiub" or array.ndim > 2:
        return None
    return array[:, None] if array.ndim < 2 and array.size > 1 else np.atleast_2d(array)


def _of_hdf5(contents: Hdf5Contents) -> dict[str, Value]:
    """Return the arrays at the top of an HDF5 file, and its groups as structs."""
    found: dict[str, Value] = {}
    for name, entry in contents.file.items():
        if hasattr(entry, "keys"):
            inner = [one for one in entry if hasattr(entry[one], "shape")]
            found[str(name)] = Struct(
                [
                    {
                        _with_unit(str(one), entry[one]): _value(contents.array(f"{name}/{one}"))
                        for one in inner
                    }
                ]
            )
        elif hasattr(entry, "shape"):
            found[_with_unit(str(name), entry)] = _value(contents.array(str(name)))
    found |= {
        str(name): np.atleast_2d(np.float64(value))
        for name, value in contents.file.attrs.items()
        if str(name).lower() in _RATES and np.size(value) == 1
    }
    return found


def _with_unit(name: str, entry: Any) -> str:
    """Return the name of an array with the unit in its attributes, where that is one of its own."""
    stated = next((entry.attrs[key] for key in ("units", "unit") if key in entry.attrs), "")
    unit = text_of(stated).strip()
    meaning = column_meaning(name)
    if meaning is None or meaning.unit or not ALLOWED[meaning.quantity] or not unit:
        return name
    return f"{name} [{unit}]"


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
        try:
            from pyarrow import feather, parquet
        except ImportError as error:
            raise InputError(
                "Parquet and Feather need pyarrow: pip install 'driftwalk[arrow]', or save CSV"
            ) from error
        with damaged_as("by pyarrow", path):
            is_parquet = file_start(path).startswith(_PARQUET)
            frame = (parquet if is_parquet else feather).read_table(path).to_pandas()
        return recording_of(table_in_memory(frame), options)


LOADERS = (ArraysLoader(), ArrowLoader())
