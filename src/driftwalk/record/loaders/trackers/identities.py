"""Programs that keep the identities of animals: idTracker's text (2014), idtracker.ai 4 to 6, TRex.

idTracker: tab-separated ``X1 Y1 ProbId1 X2 ...``, pixels, one row per frame. idtracker.ai:
trajectories over frame, individual and (x, y), in pixels, with the frame rate, as NumPy, pickle,
HDF5, CSV with its attributes. Nothing in a pickle is executed: see `record.containers`.

TRex: one file of arrays, or table, per individual; a folder of them is the recording. Positions in
cm, y down as in the image; a frame in which the individual is lost has infinity. Points of a pose
are in pixels.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, InputError, damaged_as, naming_its_file
from driftwalk.core.text_files import MIB, parse_json, read_bounded
from driftwalk.record.cleaning.clean import number_codes, split_bodies
from driftwalk.record.column_names import unit_of_name
from driftwalk.record.containers import (
    NPY,
    ZIP,
    PickledArray,
    members,
    names_in,
    opened_hdf5,
    opened_npz,
    unpickle,
)
from driftwalk.record.loaders.plain import numbers_by_name, side_by_side
from driftwalk.record.pose import angle_between
from driftwalk.record.raw import Array, Marks, RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.tables.text_source import first_line, first_names, first_row
from driftwalk.record.text import read_table
from driftwalk.schema.stores.netcdf import HDF5, file_start

_POSITION = re.compile(r"(?P<axis>[XY])(?P<body>\d+)")
_HEADER = re.compile(r"X1\s+Y1\s+ProbId1\b", re.ASCII)


class IdTrackerLoader:
    """Positions in pixels without a clock: the frame rate and the scale have to be given."""

    name = "idtracker"
    description = "idTracker trajectories.txt (X1 Y1 ProbId1 ..., pixels, no clock)"

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        return 0.95 if _HEADER.match(first_line(head)) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every individual; ``ProbId`` -1 and -2 mark positions that idTracker estimated."""
        bodies, columns = side_by_side(path, _POSITION, options.delimiter)
        chances = [columns.get(f"ProbId{body.name}", np.zeros(0)) for body in bodies]
        estimated = sum(int((one < 0).sum()) for one in chances)
        note = f"{estimated} positions were estimated by idTracker, not seen"
        return RawRecording(bodies, length_unit="px", notes=[note] if estimated else [])


TABLE: Final = "trajectories.csv"
ATTRIBUTES: Final = "attributes.json"
TIDY: Final = ["frame", "time", "individual", "x", "y", "probability"]
KNOWN: Final = ("frames_per_second", "length_unit", "identities_labels")
"""Attributes that are read."""
PROBABILITIES: Final = "id_probabilities"


Probabilities = Callable[[], "npt.NDArray[Any] | None"]
"""Returns the probabilities of the identities, shape (frame, individual) or one more."""


