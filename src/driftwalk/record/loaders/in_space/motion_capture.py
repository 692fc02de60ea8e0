"""Tables of motion capture: OptiTrack Motive, Vicon and Qualisys Track Manager.

Lines of facts, rows that name body, axis and unit of each column, then a row per frame. Motive: CSV
with the settings in the first line, y up. Vicon: CSV with section, frame rate, names, axes, units,
z up. Qualisys: TSV of markers (3D) or rigid bodies (6D) [mm], z up.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.raw import ANGLE_UNITS, LENGTH_UNITS, RawRecording, ReadOptions, TableLayout
from driftwalk.record.space import MATRIX, QUATERNION, VECTOR, SpaceColumns, read_in_space
from driftwalk.record.tables.text_source import first_lines
from driftwalk.record.text import header_rows
from driftwalk.record.unit_and_column_words import UNITS

Rows = Sequence[Sequence[str]]
"""Rows of titles, all as long as the table is wide; the last names axes."""


def _rows_of(text: Rows, width: int) -> list[list[str]]:
    return [([*row] + [""] * width)[:width] for row in text]


def _axes_of(rows: Rows, *above: str) -> dict[str, int]:
    """Return axes, each with its column, of the columns that have these titles above them."""
    columns = enumerate(zip(*rows, strict=True))
    return {axis: at for at, (*titles, axis) in columns if titles == [*above] and axis}


def _rate(text: str, what: str, line: int | None) -> float:
    """Return the frames per second [Hz]."""
    if not is_number(text) or not float(text) > 0.0:
        raise FormatError(f"{what} is '{text:.40}', and no rate of frames", line=line)
    return float(text)


START: Final = b"Format Version,"
_ORDERS: Final = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


class OptiTrackLoader:
    """Rigid bodies by their names; single markers where there are no rigid bodies."""

    name = "optitrack"
    description = "OptiTrack Motive CSV (rigid bodies, or markers; y up)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the settings of the first line."""
        return 0.95 if head.startswith(START) and b"Take Name" in head else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every rigid body."""
        # Titles end by row 12: blank, type, name, id, parent, quantity, axes.
        rows = [split_fields(line, ",") for line in header_rows(path, 13)]
        at = next((i for i, row in enumerate(rows) if row[:1] == ["Frame"]), 0)
        above = [row for row in rows[1:at] if any(row)]
        if len(above) < 3:
            raise FormatError(
                "the rows that name type, body and axis of each column are missing: export the "
                "take with its header"
            )
        settings = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
        # A data row may end in a comma that the header has not, and the other way round.
        width = max(len(row) for row in rows[at : at + 2])
        types, names, *_, quantities, axes = _rows_of((*above, rows[at]), width)
        titles = [types, names, quantities, axes]
        kind = next((one for one in ("Rigid Body", "Marker") if one in types), None)
        if kind is None:
            raise FormatError("there is no rigid body and no marker: export the take with one")
        found = dict.fromkeys(one for of, one in zip(types, names, strict=True) if of == kind)
        times = [axis for axis in axes if axis in ("Time", "Time (Seconds)")]
        unit = UNITS.get(settings.get("Length Units", "").lower(), "")
        if settings.get("Length Units") and unit not in LENGTH_UNITS:
            what = f"the unit of length is '{settings['Length Units']}'"
            raise FormatError(f"{what}: export in meters or millimeters", line=1)
        rate = settings.get("Export Frame Rate") or settings.get("Capture Frame Rate")
        titled = enumerate(zip(names, quantities, axes, strict=True), start=1)
        labels = [" ".join(filter(None, one)) or str(number) for number, one in titled]
        recording = read_in_space(
            path,
            TableLayout(",", labels, at + 1, clock=axes.index(times[0] if times else "Frame")),
            {name: _of_motive(titles, kind, name, settings) for name in found},
            options.up or "y",  # Motive's own axis; its CSV does not name another choice
            clock_unit="s" if times else "frame",
            length_unit=unit,
            frame_rate_hz=None if times or rate is None else _rate(rate, "the setting", 1),
        )
        note = "no rigid bodies: each marker is read as a body, without orientation"
        recording.notes += [note] if kind == "Marker" else []
        return recording


def _of_motive(titles: Rows, kind: str, name: str, settings: dict[str, str]) -> SpaceColumns:
    """Return the columns of a body; Motive's Euler angles turn about the axes of the body."""
    placed, turned = (_axes_of(titles, kind, name, what) for what in ("Position", "Rotation"))
    if set(placed) != set("XYZ"):
        raise FormatError(f"'{name}' has no columns X, Y, Z of its position")
    position = [placed[axis] for axis in "XYZ"]
    if not turned:
        return SpaceColumns(position)
    form = settings.get("Rotation Type", "")
    axes = "XYZW" if form == "Quaternion" else form
    if form not in (*_ORDERS, "Quaternion") or set(turned) != set(axes):
        raise FormatError(
            f"the rotation type is '{form}' and the columns of rotation are {', '.join(turned)}: "
            "export quaternions, or Euler angles in an order such as XYZ"
        )
    known = QUATERNION if form == "Quaternion" else form
    return SpaceColumns(position, [turned[axis] for axis in axes], known, degrees=True)


