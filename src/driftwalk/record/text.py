"""Tables of numbers in text files: strict, exact, and in bounded memory.

The file is read in blocks of a few megabytes. In each block the fields of every line are counted
first, so that a short or long row cannot slip through, then pandas' C parser reads the numbers
(correctly rounded). Only when a block fails is it read again line by line, to say which line and
column is wrong.
"""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import check_lines
from driftwalk.record.layout import MISSING, TableLayout
from driftwalk.record.raw import Array

BLOCK_BYTES = 4 << 20
GZIP_MAGIC = b"\x1f\x8b"
DAMAGED_GZIP = (gzip.BadGzipFile, EOFError, zlib.error)
"""Exceptions raised by reading a gzip file that is cut off or damaged."""
BOM = b"\xef\xbb\xbf"
HEAD_BYTES = 1 << 16
_EXACT = 1 << 53
LONGEST_LINE = 16 << 20
GZIP_ALLOWANCE = 16 << 20
GZIP_RATIO = 50
"""A gzip file may unpack to this many times its size, and 16 MiB more. Tables of numbers shrink to
a third, of mostly missing ones to a twentieth."""


@dataclass
class Table:
    """Columns of a text file."""

    rows: int
    numbers: dict[int, Array]
    """Column (from 0) to its values."""
    clock_origin: int = 0
    """Offset subtracted from the clock, so that nanoseconds since 1970 stay exact."""
    codes: dict[int, npt.NDArray[np.int32]] = field(default_factory=dict)
    """Text column to the index of each row's value in `labels`."""
    labels: dict[int, list[str]] = field(default_factory=dict)
    """Text column to its distinct values, in order of appearance."""


def open_binary(path: Path) -> IO[bytes]:
    """Open a file for reading, through gzip when its content says so."""
    try:
        with path.open("rb") as file:
            compressed = file.read(2) == GZIP_MAGIC
        return io.BufferedReader(_BoundedGzip(path), 1 << 20) if compressed else path.open("rb")
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        reason = getattr(error, "strerror", None) or error
        raise FormatError(f"cannot be opened: {reason}", path=path) from error


