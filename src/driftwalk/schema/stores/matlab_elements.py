"""Elements of MATLAB's old format, looked through before scipy reads them.

A variable is a nest of elements, and each begins with the number of its type. scipy looks the
number up without asking whether there is such a type, and ends the whole program where there is
none. Nothing but the beginnings is read here.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, Protocol

from driftwalk.core.errors import FormatError

_BEGIN: Final = 128
"""Bytes of text, version and byte order before the first variable."""
_MATRIX: Final = 14
_COMPRESSED: Final = 15
_KNOWN: Final = frozenset({*range(1, 8), 9, 12, 13, _MATRIX, 16, 17, 18})
"""Numbers of the types that an element inside a variable may have."""
_TAG: Final = 8
_BLOCK: Final = 1 << 16


class _Bytes(Protocol):
    """A file, or what is packed in it, from front to back."""

    def read(self, count: int, /) -> bytes:
        """Return the next bytes, fewer at the end."""


def refuse_unknown_elements(path: Path) -> None:
    """Refuse a file of MATLAB's old format in which an element has a type that there is not.

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
            after = file.tell() + size
            unknown = _unknown_in(file, kind, size, order, path)
            if unknown is not None:
                raise FormatError(
                    f"is damaged: an element in it has the type {unknown}, which there is not",
                    path=path,
                )
            file.seek(after)


def _unknown_in(file: BinaryIO, kind: int, size: int, order: str, path: Path) -> int | None:
    """Return a type inside a variable that there is not, None where all are known."""
    if kind == _MATRIX:
        return _first_unknown(file, size, order)
    if kind != _COMPRESSED:
        return None  # scipy refuses it
    try:
        packed = _Unpacked(file, size)
        tag = packed.read(_TAG)
        if len(tag) < _TAG:
            return None
        kind, inside = struct.unpack(f"{order}II", tag)
        return _first_unknown(packed, inside, order) if kind == _MATRIX else None
    except zlib.error as error:
        raise FormatError(
            f"is damaged: a variable cannot be unpacked: {error}", path=path
        ) from error


def _first_unknown(content: _Bytes, left: int, order: str) -> int | None:
    """Walk through the elements of a variable, into those that hold others."""
    while left >= _TAG:
        tag = content.read(_TAG)
        if len(tag) < _TAG:
            return None
        left -= _TAG
        kind, size = struct.unpack(f"{order}II", tag)
        if kind >> 16:
            kind &= 0xFFFF  # a short element, whose content is in the place of its size
            size = 0
        elif kind == _MATRIX:
            size = 0
        if kind not in _KNOWN:
            rest = (block.strip(b"\x00") for block in _blocks(content, left))
            # Nothing but zeros to the end is a filling.
            return kind if kind or any(rest) else None
        whole = -(-size // 8) * 8
        for _ in _blocks(content, min(whole, left)):
            pass
        left -= whole
    return None


def _blocks(content: _Bytes, count: int) -> Iterator[bytes]:
    """Yield so many bytes in parts, fewer where the content ends."""
    while count > 0 and (block := content.read(min(count, _BLOCK))):
        count -= len(block)
        yield block


class _Unpacked:
    """A packed variable, unpacked as far as it is read."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self._left = file, size
        self._packed = zlib.decompressobj()
        self._rest = b""

    def read(self, count: int, /) -> bytes:
        """Return the next bytes, fewer at the end."""
        parts: list[bytes] = []
        while count > 0:
            if not self._rest:
                self._rest = self._file.read(min(_BLOCK, self._left))
                self._left -= len(self._rest)
            part = self._packed.decompress(self._rest, count)
            ended = not part and (self._packed.eof or not self._rest)
            self._rest = self._packed.unconsumed_tail
            if ended:
                break
            parts.append(part)
            count -= len(part)
        return b"".join(parts)
