"""Tables of numbers in text files: strict, exact, and in bounded memory.

The file is read in blocks of a few megabytes. In each block the fields of every line are counted
first, so that a short or long row cannot slip through, then pandas' C parser reads the numbers
(correctly rounded), with a point or a comma as decimal sign, and time stamps become numbers. Only
when a block fails is it read again line by line, to say which line and column is wrong.
"""

from __future__ import annotations

import codecs
import contextlib
import gzip
import io
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Bools, Codes, Integers
from driftwalk.core.errors import DAMAGED, FormatError, naming_its_file
from driftwalk.record.bad_row import check_lines, decoded_line
from driftwalk.record.raw import MISSING, NAMELESS, Array, TableLayout
from driftwalk.record.tables.date_stamps import RowError, StampReader, calendar_of, clock_of_stamps

UTF16: Final = "UTF-16"
"""Encoding of "Unicode text", which begins with a byte order mark."""
WINDOWS: Final = "Windows-1252"
"""Encoding of "CSV" in western Europe and America, with one byte for a letter such as µ or °."""
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
    for encoding, other in (("UTF-8", None), (WINDOWS, WINDOWS)):
        # Not as a whole: its last letter may be cut.
        with contextlib.suppress(UnicodeDecodeError):
            codecs.getincrementaldecoder(encoding)().decode(start)
            return other
    return None


class TranscodedText(io.RawIOBase):
    """The contents of a text file as UTF-8, without a byte order mark."""

    def __init__(self, file: io.BufferedReader, encoding: str) -> None:
        self._file = io.TextIOWrapper(file, encoding, newline="")
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
            what = f"begins as {self._encoding} text but does not go on as such"
            raise FormatError(f"{what}: save the file as UTF-8") from error
        buffer[: len(piece)] = piece
        return len(piece)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()


class TextPolicy(NamedTuple):
    """How text files are read in bounded memory."""

    block_bytes: int = 4 << 20
    """Bytes that are parsed at once; chosen by hand."""
    head_bytes: int = 1 << 16
    """Bytes by which a file is recognised; chosen by hand."""
    longest_line: int = 16 << 20
    """Bytes of a line at most; chosen by hand."""
    gzip_allowance: int = 16 << 20
    """Bytes that any gzip file may unpack to; chosen by hand."""
    gzip_ratio: int = 50
    """Times its size that a gzip file may unpack to beyond that. Measured: tables of numbers shrink
    to a third, of mostly missing ones to a twentieth."""


TEXT: Final = TextPolicy()

_BUFFER: Final = 1 << 20
"""Bytes that are read ahead: few calls of the decoder in Python for each block; chosen by hand."""
GZIP_MAGIC = b"\x1f\x8b"
BOM = b"\xef\xbb\xbf"


@dataclass
class Table:
    """Columns of a text file."""

    rows: int
    numbers: dict[int, Array]
    """Column (from 0) to its values."""
    clock_origin: int = 0
    """Offset subtracted from the clock, so that nanoseconds since 1970 stay exact."""
    calendar: str = ""
    """Origin of the nanoseconds of time stamps, see `StampReader`; ``""``: the clock has none."""
    codes: dict[int, Codes] = field(default_factory=dict)
    """Text column to the index of each row's value in `labels`."""
    labels: dict[int, list[str]] = field(default_factory=dict)
    """Text column to its distinct values, in order of appearance."""

    def stack(self, columns: Iterable[int]) -> Array:
        """Return columns of numbers side by side, shape (rows, columns)."""
        return np.column_stack([self.numbers[column] for column in columns])


def open_binary(path: Path) -> IO[bytes]:
    """Open a file for reading, through gzip and as UTF-8 when its content says so."""
    file = _opened(path)
    encoding = _encoding(file)
    return file if encoding is None else io.BufferedReader(TranscodedText(file, encoding), _BUFFER)


def encoding_notes(path: Path) -> list[str]:
    """Return the warning about text of an unknown encoding.

    Parameters
    ----------
    path : Path
        A file, which may be packed by gzip, or a folder.
    """
    if not path.is_file():
        return []
    note = "the text is not UTF-8 and was read as Windows-1252: check letters such as µ and °"
    with _opened(path) as file:
        return [note] if _encoding(file) == WINDOWS else []


