"""Text in the encodings that spreadsheets write, handed on as UTF-8."""

from __future__ import annotations

import codecs
import io
import re
from pathlib import Path
from typing import IO, Any, Final

from driftwalk.core.errors import FormatError

UTF16: Final = "UTF-16"
"""Encoding of "Unicode text", which begins with a byte order mark."""
WINDOWS: Final = "Windows-1252"
"""Encoding of "CSV" in western Europe and America, with one byte for a letter such as µ or °."""
_CODECS: Final = {UTF16: "utf-16", WINDOWS: "cp1252"}
_MARKS: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_NO_TEXT: Final = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")


def other_encoding(start: bytes) -> str | None:
    """Return the encoding of a text that is not UTF-8, None for UTF-8 and for what is not text.

    Parameters
    ----------
    start : bytes
        The first bytes of the text, which may end in the middle of a letter.

    Examples
    --------
    >>> other_encoding("x [µm]".encode("cp1252")), other_encoding("x [µm]".encode())
    ('Windows-1252', None)
    """
    if start.startswith(_MARKS):
        return UTF16
    if start.isascii() or _NO_TEXT.search(start):
        return None
    try:
        start.decode("utf-8")
    except UnicodeDecodeError as error:
        # A letter of UTF-8 has four bytes at most, and may be cut.
        if error.start >= len(start) - 4 and error.reason == "unexpected end of data":
            return None
    else:
        return None
    try:
        start.decode(_CODECS[WINDOWS])
    except UnicodeDecodeError:
        return None
    return WINDOWS


class TranscodedText(io.RawIOBase):
    """The contents of a text file as UTF-8, without a byte order mark."""

    def __init__(self, file: IO[bytes], encoding: str, path: Path) -> None:
        self._file = file
        self._path = path
        self._encoding = encoding
        self._decoder = codecs.getincrementaldecoder(_CODECS[encoding])()
        self._rest = memoryview(b"")
        self._ended = False

    def readable(self) -> bool:
        """Return that it can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer with the next bytes of the text."""
        while not self._rest and not self._ended:
            piece = self._file.read(1 << 20)
            self._ended = not piece
            self._rest = memoryview(self._decoded(piece))
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
                f"begins as {self._encoding} text but does not go on as such: save the file as "
                "UTF-8",
                path=self._path,
            ) from error
