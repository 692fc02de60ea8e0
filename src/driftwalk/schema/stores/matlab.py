"""MATLAB files: which they are, the names of their variables, and what scipy reads of old ones."""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.schema.stores.netcdf import most_bytes, refuse_huge

MOST_ELEMENTS: Final = 200_000
"""Elements of an array of structs or cells that are read; chosen by hand."""
_SIZES: Final = {"int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "single": 4, "logical": 1}
"""Bytes of an element by MATLAB's class; all others have 8."""
OLD: Final = b"MATLAB 5.0 MAT-file"
"""Start of the format that MATLAB writes unless a user chooses another."""
HDF5_BASED: Final = b"MATLAB 7.3 MAT-file"
"""Start of the format for large variables, an HDF5 file behind half a kilobyte of text."""


def matlab_variables(path: Path) -> list[str]:
    """Return the names of a file's variables, [] when it is no file of MATLAB's or damaged.

    Parameters
    ----------
    path : Path
        Any file.
    """
    try:
        with path.open("rb") as file:
            old = file.read(len(OLD)) == OLD
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _old_variables(path) if old else _hdf5_variables(path)
    except Exception:  # whatever the damage of a file leads the libraries to
        return []


def read_old(path: Path) -> dict[str, Any]:
    """Return what scipy reads from a file of the old format, by the variables' names.

    Parameters
    ----------
    path : Path
        A file that begins with `OLD`.

    Raises
    ------
    FormatError
        When the file declares more than it can hold, more than 200,000 structs or cells, or an
        element of no known type. Of other damage scipy raises what it likes.
    """
    from scipy.io import loadmat

    with warnings.catch_warnings():
        # Of two variables of one name the later counts, as in MATLAB.
        warnings.simplefilter("ignore")
        _refuse_declared(path)
        refuse_unknown_elements(path)
        content: dict[str, Any] = loadmat(path, appendmat=False)
    return {name: value for name, value in content.items() if not name.startswith("__")}


def refuse_many(count: float, path: Path | None = None) -> None:
    """Refuse an array of more structs or cells than are read.

    Parameters
    ----------
    count : float
        How many there are.
    path : Path, optional
        The file.

    Raises
    ------
    FormatError
        When there are more.
    """
    if count > MOST_ELEMENTS:
        raise FormatError(
            f"has an array of {count:.0f} structs or cells, and {MOST_ELEMENTS} are read: save a "
            "struct of arrays (table2struct(T, 'ToScalar', true))",
            path=path,
        )


def _refuse_declared(path: Path) -> None:
    """Refuse what a file declares and cannot hold.

    Of objects scipy knows no shape, and gives up.
    """
    from scipy.io import whosmat

    try:
        declared = whosmat(path, appendmat=False)
        size = sum(int(_count(shape)) * _SIZES.get(kind, 8) for _, shape, kind in declared)
    except TypeError:
        return
    refuse_huge(size, path)
    for _, shape, kind in declared:
        if kind in ("struct", "cell"):
            refuse_many(_count(shape), path)


def _count(shape: tuple[int, ...]) -> float:
    return float(np.prod([float(length) for length in shape]))


def _old_variables(path: Path) -> list[str]:
    from scipy.io import whosmat

    return [str(name) for name, _, _ in whosmat(path, appendmat=False)]


def _hdf5_variables(path: Path) -> list[str]:
    import h5py

    with h5py.File(path, "r") as file:
        return [str(name) for name in file if not str(name).startswith("#")]


_BEGIN: Final = 128
"""Bytes of text, version and byte order before the first variable."""
_MATRIX: Final = 14
"""Number of the type of an array (miMATRIX in MATLAB's description of MAT-files)."""
_COMPRESSED: Final = 15
"""Number of the type of a compressed element (miCOMPRESSED)."""
_KNOWN: Final = frozenset({*range(1, 8), 9, 12, 13, _MATRIX, 16, 17, 18})
"""Numbers of the types that an element inside a variable may have."""
_TAG: Final = 8
"""Bytes of a tag: two numbers of 32 bits, type and size."""


def refuse_unknown_elements(path: Path) -> None:
    """Refuse a file of MATLAB's old format with an element of an unknown type.

    A variable is a nest of elements, and each begins with the number of its type. scipy looks the
    number up unchecked: of a type that does not exist scipy 1.17 ends the process by a segmentation
    fault, which no error handler catches.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    FormatError
        Says the type; where a packed variable cannot be unpacked.
    """
    with path.open("rb") as file:
        order = {b"IM": "<", b"MI": ">"}.get(file.read(_BEGIN)[-2:])
        if order is None:
            return  # scipy says what is wrong with it
        while len(tag := file.read(_TAG)) == _TAG:
            kind, size = struct.unpack(f"{order}II", tag)
            # A size beyond the end would be made room for.
            content = file.read(min(size, path.stat().st_size))
            if kind == _COMPRESSED:
                content = _unpacked(content, path)
                kind, size = struct.unpack(f"{order}II", content[:_TAG].ljust(_TAG, b"\x00"))
                content = content[_TAG : _TAG + size]
            unknown = _unknown_in(content, order) if kind == _MATRIX else None
            if unknown is not None:
                raise FormatError(f"is damaged: unknown MATLAB element type {unknown}", path=path)


def _unpacked(content: bytes, path: Path) -> bytes:
    """Return what is packed in a variable, no more than a sound file of this size holds."""
    unpack = zlib.decompressobj()
    try:
        found = unpack.decompress(content, most_bytes(path))
    except zlib.error as error:
        raise FormatError(
            f"is damaged: a variable cannot be unpacked: {error}", path=path
        ) from error
    if unpack.unconsumed_tail:
        refuse_huge(most_bytes(path) + 1, path)
    return found


def _unknown_in(content: bytes, order: str) -> int | None:
    """Walk through the elements of a variable, into those that hold others."""
    at = 0
    while at + _TAG <= len(content):
        kind, size = struct.unpack_from(f"{order}II", content, at)
        at += _TAG
        if kind >> 16:
            kind &= 0xFFFF  # a short element, whose content is in the place of its size
            size = 0
        elif kind == _MATRIX:
            size = 0
        if kind not in _KNOWN:
            # Nothing but zeros to the end is a filling.
            return kind if kind or content[at:].strip(b"\x00") else None
        at += -(-size // 8) * 8
    return None
