"""OptiTrack Motive CSV: a line of settings, rows that name the columns, then a row per frame."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import split_fields
from driftwalk.record.raw import RawRecording, ReadOptions, TableLayout
from driftwalk.record.space import QUATERNION, SpaceColumns, read_in_space
from driftwalk.record.text import header_rows

START: Final = b"Format Version,"
_UNITS: Final = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}
_ORDERS: Final = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


@dataclass(frozen=True)
class _Header:
    settings: dict[str, str]
    lines: int
    """Lines before the data."""
    types: list[str]
    names: list[str]
    quantities: list[str]
    axes: list[str]

    def columns(self, name: str, kind: str, quantity: str) -> dict[str, int]:
        """Return the axes of one quantity of a body, each with its column."""
        rows = zip(self.types, self.names, self.quantities, self.axes, strict=True)
        return {
            axis: column
            for column, (*row, axis) in enumerate(rows)
            if row == [kind, name, quantity] and axis
        }


class OptiTrackLoader:
    """Rigid bodies by their names; single markers where there are no rigid bodies."""

    name = "optitrack"
    description = "OptiTrack Motive CSV (rigid bodies, or markers; y up)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the settings of the first line."""
        return 0.95 if head.startswith(START) and b"Take Name" in head else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every rigid body."""
        header = _read_header(path)
        kind, bodies = _bodies(header)
        columns = {name: _columns(header, name, kind) for name in bodies}
        clock, clock_unit = _clock(header)
        labels = [
            " ".join(part for part in parts if part) or str(number)
            for number, parts in enumerate(
                zip(header.names, header.quantities, header.axes, strict=True), start=1
            )
        ]
        rate = header.settings.get("Export Frame Rate") or header.settings.get("Capture Frame Rate")
        recording = read_in_space(
            path,
            TableLayout(",", labels, header.lines, clock=clock),
            columns,
            options.up or "y",  # Motive's own axis; its CSV does not name another choice
            clock_unit=clock_unit,
            length_unit=_length_unit(header),
            frame_rate_hz=_rate(rate) if clock_unit == "frame" else None,
        )
        if kind != "Rigid Body":
            note = "no rigid bodies: each marker is read as a body, without orientation"
            recording.notes.append(note)
        return recording


def _read_header(path: Path) -> _Header:
    # Titles end by row 12: blank, type, name, id, parent, quantity, axes.
    lines = header_rows(path, 13)
    rows = [split_fields(line, ",") for line in lines]
    at = next((i for i, row in enumerate(rows) if row[:1] == ["Frame"]), None)
    above = [] if at is None else [row for row in rows[1:at] if any(row)]
    if at is None or len(above) < 3:
        raise FormatError(
            "the rows that name type, body and axis of each column are missing: export the take "
            "with its header"
        )
    settings = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    # A data row may end in a comma that the header has not, and the other way round.
    width = max(len(row) for row in rows[at : at + 2])
    types, names, *_, quantities, axes = (
        (row + [""] * width)[:width] for row in (*above, rows[at])
    )
    return _Header(settings, at + 1, types, names, quantities, axes)


def _bodies(header: _Header) -> tuple[str, list[str]]:
    """Return which type is read, and the names of its bodies in the file's order."""
    for kind in ("Rigid Body", "Marker"):
        named = zip(header.types, header.names, strict=True)
        names = list(dict.fromkeys(name for type_, name in named if type_ == kind))
        if names:
            return kind, names
    raise FormatError("there is no rigid body and no marker: export the take with one of them")


def _clock(header: _Header) -> tuple[int, str]:
    """Return the column of the clock and its unit."""
    for column, name in enumerate(header.axes):
        if name in ("Time", "Time (Seconds)"):
            return column, "s"
    return header.axes.index("Frame"), "frame"


def _rate(text: str | None) -> float | None:
    try:
        return None if text is None else float(text)
    except ValueError as error:
        raise FormatError(f"the frame rate is '{text}'", line=1) from error


def _length_unit(header: _Header) -> str:
    """Return the unit of positions, ``""`` when the settings do not say."""
    text = header.settings.get("Length Units", "")
    if text and text.lower() not in _UNITS:
        raise FormatError(
            f"the unit of length is '{text}': export in meters or millimeters", line=1
        )
    return _UNITS.get(text.lower(), "")


def _columns(header: _Header, name: str, kind: str) -> SpaceColumns:
    """Return the columns of a body; Motive's Euler angles turn about the axes of the body."""
    placed, turned = (header.columns(name, kind, what) for what in ("Position", "Rotation"))
    if set(placed) != set("XYZ"):
        raise FormatError(f"'{name}' has no columns X, Y, Z of its position")
    position = [placed[axis] for axis in "XYZ"]
    if not turned:
        return SpaceColumns(position)
    form = header.settings.get("Rotation Type", "")
    axes = "XYZW" if form == "Quaternion" else form
    if form not in (*_ORDERS, "Quaternion") or set(turned) != set(axes):
        raise FormatError(
            f"the rotation type is '{form}' and the columns of rotation are {', '.join(turned)}: "
            "export quaternions, or Euler angles in an order such as XYZ"
        )
    turns = [turned[axis] for axis in axes]
    known = QUATERNION if form == "Quaternion" else form
    return SpaceColumns(position, turns, known, degrees=True)


LOADER = OptiTrackLoader()