_READ: Final = ("Objects", "Segments", "Trajectories")
_OTHERS: Final = ("Devices", "Joints", "Model Outputs")
_LINES: Final = 5
"""Lines of a Vicon file before its data: section, rate, names, axes and units."""
_POSITIONS: Final = (("TX", "TY", "TZ"), ("X", "Y", "Z"))
_QUATERNION: Final = ("RX", "RY", "RZ", "RW")
_PREFIX: Final = re.compile(r"^Global Angle\s+")


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
        lines = header_rows(path, _LINES + 1)
        if len(lines) <= _LINES or not lines[_LINES].strip():
            raise FormatError("the file ends before its first row of data")
        section = lines[0].strip(", ")
        if section not in _READ:
            known = "Objects, Segments or Trajectories"
            raise FormatError(f"begins with the section '{section}': export {known}", line=1)
        rate = _rate(lines[1].strip(", "), "the frame rate", 2)
        rows = [split_fields(line, ",") for line in lines[2 : _LINES + 1]]
        width = max(len(rows[1]), len(rows[3]))
        if len(rows[1]) < 5 or rows[1][0] != "Frame":
            raise FormatError("expected the names of the axes, from 'Frame' on", line=4)
        above, axes, units = _rows_of(rows[:3], width)
        names = ["", ""]
        for name in above[2:]:  # a name stands over the first of its columns alone
            subject, _, segment = _PREFIX.sub("", name).partition(":")
            own = subject if segment in ("", subject) else f"{subject}:{segment}"
            names.append(own or names[-1])
        bodies = {
            name: _of_vicon(name, _axes_of((names, axes), name), units)
            for name in dict.fromkeys(filter(None, names))
        }
        lengths = {units[column] for one in bodies.values() for column in one.position}
        if len(lengths) != 1 or not lengths <= {*LENGTH_UNITS, ""}:
            found = ", ".join(sorted(lengths))
            what = f"the units of the positions are {found}: expected one, mm or m"
            raise FormatError(what, line=_LINES)
        labels = [f"{name} {axis}".strip() for name, axis in zip(names, axes, strict=True)]
        layout, unit = TableLayout(",", labels, _LINES, clock=0), lengths.pop()
        facts: dict[str, Any] = {"length_unit": unit, "frame_rate_hz": rate}
        try:
            return read_in_space(path, layout, bodies, options.up or "z", **facts)
        except FormatError as error:
            wrong = header_rows(path, error.line)[-1:] if error.line else []
            if not any(line.strip(", \r") in (*_READ, *_OTHERS) for line in wrong):
                raise
            what = "another section begins here: keep one section in a file, or export one alone"
            raise FormatError(what, line=error.line) from error


def _of_vicon(name: str, columns: dict[str, int], units: list[str]) -> SpaceColumns:
    axes = next((axes for axes in _POSITIONS if set(axes) <= set(columns)), None)
    if axes is None:
        raise FormatError(f"'{name}' has no columns TX, TY, TZ or X, Y, Z of its position", line=4)
    position, turns = ([columns[one] for one in of if one in columns] for of in (axes, _QUATERNION))
    if len(turns) != 3 or "RW" in columns:
        return SpaceColumns(position, turns if len(turns) == 4 else ())
    unit = units[columns["RX"]]
    if unit not in ANGLE_UNITS:
        raise FormatError(f"the unit of the angles is '{unit}': expected rad or deg", line=_LINES)
    return SpaceColumns(position, turns, VECTOR, degrees=unit == "deg")


_FIRST: Final = b"NO_OF_FRAMES\t"
_MOST_HEAD: Final = 40
"""Lines among which the first row is looked for; chosen by hand."""
_WIDTH: Final = {"3D": 3, "6D": 16}
"""Columns of a marker: X, Y, Z; of a rigid body: with three angles, the residual, nine of the
rotation matrix."""


class QualisysLoader:
    """Every body, or every marker of a file without bodies."""

    name = "qualisys"
    description = "Qualisys Track Manager TSV, 3D and 6D (mm; z up)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the first line."""
        return 0.95 if head.startswith(_FIRST) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the frames; the unit, the rate and the names stand above them."""
        rows = [line.split("\t") for line in header_rows(path, _MOST_HEAD)]
        skip = next((at for at, row in enumerate(rows) if is_number(row[0])), None)
        if skip is None:
            raise FormatError("has no rows under its head")
        fields, facts = rows[skip], {row[0]: row[1:] for row in rows[:skip]}
        kind = (facts.get("DATA_INCLUDED") or ["3D"])[0].strip()
        names = [*filter(None, facts.get("BODY_NAMES", facts.get("MARKER_NAMES", [])))]
        if kind not in _WIDTH or not names:
            raise FormatError(
                "expected DATA_INCLUDED 3D with MARKER_NAMES, or 6D with BODY_NAMES: export these "
                "from Qualisys Track Manager"
            )
        # Frame and time may stand before the positions, and a tab at the end.
        first = len(fields) - _WIDTH[kind] * len(names) - (not fields[-1].strip())
        if not 0 <= first <= 2:
            raise FormatError(
                f"expected {_WIDTH[kind]} columns for each of {len(names)} names, after frame and "
                f"time or none; got {len(fields)}",
                line=skip + 1,
            )
        bodies = {}
        for at, name in zip(range(first, len(fields), _WIDTH[kind]), names, strict=False):
            turns = range(at + 7, at + 16) if kind == "6D" else ()
            bodies[name] = SpaceColumns(range(at, at + 3), turns, MATRIX)
        layout = TableLayout("\t", [""] * len(fields), skip)
        rate = _rate((facts.get("FREQUENCY") or [""])[0], "FREQUENCY", None)
        known: dict[str, Any] = {"length_unit": "mm", "frame_rate_hz": rate}
        return read_in_space(path, layout, bodies, options.up or "z", zero_is_missing=True, **known)


LOADERS = (OptiTrackLoader(), ViconLoader(), QualisysLoader())
