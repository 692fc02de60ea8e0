"""Variables of MATLAB files, of the old format and of the one that is HDF5, in one form."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, damaged_as
from driftwalk.record.stores.hdf5 import Hdf5Contents, opened_hdf5, text_of
from driftwalk.schema.stores.matlab import HDF5_BASED, OLD, read_old, refuse_many

_CLASS: Final = "MATLAB_class"


@dataclass(frozen=True)
class Struct:
    """A struct, or an array of structs."""

    elements: list[dict[str, Value]]
    """The fields of each element."""


@dataclass(frozen=True)
class Opaque:
    """An object that only MATLAB can read."""

    kind: str
    """Its class: table, timetable, datetime, string, ..."""


Value = npt.NDArray[Any] | str | list[Any] | Struct | Opaque | None
"""An array of numbers with two axes or more, a text, a cell array as a list, or none of these."""


@contextmanager
def matlab_variables_of(path: Path) -> Iterator[dict[str, Value]]:
    """Return the variables of a file by their names.

    Raises
    ------
    FormatError
        When it is no file of MATLAB's, is damaged, or declares more than it can hold.
    """
    with path.open("rb") as file:
        start = file.read(len(OLD))
    if start == HDF5_BASED:
        with opened_hdf5(path) as contents:
            names = [str(name) for name in contents.file if not str(name).startswith("#")]
            yield {name: _hdf5_value(contents, name) for name in names}
    elif start == OLD:
        with damaged_as("as a MATLAB file", path):
            content = read_old(path)
        # The name of an opaque object is inside it.
        names = {
            name: text_of(value["s0"].ravel()[0]) if _is_opaque(value) else ""
            for name, value in content.items()
        }
        yield {names[name] or name: _old_value(value) for name, value in content.items()}
    else:
        raise FormatError("is no MATLAB file of version 5 or 7.3")


def _is_opaque(value: Any) -> bool:
    names = getattr(getattr(value, "dtype", None), "names", None)
    return names is not None and {"s0", "s1", "s2"} <= set(names)


def _old_value(value: Any) -> Value:
    """Return a value of scipy's in the form that both formats share."""
    if _is_opaque(value):
        return Opaque(text_of(value["s2"].ravel()[0]))
    if not isinstance(value, np.ndarray):
        return None
    if value.dtype.names is not None:
        refuse_many(value.size)
        fields = value.dtype.names
        return Struct(
            [{name: _old_value(one[name]) for name in fields} for one in value.ravel(order="F")]
        )
    if value.dtype.kind == "O":
        refuse_many(value.size)
        return [_old_value(one) for one in value.ravel(order="F")]
    if value.dtype.kind == "U":
        return _texts([str(row) for row in value.ravel()])
    return value if value.dtype.kind in "fiub" else None


def _hdf5_value(contents: Hdf5Contents, name: str) -> Value:
    """Return an entry of an HDF5 file in the form that both formats share."""
    import h5py

    entry = contents.file[name]
    kind = text_of(entry.attrs.get(_CLASS, b""))
    if isinstance(entry, h5py.Group):
        return _hdf5_struct(contents, entry) if kind in ("struct", "") else Opaque(kind)
    if not isinstance(entry, h5py.Dataset):
        return None
    if "MATLAB_object_decode" in entry.attrs:
        return Opaque(kind)
    if "MATLAB_empty" in entry.attrs:
        return np.empty((0, 0))
    if entry.dtype.kind == "O":
        return [_hdf5_value(contents, one) for one in _referred(contents, entry)]
    if entry.dtype.kind not in "fiub":
        return None
    # Columns come first in MATLAB.
    values = contents.array(name).T
    if kind == "char":
        return _texts(["".join(map(chr, row)) for row in np.atleast_2d(values).tolist()])
    return values


def _texts(rows: list[str]) -> Value:
    """Return a matrix of letters as the text of its only row, or as one text a row."""
    texts: list[Any] = [row.strip() for row in rows]
    return texts if len(texts) > 1 else "".join(texts)


def _hdf5_struct(contents: Hdf5Contents, group: Any) -> Struct:
    """Return a struct; of an array of them each field holds references to the elements' values."""
    import h5py

    many: dict[str, list[str]] = {}
    one: dict[str, Value] = {}
    for field in map(str, group):
        entry = group[field]
        kind = text_of(entry.attrs.get(_CLASS, b""))
        references = isinstance(entry, h5py.Dataset) and entry.dtype.kind == "O"
        if references and kind != "cell":
            many[field] = _referred(contents, entry)
        else:
            one[field] = _hdf5_value(contents, str(entry.name))
    lengths = {len(names) for names in many.values()}
    if not many:
        return Struct([one])
    if len(lengths) > 1:
        raise FormatError(f"'{group.name}' has fields of different lengths")
    return Struct(
        [
            {field: _hdf5_value(contents, names[at]) for field, names in many.items()}
            for at in range(lengths.pop())
        ]
    )


def _referred(contents: Hdf5Contents, entry: Any) -> list[str]:
    """Return the names of the entries that a cell array refers to, in MATLAB's order."""
    refuse_many(entry.size)
    references = contents.array(str(entry.name)).T.ravel(order="F")
    return [str(contents.file[reference].name) for reference in references]