def _opened(path: Path) -> io.BufferedReader:
    """Open a file, through gzip when its content says so."""
    try:
        with path.open("rb") as start:
            compressed = start.read(2) == GZIP_MAGIC
        raw: Any = _BoundedGzip(path) if compressed else io.FileIO(path)
        return io.BufferedReader(raw, _BUFFER)
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        reason = getattr(error, "strerror", None) or error
        raise FormatError(f"cannot be opened: {reason}") from error


def _encoding(file: io.BufferedReader) -> str | None:
    """Return the encoding of a text that is not UTF-8, without moving on in it."""
    try:
        return other_encoding(file.peek(TEXT.head_bytes)[: TEXT.head_bytes])
    except DAMAGED:
        return None  # reading it reports the damage and its place


class _BoundedGzip(gzip.GzipFile):
    """Contents of a gzip file, as far as text can be packed: zeros shrink by a thousand."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "rb")
        self._left = TEXT.gzip_allowance + TEXT.gzip_ratio * path.stat().st_size

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer with the next bytes."""
        count = super().readinto(buffer)
        self._left -= count
        if self._left < 0:
            raise FormatError(
                f"unpacks to more than {TEXT.gzip_ratio} times its size, which no recording does: "
                "unpack it (gzip -d) if it is one",
            )
        return count


def refuse_long_line(line: bytes, number: int) -> None:
    """Refuse a line that is longer than any line of a text file."""
    if len(line) > TEXT.longest_line:
        raise FormatError(
            f"has a line of more than {TEXT.longest_line >> 20} MiB: is it a text file?",
            line=number,
        )


@naming_its_file
def read_head(path: Path) -> bytes:
    """Return the first 64 KiB of a file, uncompressed and without a byte order mark."""
    with open_binary(path) as file:
        return file.read(TEXT.head_bytes).removeprefix(BOM)


@naming_its_file
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
            line = file.readline(TEXT.longest_line + 1)
            refuse_long_line(line, number)
            if not line:
                break
            text = line.removeprefix(BOM if number == 1 else b"").removesuffix(b"\n")
            rows.append(decoded_line(text, number))
    return rows


