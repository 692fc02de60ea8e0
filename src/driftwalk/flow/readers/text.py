"""Velocity fields in text: the header is found among the lines, then a row for each node."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import FormatError, InputError
from driftwalk.flow.grid import FieldRows
from driftwalk.flow.readers.columns import (
    FIELD,
    MARKS,
    choose_columns,
    column_of,
    holds_field,
    number,
)
from driftwalk.flow.readers.programs import HEAD, PLAIN, Program, program_of
from driftwalk.flow.readers.units import RawField

Lines = list[tuple[int, str]]

_DELIMITERS: Final = ("\t", ";", ",", None)
_ROW: Final = re.compile(r"\s*(?:[-+.\d]|nan\b)", re.IGNORECASE)
_WORDS: Final = re.compile(r'"[^"]*"|vector type(?:\s*\[-\])?|\S+(?:\s*[\[(][^\])]*[\])])*', re.I)
_INTEGER_ENDS: Final = (32767.0, 32768.0, 65535.0)
"""Ends of the integers of 16 bits, with which programs mark a missing velocity."""
_FAR: Final = 20.0
"""Times the largest velocity beyond which a value such as -9999 is a mark, and no velocity; chosen
by hand."""
_MOST_HEAD: Final = 200
"""Lines among which a header is looked for; chosen by hand."""


@dataclass(frozen=True)
class TextOptions:
    """Columns and header of a text, stated by the user."""

    columns: Mapping[str, str] = field(default_factory=dict)
    """Name or number (from 1) of the columns of x, y, u, v; ``":unit"`` may follow."""
    header_line: int | None = None
    """Line that names the columns, from 1; None: found."""
    delimiter: str | None = None
    """Character between fields; None: found."""


class Layout(NamedTuple):
    """Where the numbers of a text stand."""

    program: Program
    header: int
    """Line of the header, from 1; 0 where there is none."""
    names: list[str]
    delimiter: str | None
    """None: any run of blanks."""
    rows: Lines


def refuse_binary(path: Path) -> None:
    """Refuse DaVis' own files, which only its maker's library reads.

    Raises
    ------
    FormatError
        Says what to do.
    """
    ending = path.suffix.lower()
    if ending in (".vc7", ".im7"):
        raise FormatError(
            f"is a file of DaVis' own ({ending}): export it from DaVis as txt", path=path
        )


def read_text(path: Path, *, most: int = -1) -> str:
    """Return the text of a file in UTF-8, UTF-16 with its mark, or Latin letters.

    Raises
    ------
    FormatError
        When it is no text.
    """
    with path.open("rb") as file:
        content = file.read(most)
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", "replace")
    if b"\0" in content:
        raise FormatError("is not text")
    try:
        return content.decode("utf-8-sig", "strict" if most < 0 else "ignore")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def signed(path: Path) -> str | None:
    """Return the program that a file is known to be of by its head, even if damaged."""
    try:
        found = program_of(read_text(path, most=HEAD))
    except FormatError:
        return None
    return None if found is PLAIN else found.name


def read(path: Path, options: TextOptions) -> RawField:
    """Read the rows of a text of any program.

    Raises
    ------
    FormatError
        When a column is missing or a row cannot be read, with line and column.
    """
    text = read_text(path)
    layout = layout_of(text, options)
    program, names = layout.program, layout.names
    if not layout.rows:
        raise FormatError("there is no row under the header", line=layout.header or None)
    last, ending = layout.rows[-1]
    if not text.endswith("\n") and not ending.split(layout.delimiter)[-1].strip():
        raise FormatError("the file ends within a row", line=last)
    try:
        places = choose_columns(names, options.columns)
    except InputError as error:
        raise FormatError(str(error), line=layout.header or None) from error
    marks = _marks(layout)
    line, values = _numbers(layout, [*(places[one][0] for one in FIELD), *marks])
    missing = np.zeros(len(line), dtype=bool)
    for rule, mark in zip(marks.values(), values.T[4:], strict=True):
        missing |= ~rule(mark)
    if program.zero_is_missing and not marks:
        missing |= (values[:, 2:4] == 0.0).all(axis=1)
    notes = []
    # After the marks: a value such as -9999 stands out only where those nodes are not counted.
    for value in _sentinels(values[~missing, 2:4]):
        marked = (values[:, 2:4] == value).all(axis=1)
        missing |= marked
        nodes = int(marked.sum())
        notes.append(f"u and v are {value:g} at {nodes} node{'s' * (nodes > 1)}: taken as missing")
    rows = masked_rows(line, values, missing)
    length, velocity = places["x"][1], places["u"][1]
    if not (length or velocity):
        length, velocity = program.units_in(text)
    if not layout.header and (unread := names.count("")):
        notes.append(f"columns beyond x, y, u, v have no name and are not read: {unread}")
    down, interval = program.counts_down(rows.y), program.interval_in(text)
    reading = _described(layout, places, list(marks))
    return RawField(rows, length, velocity, down, interval, notes, reading)


def _marks(layout: Layout) -> dict[int, Callable[[Floats], npt.NDArray[np.bool_]]]:
    """Return the columns that mark missing velocities, without those of words."""
    first = dict(enumerate(layout.rows[0][1].split(layout.delimiter)))
    bases = [column_of(name).base for name in layout.names]
    return {
        at: MARKS[base]
        for at, base in enumerate(bases)
        if base in MARKS and number(first.get(at, ""), comma=False) is not None
    }


def _sentinels(velocity: Floats) -> list[float]:
    """Return the values far beyond all others that mark a missing velocity."""
    known = velocity[np.isfinite(velocity).all(axis=1)]
    alike = known[known[:, 0] == known[:, 1], 0]
    found = [float(value) for value in np.unique(alike) if _may_be_mark(abs(float(value)))]
    rest = known[~np.isin(known, found).all(axis=1)]
    largest = float(np.abs(rest).max()) if rest.size else math.inf
    return [value for value in found if abs(value) > _FAR * largest]


def _may_be_mark(size: float) -> bool:
    """Return whether programs mark a missing velocity with a value such as 1e32, -9999 or 32768."""
    return size >= 1e9 or size in _INTEGER_ENDS or re.fullmatch("9{2,}", f"{size:g}") is not None


def _described(layout: Layout, places: Mapping[str, tuple[int, str]], marks: list[int]) -> str:
    """Return what was taken for what."""
    called = [name or f"column {at}" for at, name in enumerate(layout.names, start=1)]
    parts = [f"{one} from '{called[places[one][0]]}'" for one in FIELD]
    parts += [f"missing by '{called[at]}'" for at in marks]
    if layout.program.zero_is_missing and not marks:
        parts.append("missing where u and v are 0")
    header = f"header in line {layout.header}" if layout.header else "no header"
    return f"{layout.program.title}, {header}: {', '.join(parts)}"


def layout_of(text: str, options: TextOptions) -> Layout:
    """Return where the numbers of a text stand.

    Raises
    ------
    FormatError
        When there is nothing, or it is a field of some other layout.
    """
    lines = [(at, line) for at, line in enumerate(text.splitlines(), start=1) if line.strip()]
    if not lines:
        raise FormatError("the file is empty")
    program = program_of(text)
    if options.header_line is not None:
        at = next((k for k, one in enumerate(lines) if one[0] == options.header_line), None)
        if at is None:
            raise FormatError(f"line {options.header_line} holds no names of columns")
        return _under(lines, at, _delimiter(lines[at][1], options), program)
    if stated := program.names_in(text):
        return _after_text(lines, stated, program, options)
    for at, (_, line) in enumerate(lines[:_MOST_HEAD]):
        if row_delimiter(line) is not None:
            break
        for delimiter in _tried(options):
            names = _names(line, delimiter)
            if holds_field(names) or _are_there(options.columns, names):
                above = any(not one.lstrip().startswith(("#", "sep=")) for _, one in lines[:at])
                bare = above or line.lstrip().startswith("#") or not holds_field(names)
                own = program.without_units() if program is PLAIN and bare else program
                return _under(lines, at, delimiter, own)
    return _without_names(lines, program, options)


def _tried(options: TextOptions) -> tuple[str | None, ...]:
    stated = options.delimiter
    if stated is None:
        return _DELIMITERS
    return (None if stated.isspace() and stated != "\t" else stated,)


def _delimiter(line: str, options: TextOptions) -> str | None:
    """Return the delimiter of a header that the user points to: the one that finds most names."""
    return max(_tried(options), key=lambda one: len(_names(line, one)) if one else 1.5)


def _are_there(stated: Mapping[str, str], names: Sequence[str]) -> bool:
    """Return whether all columns that the user names, and not by number, are in a line."""
    wanted = {text.strip().lower() for text in stated.values()}
    wanted -= {one for one in wanted if one.partition(":")[0].isdecimal()}
    known = {one.strip().lower() for one in names} | {column_of(one).base for one in names}
    known.discard("")
    return bool(wanted) and all(one in known or one.rpartition(":")[0] in known for one in wanted)


def _under(lines: Lines, at: int, delimiter: str | None, program: Program) -> Layout:
    """Return the layout of a table below its header, where a row of units may come first."""
    line, header = lines[at]
    names = _names(header, delimiter)
    rest = [one for one in lines[at + 1 :] if not one[1].lstrip().startswith("#")]
    if rest and delimiter is not None and delimiter not in rest[0][1]:
        delimiter = None
    units = [one.strip().strip("[]()") for one in _split(rest[0][1], delimiter)] if rest else []
    below = _split(rest[1][1], delimiter) if len(rest) > 1 else []
    if len(units) == len(names) and _are_units(units, below, comma=delimiter != ","):
        names = [
            f"{name} [{unit}]" if unit and not column_of(name).unit else name
            for name, unit in zip(names, units, strict=True)
        ]
        rest = rest[1:]
    if delimiter is None and rest:
        # Blanks stand in names as well.
        width = len(rest[0][1].split())
        if holds_field(names[:width]):
            names = [*names[:width], *[""] * (width - len(names))]
    return Layout(program, line, names, delimiter, rest)


def _are_units(row: list[str], below: list[str], *, comma: bool) -> bool:
    """Return whether a row holds units: words and no number, and numbers follow."""
    values = [number(one, comma=comma) for one in row]
    numbers = [number(one, comma=comma) for one in below]
    return values.count(None) >= 2 and _known(values) == 0 and _known(numbers) >= 2


def _known(values: Sequence[float | None]) -> int:
    """Return how many fields hold a number, and no mark of a missing one."""
    return sum(value is not None and not math.isnan(value) for value in values)


def _after_text(lines: Lines, names: list[str], program: Program, options: TextOptions) -> Layout:
    """Return the layout of a text whose names stand in words above the rows, as Tecplot's do."""
    rows = [one for one in lines if _ROW.match(one[1])]
    zones = [n for n, line in lines if re.match(r"\s*ZONE\b", line, re.IGNORECASE)]
    if len(zones) > 1:
        raise FormatError(f"holds {len(zones)} zones: write one zone into a file", line=zones[1])
    head = "\n".join(line for n, line in lines if not rows or n < rows[0][0])
    if re.search(r"\b(?:F|DATAPACKING)\s*=\s*BLOCK\b", head, re.IGNORECASE):
        raise FormatError("is in Tecplot's BLOCK order: write it in POINT order")
    found = row_delimiter(rows[0][1]) if rows else None
    delimiter = found.delimiter if found is not None else options.delimiter
    if found is not None and found.width > len(names):
        names = [*names, *[""] * (found.width - len(names))]
    return Layout(program, 1, names, delimiter, rows)


