"""SwisTrack: track files, ``particles.csv``, and the NMEA stream of its server.

Track files: one per track, tab-separated, a header that starts with ``%``. 2009 to 2022
(``track_00000003.txt``): frame, image x, y, world x, y, area, orientation, compactness, time stamp
in ms since 1970 or -1. Since 2022 (``track00000003.csv``): frame, x, y in image pixels.

``particles.csv`` (since 2022), tab-separated despite its name: frame, ISO time, image x, y, world
x, y, area, orientation, compactness; the header has commas and starts with ``%``.

NMEA: lines ``$COMMAND,argument,...*HH``; HH, the exclusive or of the characters between ``$`` and
``*``, may be absent. Up to 2022 ``$PARTICLE`` has id, image x, y, orientation, world x, y; later
id, image x, y, world x, y, area, orientation, compactness. There is no clock.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import reduce
from pathlib import Path

import numpy as np

from driftwalk.core.arrays import Codes, Integers
from driftwalk.core.errors import FormatError, naming_its_file
from driftwalk.record.cleaning.clean import order_in_frame, split_bodies
from driftwalk.record.raw import Array, RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.tables.text_source import first_line, first_lines
from driftwalk.record.text import Table, blocks_of, read_head, read_table

PARTICLE = ["x (image)", "y (image)", "x (world)", "y (world)", "area", "orientation"]
OLD = ["frame", *PARTICLE, "compactness", "time stamp"]
NEW = ["frame", "x", "y"]
_FILE_NAME = re.compile(r"(?:.*_)?(?:track_?)?(\d{8})\.(?:txt|csv)")


class SwisTrackTracksLoader:
    """A body per track: give one file, or the run folder for all of its tracks."""

    name = "swistrack-tracks"
    description = "SwisTrack track files (track_00000003.txt of 2009-2022, track00000003.csv since)"

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the header, or a folder that holds track files."""
        if path.is_dir():
            return 0.7 if _track_files(path) else 0.0
        return 0.95 if _columns(head) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read one track, or every track of a folder.

        World coordinates are used when the run was calibrated, unless `metres_per_pixel` asks
        for the image. Angles are measured in the image in either case.
        """
        files = _track_files(path) if path.is_dir() else [path]
        if not files:
            raise FormatError("the folder holds no track files (track_00000000.txt)")
        matches = [_FILE_NAME.fullmatch(file.name) for file in files]
        names = [str(int(match[1])) if match else "0" for match in matches]
        tables = dict(zip(names, map(_read_one, files), strict=True))
        tracks = [*tables.values()]
        if len({len(one) for one in tracks}) > 1:
            raise FormatError("the folder mixes track files of two SwisTrack versions")
        if len(tracks[0]) == len(NEW):
            return RawRecording([RawBody(at, *tables[at]) for at in tables], "frame", "px")
        timed = options.frame_rate_hz is None and all((one[8] >= 0).all() for one in tracks)
        world = _in_world([one[at] for one in tracks for at in (3, 4)], options)
        used = (8 if timed else 0, *((3, 4) if world else (1, 2)), 6)
        bodies = [RawBody(name, *(one[at] for at in used)) for name, one in tables.items()]
        return _recording(bodies, "ms" if timed else "frame", world=world)


def _in_world(places: Sequence[Array], options: ReadOptions) -> bool:
    """Whether the run was calibrated, and the image is not asked for."""
    return options.metres_per_pixel is None and any(one.any() for one in places)


def _recording(bodies: list[RawBody], clock_unit: str, *, world: bool) -> RawRecording:
    """Return bodies in the world or the image; angles are measured in the image in either case."""
    unit, up = ("m", "up") if world else ("px", "down")
    return RawRecording(bodies, clock_unit, unit, y_axis=up, theta_axis="down")


def _of_particles(
    rows: Array | Sequence[Array], codes: Codes, names: list[str], options: ReadOptions
) -> RawRecording:
    """Return bodies of rows of frame or time, image x, y, world x, y and orientation."""
    clock, *places, theta = rows
    world = _in_world(places[2:], options)
    x, y = places[2:] if world else places[:2]
    bodies = split_bodies(RawBody("", clock, x, y, theta), codes, names)
    return _recording(bodies, "frame", world=world)


def _columns(head: bytes) -> list[str]:
    """Return the columns that the header announces, [] when it is not SwisTrack's."""
    line = first_line(head)
    header = [field.strip().lower() for field in line.lstrip("% ").split("\t")]
    if not line.startswith("%") or not header[0].startswith("frame number"):
        return []
    if len(header) == 1:  # the newer versions write the header with commas above tabs
        header = [field.strip() for field in header[0].split(",") if field.strip()]
    if len(header) == len(OLD) and "image" in header[1] and "time" in header[8]:
        return OLD
    return NEW if header[1:] == ["x", "y"] else []


@naming_its_file
def _read_one(path: Path) -> list[Array]:
    columns = _columns(read_head(path))
    if not columns:
        raise FormatError("the header does not belong to a SwisTrack track file", line=1)
    table = read_table(path, TableLayout("\t", columns, 1, tuple(range(len(columns)))))
    if np.isnan(table.numbers[0]).any():
        raise FormatError("a row has no frame number")
    return [*table.numbers.values()]


