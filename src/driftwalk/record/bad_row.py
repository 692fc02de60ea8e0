"""Find the unreadable row of a text table and its error.

Slow and plain: it runs only on a block that has already failed.
"""

from __future__ import annotations

import csv

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import MISSING, TableLayout

DELIMITER_NAMES = {",": "a comma", "\t": "a tab", ";": "a semicolon", " ": "blanks"}


def check_lines(block: bytes, layout: TableLayout, *, line: int, decimal: str = ".") -> int:
    """Return the fields of the longest row; raise a `FormatError` at the first row that is wrong.

    Parameters
    ----------
    block : bytes
        Whole lines.
    layout : TableLayout
        Columns that were to be read.
    line : int
        Number of the block's first line in the file, from 1.
    decimal : {".", ","}
        Decimal sign of the numbers.
    """
    widest, expected = 0, len(layout.names)
    for offset, raw in enumerate(block.split(b"\n")):
        number = line + offset
        text = decoded_line(raw, number)
        if "\0" in text:
            raise FormatError("has a zero byte: this is not a text file", line=number)
        if not text.strip():
            continue
        fields = split_fields(text, layout.delimiter)
        widest = max(widest, len(fields))
        if len(fields) > expected and not any(fields[expected:]):
            fields = fields[:expected]
        if len(fields) != expected:
            commas = layout.delimiter == "," and len(fields) > 1 and "." not in text
            hint = " (if decimals are written with a comma, save them with a point)"
            between = DELIMITER_NAMES.get(layout.delimiter, repr(layout.delimiter))
            what = f"expected {expected} fields separated by {between}, got {len(fields)}"
            raise FormatError(what + hint if commas else what, line=number)
        for column in layout.numbers:
            value = fields[column]
            if value not in MISSING and not is_number(value, decimal=decimal):
                raise FormatError(
                    f"'{value:.40}' in column '{layout.names[column]}' is not a number"
                    f"{_other_sign(value, decimal)}",
                    line=number,
                    column=column + 1,
                )
    return widest


def decoded_line(line: bytes, number: int) -> str:
    """Return a line as text, without the carriage return at its end.

    Raises
    ------
    FormatError
        When it is not UTF-8.
    """
    try:
        return line.decode("utf-8").rstrip("\r")
    except UnicodeDecodeError as error:
        raise FormatError(
            f"is not UTF-8 text (byte 0x{line[error.start]:02x}): save the file as UTF-8",
            line=number,
            column=error.start + 1,
        ) from error


def _other_sign(value: str, decimal: str) -> str:
    """Return what is wrong with a number of another decimal sign than those before it."""
    other = "," if decimal == "." else "."
    if not is_number(value, decimal=other):
        return ""
    signs = {".": "a point", ",": "a comma"}
    return f": it has {signs[other]} as decimal sign, and other numbers have {signs[decimal]}"


def split_fields(text: str, delimiter: str) -> list[str]:
    """Split one line into its fields, without blanks around them; quotes are understood."""
    if delimiter == " ":
        return text.split()
    try:
        row = next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:
        row = text.split(delimiter)
    return [value.strip() for value in row]


def is_number(text: str, *, decimal: str = ".") -> bool:
    """Whether a field is a plain decimal number (no ``1_000``, no words but inf and nan).

    Parameters
    ----------
    text : str
        The field.
    decimal : {".", ","}
        The decimal sign that it has to have, where it has decimals.

    Examples
    --------
    >>> is_number("1,5"), is_number("1,5", decimal=","), is_number("1.5", decimal=",")
    (False, True, False)
    """
    if "_" in text or (decimal == "," and "." in text):
        return False
    try:
        float(text.replace(decimal, ".", 1))
    except ValueError:
        return False
    return True
