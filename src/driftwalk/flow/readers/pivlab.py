"""PIVlab ``.mat``: one field for each pair of images, in MATLAB's old format or its HDF5."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import FormatError, damaged_as
from driftwalk.flow.readers.text import masked_rows
from driftwalk.flow.readers.units import RawField
from driftwalk.schema.stores.hdf5_texts import refuse_endless_texts
from driftwalk.schema.stores.matlab import HDF5_BASED, OLD, matlab_variables, read_old
from driftwalk.schema.stores.netcdf import HDF5, declared_bytes, refuse_elsewhere, refuse_huge

_ENDINGS: Final = ("_filtered", "_original", "")
"""Of what PIVlab saves of the velocities, the first that is there is read."""
_NUMBERED: Final = re.compile(r"u_(\d+)")
_FACTORS: Final = (("calxy",), ("calu", "caluv"), ("calv", "caluv"))
"""Factors of positions, u and v to m and m/s; of several the first that is there counts."""
_MOST_FRAMES: Final = 10_000
"""Frames that are read: a damaged file may claim any number. Chosen by hand."""


class _File(NamedTuple):
    """A file in either format of MATLAB."""

    names: list[str]
    read: Callable[[str], list[Any]]
    """Returns the arrays of a variable, several when it is a cell array."""


def is_pivlab(path: Path) -> bool:
    """Return whether a file is one of MATLAB's."""
    with path.open("rb") as file:
        head = file.read(len(OLD))
    named = path.suffix.lower() == ".mat"
    return head.startswith((OLD, HDF5_BASED, *((HDF5,) if named else ())))


def holds_velocities(path: Path) -> bool:
    """Whether a file of MATLAB's has velocities as PIVlab names them.

    Parameters
    ----------
    path : Path
        A file of MATLAB's, which may be damaged.
    """
    names = set(matlab_variables(path))
    numbered = any(_NUMBERED.fullmatch(name) for name in names)
    return numbered or any({f"u{ending}", f"v{ending}"} <= names for ending in _ENDINGS)


def read(path: Path) -> RawField:
    """Read all frames and average them: the file does not hold the times between them.

    PIVlab's y counts downwards. Masked and replaced vectors are missing.

    Raises
    ------
    FormatError
        When there is no field in the file, or frames differ in their nodes.
    """
    with _opened(path) as file:
        frames = [frame for names in _frames(file) for frame in _frame(file, names)]
        length, velocity, scale = _units(file)
    if not frames:
        has = ", ".join(file.names[:12])
        raise FormatError(f"has no velocities of PIVlab (x, y, u, v), only {has}")
    nodes = frames[0][:, :2]
    if len(frames) > _MOST_FRAMES or not all(np.array_equal(f[:, :2], nodes) for f in frames):
        raise FormatError("the frames have different nodes: save one alone")
    values = np.column_stack([nodes, _mean(np.stack(frames)[:, :, 2:])]) * scale
    line = np.arange(1, len(values) + 1, dtype=np.intp)
    notes = []
    if len(frames) > 1:
        notes.append(f"the flow is the mean of {len(frames)} frames: the file holds no times")
    rows = masked_rows(line, values, np.zeros(len(values), dtype=bool))
    return RawField(rows, length, velocity, down=True, notes=notes, reading="PIVlab's .mat")


def _mean(velocity: Floats) -> Floats:
    """Return the mean over frames at each node, shape (n, 2), NaN where no frame has any."""
    count = np.isfinite(velocity).sum(axis=0)
    return np.where(count > 0, np.nansum(velocity, axis=0) / np.maximum(count, 1), np.nan)


@contextmanager
def _opened(path: Path) -> Iterator[_File]:
    """Open a file of MATLAB; what goes wrong inside becomes a `FormatError`."""
    with path.open("rb") as binary:
        old = binary.read(len(OLD)) == OLD
    with damaged_as("as a MATLAB file", path):
        if old:
            yield _old_file(path)
            return
        import h5py

        refuse_endless_texts(path)
        with h5py.File(path, "r") as file:
            refuse_elsewhere(file, path)
            refuse_huge(_declared(file), path)
            yield _File(list(file), lambda name: _hdf5_arrays(file, name))


