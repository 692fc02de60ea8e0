"""Arrays: NumPy, HDF5 by name, Parquet and Feather, and MATLAB files with tracks of other programs.

``.npy`` has a row per sample; MATLAB files hold structs, vectors, matrices. Ctrax and JAABA: an
array of structs, one a body, each with its first frame. FlyTracker: one array over body, frame and
field, with the names of the fields. Robotarium: five rows for each robot.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError, damaged_as, listed
from driftwalk.record.column_names import column_meaning, quantity_of
from driftwalk.record.containers import (
    NPY,
    ZIP,
    Hdf5Contents,
    members,
    opened_hdf5,
    opened_npz,
    text_of,
)
from driftwalk.record.raw import Array, RawBody, RawRecording, ReadOptions
from driftwalk.record.tables.in_memory import table_in_memory
from driftwalk.record.tables.matlab import (
    Value,
    elements_of,
    matlab_tables,
    matlab_variables_of,
    only_matlab,
)
from driftwalk.record.tables.rows import recording_of, the_one_that_fits
from driftwalk.record.unit_and_column_words import ALLOWED
from driftwalk.schema.stores.matlab import HDF5_BASED, OLD, matlab_variables
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
            stated: dict[str, Value] = {
                str(name): np.atleast_2d(np.float64(value))
                for name, value in contents.file.attrs.items()
                if str(name).lower() in _RATES and np.size(value) == 1
            }
            return _of_arrays(_of_hdf5(contents, contents.file) | stated, options)


def _are_positions(names: set[str]) -> bool:
    return {"x", "y"} <= set(map(quantity_of, names))


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
    recording = recording_of(the_one_that_fits(matlab_tables(variables), options, "array"), options)
    rates = [value for name, value in variables.items() if name.lower() in _RATES]
    if len(rates) == 1 and isinstance(rates[0], np.ndarray) and rates[0].size == 1:
        recording.frame_rate_hz = float(rates[0].ravel()[0])
    return recording


def _value(array: np.ndarray[Any, Any]) -> Value:
    """Return an array in the form of a MATLAB variable: with two axes."""
    if array.dtype.names is not None:
        return [{name: _value(array[name]) for name in array.dtype.names}]
    if array.dtype.kind in "SU":
        return [one.decode() if isinstance(one, bytes) else str(one) for one in array.ravel()]
    if array.dtype.kind == "M":
        array = array.astype("datetime64[ns]").astype(np.int64)
    if array.dtype.kind not in "fiub" or array.ndim > 2:
        return None
    return array[:, None] if array.ndim < 2 and array.size > 1 else np.atleast_2d(array)


def _of_hdf5(contents: Hdf5Contents, group: Any, above: str = "") -> dict[str, Value]:
    """Return the arrays of a file or of a group in it, and the groups of a file as structs."""
    found: dict[str, Value] = {}
    for name in map(str, group):
        entry = group[name]
        if hasattr(entry, "shape"):
            found[_with_unit(name, entry)] = _value(contents.array(above + name))
        elif hasattr(entry, "keys") and not above:
            found[name] = [_of_hdf5(contents, entry, f"{name}/")]
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


class ArrowLoader:
    """Columns, times and units as in a DataFrame."""

    name = "arrow"
    description = "Parquet and Feather (columns as in a plain table; needs pyarrow)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the first letters."""
        return 0.9 if head.startswith((_PARQUET, b"ARROW1", b"FEA1")) else 0.0

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
            tables = matlab_tables(variables)
            unread = only_matlab(variables)
            if not tables:
                has = listed(list(variables)) or "nothing"
                reason = unread or f"has no struct, vectors or matrix of numbers, only {has}"
                raise FormatError(reason)
            try:
                return recording_of(the_one_that_fits(tables, options, "variable"), options)
            except FormatError as error:
                raise FormatError(f"{error.reason}{unread and f'; {unread}'}") from error


ROBOT_ROWS: Final = 5
"""x, y, theta, speed and turn rate of a robot."""


class MatlabTracksLoader:
    """One body for each struct, row of an array or robot."""

    name = "matlab-tracks"
    description = "MATLAB tracks of Ctrax and JAABA (trx), FlyTracker (trk), Robotarium"

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the name of the variable."""
        known = head.startswith((OLD, HDF5_BASED)) and set(_READERS) & set(matlab_variables(path))
        try:
            return 0.9 if known and _tracks(path) is not None else 0.0
        except FormatError:
            return 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every body."""
        recording = _tracks(path)
        if recording is None or not recording.bodies:
            raise FormatError(
                f"has no tracks: it needs one of {', '.join(_READERS)} in the layout of its program"
            )
        return recording