class _BoundedGzip(io.RawIOBase):
    """Contents of a gzip file, as far as text can be packed: zeros shrink by a thousand."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = gzip.open(path, "rb")  # noqa: SIM115
        self._left = GZIP_ALLOWANCE + GZIP_RATIO * path.stat().st_size

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        content = self._file.read(len(buffer))
        self._left -= len(content)
        if self._left < 0:
            raise FormatError(
                f"unpacks to more than {GZIP_RATIO} times its size, which no recording does: "
                "unpack it (gzip -d) if it is one",
                path=self._path,
            )
        buffer[: len(content)] = content
        return len(content)

    def close(self) -> None:
        if not self.closed:
            self._file.close()
        super().close()


def lines_of(file: IO[bytes], path: Path) -> Iterator[tuple[int, bytes]]:
    """Yield the lines of a text file that hold anything, with their numbers from 1.

    Raises
    ------
    FormatError
        When one is longer than any line of a text file.
    """
    number, rest = 1, b""
    while block := file.read(BLOCK_BYTES):
        if not rest and not block.strip():
            number += block.count(b"\n")
            continue
        *lines, rest = (rest + block).split(b"\n")
        refuse_long_line(rest, path, number + len(lines))
        yield from ((at, line) for at, line in enumerate(lines, start=number) if line)
        number += len(lines)
    if rest:
        yield number, rest


def refuse_long_line(line: bytes, path: Path, number: int) -> None:
    """Refuse a line that is longer than any line of a text file."""
    if len(line) > LONGEST_LINE:
        raise FormatError(
            f"has a line of more than {LONGEST_LINE >> 20} MiB: is it a text file?",
            path=path,
            line=number,
        )


def read_head(path: Path) -> bytes:
    """Return the first 64 KiB of a file, uncompressed and without a byte order mark."""
    with open_binary(path) as file:
        try:
            head = file.read(HEAD_BYTES)
        except (OSError, *DAMAGED_GZIP) as error:
            raise FormatError(f"is a damaged gzip file: {error}", path=path) from error
    return head.removeprefix(BOM)


def header_rows(path: Path, count: int) -> list[str]:
    """Return the first lines of a text file, blank ones too, however long, without their ends.

    Raises
    ------
    FormatError
        When one is too long for a text file, or no UTF-8.
    """
    rows = []
    with open_binary(path) as file:
        for number in range(1, count + 1):
            try:
                line = file.readline(LONGEST_LINE + 1)
            except (OSError, *DAMAGED_GZIP) as error:
                raise FormatError(f"cannot be read to its end: {error}", path=path) from error
            refuse_long_line(line, path, number)
            if not line:
                break
            text = line.removeprefix(BOM if number == 1 else b"").removesuffix(b"\n")
            rows.append(decoded_line(text, path, number))
    return rows


def decoded_line(line: bytes, path: Path, number: int) -> str:
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
            path=path,
            line=number,
            column=error.start + 1,
        ) from error


def read_table(path: Path, layout: TableLayout, *, blocks: int | None = None) -> Table:
    """Read the numbered and the text columns of a table.

    Parameters
    ----------
    path : Path
        Text file, may be gzip-compressed.
    layout : TableLayout
        Columns to read.
    blocks : int, optional
        Read no more than so many blocks of 4 MiB; None: the whole file.

    Returns
    -------
    Table
        Values as float64, NaN where a field is empty or says so.

    Raises
    ------
    FormatError
        With line and column, when a row has another number of fields than the header or a field is
        not a number.
    """
    needed = 1 + max((*layout.numbers, *layout.texts))
    if needed > len(layout.names):
        raise FormatError(
            f"expected at least {needed} columns, got {len(layout.names)}: is it another format?",
            path=path,
        )
    chunks: dict[int, list[Array]] = {column: [] for column in layout.numbers}
    codes: dict[int, list[npt.NDArray[np.int32]]] = {column: [] for column in layout.texts}
    labels: dict[int, dict[str, int]] = {column: {} for column in layout.texts}
    rows = 0
    origin = 0
    for line, block in islice(_blocks(path, layout.skip_lines), blocks):
        # pandas fails on a table of blank lines alone.
        if not block.strip(b" \r\n"):
            continue
        frame = _parse(block, layout, path=path, line=line)
        if layout.clock is not None and not rows:
            origin = _far_origin(frame[layout.clock].to_numpy())
        rows += len(frame)
        for column, parts in chunks.items():
            values = frame[column].to_numpy()
            if origin and column == layout.clock:
                values = values - (origin if values.dtype.kind == "i" else float(origin))
            parts.append(values.astype(np.float64, copy=False))
        for column, seen in labels.items():
            codes[column].append(_encode(frame[column], seen))
    if not rows:
        raise FormatError("holds no rows of data", path=path)
    # Column by column, so that no more than one column is ever held twice.
    return Table(
        rows=rows,
        numbers={column: _join(chunks.pop(column)) for column in layout.numbers},
        codes={column: np.concatenate(codes.pop(column)) for column in layout.texts},
        labels={column: list(seen) for column, seen in labels.items()},
        clock_origin=origin,
    )


def _far_origin(values: npt.NDArray[Any]) -> int:
    """Return the first of whole numbers that float64 would round, 0 when it need not."""
    if not values.size or values.dtype.kind != "i" or np.abs(values).max() <= _EXACT:
        return 0
    return int(values[0])


def _join(parts: list[Array]) -> Array:
    joined = np.concatenate(parts)
    parts.clear()
    return joined


def _blocks(path: Path, skip_lines: int) -> Iterator[tuple[int, bytes]]:
    """Yield (number of the first line, whole lines) until the file ends."""
    line = 1 + skip_lines
    with open_binary(path) as file:
        try:
            for _ in range(skip_lines):
                file.readline(LONGEST_LINE)
            if not skip_lines:
                start = file.read(len(BOM))
                rest = b"" if start == BOM else start
            else:
                rest = b""
            while block := file.read(BLOCK_BYTES):
                whole, newline, tail = (rest + block).rpartition(b"\n")
                rest = tail
                refuse_long_line(rest, path, line + whole.count(b"\n"))
                if newline:
                    yield line, whole + newline
                    line += whole.count(b"\n") + 1
            if rest.strip():
                yield line, rest + b"\n"
        except (OSError, *DAMAGED_GZIP) as error:
            raise FormatError(f"cannot be read to its end: {error}", path=path) from error


def _parse(block: bytes, layout: TableLayout, *, path: Path, line: int) -> Any:
    """Return the block as a data frame, or raise a `FormatError` that says where it is wrong."""
    import pandas as pd

    fields = _field_counts(block, layout.delimiter)
    expected = len(layout.names)
    whole = fields[fields > 0]
    width = expected
    if (whole != expected).any():
        check_lines(block, layout, path=path, line=line)
        width = max(expected, int(whole.max(initial=0)))
    # The stubs of pandas cannot follow options in a dictionary.
    exact: Any = {} if _pandas_is_exact(pd.__version__) else {"float_precision": "round_trip"}
    try:
        frame = pd.read_csv(
            io.BytesIO(block),
            header=None,
            names=list(range(width)),
            usecols=sorted({*layout.numbers, *layout.texts}),
            dtype=dict.fromkeys(layout.texts, str),
            sep=r"\s+" if layout.delimiter == " " else layout.delimiter,
            na_values=list(MISSING),
            keep_default_na=False,
            index_col=False,
            skipinitialspace=True,
            low_memory=False,
            engine="c",
            **exact,
        )
    except (ValueError, UnicodeDecodeError) as error:
        check_lines(block, layout, path=path, line=line)
        raise FormatError(f"cannot be read as a table: {error}", path=path, line=line) from error
    if any(frame[column].dtype.kind not in "iuf" for column in layout.numbers):
        check_lines(block, layout, path=path, line=line)
        raise FormatError("has a column that is not numbers", path=path, line=line)
    if b'"' in block and len(frame) != whole.size:
        raise FormatError("has a quotation mark that is not closed", path=path, line=line)
    return frame


def _pandas_is_exact(version: str) -> bool:
    """Whether pandas' default parsing of floats is correctly rounded (from 3.1 on)."""
    major, minor = (int(part) for part in version.split(".")[:2])
    return (major, minor) >= (3, 1)


