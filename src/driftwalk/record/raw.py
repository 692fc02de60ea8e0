"""Result of a loader: the numbers of a file in its own units, and their meaning.

Units, scale, clock and the direction of y are turned into SI in one place, `record.convert_units`;
a loader only says what the file holds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.record.unit_and_column_words import words

NAMELESS: Final = words("nameless") | {""}
"""Words for a missing name of a body."""
MISSING: Final = NAMELESS | words("missing")
"""Words that trackers, spreadsheets and compilers write for a missing number."""


@dataclass(frozen=True)
class TableLayout:
    """Where the numbers stand in a text file."""

    delimiter: str
    """One character, or ``" "`` for any run of blanks."""
    names: list[str]
    """Names of all columns, in order (for error messages)."""
    skip_lines: int = 0
    """Lines before the first row of data."""
    numbers: tuple[int, ...] = ()
    """Columns (from 0) to read as numbers."""
    texts: tuple[int, ...] = ()
    """Columns (from 0) to read as text."""
    clock: int | None = None
    """The one of the numbers whose whole values may be beyond those that float64 holds exactly."""
    stamps: tuple[int, ...] = ()
    """Columns (from 0) of time stamps; of several the sum counts, as of a date and a time of day.
    It becomes the numbers of the first of them."""


Array = Floats

LENGTH_UNITS: dict[str, float] = {
    **{"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "km": 1e3, "dm": 0.1, "nm": 1e-9},
    **{"ft": 0.3048, "in": 0.0254, "yd": 0.9144},
}
"""Metres per unit of length; pixels are ``"px"``, and ``""`` is a file that does not say."""

CLOCK_UNITS: dict[str, float] = {
    **{"s": 1.0, "ds": 10.0, "cs": 100.0, "ms": 1e3, "us": 1e6, "ns": 1e9},
    **{"min": 1.0 / 60.0, "h": 1.0 / 3600.0, "d": 1.0 / 86_400.0},
}
"""Units of time per second; a clock that counts frames is ``"frame"``."""

ANGLE_UNITS: dict[str, float] = {
    **{"rad": 1.0, "deg": float(np.pi / 180.0), "mrad": 1e-3, "gon": float(np.pi / 200.0)},
    **{"turn": float(2.0 * np.pi), "ddeg": float(np.pi / 1800.0), "cdeg": float(np.pi / 18000.0)},
}
"""Radians per unit of angle."""


DELIMITERS: Final = {"tab": "\t", "\\t": "\t", "space": " "}
"""Words for characters that are hard to type between quotes."""


@dataclass
class RawBody:
    """The samples of one body as the file has them, in the file's order.

    Arrays of float64 that the reading of the file made: they are converted in place. Bodies may
    share a clock, and nothing else.
    """

    name: str
    clock: Array
    """Time stamps or frame numbers, shape (n,); bodies may share one array."""
    x: Array
    """Position x, shape (n,), NaN where the body was not detected."""
    y: Array
    """Position y, shape (n,)."""
    theta: Array | None = None
    """Orientation, shape (n,), wrapped or not; None when the file has none."""
    extra: dict[str, Array] = field(default_factory=dict, kw_only=True)
    """Further values of each sample, shape (n, ...), by name; see `RawRecording.extra`."""

    def take(self, rows: Bools | Integers) -> RawBody:
        """Return the body with these rows alone."""
        theta = None if self.theta is None else self.theta[rows]
        extra = {name: values[rows] for name, values in self.extra.items()}
        return RawBody(self.name, self.clock[rows], self.x[rows], self.y[rows], theta, extra=extra)

    def blank(self, lost: Bools) -> None:
        """Make rows missing, in place."""
        self.x[lost] = self.y[lost] = np.nan
        if self.theta is not None:
            self.theta[lost] = np.nan


@dataclass(frozen=True)
class Extra:
    """Meaning of a further variable of a recording, which is carried along unchanged."""

    dims: tuple[str, ...]
    """Dimensions after (time, body)."""
    attrs: dict[str, Any]
    """Its unit and name."""
    coords: dict[str, Any]
    """Values along these dimensions."""


@dataclass
class RawRecording:
    """The bodies of a file and what the file says about its numbers."""

    bodies: list[RawBody]
    clock_unit: str = "frame"
    """A key of `CLOCK_UNITS`, or ``"frame"``."""
    length_unit: str = ""
    """A key of `LENGTH_UNITS`, ``"px"``, or ``""`` when the file does not say."""
    angle_unit: str = "rad"
    """A key of `ANGLE_UNITS`."""
    bare_length_is_si: bool = False
    """Whether a length without a unit is metres in this format."""
    y_axis: str = ""
    """Direction of y in the file, ``"up"`` or ``"down"``; ``""``: down in pixels, else up."""
    plane: str = ""
    """Which plane of a file in space the positions lie in, in words; ``""``: they had no third
    axis."""
    theta_axis: str = ""
    """Direction of y that the angles were measured in; ``""``: the same as `y_axis`."""
    frame_rate_hz: float | None = None
    """Frame rate when the file itself holds it."""
    rows: int = 0
    """Rows of data in the file; 0: those of the bodies, of which one clock counts once."""
    notes: list[str] = field(default_factory=list)
    """Sentences for the person who loads the file."""
    attrs: dict[str, Any] = field(default_factory=dict)
    """Attributes to carry over into the dataset."""
    extra: dict[str, Extra] = field(default_factory=dict)
    """Further variables, which each body has in its `extra`."""
    clock_origin: int = 0
    """Offset to add to every clock, subtracted because its whole numbers are beyond float64."""
    calendar: str = ""
    """Origin of a clock of time stamps: ``"UTC"`` or ``"local"`` for 1970 there, ``"day"``
    for midnight; ``""``: the clock is of numbers."""
    bare_clock: str | None = None
    """Column of a clock that is taken as seconds though nothing says so, ``""`` where the format
    has no columns to name; None for any other clock."""
    bare_angle: bool = False
    """Whether angles are taken as radians though nothing says so."""
    separate: bool = False
    """Whether the format itself keeps bodies apart: rows at one time come of a coarse clock."""
    has_keypoints: bool = False
    """Whether the format has keypoints, of which the loader has made the bodies."""
    has_confidence: bool = False
    """Whether the loader has minded the least confidence."""
    body_columns: Callable[[bool], list[str]] | None = None
    """Finds the columns that could name the body, see `record.several_bodies`; None: there are no
    columns to choose from."""
    columns: list[dict[str, str]] = field(default_factory=list)
    """Readings of the columns of a table: column, meaning, unit, why."""


@dataclass(frozen=True)
class ReadOptions:
    """Facts that the person who loads a recording knows and the file may not state.

    A loader reads what it needs and leaves the rest to the stages after it.
    """

    columns: dict[str, str] = field(default_factory=dict)
    """Name or number (from 1) of the column of each quantity, such as t, frame, x, y, theta, body;
    ``":unit"`` may follow. Columns of ``"skip"``, with plus signs between, are not read."""
    columns_stated_by: str = "you named it"
    """Why `columns` are what they are, in the words of a reading."""
    delimiter: str | None = None
    """Character between fields; None: recognised."""
    frame_rate_hz: float | None = None
    """Frames per second [Hz]."""
    metres_per_pixel: float | None = None
    """Scale of a recording in pixels [m]."""
    length_unit: str | None = None
    """Unit of positions in a file that does not say: ``"m"``, ``"cm"``, ``"mm"``, ``"um"``."""
    up: str | None = None
    """Axis of positions in space that points up: ``"x"``, ``"-y"``, ...; None: as the format has
    it."""
    topic: str | None = None
    """Topic of a ROS bag, or several with commas between them."""
    header_line: int | None = None
    """Line of a plain table, from 1, that names its columns; None: the first."""
    sheet: str | None = None
    """Name or number, from 1, of a sheet; name of a variable of a MATLAB file."""
    x: Path | None = None
    """File of the x matrix (one row a frame, one column a body)."""
    y: Path | None = None
    """File of the y matrix."""
    theta: Path | None = None
    """File of the orientation matrix."""
    keypoint: str | None = None
    """Keypoint of a pose file that is the body."""
    heading: tuple[str, str] | None = None
    """Two keypoints, or markers: the body points from the first to the second."""
    min_confidence: float | None = None
    """Keypoints seen with less confidence are missing; None: as usual for the format."""
    box: str | None = None
    """Columns of a box: ``"xyxy"``, ``"xywh"``, ``"cxcywh"``; ``"none"``: there is no box.
    ``"cxcywh@WxH"``: of shares of an image."""
    missing: tuple[str, ...] = ()
    """Places that mean that the body was not seen: ``"0,0"``, ``"-9999"``, ``"held"``."""
    replicate: int = 0
    """Replicate of a simulation, counted from 0."""


@dataclass(frozen=True)
class Marks:
    """Names that a file of a format has: a loader may have several, for several forms of it."""

    container: str
    """``"HDF5"``, ``"npz"``, ``"npy"``, ``"XML"``, ``"table"`` or ``"folder"``."""
    names: tuple[str, ...]
    """Arrays, attributes, keys, elements, columns or files."""