def _track_files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if _FILE_NAME.fullmatch(file.name))


PARTICLES = ["frame", "time", *PARTICLE, "compactness"]


class SwisTrackParticlesLoader:
    """Bodies are distinguished by their order within a frame, since the file has no identities."""

    name = "swistrack-particles"
    description = "SwisTrack particles.csv (2022 and later; no identities)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        header = first_line(head).lower()
        known = header.startswith("%") and "frame number" in header and "time" in header
        return 0.93 if known and header.find("time") < header.find("x (image)") else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every particle; world coordinates where the run was calibrated."""
        table = read_table(path, TableLayout("\t", PARTICLES, 1, (0, 2, 3, 4, 5, 7), (1,)))
        numbers = table.numbers
        order = order_in_frame(numbers[0])
        names = [*map(str, range(int(order.max()) + 1))]
        timed = options.frame_rate_hz is None
        rows = (_times(table) if timed else numbers[0], *(numbers[at] for at in (2, 3, 4, 5, 7)))
        raw = _of_particles(rows, order, names, options)
        raw.clock_unit = "s" if timed else "frame"
        note = "holds no identities: bodies are distinguished by their order in a frame"
        raw.notes = [f"particles.csv {note}"] if len(names) > 1 else []
        return raw


def _times(table: Table) -> Array:
    """Return seconds since 1970 of the ISO time stamps."""
    try:
        times = [datetime.fromisoformat(label) for label in table.labels[1]]
        # A time without a zone is one of UTC.
        zoned = [one if one.tzinfo is not None else one.replace(tzinfo=UTC) for one in times]
        stamps = np.array([one.timestamp() for one in zoned], dtype=np.float64)
    except (ValueError, OverflowError) as error:
        raise FormatError(
            f"a time stamp is not an ISO date ({error}); give `frame_rate` to use frame numbers"
        ) from error
    return np.asarray(stamps[table.codes[1]])


class SwisTrackNmeaLoader:
    """Frame numbers and poses; the frame rate has to be given."""

    name = "swistrack-nmea"
    description = "SwisTrack NMEA log ($FRAMENUMBER, $PARTICLE; no clock)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the commands."""
        lines = first_lines(head, 20)
        known = ("$STEP_START", "$FRAMENUMBER", "$PARTICLE")
        return 0.95 if any(line.startswith(known) for line in lines) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every particle; world coordinates where the run was calibrated."""
        values, ids = _particles(path)
        frame = values[0]
        if not frame.size:
            raise FormatError("holds no $PARTICLE")
        # Some senders give every particle the same id: then only their order tells them apart.
        repeated = np.unique(np.stack([frame, ids]), axis=1).shape[1] < frame.size
        distinct, codes = np.unique(order_in_frame(frame) if repeated else ids, return_inverse=True)
        names = [*map(str, distinct.tolist())]
        raw = _of_particles(values, codes.astype(np.int32), names, options)
        note = "ids repeat within a frame: bodies are distinguished by their order in the frame"
        raw.notes = [note] if repeated else []
        return raw


def _particles(path: Path) -> tuple[Array, Integers]:
    """Return (frame, image x, y, world x, y, orientation) and the ids, one column a particle."""
    values = array("d")
    ids = array("q")
    frame = float("nan")
    for first, block in blocks_of(path):
        for line, raw in enumerate(block.split(b"\n"), start=first):
            text = raw.strip()
            if text.startswith((b"$FRAMENUMBER,", b"$PARTICLE,")):
                command, *arguments = _verified(text, line).split(",")
                try:
                    if command == "FRAMENUMBER":
                        frame = float(int(arguments[0]))
                        continue
                    places = {6: (1, 2, 4, 5, 3), 8: (1, 2, 3, 4, 6)}[len(arguments)]
                    ids.append(int(arguments[0]))
                    values.append(frame)
                    values.extend(float(arguments[place]) for place in places)
                except (KeyError, ValueError, OverflowError) as error:
                    raise FormatError(
                        f"cannot read '{text[:60].decode('ascii', 'replace')}': expected 6 or 8 "
                        "numbers after $PARTICLE, 1 after $FRAMENUMBER",
                        line=line,
                    ) from error
                if frame != frame:
                    raise FormatError("$PARTICLE before any $FRAMENUMBER", line=line)
            elif text and not text.startswith(b"$"):
                raise FormatError("expected a line that starts with $", line=line)
    columns = np.frombuffer(values, dtype=np.float64).reshape(-1, 6).T
    return np.ascontiguousarray(columns), np.array(ids, dtype=np.int64)


def _verified(text: bytes, line: int) -> str:
    """Return the line between ``$`` and ``*``, its checksum compared if it has one."""
    content, star, stated = text[1:].partition(b"*")
    if star:
        actual = f"{reduce(lambda total, byte: total ^ byte, content, 0):02X}"
        if stated.strip().decode("ascii", "replace").upper() != actual:
            raise FormatError(
                f"the checksum is {stated.decode('ascii', 'replace')}, computed {actual}: the line "
                "is damaged",
                line=line,
            )
    return content.decode("ascii", "replace")


LOADERS = (SwisTrackTracksLoader(), SwisTrackParticlesLoader(), SwisTrackNmeaLoader())