def _field_counts(block: bytes, delimiter: str) -> npt.NDArray[np.int64]:
    """Count the fields of each line of a block; 0 for a blank line."""
    characters = np.frombuffer(block, dtype=np.uint8)
    ends = np.flatnonzero(characters == ord("\n"))
    if delimiter == " ":
        blank = np.isin(characters, np.frombuffer(b" \t\r\n", dtype=np.uint8))
        first = np.concatenate(([True], blank[:-1])) & ~blank
        return np.diff(np.searchsorted(np.flatnonzero(first), ends), prepend=0)
    starts = np.concatenate(([0], ends[:-1] + 1))
    separators = characters == ord(delimiter)
    if b'"' in block:
        separators &= ~_quoted(characters, starts)
    fields = np.add.reduceat(separators, starts, dtype=np.int64) + 1
    # A line of blanks alone holds no field; it may hold delimiters when these are tabs.
    for line in np.flatnonzero((fields == 1) | (ends - starts < 2 * fields)):
        if not block[starts[line] : ends[line]].strip():
            fields[line] = 0
    return fields


def _quoted(
    characters: npt.NDArray[np.uint8], starts: npt.NDArray[np.int64]
) -> npt.NDArray[np.bool_]:
    """Return what stands between quotation marks, of lines in which all of them are closed."""
    marks = (characters == ord('"')).astype(np.int64)
    before = np.cumsum(marks)
    per_line = np.add.reduceat(marks, starts)
    lengths = np.diff(np.append(starts, characters.size))
    within = before - np.repeat(before[starts] - marks[starts], lengths)
    closed = np.repeat(per_line % 2 == 0, lengths)
    return np.asarray((within % 2 == 1) & closed)


def _encode(values: Any, seen: dict[str, int]) -> npt.NDArray[np.int32]:
    """Turn the texts of a column into numbers, adding new ones to `seen`."""
    import pandas as pd

    local, found = pd.factorize(values.fillna("").astype(str))
    index = np.array([seen.setdefault(str(text), len(seen)) for text in found], dtype=np.int32)
    return index[local]