def _old_file(path: Path) -> _File:
    content = read_old(path)

    def arrays(name: str) -> list[Any]:
        values = content[name]
        return list(values.ravel()) if values.dtype.kind == "O" else [values]

    return _File(list(content), arrays)


def _hdf5_arrays(file: Any, name: str) -> list[Any]:
    import h5py

    entry = file[name]
    if not isinstance(entry, h5py.Dataset):
        return []
    if entry.dtype.kind != "O":
        return [entry[...]]
    if entry.size > _MOST_FRAMES:
        raise FormatError(f"'{name}' has {entry.size} frames, more than the {_MOST_FRAMES} read")
    return [file[reference][...] for reference in entry[...].ravel()]


def _declared(file: Any) -> int:
    """Return how many bytes the arrays of a file have in memory by its header."""
    sizes: list[int] = []
    # A visitor that returns anything ends the visit.
    file.visititems(lambda _, entry: sizes.append(declared_bytes(entry)))
    return sum(sizes)


def _frames(file: _File) -> list[list[str]]:
    """Return the names of the arrays of each frame, or of all where they are cell arrays.

    They are x, y, u, v and the type of the vectors.
    """
    numbers = sorted(int(match[1]) for name in file.names if (match := _NUMBERED.fullmatch(name)))
    if numbers:
        kinds = ("x", "y", "u", "v", "typevector")
        return [[f"{kind}_{number}" for kind in kinds] for number in numbers]
    for ending in _ENDINGS:
        if {f"u{ending}", f"v{ending}"} <= set(file.names):
            return [["x", "y", *(f"{kind}{ending}" for kind in ("u", "v", "typevector"))]]
    return []


def _frame(file: _File, names: list[str]) -> Iterator[Floats]:
    """Yield x, y, u, v of every frame, shape (n, 4), NaN where a vector was not measured."""
    *needed, kind = names
    if lacking := [name for name in needed if name not in file.names]:
        raise FormatError(f"has no variable '{lacking[0]}'")
    columns = [file.read(name) for name in needed]
    kinds = file.read(kind) if kind in file.names else []
    if len({len(arrays) for arrays in columns}) != 1 or len(kinds) not in (0, len(columns[0])):
        raise FormatError("has different numbers of frames in x, y, u and v")
    for number, arrays in enumerate(zip(*columns, strict=True)):
        if not arrays[0].size:
            continue  # PIVlab leaves the cells of pairs that it was not asked for empty
        shapes = {array.shape for array in arrays}
        if len(shapes) != 1 or any(array.dtype.kind not in "fiu" for array in arrays):
            raise FormatError(f"x, y, u and v of frame {number + 1} are no matrices of one size")
        frame = np.column_stack([array.ravel().astype(np.float64) for array in arrays])
        if kinds and kinds[number].shape == arrays[0].shape:
            # Type 1 was measured; 0 is masked, 2 was replaced by its neighbours.
            frame[kinds[number].ravel() != 1, 2:] = np.nan
        yield frame


def _units(file: _File) -> tuple[str, str, Floats]:
    """Return the units of positions and velocities, and the factors to them.

    An export says its units and is calibrated. A session has pixels, and factors to m and m/s that
    are 1 without a calibration.
    """
    if "units" in file.names:
        text = _text(file.read("units"))
        length, velocity = ("m", "m/s") if "[m]" in text else ("px", "px/frame")
        return length, velocity, np.ones(4)
    place, u, v = (_factor(file, names) for names in _FACTORS)
    if place == 1.0:
        return "px", "px/frame", np.ones(4)
    return "m", "m/s", np.array([place, place, u, v])


def _factor(file: _File, names: tuple[str, ...]) -> float:
    name = next((one for one in names if one in file.names), None)
    return 1.0 if name is None else float(np.ravel(file.read(name)[0])[0])


def _text(arrays: list[Any]) -> str:
    """Return a text of MATLAB, which its HDF5 keeps as the numbers of the letters."""
    values = np.ravel(arrays[0])
    return "".join(chr(value) for value in values) if values.dtype.kind == "u" else str(values)
