"""MATLAB files (``.mat``): structs, vectors, matrices; tracks of Ctrax, FlyTracker, Robotarium.

Ctrax and JAABA: an array of structs, one a body, each with its first frame. FlyTracker: one array
over body, frame and field, with the names of the fields. Robotarium: five rows for each robot.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import FormatError, listed
from driftwalk.record.raw import Array, RawBody, RawRecording, ReadOptions
from driftwalk.record.tables.matlab import (
    Struct,
    Value,
    matlab_tables,
    matlab_variables_of,
    only_matlab,
)
from driftwalk.record.tables.rows import recording_of, the_one_that_fits
from driftwalk.schema.stores.matlab import HDF5_BASED, OLD, matlab_variables


class MatlabLoader:
    """Fields and variables are named as the columns of a plain table."""

    name = "matlab"
    description = "MATLAB .mat, versions 5 and 7.3 (struct or vectors t, x, y; `sheet` names one)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the first words."""
        return 0.5 if head.startswith((OLD, HDF5_BASED)) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the variable that holds positions."""
        with matlab_variables_of(path) as variables:
            tables = matlab_tables(variables)
            unread = only_matlab(variables)
            if not tables:
                has = listed(list(variables)) or "nothing"
                reason = unread or f"has no struct, vectors or matrix of numbers, only {has}"
                raise FormatError(reason)
            try:
                return recording_of(the_one_that_fits(tables, options, "variable"), options)
            except FormatError as error:
                also = f"; {unread}" if unread else ""
                raise FormatError(f"{error.reason}{also}") from error


ROBOT_ROWS: Final = 5
"""x, y, theta, speed and turn rate of a robot."""


class MatlabTracksLoader:
    """One body for each struct, row of an array or robot."""

    name = "matlab-tracks"
    description = "MATLAB tracks of Ctrax and JAABA (trx), FlyTracker (trk), Robotarium"

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the name of the variable."""
        known = head.startswith((OLD, HDF5_BASED)) and set(_READERS) & set(matlab_variables(path))
        try:
            return 0.9 if known and _tracks(path) is not None else 0.0
        except FormatError:
            return 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every body."""
        del options
        recording = _tracks(path)
        if recording is None or not recording.bodies:
            raise FormatError(
                f"has no tracks: it needs one of {', '.join(_READERS)} in the layout of its program"
            )
        return recording


def _tracks(path: Path) -> RawRecording | None:
    """Return the tracks of a file, None where no variable has the layout of its program."""
    with matlab_variables_of(path) as variables:
        name = next((one for one in _READERS if one in variables), None)
        return None if name is None else _READERS[name](variables[name])


def _ctrax(value: Value) -> RawRecording | None:
    """Return the bodies of Ctrax: millimetres where it knows them, y as in the image."""
    if not isinstance(value, Struct) or not value.elements:
        return None
    if not {"x", "y", "firstframe"} <= set(value.elements[0]):
        return None
    scaled = {"x_mm", "y_mm"} <= set(value.elements[0])
    stamped = all(
        "timestamps" in one and _flat(one["timestamps"]).size == _flat(one["x"]).size > 0
        for one in value.elements
    )
    bodies = []
    for at, one in enumerate(value.elements, start=1):
        x, y = (_flat(one[f"{axis}_mm" if scaled else axis]) for axis in "xy")
        theta = _flat(one["theta"]) if "theta" in one else None
        first = _single(one["firstframe"], 1.0)
        frames = np.arange(x.size, dtype=np.float64) + (first - 1.0)
        clock = _flat(one["timestamps"]) if stamped else frames
        if x.size != y.size or clock.size != x.size or (theta is not None and theta.size != x.size):
            raise FormatError(f"body {at} of 'trx' has x, y and theta of different lengths")
        name = _single(one.get("id"), float(at))
        bodies.append(RawBody(f"{name:g}", clock, x, y, theta))
    rate = _single(value.elements[0].get("fps"), 0.0)
    return RawRecording(
        bodies,
        clock_unit="s" if stamped else "frame",
        length_unit="mm" if scaled else "px",
        y_axis="down",
        frame_rate_hz=rate if rate > 0.0 and not stamped else None,
        separate=True,
    )


def _flytracker(value: Value) -> RawRecording | None:
    """Return the bodies of FlyTracker: pixels, y down, but angles with y up."""
    fields = value.elements[0] if isinstance(value, Struct) and value.elements else {}
    names, data = fields.get("names"), fields.get("data")
    if not isinstance(names, list) or not isinstance(data, np.ndarray) or data.ndim not in (2, 3):
        return None
    # Of one body MATLAB keeps the first axis, and of one field drops the last.
    stack = data.reshape(data.shape[0], -1, len(names)) if data.ndim == 2 else data
    if stack.shape[2] != len(names) or not {"pos x", "pos y"} <= set(map(str, names)):
        return None
    at = {str(name): index for index, name in enumerate(names)}
    clock = np.arange(stack.shape[1], dtype=np.float64)
    of_x, of_y, of_angle = (at.get(name) for name in ("pos x", "pos y", "ori"))
    bodies = [
        RawBody(
            str(number),
            clock,
            _flat(track[:, of_x]),
            _flat(track[:, of_y]),
            None if of_angle is None else _flat(track[:, of_angle]),
        )
        for number, track in enumerate(stack, start=1)
    ]
    return RawRecording(bodies, length_unit="px", y_axis="down", theta_axis="up", separate=True)


def _robotarium(value: Value) -> RawRecording | None:
    """Return the robots of the Robotarium: metres, y up, a column for each step of 33 ms."""
    if not isinstance(value, np.ndarray) or value.ndim != 2 or value.dtype.kind not in "fiu":
        return None
    stamped = value.shape[0] % ROBOT_ROWS == 1 and value.shape[0] > 1
    count = value.shape[0] // ROBOT_ROWS
    if not count or value.shape[0] % ROBOT_ROWS > 1:
        return None
    clock = np.arange(value.shape[1], dtype=np.float64)
    robots = [[_flat(value[ROBOT_ROWS * at + row]) for row in range(3)] for at in range(count)]
    notes = ["every column counts as a frame; the Robotarium steps each 33 ms unless it is late"]
    if stamped:
        notes.append("the time stamps in the last row have no unit and are not read")
    return RawRecording(
        [RawBody(str(at), clock, *of) for at, of in enumerate(robots, start=1)],
        length_unit="m",
        y_axis="up",
        notes=notes,
        separate=True,
    )


_READERS: Final[dict[str, Callable[[Value], RawRecording | None]]] = {
    "trx": _ctrax,
    "trk": _flytracker,
    "robotarium_data": _robotarium,
}
"""From the name of a variable to what makes a recording of it."""


def _flat(value: Any) -> Array:
    return np.array(value, dtype=np.float64).ravel()


def _single(value: Any, otherwise: float) -> float:
    """Return the one number of a field."""
    known = isinstance(value, np.ndarray) and value.size == 1 and value.dtype.kind in "fiu"
    return float(value.ravel()[0]) if known else otherwise


LOADERS = (MatlabLoader(), MatlabTracksLoader())
