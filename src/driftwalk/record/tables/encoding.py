"""Text in the encodings that spreadsheets write, handed on as UTF-8."""

from __future__ import annotations

import codecs
import io
import re
from typing import Any, Final

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

    def __init__(self, file: io.BufferedReader, encoding: str) -> None:
        self._file = io.TextIOWrapper(file, _CODECS[encoding], newline="")
        self._encoding = encoding

    def readable(self) -> bool:
        """Return that it can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer with the next bytes of the text."""
        try:
            # A letter of these encodings has up to four bytes in UTF-8.
            piece = self._file.read(max(len(buffer) // 4, 1)).encode("utf-8")
        except UnicodeError as error:
            raise FormatError(
                f"begins as {self._encoding} text but does not go on as such: save the file as "
                "UTF-8"
            ) from error
        buffer[: len(piece)] = piece
        return len(piece)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()