def _without_names(lines: Lines, program: Program, options: TextOptions) -> Layout:
    """Return the layout of rows under no header, or under one that names none of the quantities."""
    for at, (_, line) in enumerate(lines):
        found = row_delimiter(line)
        if found is None:
            continue
        rows = [one for one in lines[at:] if not one[1].lstrip().startswith("#")]
        if len(program.columns) == found.width:
            return Layout(program, 0, list(program.columns), found.delimiter, rows)
        above = _names(lines[at - 1][1], found.delimiter) if at else []
        if len(above) == found.width:
            own = program.without_units()
            return Layout(own, lines[at - 1][0], above, found.delimiter, rows)
        blank = not options.columns and found.delimiter in (None, "\t")
        own = program_of("", width=found.width) if blank and program is PLAIN else program
        names = [*own.columns, *[""] * (found.width - len(own.columns))]
        return Layout(own if own.columns else own.without_units(), 0, names, found.delimiter, rows)
    first = next((k for k, one in enumerate(lines) if not one[1].lstrip().startswith("#")), 0)
    return _under(lines, first, _delimiter(lines[first][1], options), program)


class Row(NamedTuple):
    """How a row of numbers is written."""

    delimiter: str | None
    width: int


def row_delimiter(line: str) -> Row | None:
    """Return how a row of four numbers and more is written; None of any other line.

    Examples
    --------
    >>> row_delimiter("1,5;2,5;0;NaN"), row_delimiter("x y u v")
    (Row(delimiter=';', width=4), None)
    """
    for delimiter in _DELIMITERS:
        fields = _split(line, delimiter)
        values = [number(one, comma=delimiter != ",") for one in fields]
        if len(fields) >= 4 and None not in values and _known(values) >= 2:
            return Row(delimiter, len(fields))
    return None