class IdTrackerAiLoader:
    """Every individual, by its label where there is one."""

    name = "idtrackerai"
    description = "idtracker.ai 4 to 6 (.npy, .pickle, .h5, folder of CSV, tidy CSV; pixels)"
    marks = (
        Marks("HDF5", ("trajectories", "frames_per_second", PROBABILITIES)),
        Marks("table", tuple(TIDY)),
        Marks("folder", (TABLE, ATTRIBUTES)),
    )

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise a dictionary in NumPy's form, the arrays in HDF5, or the files of CSV."""
        if path.is_dir() or path.name == TABLE:
            folder = path if path.is_dir() else path.parent
            return 0.96 if (folder / TABLE).is_file() and (folder / ATTRIBUTES).is_file() else 0.0
        if head.startswith(NPY):
            return 0.9 if b"'|O'" in head[:200] and b"trajectories" in head else 0.3
        if head.startswith(b"\x80"):
            return 0.9 if b"trajectories" in head else 0.0
        if head.startswith(HDF5):
            names = names_in(path, head)
            known = "trajectories" in names and {"frames_per_second", PROBABILITIES} & names
            return 0.95 if known else 0.0
        return 0.95 if head.startswith(",".join(TIDY).encode()) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every individual; `min_confidence` asks for the probability of its identity."""
        if path.is_dir() or path.name == TABLE:
            return _of_folder(path if path.is_dir() else path.parent, options)
        start = file_start(path)
        if start == HDF5:
            return _of_hdf5(path, options)
        if start.startswith((NPY, b"\x80")):
            return _of_pickle(path, options)
        return _of_tidy(path, options)


def _bodies(values: npt.NDArray[Any], attributes: dict[str, Any]) -> list[RawBody]:
    """Return the individuals of trajectories over frame, individual and (x, y)."""
    if values.ndim != 3 or values.shape[2] != 2 or values.dtype.kind not in "fiu":
        raise FormatError(
            f"'trajectories' has the shape {values.shape}, expected frames, individuals, 2"
        )
    frame = np.arange(len(values), dtype=np.float64)
    names = _labels(attributes.get("identities_labels"), values.shape[1])
    return [
        RawBody(name, frame, *(np.array(values[:, at, axis], dtype=np.float64) for axis in (0, 1)))
        for at, name in enumerate(names)
    ]


def _recording(
    bodies: list[RawBody], probabilities: Probabilities, known: dict[str, Any], options: ReadOptions
) -> RawRecording:
    """Return the recording of individuals that were seen in each frame; `known` of the session."""
    notes = _unit_note(known)
    if options.min_confidence is not None:
        notes.append(_drop_unsure(bodies, probabilities(), options.min_confidence))
    rate = _rate(known)
    return RawRecording(bodies, "frame", "px", frame_rate_hz=rate, has_confidence=True, notes=notes)


def _labels(stated: Any, count: int) -> list[str]:
    labels = [str(label) for label in stated] if isinstance(stated, list | tuple) else []
    usable = len(labels) == count and len(set(labels)) == count
    return labels if usable else [str(at + 1) for at in range(count)]


def _unit_note(attributes: dict[str, Any]) -> list[str]:
    """Say what the file knows of its scale: pixels per a unit that it does not name."""
    unit = attributes.get("length_unit")
    if not isinstance(unit, int | float) or not unit > 0:
        return []
    what = f"{unit:g} pixels to its user's unit of length, without naming that"
    return [f"the file states {what}: if it is 1 cm, `metres_per_pixel` is {0.01 / unit:.6g}"]


def _rate(attributes: dict[str, Any]) -> float | None:
    rate = attributes.get("frames_per_second")
    if rate is None:
        return None
    if not isinstance(rate, int | float) or not 0 < rate < 1e9:
        raise FormatError(f"'frames_per_second' is {str(rate)[:40]}")
    return float(rate)


def _drop_unsure(
    bodies: list[RawBody], probabilities: npt.NDArray[Any] | None, least: float
) -> str:
    count = bodies[0].clock.size if bodies else 0
    if probabilities is None or probabilities.size != count * len(bodies):
        raise InputError("the file holds no confidences: leave `min_confidence` out")
    dropped = 0
    for body, known in zip(bodies, probabilities.reshape(count, len(bodies)).T, strict=True):
        unsure = np.isfinite(body.x) & (known < least)
        body.x[unsure] = body.y[unsure] = np.nan
        dropped += int(unsure.sum())
    return f"positions with a probability of the identity below {least:g} are missing: {dropped}"


def _of_pickle(path: Path, options: ReadOptions) -> RawRecording:
    content = path.read_bytes()
    if content.startswith(NPY):
        header, _, content = content[len(NPY) :].partition(b"\n")
        if b"'|O'" not in header:
            with damaged_as("as .npy", path):
                stored = np.load(path, allow_pickle=False)
            raise FormatError(
                f"is an array of {stored.dtype} of shape {stored.shape}, and no dictionary of "
                "idtracker.ai: save columns of time, x and y as CSV"
            )
    found = unpickle(content, where="the file")
    if isinstance(found, PickledArray) and len(found.objects()) == 1:
        found = found.objects()[0]
    if not isinstance(found, dict) or not isinstance(found.get("trajectories"), PickledArray):
        held = ", ".join(map(str, list(found)[:8])) if isinstance(found, dict) else "no dictionary"
        raise FormatError(f"has no 'trajectories' as idtracker.ai's have it, but {held}")

    def array(name: str) -> npt.NDArray[Any] | None:
        try:
            return found[name].values() if isinstance(found.get(name), PickledArray) else None
        except (ValueError, TypeError, MemoryError) as error:
            raise FormatError(f"'{name}' is damaged: {error}") from error

    trajectories = array("trajectories")
    assert trajectories is not None
    return _recording(_bodies(trajectories, found), lambda: array(PROBABILITIES), found, options)


def _of_hdf5(path: Path, options: ReadOptions) -> RawRecording:
    with opened_hdf5(path) as contents:
        trajectories = contents.array("trajectories")
        stored = contents.file.attrs
        attributes = {name: np.asarray(stored[name]).tolist() for name in KNOWN if name in stored}
        known = contents.array(PROBABILITIES) if PROBABILITIES in contents.file else None
    return _recording(_bodies(trajectories, attributes), lambda: known, attributes, options)


def _of_folder(folder: Path, options: ReadOptions) -> RawRecording:
    attributes = _attributes(folder / ATTRIBUTES)
    path = folder / TABLE
    columns = numbers_by_name(path)
    places = [name for name in columns if name[:1] in "xy" and name[1:].isdecimal()]
    count = len(places) // 2
    expected = [f"{axis}{at}" for at in range(1, count + 1) for axis in "xy"]
    if places != expected or not count:
        raise FormatError("no columns x1, y1, x2, y2, ... as idtracker.ai writes them", path=path)
    trajectories = np.stack([columns[name] for name in places], axis=1).reshape(-1, count, 2)

    def probabilities() -> npt.NDArray[Any] | None:
        file = folder / f"{PROBABILITIES}.csv"
        if not file.is_file():
            return None
        return np.stack(
            [one for name, one in numbers_by_name(file).items() if name != "time"], axis=1
        )

    return _recording(_bodies(trajectories, attributes), probabilities, attributes, options)


def _attributes(path: Path) -> dict[str, Any]:
    """Return the attributes that idtracker.ai writes next to its tables, {} where it wrote none."""
    if not path.is_file():
        return {}
    attributes = parse_json(read_bounded(path, most=64 * MIB), path=path)
    return attributes if isinstance(attributes, dict) else {}


def _of_tidy(path: Path, options: ReadOptions) -> RawRecording:
    if first_row(path) != TIDY:
        raise FormatError(f"the columns are not {','.join(TIDY)}", line=1)
    frame, time, individual, x, y, known = numbers_by_name(path).values()
    if not np.isfinite(individual).all():
        raise FormatError("a row names no individual")
    attributes = _attributes(path.with_name("attributes_tidy.json"))
    by_frames = _rate(attributes) is not None or options.frame_rate_hz is not None
    clock, clock_unit = (frame, "frame") if by_frames else (time, "s")
    raw = _recording([RawBody("", clock, x, y)], lambda: known[:, None], attributes, options)
    codes, _ = number_codes(individual)
    labels = _labels(attributes.get("identities_labels"), int(codes.max()) + 1)
    return replace(raw, bodies=split_bodies(raw.bodies[0], codes, labels), clock_unit=clock_unit)


CENTRES: Final = ("wcentroid", "centroid", "pcentroid", "head")
"""Points that TRex knows of an individual, the first that a file has is the body."""
POSE: Final = tuple(f"pose{at}" for at in range(100))
"""Points of the posture, as TRex numbers them; more than it writes."""
ASSUMED: Final = (
    "the file does not hold cm_per_pixel, and TRex takes the image to be 30 cm wide where no scale "
    "was set: check the scale"
)
_USED: Final = re.compile(r"frame|time|missing|ANGLE|[XY](#[wp]?centroid)?|pose[XY]\d+")
_INDIVIDUAL: Final = re.compile(r"(.*?)_?(?:fish|id)?(\d+)\.(?:npz|csv)")


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
        notes = [ASSUMED] if self.cm_per_pixel is None else []
        return replace(raw, frame_rate_hz=self.frame_rate_hz, notes=notes)

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
            return 0.8 if _trex_files(path) else 0.0
        if head.startswith(ZIP):
            return 0.95 if _is_individual(members(path)) else 0.0
        names = [name.partition(" ")[0] for name in first_names(head)]
        return 0.95 if "frame" in names and any("#wcentroid" in name for name in names) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read one individual, or every one of a folder."""
        if options.min_confidence is not None:
            raise InputError("the file holds no confidences: leave `min_confidence` out")
        files = _trex_files(path) if path.is_dir() else [path]
        if not files:
            raise FormatError("the folder holds no file of an individual (VIDEO_id0.npz)")
        videos = sorted({_name_of(file)[0] for file in files})
        if len(videos) > 1:
            raise FormatError(
                f"the folder holds several videos ({', '.join(videos[:4])}): give a folder with "
                "the files of one"
            )
        read = [_read_trex(file, options) for file in files]
        if len({(one.clock_unit, one.length_unit) for one in read}) > 1:
            raise FormatError("the files of the folder differ in clock or unit")
        notes = dict.fromkeys(note for one in read for note in one.notes)
        return replace(read[0], bodies=[one.bodies[0] for one in read], notes=[*notes])


def _trex_files(folder: Path) -> list[Path]:
    """Return the files of individuals in a folder, in the order of their numbers."""
    found = [file for file in folder.glob("*.npz") if _is_individual(members(file))]
    return sorted(found, key=lambda file: (_name_of(file)[0], int(_name_of(file)[1])))


def _is_individual(names: set[str]) -> bool:
    return "frame" in names and bool({"X#wcentroid", "X"} & names)


def _name_of(file: Path) -> tuple[str, str]:
    """Return the video and the individual that a file is of."""
    match = _INDIVIDUAL.fullmatch(file.name)
    return (match[1], match[2]) if match else (file.stem, "0")


def _keys(point: str) -> tuple[str, str]:
    """Return the names of x and y of a point."""
    if point == "head":
        return "X", "Y"
    end = f"#{point}"
    return (f"poseX{point[4:]}", f"poseY{point[4:]}") if point in POSE else (f"X{end}", f"Y{end}")


@naming_its_file
def _read_trex(path: Path, options: ReadOptions) -> RawRecording:
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
    return _Columns({bare: table.numbers[at] for at, bare in used.items()}, next(iter(units), ""))


LOADERS = (IdTrackerLoader(), IdTrackerAiLoader(), TrexLoader())
