"""TRex: one file of arrays, or table, per individual; a folder of them is the recording.

Positions in cm, y down as in the image; a frame in which the individual is lost has infinity.
Points of a pose are in pixels.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, InputError, naming_its_file
from driftwalk.record.column_names import unit_of_name
from driftwalk.record.pose import angle_between
from driftwalk.record.raw import Array, Marks, RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.stores.npz import ZIP, members, opened_npz
from driftwalk.record.tables.text_source import first_names, first_row
from driftwalk.record.text import read_table
from driftwalk.schema.stores.netcdf import file_start

CENTRES: Final = ("wcentroid", "centroid", "pcentroid", "head")
"""Points that TRex knows of an individual, the first that a file has is the body."""
POSE: Final = tuple(f"pose{at}" for at in range(100))
ASSUMED: Final = (
    "the file does not hold cm_per_pixel, and TRex takes the image to be 30 cm wide where nobody "
    "set it: check the scale"
)
_USED: Final = re.compile(r"frame|time|missing|ANGLE|[XY](#[wp]?centroid)?|pose[XY]\d+")
_NUMBER: Final = re.compile(r"(.*?)_?(?:fish|id)?(\d+)\.(?:npz|csv)")


@dataclass(frozen=True)
class _Columns:
    """Columns of one individual by their names, read when they are asked for."""

    arrays: Mapping[str, npt.NDArray[Any]]
    length_unit: str
    cm_per_pixel: float | None = None
    frame_rate_hz: float | None = None

    def recording(self, name: str, options: ReadOptions) -> RawRecording:
        """Return the one body."""
        if "frame" not in self.arrays:
            raise FormatError("has no 'frame'")
        timed = "time" in self.arrays and options.frame_rate_hz is None
        clock = self.read("time" if timed else "frame")
        centres = (name for name in CENTRES if set(_keys(name)) <= self.arrays.keys())
        x, y = self.point(options.keypoint or next(centres, CENTRES[0]))
        theta = None
        if options.heading is not None:
            theta = angle_between(*map(self.point, options.heading))
        elif "ANGLE" in self.arrays:
            theta = self.read("ANGLE")
        bodies, clock_unit = [RawBody(name, clock, x, y, theta)], "s" if timed else "frame"
        raw = RawRecording(bodies, clock_unit, self.length_unit, has_keypoints=True, y_axis="down")
        raw.frame_rate_hz = self.frame_rate_hz
        raw.notes = [ASSUMED] if self.cm_per_pixel is None else []
        return raw

    def read(self, name: str) -> Array:
        """Return a column as a new array."""
        return _numbers(self.arrays[name], name)

    def point(self, name: str) -> tuple[Array, Array]:
        """Return x and y of a point of the individual, NaN where it was not seen."""
        keys = _keys(name)
        if not set(keys) <= self.arrays.keys():
            known = [one for one in (*CENTRES, *POSE) if set(_keys(one)) <= self.arrays.keys()]
            raise FormatError(
                f"has no point '{name}' in x and y; there are {', '.join(known) or 'none'}"
            )
        x, y = (self.read(key) for key in keys)
        if x.size != y.size:
            raise FormatError("the arrays have different lengths")
        lost = ~(np.isfinite(x) & np.isfinite(y))
        if "missing" in self.arrays:  # a position may be interpolated there
            missing = self.read("missing")
            lost |= missing == 1.0 if missing.size == lost.size else False
        x[lost] = y[lost] = np.nan
        if name not in POSE:
            return x, y
        if self.cm_per_pixel is None:
            raise FormatError("points of a pose are in pixels, and cm_per_pixel is not there")
        return x * self.cm_per_pixel, y * self.cm_per_pixel


class TrexLoader:
    """One body per file; `keypoint` chooses among the centres and the points of a pose."""

    name = "trex"
    description = "TRex, one .npz or CSV per individual, or a folder of .npz (X#wcentroid; cm)"
    marks = (
        Marks("npz", ("X#wcentroid", "Y#wcentroid", "frame", "time", "missing")),
        Marks("table", ("frame", "X#wcentroid (cm)", "Y#wcentroid (cm)")),
    )

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the names of its arrays or columns."""
        if path.is_dir():
            return 0.8 if _files(path) else 0.0
        if head.startswith(ZIP):
            return 0.95 if _is_individual(members(path)) else 0.0
        names = [name.partition(" ")[0] for name in first_names(head)]
        return 0.95 if "frame" in names and any("#wcentroid" in name for name in names) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read one individual, or every one of a folder."""
        if options.min_confidence is not None:
            raise InputError("the file holds no confidences: leave `min_confidence` out")
        files = _files(path) if path.is_dir() else [path]
        if not files:
            raise FormatError("the folder holds no file of an individual (VIDEO_id0.npz)")
        videos = sorted({_name_of(file)[0] for file in files})
        if len(videos) > 1:
            raise FormatError(
                f"the folder holds several videos ({', '.join(videos[:4])}): give a folder with "
                "the files of one"
            )
        read = [_read(file, options) for file in files]
        if len({(one.clock_unit, one.length_unit) for one in read}) > 1:
            raise FormatError("the files of the folder differ in clock or unit")
        notes = dict.fromkeys(note for one in read for note in one.notes)
        return replace(read[0], bodies=[one.bodies[0] for one in read], notes=[*notes])


def _files(folder: Path) -> list[Path]:
    """Return the files of individuals in a folder, in the order of their numbers."""
    found = [file for file in folder.glob("*.npz") if _is_individual(members(file))]
    return sorted(found, key=lambda file: (_name_of(file)[0], int(_name_of(file)[1])))


def _is_individual(names: set[str]) -> bool:
    return "frame" in names and bool({"X#wcentroid", "X"} & names)


def _name_of(file: Path) -> tuple[str, str]:
    """Return the video and the individual that a file is of."""
    match = _NUMBER.fullmatch(file.name)
    return (match[1], match[2]) if match else (file.stem, "0")


def _keys(point: str) -> tuple[str, str]:
    """Return the names of x and y of a point."""
    if point == "head":
        return "X", "Y"
    end = f"#{point}"
    return (f"poseX{point[4:]}", f"poseY{point[4:]}") if point in POSE else (f"X{end}", f"Y{end}")


@naming_its_file
def _read(path: Path, options: ReadOptions) -> RawRecording:
    _, name = _name_of(path)
    if not file_start(path).startswith(ZIP):
        return _of_csv(path).recording(name, options)
    with opened_npz(path) as arrays:
        scale = _first(arrays, "cm_per_pixel")
        # Without it, what is called cm may be pixels.
        unit = options.length_unit or ("px" if options.metres_per_pixel else "cm")
        unit, rate = unit if scale is None else "cm", _first(arrays, "frame_rate")
        return _Columns(arrays, unit, scale, rate).recording(name, options)


def _numbers(values: npt.NDArray[Any], name: str) -> Array:
    if values.dtype.kind not in "fiub" or values.ndim != 1:
        raise FormatError(f"'{name}' is no row of numbers")
    return np.array(values, dtype=np.float64)


def _first(arrays: Mapping[str, npt.NDArray[Any]], name: str) -> float | None:
    """Return the number in an array of one, None where there is none above zero."""
    if name not in arrays:
        return None
    values = _numbers(np.ravel(arrays[name]), name)
    return float(values[0]) if values.size and 0 < values[0] < np.inf else None


def _of_csv(path: Path) -> _Columns:
    """Return the columns of a table by their names without units."""
    names = first_row(path)
    bare_names = enumerate(name.partition(" (")[0] for name in names)
    used = {at: bare for at, bare in bare_names if _USED.fullmatch(bare)}
    if not used:
        raise FormatError("has no columns frame, X#wcentroid and Y#wcentroid", line=1)
    units = {unit_of_name(names[at]) for at, bare in used.items() if bare[0] in "XY"}
    if len(units) > 1:
        raise FormatError("the columns of positions name different units", line=1)
    table = read_table(path, TableLayout(",", names, 1, tuple(used)))
    columns = {bare: table.numbers[at] for at, bare in used.items()}
    return _Columns(columns, next(iter(units), ""))


LOADER = TrexLoader()
