"""TrackMate: spots as CSV, and its own XML of spots and the edges that make tracks of them.

CSV: names, titles, short titles and units in four rows, then the spots; before version 7 there was
one row of names, and no units.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.parsers import expat

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.cleaning.several_bodies import split_numbered
from driftwalk.record.column_names import unit_of_name
from driftwalk.record.raw import (
    LENGTH_UNITS,
    Array,
    Marks,
    RawBody,
    RawRecording,
    ReadOptions,
    TableLayout,
)
from driftwalk.record.text import header_rows, open_binary, read_table
from driftwalk.record.text_head import first_names

NEEDED: Final = ("TRACK_ID", "POSITION_X", "POSITION_Y", "POSITION_T", "FRAME")
OUTSIDE: Final = "spots outside the tracks, left out: {}"


class TrackMateLoader:
    """One body per track, in the unit of the image."""

    name = "trackmate"
    description = "TrackMate spots CSV (TRACK_ID, POSITION_X, ...; units in the fourth row)"
    marks = (Marks("table", NEEDED),)

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the names of the spots' columns."""
        needed = {"TRACK_ID", "POSITION_X", "POSITION_Y"}
        return 0.95 if needed <= set(first_names(head)) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every track; `frame_rate` counts frames in place of the file's times."""
        rows = [split_fields(line, ",") for line in header_rows(path, 5)]
        names = rows[0] if rows else []
        missing = [name for name in NEEDED if name not in names]
        if missing:
            raise FormatError(f"no column {', '.join(missing)} as TrackMate has it", line=1)
        places = {name: names.index(name) for name in NEEDED}
        # Three rows that explain the names may stand below them.
        cells = ["".join(row[places["POSITION_X"] :][:1]) for row in rows[1:]]
        header = next((at for at, cell in enumerate(cells, start=1) if is_number(cell)), len(rows))
        units = rows[3] if header == 4 and len(rows[3]) == len(names) else [""] * len(names)
        length = stated_unit(units[places["POSITION_X"]])
        clock_unit = _clock_unit(units[places["POSITION_T"]], options)
        clock = "FRAME" if clock_unit == "frame" else "POSITION_T"
        wanted = {name: places[name] for name in ("TRACK_ID", "POSITION_X", "POSITION_Y", clock)}
        layout = TableLayout(",", names, header, tuple(sorted(wanted.values())))
        table = read_table(path, layout)
        track, x, y, time = (table.numbers[place] for place in wanted.values())
        bodies, outside = split_numbered(RawBody("", time, x, y), track)
        if not bodies:
            raise FormatError("no spot belongs to a track")
        return RawRecording(
            bodies,
            clock_unit=clock_unit,
            length_unit=length,
            y_axis="down",
            rows=table.rows,
            notes=[OUTSIDE.format(outside)] if outside else [],
        )


def _clock_unit(stated: str, options: ReadOptions) -> str:
    """Return the unit of the times of the file, or ``"frame"`` where its frames are used."""
    unit = unit_of_name(f"t {stated}")
    return unit if options.frame_rate_hz is None and unit in ("s", "ms", "us", "min") else "frame"


def stated_unit(text: str) -> str:
    """Return the unit of length that TrackMate states, ``""`` where it states none.

    Raises
    ------
    FormatError
        When it is none that is read.

    Examples
    --------
    >>> stated_unit("(micron)")
    'um'
    """
    unit = unit_of_name(f"x {text}") if text else ""
    if text.strip("() ") and not unit:
        raise FormatError(
            f"the positions are in '{text.strip('() ')}': give the image one of the units "
            f"{', '.join(LENGTH_UNITS)} or pixel, and export again"
        )
    return unit


_SPOT: Final = ("ID", "POSITION_X", "POSITION_Y", "POSITION_T", "FRAME")


