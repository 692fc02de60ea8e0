"""Files as MATLAB writes them, of what no library here writes: version 7.3, and objects."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

_UINT8, _INT32, _UINT32, _MATRIX, _INT8 = 2, 5, 6, 14, 1
_OPAQUE_CLASS, _UINT32_CLASS = 17, 13


def hdf5_file(path: Path, fill: Callable[[h5py.File], None]) -> Path:
    """Write a file of version 7.3: HDF5 behind the half kilobyte of MATLAB's own header."""
    with h5py.File(path, "w", userblock_size=512) as file:
        fill(file)
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, synthetic".ljust(116) + bytes(8) + b"\0\2IM"
    with path.open("r+b") as file:
        file.write(header)
    return path


def numbers(place: h5py.Group, name: str, values: Any, kind: str = "double") -> None:
    """Add a variable or field; MATLAB stores columns first."""
    entry = place.create_dataset(name, data=np.atleast_2d(values).T)
    entry.attrs["MATLAB_class"] = np.bytes_(kind)


def struct_of(place: h5py.Group, name: str, fields: dict[str, Any]) -> None:
    """Add a struct of columns."""
    group = place.create_group(name)
    group.attrs["MATLAB_class"] = np.bytes_("struct")
    for field, values in fields.items():
        numbers(group, field, np.asarray(values)[:, None])


def elements_of(file: h5py.File, name: str, elements: list[dict[str, Any]]) -> None:
    """Add an array of structs: each field refers to the elements' values."""
    hidden = file.require_group("#refs#")
    group = file.create_group(name)
    group.attrs["MATLAB_class"] = np.bytes_("struct")
    for field in elements[0]:
        references = np.empty((len(elements), 1), dtype=h5py.ref_dtype)
        for at, element in enumerate(elements):
            numbers(hidden, f"{field}{at}", np.atleast_1d(element[field])[:, None])
            references[at, 0] = hidden[f"{field}{at}"].ref
        group.create_dataset(field, data=references, dtype=h5py.ref_dtype)


def object_of_hdf5(file: h5py.File, name: str, kind: str) -> None:
    """Add an object, of which a file holds numbers that mean something to MATLAB alone."""
    entry = file.create_dataset(name, data=np.zeros((1, 6), np.uint32))
    entry.attrs["MATLAB_class"] = np.bytes_(kind)
    entry.attrs["MATLAB_object_decode"] = np.int32(3)
    file.require_group("#subsystem#")


def object_file(path: Path, name: str, kind: str) -> Path:
    """Write a file of version 5 with one object."""
    inner = _element(_UINT32, struct.pack("<II", _UINT32_CLASS, 0))
    inner += _element(_INT32, struct.pack("<ii", 6, 1)) + _element(_INT8, b"")
    inner += _element(_UINT32, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))
    body = _element(_UINT32, struct.pack("<II", _OPAQUE_CLASS, 0))
    body += b"".join(_element(_INT8, text.encode()) for text in (name, "MCOS", kind))
    body += _element(_MATRIX, inner)
    header = b"MATLAB 5.0 MAT-file, Platform: GLNXA64, synthetic".ljust(116) + bytes(8) + b"\0\1IM"
    path.write_bytes(header + _element(_MATRIX, body))
    return path


def _element(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)
