"""Spots that are linked to tracks: TrackMate's CSV and XML, trackpy's DataFrames.

TrackMate CSV: names, titles, short titles and units in four rows, then the spots; before version 7
there was one row of names, and no units. Its XML: spots and the edges that make tracks of them.

trackpy: x, y, frame and particle in pixels, as CSV or in an HDF5 store of one table, or one table
per frame (``PandasHDFStoreBig``).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final
from xml.parsers import expat

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.cleaning.clean import number_codes, split_bodies
from driftwalk.record.column_names import unit_of_name
from driftwalk.record.containers import Frame, Hdf5Contents, frame_in, names_in, opened_hdf5
from driftwalk.record.loaders.plain import numbers_by_name
from driftwalk.record.raw import LENGTH_UNITS, Array, Marks, RawBody, RawRecording, ReadOptions
from driftwalk.record.tables.text_source import first_names, first_row
from driftwalk.record.text import header_rows, open_binary
from driftwalk.schema.stores.netcdf import HDF5, file_start

NEEDED: Final = ("TRACK_ID", "POSITION_X", "POSITION_Y", "POSITION_T", "FRAME")
OUTSIDE: Final = "spots outside the tracks, left out: {}"


class TrackMateLoader:
    """One body per track, in the unit of the image."""

    name = "trackmate"
    description = "TrackMate spots CSV (TRACK_ID, POSITION_X, ...; units in the fourth row)"
    marks = (Marks("table", NEEDED),)

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the names of the spots' columns."""
        return 0.95 if {"TRACK_ID", "POSITION_X", "POSITION_Y"} <= set(first_names(head)) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every track; `frame_rate` counts frames in place of the file's times."""
        rows = [split_fields(line, ",") for line in header_rows(path, 5)]
        names = rows[0] if rows else []
        if missing := [name for name in NEEDED if name not in names]:
            raise FormatError(f"no column {', '.join(missing)} as TrackMate has it", line=1)
        places = {name: names.index(name) for name in NEEDED}
        # Three rows that explain the names may stand below them.
        cells = ["".join(row[places["POSITION_X"] :][:1]) for row in rows[1:]]
        header = next((at for at, cell in enumerate(cells, start=1) if is_number(cell)), len(rows))
        units = rows[3] if header == 4 and len(rows[3]) == len(names) else [""] * len(names)
        length = stated_unit(units[places["POSITION_X"]])
        clock_unit = _clock_unit(units[places["POSITION_T"]], options)
        clock = "FRAME" if clock_unit == "frame" else "POSITION_T"
        used = ("TRACK_ID", "POSITION_X", "POSITION_Y", clock)
        track, x, y, time = numbers_by_name(path, names, used, skip=header).values()
        what = "no spot belongs to a track", OUTSIDE
        facts = {"clock_unit": clock_unit, "length_unit": length, "y_axis": "down"}
        return _of_numbered(RawBody("", time, x, y), track, what, **facts)


def _of_numbered(
    rows: RawBody, numbers: Array, what: tuple[str, str], **facts: Any
) -> RawRecording:
    """Return a body for each number; `what` says that no row has one, or how many have none."""
    named = np.isfinite(numbers)
    if not named.any():
        raise FormatError(what[0])
    bodies = split_bodies(rows.take(named), *number_codes(numbers[named]))
    left_out = int((~named).sum())
    notes = [what[1].format(left_out)] if left_out else []
    return RawRecording(bodies, rows=named.size, notes=notes, **facts)


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

    units: dict[str, str] | None = None
    """The attributes of the model, which names its units."""
    spots: list[float] = field(default_factory=list)
    """The attributes of `_SPOT`, one spot after the other."""
    edges: dict[str, list[float]] = field(default_factory=dict)
    """Track to the spots at the ends of its edges."""
    kept: set[str] | None = None
    """Tracks that the filters of the session keep; None: it has no filters."""
    track: str = ""

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
        elif element == "FilteredTracks":
            self.kept = self.kept or set()
        elif element == "TrackID" and self.kept is not None:
            self.kept.add(attributes["TRACK_ID"])
        elif element == "Model":
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
        if contents.units is None or not contents.spots:
            raise FormatError("holds no spots: is it a TrackMate session?")
        spots = np.array(contents.spots).reshape(-1, len(_SPOT))
        spots = spots[np.argsort(spots[:, 0], kind="stable")]
        clock_unit = _clock_unit(f"({contents.units.get('timeunits', '')})", options)
        kept = contents.edges if contents.kept is None else contents.kept
        tracks = {name: ends for name, ends in contents.edges.items() if ends and name in kept}
        if not tracks:
            raise FormatError("no track is kept: track the spots in TrackMate, and save")
        clock = 4 if clock_unit == "frame" else 3
        names = sorted(tracks, key=lambda name: (len(name), name))
        bodies = [_body(name, spots, tracks[name], clock=clock) for name in names]
        outside = len(spots) - len(np.unique(np.concatenate([*map(np.array, tracks.values())])))
        length = stated_unit(contents.units.get("spatialunits", ""))
        notes = [OUTSIDE.format(outside)] if outside else []
        return RawRecording(bodies, clock_unit, length, y_axis="down", rows=len(spots), notes=notes)


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
        what = f"an element lacks its attribute {error}" if isinstance(error, KeyError) else error
        raise FormatError(f"is damaged XML: {what}", line=parser.CurrentLineNumber) from error
    return contents