def _names(line: str, delimiter: str | None) -> list[str]:
    bare = line.strip().lstrip("#%! ")
    if delimiter is None:
        return [one.strip('"') for one in _WORDS.findall(bare)]
    return [one.strip().strip('"').strip() for one in _split(bare, delimiter)]


def _split(line: str, delimiter: str | None) -> list[str]:
    """Return the fields of a line; a delimiter at its end leaves none."""
    fields = line.split(delimiter)
    return fields[:-1] if len(fields) > 4 and not fields[-1].strip() and delimiter else fields


def _numbers(layout: Layout, wanted: Sequence[int]) -> tuple[npt.NDArray[np.intp], Floats]:
    """Return the line numbers and the wanted columns, shape (n, columns), NaN where missing."""
    values = np.empty((len(layout.rows), len(wanted)))
    width, comma = len(layout.names), layout.delimiter != ","
    for row, (line, text) in enumerate(layout.rows):
        fields = text.split(layout.delimiter)
        if len(fields) == width + 1 and not fields[-1].strip():
            fields = fields[:-1]
        if len(fields) != width:
            raise FormatError(f"expected {width} fields, got {len(fields)}", line=line)
        for at, column in enumerate(wanted):
            value = number(fields[column], comma=comma)
            if value is None:
                raise FormatError(
                    f"expected a finite number, got '{fields[column].strip():.40}'",
                    line=line,
                    column=column + 1,
                )
            values[row, at] = value
    return np.array([line for line, _ in layout.rows], dtype=np.intp), values


def masked_rows(
    line: npt.NDArray[np.intp], values: Floats, missing: npt.NDArray[np.bool_]
) -> FieldRows:
    """Return rows x, y, u, v whose velocities are NaN where they are missing.

    Raises
    ------
    FormatError
        When a position is missing, or every velocity.
    """
    lost = np.flatnonzero(~np.isfinite(values[:, :2]).all(axis=1))
    if lost.size:
        raise FormatError("a node has no position", line=int(line[lost[0]]))
    velocity = np.where(missing[:, None], np.nan, values[:, 2:4])
    if not np.isfinite(velocity).all(axis=1).any():
        raise FormatError("every node is masked or missing: there is no velocity")
    return FieldRows(line, values[:, 0], values[:, 1], velocity[:, 0], velocity[:, 1])