@naming_its_file
def read_table(path: Path, layout: TableLayout, *, blocks: int | None = None) -> Table:
    """Read the numbered and the text columns of a table.

    Parameters
    ----------
    path : Path
        Text file, may be gzip-compressed.
    layout : TableLayout
        Columns to read.
    blocks : int, optional
        Blocks of 4 MiB to read at most; None: the whole file.

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
    needed = 1 + max((*layout.numbers, *layout.texts, *layout.stamps))
    if needed > len(layout.names):
        raise FormatError(
            f"expected at least {needed} columns, got {len(layout.names)}: is it another format?",
        )
    collected = _Collected(layout)
    for line, block in islice(blocks_of(path, layout.skip_lines), blocks):
        # pandas fails on a table of blank lines alone.
        if block.strip(b" \r\n"):
            collected.add(block, line)
    return collected.table()


class _Collected:
    """Columns of a table as far as it is read, each of them held once."""

    def __init__(self, layout: TableLayout) -> None:
        self._layout = layout
        self._columns: dict[int, npt.NDArray[Any]] = {at: np.empty(0) for at in layout.numbers}
        self._columns |= {at: np.empty(0) for at in layout.stamps[:1]}
        self._columns |= {at: np.empty(0, dtype=np.int32) for at in layout.texts}
        self._labels: dict[int, dict[str, int]] = {column: {} for column in layout.texts}
        self._stamps = {column: StampReader() for column in layout.stamps}
        self._decimal = "."
        self._origin: int | None = None
        self._rows = 0

    def add(self, block: bytes, line: int) -> None:
        """Read a block of whole lines; its first has this number."""
        frame = self._parsed(block, line)
        rows = slice(self._rows, self._rows + len(frame))
        room = next(iter(self._columns.values())).size
        if rows.stop > room:
            self._resize(rows.stop + room // 4)  # a quarter more, chosen by hand
        for column in self._layout.numbers:
            values = frame[column].to_numpy()
            if column == self._layout.clock:
                if self._origin is None:
                    self._origin = far_origin(values)
                if self._origin:
                    whole = values.dtype.kind == "i"
                    values = values - (self._origin if whole else float(self._origin))
            self._columns[column][rows] = values
        for column, seen in self._labels.items():
            local, texts = frame[column].fillna("").astype(str).factorize()
            index = [seen.setdefault(str(text), len(seen)) for text in texts]
            self._columns[column][rows] = np.array(index, dtype=np.int32)[local]
        if self._stamps:
            self._columns[self._layout.stamps[0]][rows] = self._clock(frame, block, line)
        self._rows = rows.stop

    def _resize(self, rows: int) -> None:
        """Make room for so many rows where the columns are: no list of parts is to be joined."""
        for column in self._columns.values():
            column.resize(rows, refcheck=False)

    def table(self) -> Table:
        """Return what was read."""
        if not self._rows:
            raise FormatError("holds no rows of data")
        self._resize(self._rows)
        return Table(
            rows=self._rows,
            numbers={at: one for at, one in self._columns.items() if at not in self._labels},
            codes={at: self._columns[at] for at in self._labels},
            labels={column: list(seen) for column, seen in self._labels.items()},
            clock_origin=self._origin or 0,
            calendar=calendar_of([*self._stamps.values()]),
        )

    def _parsed(self, block: bytes, line: int) -> Any:
        """Return a block as a data frame, with a comma as decimal sign where its numbers have it.

        The sign is that of the first number with decimals; then all have it.
        """
        layout = self._layout
        undecided = self._decimal == "." and b"," in block
        errors: list[FormatError] = []
        for decimal in (".", ",") if undecided else self._decimal:
            try:
                frame = _parse(block, layout, line=line, decimal=decimal)
                numeric = all(frame[column].dtype.kind in "iuf" for column in layout.numbers)
                if numeric and (decimal == self._decimal or self._only_whole()):
                    self._decimal = decimal
                    return frame
                check_lines(block, layout, line=line, decimal=decimal)
                raise FormatError("has a column that is not numbers", line=line)
            except FormatError as error:
                errors.append(error)
        # With the sign that is wrong an earlier row is the first that cannot be read.
        raise max(errors, key=lambda error: (error.line or 0, error.column or 0))

    def _only_whole(self) -> bool:
        """Whether no number so far has decimals."""
        known = [self._columns[at][: self._rows] for at in self._layout.numbers]
        return not any((one[np.isfinite(one)] % 1.0 != 0.0).any() for one in known)

    def _clock(self, frame: Any, block: bytes, line: int) -> Array:
        """Return the time stamps of a block in nanoseconds from the first one on."""
        try:
            ticks = []
            for column, reader in self._stamps.items():
                ticks.append(reader.read(frame[column].to_numpy(dtype=reader.dtype)))
            column = self._layout.stamps[0]
            clock, self._origin = clock_of_stamps(ticks, self._origin)
        except RowError as error:
            rows = (at for at, of in enumerate(block.split(b"\n"), start=line) if of.strip())
            raise FormatError(
                f"{error} (column '{self._layout.names[column]}')",
                line=next(islice(rows, error.row, None), line),
                column=column + 1,
            ) from error
        return clock


def far_origin(values: npt.NDArray[Any]) -> int:
    """Return the first of whole numbers that float64 would round, 0 when it need not.

    Parameters
    ----------
    values : array, shape (n,)
        Times.

    Examples
    --------
    >>> far_origin(np.array([1_700_000_000_000_000_001])), far_origin(np.array([5]))
    (1700000000000000001, 0)
    """
    # float64 holds every whole number up to 2^53.
    if not values.size or values.dtype.kind != "i" or np.abs(values).max() <= 1 << 53:
        return 0
    return int(values[0])


def blocks_of(path: Path, skip_lines: int = 0) -> Iterator[tuple[int, bytes]]:
    """Yield (number of the first line, whole lines) until the file ends."""
    line = 1 + skip_lines
    with open_binary(path) as file:
        for _ in range(skip_lines):
            # A file may say itself how many lines to skip, and be wrong about it.
            if not file.readline(TEXT.longest_line):
                return
        rest = b"" if skip_lines else file.read(len(BOM)).removeprefix(BOM)
        while block := file.read(TEXT.block_bytes):
            whole, newline, rest = (rest + block).rpartition(b"\n")
            refuse_long_line(rest, line)
            if newline:
                yield line, whole + newline
                # Several times as fast as the method `count` of bytes.
                line += 1 + int(np.count_nonzero(np.frombuffer(whole, np.uint8) == ord("\n")))
        if rest.strip():
            yield line, rest + b"\n"


def _parse(block: bytes, layout: TableLayout, *, line: int, decimal: str) -> Any:
    """Return the block as a data frame, or raise a `FormatError` that says where it is wrong."""
    import pandas as pd

    fields = _field_counts(block, layout.delimiter)
    whole = fields[fields > 0]
    width = len(layout.names)
    if (whole != width).any():
        width = max(width, check_lines(block, layout, line=line, decimal=decimal))
    used = sorted({*layout.numbers, *layout.texts, *layout.stamps})
    # The stubs of pandas cannot follow options in a dictionary.
    missing: Any = {at: list(NAMELESS if at in layout.texts else MISSING) for at in used}
    # Before 3.1 the usual parsing of pandas is not correctly rounded.
    old = tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1)
    exact: Any = {"float_precision": "round_trip"} if old else {}
    try:
        frame = pd.read_csv(
            io.BytesIO(block),
            header=None,
            names=list(range(width)),
            usecols=used,
            dtype=dict.fromkeys(layout.texts, str)
            | dict.fromkeys(layout.stamps, StampReader.dtype),
            decimal=decimal,
            sep=r"\s+" if layout.delimiter == " " else layout.delimiter,
            na_values=missing,
            keep_default_na=False,
            index_col=False,
            skipinitialspace=True,
            low_memory=False,
            engine="c",
            **exact,
        )
    except (ValueError, UnicodeDecodeError) as error:
        check_lines(block, layout, line=line, decimal=decimal)
        raise FormatError(f"cannot be read as a table: {error}", line=line) from error
    if b'"' in block and len(frame) != whole.size:
        raise FormatError("has a quotation mark that is not closed", line=line)
    return frame


def _field_counts(block: bytes, delimiter: str) -> Integers:
    """Count the fields of each line of a block; 0 for a blank line."""
    characters = np.frombuffer(block, dtype=np.uint8)
    ends = characters == ord("\n")
    if delimiter == " ":
        blank = np.isin(characters, np.frombuffer(b" \t\r\n", dtype=np.uint8))
        first = np.concatenate(([True], blank[:-1])) & ~blank
        return np.diff(np.searchsorted(np.flatnonzero(first), np.flatnonzero(ends)), prepend=0)
    separators = characters == ord(delimiter)
    if b'"' in block:
        separators &= ~_quoted(characters, ends)
    # A field ends at each separator and at each end of a line.
    marks = np.flatnonzero(separators | ends)
    last = np.flatnonzero(ends[marks])
    fields = np.diff(last, prepend=-1)
    stops = marks[last]
    lengths = np.diff(stops, prepend=-1)
    # A line of blanks alone holds no field; it may hold delimiters when these are tabs.
    for line in np.flatnonzero((fields == 1) | (lengths <= 2 * fields)):
        if not block[stops[line] + 1 - lengths[line] : stops[line]].strip():
            fields[line] = 0
    return fields


def _quoted(characters: npt.NDArray[np.uint8], ends: Bools) -> Bools:
    """Return what stands between quotation marks, of lines in which all of them are closed."""
    marks = np.cumsum(characters == ord('"'))
    stops = np.flatnonzero(ends)
    lengths, of_line = np.diff(stops, prepend=-1), np.diff(marks[stops], prepend=0)
    within = marks - np.repeat(marks[stops] - of_line, lengths)
    return np.asarray((within % 2 == 1) & np.repeat(of_line % 2 == 0, lengths))