def _refuse_doctype(*_: object) -> None:
    """Refuse definitions of entities, by which a small file may become a huge one."""
    raise FormatError("defines a document type, which TrackMate's files do not")


OF_TRACKPY: Final = ("x", "y", "frame", "particle")
OWN: Final = frozenset({"mass", "size", "ecc", "signal", "raw_mass", "ep"})
"""Columns that trackpy's features have; two of them tell its tables from others."""


class TrackpyLoader:
    """One body per particle."""

    name = "trackpy"
    description = "trackpy features, linked (x, y, frame, particle; CSV or HDF5; pixels, no clock)"
    marks = (
        Marks("table", (*OF_TRACKPY, "mass", "size", "ecc")),
        Marks("HDF5", ("PYTABLES_FORMAT_VERSION",)),
    )

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the columns of features, or a store of pandas."""
        if head.startswith(HDF5):
            return 0.5 if "PYTABLES_FORMAT_VERSION" in names_in(path, head) else 0.0
        names = set(first_names(head))
        return 0.9 if set(OF_TRACKPY) <= names and len(OWN & names) > 1 else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every particle; rows that are linked to none are left out."""
        if file_start(path) == HDF5:
            columns = _of_store(path)
        else:
            columns = numbers_by_name(path, used=_places(first_row(path)))
        x, y, frame, particle = columns.values()
        loose = "features that are linked to no particle, and left out: {}"
        what = "no feature is linked to a particle", loose
        return _of_numbered(RawBody("", frame, x, y), particle, what, length_unit="px")


def _of_store(path: Path) -> dict[str, Array]:
    with opened_hdf5(path) as contents:
        groups = [str(name) for name in contents.file]
        numbered = [name for name in groups if name.removeprefix("Frame_").isdecimal()]
        if frames := sorted(numbered, key=lambda name: int(name.removeprefix("Frame_"))):
            parts = [_columns(frame_in(contents, name)) for name in frames]
            return {name: np.concatenate([part[name] for part in parts]) for name in OF_TRACKPY}
        return _columns(_only_table(contents, groups))


def _only_table(contents: Hdf5Contents, groups: list[str]) -> Frame:
    """Return the table of features; of several, the one of linked ones."""
    tables = {name: frame_in(contents, name) for name in groups}
    linked = [name for name, table in tables.items() if ("particle",) in table.columns]
    chosen = groups if len(groups) == 1 else linked
    if len(chosen) != 1:
        raise FormatError(
            f"holds the tables {', '.join(groups) or 'none'}, of which {len(linked)} have a column "
            "'particle': store the one of the recording alone"
        )
    return tables[chosen[0]]


def _columns(frame: Frame) -> dict[str, Array]:
    places = _places([column[0] if len(column) == 1 else "" for column in frame.columns])
    return {name: frame.numbers(place) for name, place in places.items()}


def _places(names: list[str]) -> dict[str, int]:
    """Return the columns that are needed, or say which lack."""
    missing = [name for name in OF_TRACKPY if name not in names]
    if missing == ["particle"]:
        raise FormatError(
            "the features are not linked: let trackpy.link name their particles, and save again"
        )
    if missing:
        shown = ", ".join(names[:12])
        raise FormatError(f"no column {', '.join(missing)} as trackpy has it, among {shown}")
    return {name: names.index(name) for name in OF_TRACKPY}


LOADERS = (TrackMateLoader(), TrackMateXmlLoader(), TrackpyLoader())
