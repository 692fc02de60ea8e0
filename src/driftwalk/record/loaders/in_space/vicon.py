"""Vicon CSV: section, frame rate, names, axes, units, then a row per frame."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.raw import (
    ANGLE_UNITS,
    LENGTH_UNITS,
    RawRecording,
    ReadOptions,
    TableLayout,
)
from driftwalk.record.space import VECTOR, SpaceColumns, read_in_space
from driftwalk.record.text import header_rows
from driftwalk.record.text_head import first_lines

_READ: Final = ("Objects", "Segments", "Trajectories")
_OTHERS: Final = ("Devices", "Joints", "Model Outputs")
_LINES: Final = 5
_POSITIONS: Final = (("TX", "TY", "TZ"), ("X", "Y", "Z"))
_QUATERNION: Final = ("RX", "RY", "RZ", "RW")
_PREFIX: Final = re.compile(r"^Global Angle\s+")


@dataclass(frozen=True)
class _Header:
    rate_hz: float
    names: list[str]
    """Body of each column, ``""`` of the first two."""
    axes: list[str]
    units: list[str]

    def columns(self, body: str) -> dict[str, int]:
        """Return the axes of a body, each with its column."""
        pairs = zip(self.names, self.axes, strict=True)
        return {axis: at for at, (name, axis) in enumerate(pairs) if name == body and axis}


class ViconLoader:
    """Objects and segments with their rotation, or single markers."""

    name = "vicon"
    description = "Vicon CSV (Objects, Segments or Trajectories; z up)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the section and the row of axes."""
        lines = first_lines(head, _LINES)
        if len(lines) < _LINES - 1 or lines[0].strip(", ") not in (*_READ, *_OTHERS):
            return 0.0
        return 0.95 if lines[3].startswith("Frame,Sub Frame") else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every object; a second section of the file has to go."""
        header = _read_header(path)
        bodies = [name for name in dict.fromkeys(header.names) if name]
        columns = {name: _columns(header, name) for name in bodies}
        labels = [f"{n} {a}".strip() for n, a in zip(header.names, header.axes, strict=True)]
        try:
            return read_in_space(
                path,
                TableLayout(",", labels, _LINES, clock=0),
                columns,
                options.up or "z",
                length_unit=_length_unit(header, columns),
                frame_rate_hz=header.rate_hz,
            )
        except FormatError as error:
            if error.line is None or not _begins_section(path, error.line):
                raise
            raise FormatError(
                "another section begins here: keep one section in a file, or export one alone",
                line=error.line,
            ) from error


def _read_header(path: Path) -> _Header:
    lines = header_rows(path, _LINES + 1)
    if len(lines) <= _LINES or not lines[_LINES].strip():
        raise FormatError("the file ends before its first row of data")
    section = lines[0].strip(", ")
    if section not in _READ:
        raise FormatError(
            f"begins with the section '{section}': export {', '.join(_READ[:-1])} or {_READ[-1]}",
            line=1,
        )
    rate = lines[1].strip(", ")
    if not is_number(rate):
        raise FormatError(f"expected the frame rate, got '{rate:.40}'", line=2)
    names, axes, units, data = (split_fields(line, ",") for line in lines[2 : _LINES + 1])
    width = max(len(axes), len(data))
    if len(axes) < 5 or axes[0] != "Frame":
        raise FormatError("expected the names of the axes, from 'Frame' on", line=4)
    padded = [(row + [""] * width)[:width] for row in (names, axes, units)]
    return _Header(float(rate), _carried(padded[0]), padded[1], padded[2])


def _carried(names: list[str]) -> list[str]:
    """Return the body of each column: a name stands over the first of its columns alone."""
    carried = ["", ""]
    for name in names[2:]:
        subject, _, segment = _PREFIX.sub("", name).partition(":")
        own = subject if segment in ("", subject) else f"{subject}:{segment}"
        carried.append(own or carried[-1])
    return carried


def _columns(header: _Header, body: str) -> SpaceColumns:
    """Return the columns of a body."""
    columns = header.columns(body)
    axes = next((axes for axes in _POSITIONS if set(axes) <= set(columns)), None)
    if axes is None:
        raise FormatError(f"'{body}' has no columns TX, TY, TZ or X, Y, Z of its position", line=4)
    position, turns = ([columns[one] for one in of if one in columns] for of in (axes, _QUATERNION))
    if len(turns) != 3 or "RW" in columns:
        return SpaceColumns(position, turns if len(turns) == 4 else ())
    unit = header.units[columns["RX"]]
    if unit not in ANGLE_UNITS:
        raise FormatError(f"the unit of the angles is '{unit}': expected rad or deg", line=_LINES)
    return SpaceColumns(position, turns, VECTOR, degrees=unit == "deg")


def _length_unit(header: _Header, placed: dict[str, SpaceColumns]) -> str:
    units = {header.units[column] for one in placed.values() for column in one.position}
    if len(units) != 1 or not units <= {*LENGTH_UNITS, ""}:
        raise FormatError(
            f"the units of the positions are {', '.join(sorted(units))}: expected one, mm or m",
            line=_LINES,
        )
    return units.pop()


def _begins_section(path: Path, number: int) -> bool:
    with path.open("rb") as file:
        text = next((line for at, line in enumerate(file, start=1) if at == number), b"")
    return text.decode("utf-8", "replace").strip(", \r\n") in (*_READ, *_OTHERS)


LOADER = ViconLoader()
