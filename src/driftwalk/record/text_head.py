"""Facts from the first lines of a text file: delimiter, header, number of columns."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

from driftwalk.core.errors import FormatError, naming_its_file
from driftwalk.record.bad_row import decoded_line, is_number, split_fields
from driftwalk.record.raw import MISSING
from driftwalk.record.tables.stamps import stamp_form
from driftwalk.record.text import header_rows, read_head

_COMMA_DECIMAL = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_DELIMITER_LINE = re.compile(r"sep=(.)\s*", re.IGNORECASE)
"""First line that states the delimiter to a spreadsheet."""
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
"""Bytes that no text file holds."""


def first_lines(head: bytes, count: int = 5) -> list[str]:
    """Return the first whole lines of a file's start; bytes that are not UTF-8 are replaced.

    Nothing is returned when the bytes cannot be text.
    """
    if not _is_text(head):
        return []
    lines = head.split(b"\n", count)
    return [line.decode("utf-8", "replace").rstrip("\r") for line in lines[:count] if line.strip()]


@lru_cache(maxsize=1)
def _is_text(head: bytes) -> bool:
    # One loader after the other asks of the same head.
    return _CONTROL.search(head) is None


def first_line(head: bytes) -> str:
    """Return the first line of a file's start, ``""`` when it is blank or cannot be text."""
    return next(iter(first_lines(head, 1)), "")


def first_names(head: bytes) -> list[str]:
    """Return the fields between the commas of the first line of a file's start."""
    return split_fields(first_line(head), ",")


def detect_delimiter(lines: list[str]) -> str:
    """Return the character that separates the fields of the first lines; a blank when none does.

    A tab or semicolon wins over a comma, since a comma may also be a decimal sign; blanks come
    last, since they stand in names, but before a comma that is the decimal sign of every field.
    """
    fields = [field for line in lines[:2] for field in line.split()]
    if len(fields) > len(lines[:2]) and all(_COMMA_DECIMAL.fullmatch(field) for field in fields):
        return " "
    for delimiter in "\t;,":
        if lines and all(delimiter in line for line in lines[:2]):
            return delimiter
    return next((delimiter for delimiter in "\t;," if lines and delimiter in lines[0]), " ")


def is_numeric_row(fields: list[str]) -> bool:
    """Whether a row is data: each field is a number, a time or missing, and one at least is not."""
    known = [field for field in fields if field not in MISSING]
    return bool(known) and all(
        is_number(field) or is_number(field, decimal=",") or stamp_form(field) is not None
        for field in known
    )


@naming_its_file
def read_header(
    path: Path, *, delimiter: str | None = None, header_line: int | None = None
) -> tuple[list[str], str, int, bool]:
    """Return (names of the columns, delimiter, lines before the data, whether there is a header).

    The header is line `header_line`, from 1, where that is given. Otherwise lines that start with
    ``#`` before it are comments; a header may start with ``#`` or ``%`` itself when it is the last
    of them and has as many fields as the data.

    Raises
    ------
    FormatError
        When the file is empty, ends before its header, or its first lines are not UTF-8 text.
    """
    if header_line is not None:
        return _header_at(path, header_line, delimiter)
    head = read_head(path)
    if b"\0" in head:
        raise FormatError("is not a text file")
    raw = head.split(b"\n")
    stated = _DELIMITER_LINE.fullmatch(raw[0].decode("utf-8", "replace"))
    begin = 1 if stated else 0
    at = next(
        (
            number
            for number, line in enumerate(raw)
            if number >= begin and line.strip() and not line.startswith(b"#")
        ),
        None,
    )
    if at is None:
        raise FormatError("the file is empty")
    lines = [decoded_line(line, number) for number, line in enumerate(raw[: at + 2], start=1)]
    separator = delimiter or (stated[1] if stated else detect_delimiter(lines[at : at + 2]))
    fields = _without_trailing(split_fields(lines[at], separator))
    if not is_numeric_row(fields):
        return fields, separator, at + 1, True
    previous = [line for line in lines[begin:at] if line.strip()]
    if previous:
        commented = _without_trailing(split_fields(previous[-1].lstrip("# "), separator))
        if len(commented) == len(fields) > 1:
            return commented, separator, at, True
    return [""] * len(fields), separator, at, False


def first_row(path: Path, delimiter: str = ",") -> list[str]:
    """Return the fields of the first line of a table, however long, [] where there is none.

    Raises
    ------
    FormatError
        When it is no text.
    """
    return split_fields(next(iter(header_rows(path, 1)), ""), delimiter)


def _without_trailing(fields: list[str]) -> list[str]:
    """Drop one empty field that a delimiter at the end of a line leaves."""
    return fields[:-1] if len(fields) > 1 and not fields[-1] else fields


def _header_at(path: Path, number: int, delimiter: str | None) -> tuple[list[str], str, int, bool]:
    """Return what `read_header` does, with the header in a line that the user names."""
    lines = header_rows(path, number + 1)
    if len(lines) <= number or not lines[number].strip():
        raise FormatError(f"has no rows of data below line {number}, its header")
    separator = delimiter or detect_delimiter(lines[number - 1 :])
    names, data = (split_fields(line.lstrip("# "), separator) for line in lines[number - 1 :])
    # A delimiter at the end of a line leaves a field without a name, in the header or in the data.
    names += [""] * (len(data) - len(names))
    return (_without_trailing(names) if len(data) < len(names) else names), separator, number, True
