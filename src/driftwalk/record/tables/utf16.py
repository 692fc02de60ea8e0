"""UTF-16 text, which spreadsheets write as "Unicode text", handed on as UTF-8."""

from __future__ import annotations

import codecs
import io
from pathlib import Path
from typing import IO, Any, Final

from driftwalk.core.errors import FormatError

MARKS: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
"""Byte order marks, by one of which such a file begins."""
_PIECE: Final = 1 << 20


class Utf16Text(io.RawIOBase):
    """The contents of a UTF-16 file as UTF-8, without the byte order mark."""

    def __init__(self, file: IO[bytes], path: Path) -> None:
        self._file = file
        self._path = path
        self._decoder = codecs.getincrementaldecoder("utf-16")()
        self._rest = b""
        self._ended = False

    def readable(self) -> bool:
        """Return that it can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer with the next bytes of the text."""
        while not self._rest and not self._ended:
            piece = self._file.read(_PIECE)
            self._ended = not piece
            self._rest = self._decoded(piece)
        part = self._rest[: len(buffer)]
        self._rest = self._rest[len(part) :]
        buffer[: len(part)] = part
        return len(part)

    def close(self) -> None:
        """Close the file."""
        if not self.closed:
            self._file.close()
        super().close()

    def _decoded(self, piece: bytes) -> bytes:
        try:
            return self._decoder.decode(piece, final=self._ended).encode("utf-8")
        except UnicodeError as error:
            raise FormatError(
                "begins as UTF-16 text but does not go on as such: save the file as UTF-8",
                path=self._path,
            ) from error
