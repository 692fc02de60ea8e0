"""SwisTrack's NMEA stream, as its TCP server sends it and its log file keeps it.

Lines ``$COMMAND,argument,...*HH``; HH, the exclusive or of the characters between ``$`` and ``*``,
may be absent. Up to 2022 ``$PARTICLE`` has id, image x, y, orientation, world x, y; later it has
id, image x, y, world x, y, area, orientation, compactness. There is no clock.
"""

from __future__ import annotations

from array import array
from functools import reduce
from pathlib import Path

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError
from driftwalk.record.cleaning.stacked import order_in_frame, split_bodies
from driftwalk.record.raw import Array, RawRecording, ReadOptions
from driftwalk.record.text import lines_of, open_binary
from driftwalk.record.text_head import first_lines


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
        frame, image_x, image_y, world_x, world_y, theta = values
        if not frame.size:
            raise FormatError("holds no $PARTICLE", path=path)
        world = bool(world_x.any() or world_y.any()) and options.metres_per_pixel is None
        order = order_in_frame(frame)
        labels, codes = np.unique(ids, return_inverse=True)
        # Some senders give every particle the same id: then only their order tells them apart.
        repeated = np.unique(np.stack([frame, ids]), axis=1).shape[1] < frame.size
        names = [str(index) for index in (range(int(order.max()) + 1) if repeated else labels)]
        bodies = split_bodies(
            order if repeated else codes.astype(np.int32),
            names,
            clock=frame,
            x=world_x if world else image_x,
            y=world_y if world else image_y,
            theta=theta,
        )
        note = "ids repeat within a frame: bodies are distinguished by their order in the frame"
        return RawRecording(
            bodies,
            length_unit="m" if world else "px",
            y_axis="up" if world else "down",
            theta_axis="down",
            rows=int(frame.size),
            notes=[note] if repeated else [],
        )


def _particles(path: Path) -> tuple[Array, npt.NDArray[np.int64]]:
    """Return (frame, image x, y, world x, y, orientation) and the ids, one column a particle."""
    values = array("d")
    ids = array("q")
    frame = float("nan")
    with open_binary(path) as file:
        for line, raw in lines_of(file, path):
            text = raw.strip()
            if text.startswith((b"$FRAMENUMBER,", b"$PARTICLE,")):
                command, *arguments = _verified(text, path, line).split(",")
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
                        path=path,
                        line=line,
                    ) from error
                if frame != frame:
                    raise FormatError("$PARTICLE before any $FRAMENUMBER", path=path, line=line)
            elif text and not text.startswith(b"$"):
                raise FormatError("expected a line that starts with $", path=path, line=line)
    columns = np.frombuffer(values, dtype=np.float64).reshape(-1, 6).T
    return np.ascontiguousarray(columns), np.array(ids, dtype=np.int64)


def _verified(text: bytes, path: Path, line: int) -> str:
    """Return the line between ``$`` and ``*``, its checksum compared if it has one."""
    content, star, stated = text[1:].partition(b"*")
    if star:
        actual = f"{reduce(lambda total, byte: total ^ byte, content, 0):02X}"
        if stated.strip().decode("ascii", "replace").upper() != actual:
            raise FormatError(
                f"the checksum is {stated.decode('ascii', 'replace')}, computed {actual}: the line "
                "is damaged",
                path=path,
                line=line,
            )
    return content.decode("ascii", "replace")


LOADER = SwisTrackNmeaLoader()
