"""Elements of MATLAB's old format, looked through before scipy reads them.

A variable is a nest of elements, and each begins with the number of its type. scipy looks the
number up unchecked: of a type that does not exist scipy 1.17 ends the process by a segmentation
fault, which no error handler catches. So the types are checked here first.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.schema.stores.netcdf import most_bytes, refuse_huge

_BEGIN: Final = 128
"""Bytes of text, version and byte order before the first variable."""
_MATRIX: Final = 14
_COMPRESSED: Final = 15
_KNOWN: Final = frozenset({*range(1, 8), 9, 12, 13, _MATRIX, 16, 17, 18})
"""Numbers of the types that an element inside a variable may have."""
_TAG: Final = 8


def refuse_unknown_elements(path: Path) -> None:
    """Refuse a file of MATLAB's old format with an element of an unknown type.

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