def _tracks(path: Path) -> RawRecording | None:
    """Return the tracks of a file, None where no variable has the layout of its program."""
    with matlab_variables_of(path) as variables:
        name = next((one for one in _READERS if one in variables), None)
        return None if name is None else _READERS[name](variables[name])


def _ctrax(value: Value) -> RawRecording | None:
    """Return the bodies of Ctrax: millimetres where it knows them, y as in the image."""
    elements = elements_of(value)
    if not elements or not {"x", "y", "firstframe"} <= set(elements[0]):
        return None
    scaled = {"x_mm", "y_mm"} <= set(elements[0])
    stamped = all(
        "timestamps" in one and _values(one["timestamps"]).size == _values(one["x"]).size > 0
        for one in elements
    )
    bodies = []
    for at, one in enumerate(elements, start=1):
        x, y = (_values(one[f"{axis}_mm" if scaled else axis]) for axis in "xy")
        theta = _values(one["theta"]) if "theta" in one else None
        first = _one_number(one["firstframe"], 1.0)
        frames = np.arange(x.size, dtype=np.float64) + (first - 1.0)
        clock = _values(one["timestamps"]) if stamped else frames
        name = _one_number(one.get("id"), float(at))
        bodies.append(RawBody(f"{name:g}", clock, x, y, theta))
    rate = _one_number(elements[0].get("fps"), 0.0)
    raw = RawRecording(bodies, "s", "mm" if scaled else "px", y_axis="down", separate=True)
    if not stamped:
        raw.clock_unit, raw.frame_rate_hz = "frame", rate if rate > 0.0 else None
    return raw


def _flytracker(value: Value) -> RawRecording | None:
    """Return the bodies of FlyTracker: pixels, y down, but angles with y up."""
    fields = next(iter(elements_of(value)), {})
    names, data = fields.get("names"), fields.get("data")
    if not isinstance(names, list) or not isinstance(data, np.ndarray) or data.ndim not in (2, 3):
        return None
    # Of one body MATLAB keeps the first axis, and of one field drops the last.
    stack = data.reshape(data.shape[0], -1, len(names)) if data.ndim == 2 else data
    if stack.shape[2] != len(names) or not {"pos x", "pos y"} <= set(map(str, names)):
        return None
    at = {str(name): index for index, name in enumerate(names)}
    used = [at[name] for name in ("pos x", "pos y", "ori") if name in at]
    bodies = _over_frames(stack[:, :, used].transpose(0, 2, 1))
    return RawRecording(bodies, length_unit="px", y_axis="down", theta_axis="up", separate=True)


def _robotarium(value: Value) -> RawRecording | None:
    """Return the robots of the Robotarium: metres, y up, a column for each step of 33 ms."""
    if not isinstance(value, np.ndarray) or value.ndim != 2 or value.dtype.kind not in "fiu":
        return None
    count, stamps = divmod(value.shape[0], ROBOT_ROWS)
    if not count or stamps > 1:
        return None
    robots = value[: ROBOT_ROWS * count].reshape(count, ROBOT_ROWS, value.shape[1])
    bodies = _over_frames(robots[:, :3])
    notes = ["every column counts as a frame; the Robotarium steps each 33 ms unless it is late"]
    if stamps:
        notes.append("the time stamps in the last row have no unit and are not read")
    return RawRecording(bodies, "frame", "m", y_axis="up", notes=notes, separate=True)


def _over_frames(values: np.ndarray[Any, Any]) -> list[RawBody]:
    """Return the bodies of values over body, quantity (x, y and perhaps theta) and frame."""
    clock = np.arange(values.shape[2], dtype=np.float64)
    return [RawBody(str(at), clock, *map(_values, of)) for at, of in enumerate(values, start=1)]


_READERS: Final[dict[str, Callable[[Value], RawRecording | None]]] = {
    "trx": _ctrax,
    "trk": _flytracker,
    "robotarium_data": _robotarium,
}
"""From the name of a variable to what makes a recording of it."""


def _values(value: Any) -> Array:
    return np.array(value, dtype=np.float64).ravel()


def _one_number(value: Any, otherwise: float) -> float:
    known = isinstance(value, np.ndarray) and value.size == 1 and value.dtype.kind in "fiu"
    return float(value.ravel()[0]) if known else otherwise


LOADERS = (ArraysLoader(), ArrowLoader(), MatlabLoader(), MatlabTracksLoader())
