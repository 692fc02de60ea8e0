"""Find the row of a text table that cannot be read, and say what is wrong with it.

Slow and plain: it runs only on a block that has already failed.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

from driftwalk.core.errors import FormatError
from driftwalk.record.layout import MISSING, TableLayout

DELIMITER_NAMES = {",": "a comma", "\t": "a tab", ";": "a semicolon", " ": "blanks"}
_COMMA_DECIMAL = re.compile(r"[+-]?\d+,\d+")


def check_lines(block: bytes, layout: TableLayout, *, path: Path, line: int) -> None:
    """Raise a `FormatError` at the first row of a block that is wrong; return if none is.

    Parameters
    ----------
    block : bytes
        Whole lines.
    layout : TableLayout
        Columns that were to be read.
    path : Path
        The file, for the message.
    line : int
        Number of the block's first line in the file, from 1.
    """
    for offset, raw in enumerate(block.split(b"\n")):
        text = _decode(raw, path=path, line=line + offset)
        if text.strip():
            _check_row(text, layout, path=path, line=line + offset)


def _decode(raw: bytes, *, path: Path, line: int) -> str:
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError as error:
        raise FormatError(
            f"is not UTF-8 text (byte 0x{raw[error.start]:02x}): save the file as UTF-8",
            path=path,
            line=line,
            column=error.start + 1,
        ) from error
    if "\0" in text:
        raise FormatError("has a zero byte: this is not a text file", path=path, line=line)
    return text


def _check_row(text: str, layout: TableLayout, *, path: Path, line: int) -> None:
    fields = split_fields(text, layout.delimiter)
    expected = len(layout.names)
    if len(fields) > expected and not any(fields[expected:]):
        fields = fields[:expected]
    if len(fields) != expected:
        hint = _decimal_hint(text, layout.delimiter, got=len(fields))
        raise FormatError(
            f"expected {expected} fields separated by "
            f"{DELIMITER_NAMES.get(layout.delimiter, repr(layout.delimiter))}, "
            f"got {len(fields)}{hint}",
            path=path,
            line=line,
        )
    for column in layout.numbers:
        value = fields[column]
        if value not in MISSING and not is_number(value):
            hint = (
                ": decimals are written with a comma, save them with a point"
                if _COMMA_DECIMAL.fullmatch(value)
                else ""
            )
            raise FormatError(
                f"'{_short(value)}' in column '{layout.names[column]}' is not a number{hint}",
                path=path,
                line=line,
                column=column + 1,
            )


def _decimal_hint(text: str, delimiter: str, *, got: int) -> str:
    if delimiter == "," and got > 1 and "." not in text:
        return " (if decimals are written with a comma, save them with a point)"
    return ""


def _short(value: str) -> str:
    return value if len(value) <= 40 else value[:37] + "..."


def split_fields(text: str, delimiter: str) -> list[str]:
    """Split one line into its fields, without blanks around them; quotes are understood."""
    if delimiter == " ":
        return text.split()
    try:
        row = next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:
        row = text.split(delimiter)
    return [value.strip() for value in row]


def is_number(text: str) -> bool:
    """Whether a field is a plain decimal number (no ``1_000``, no words but inf and nan)."""
    if "_" in text:
        return False
    try:
        float(text)
    except ValueError:
        return False
    return True