@dataclass
class _Contents:
    """Attributes of the elements of a file."""

    units: dict[str, str] = field(default_factory=dict)
    spots: list[float] = field(default_factory=list)
    """The attributes of `_SPOT`, one spot after the other."""
    edges: dict[str, list[float]] = field(default_factory=dict)
    """Track to the spots at the ends of its edges."""
    kept: set[str] = field(default_factory=set)
    """Tracks that the filters of the session keep."""
    filtered: bool = False
    track: str = ""
    has_model: bool = False

    def start(self, element: str, attributes: dict[str, str]) -> None:
        """Take the start of an element."""
        if element == "Spot":
            self.spots.extend(float(attributes[name]) for name in _SPOT)
        elif element == "Edge":
            ends = (attributes["SPOT_SOURCE_ID"], attributes["SPOT_TARGET_ID"])
            self.edges[self.track].extend(float(end) for end in ends)
        elif element == "Track":
            self.track = attributes["TRACK_ID"]
            self.edges.setdefault(self.track, [])
        elif element == "TrackID":
            self.kept.add(attributes["TRACK_ID"])
        elif element == "FilteredTracks":
            self.filtered = True
        elif element == "Model":
            self.has_model = True
            self.units = attributes


class TrackMateXmlLoader:
    """One body per track that the session's filters keep, in the unit of the image."""

    name = "trackmate-xml"
    description = "TrackMate XML (spots, edges, spatialunits, timeunits)"
    marks = (Marks("XML", ("TrackMate", "Model", "AllSpots", "Spot", "AllTracks")),)

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the root element."""
        return 0.95 if b"<TrackMate" in head[:1000] else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every track; `frame_rate` counts frames in place of the file's times."""
        contents = _parsed(path)
        if not contents.has_model or not contents.spots:
            raise FormatError("holds no spots: is it a TrackMate session?")
        spots = np.array(contents.spots).reshape(-1, len(_SPOT))
        spots = spots[np.argsort(spots[:, 0], kind="stable")]
        clock_unit = _clock_unit(f"({contents.units.get('timeunits', '')})", options)
        tracks = {
            name: ends
            for name, ends in contents.edges.items()
            if ends and (name in contents.kept or not contents.filtered)
        }
        if not tracks:
            raise FormatError("no track is kept: track the spots in TrackMate, and save")
        bodies = [
            _body(name, spots, ends, clock=4 if clock_unit == "frame" else 3)
            for name, ends in sorted(tracks.items(), key=lambda entry: (len(entry[0]), entry[0]))
        ]
        outside = len(spots) - len(np.unique(np.concatenate([*map(np.array, tracks.values())])))
        return RawRecording(
            bodies,
            clock_unit=clock_unit,
            length_unit=stated_unit(contents.units.get("spatialunits", "")),
            y_axis="down",
            rows=len(spots),
            notes=[OUTSIDE.format(outside)] if outside else [],
        )


def _body(name: str, spots: Array, ends: list[float], *, clock: int) -> RawBody:
    """Return the spots of a track in the order of their times."""
    ids = np.unique(np.array(ends))
    rows = np.minimum(np.searchsorted(spots[:, 0], ids), len(spots) - 1)
    if (spots[rows, 0] != ids).any():
        lost = ids[spots[rows, 0] != ids][0]
        raise FormatError(f"track {name} has an edge to spot {lost:.0f}, which is not there")
    rows = rows[np.argsort(spots[rows, clock], kind="stable")]
    return RawBody(name, spots[rows, clock], spots[rows, 1], spots[rows, 2])


def _parsed(path: Path) -> _Contents:
    contents = _Contents()
    parser = expat.ParserCreate()
    parser.StartElementHandler = contents.start
    parser.StartDoctypeDeclHandler = _refuse_doctype
    try:
        with open_binary(path) as file:
            while block := file.read(1 << 20):
                parser.Parse(block)
            parser.Parse(b"", True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        # expat asks Python for encodings that it lacks.
        lacks = isinstance(error, KeyError)
        what = f"an element lacks its attribute {error}" if lacks else error
        raise FormatError(f"is damaged XML: {what}", line=parser.CurrentLineNumber) from error
    return contents


def _refuse_doctype(*_: object) -> None:
    """Refuse definitions of entities, by which a small file may become a huge one."""
    raise FormatError("defines a document type, which TrackMate's files do not")


LOADERS = (TrackMateLoader(), TrackMateXmlLoader())
