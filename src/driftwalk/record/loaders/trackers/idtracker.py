"""idTracker's text (2014), and idtracker.ai 4 to 6: NumPy, pickle, HDF5, CSV and its attributes.

idTracker: tab-separated ``X1 Y1 ProbId1 X2 ...``, pixels, one row per frame. idtracker.ai:
trajectories over frame, individual and (x, y), in pixels, with the frame rate. A pickle is read
without executing anything in it: see `record.stores.plain_pickle`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, InputError, damaged_as
from driftwalk.core.files.bounded import MIB, read_bounded
from driftwalk.core.text.json_text import parse_json
from driftwalk.record.cleaning.clean import number_codes, split_bodies
from driftwalk.record.loaders.plain import numbers_by_name, side_by_side
from driftwalk.record.raw import Marks, RawBody, RawRecording, ReadOptions
from driftwalk.record.stores.hdf5 import names_in, opened_hdf5
from driftwalk.record.stores.npz import NPY
from driftwalk.record.stores.plain_pickle import PickledArray, unpickle
from driftwalk.record.tables.text_source import first_line, first_row
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
TIDY_ATTRIBUTES: Final = "attributes_tidy.json"
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


def _of_arrays(
    values: npt.NDArray[Any],
    probabilities: Probabilities,
    attributes: dict[str, Any],
    options: ReadOptions,
) -> RawRecording:
    """Return the recording of trajectories over frame, individual and (x, y)."""
    if values.ndim != 3 or values.shape[2] != 2 or values.dtype.kind not in "fiu":
        raise FormatError(
            f"'trajectories' has the shape {values.shape}, expected frames, individuals, 2"
        )
    frame = np.arange(len(values), dtype=np.float64)
    names = _labels(attributes.get("identities_labels"), values.shape[1])
    bodies = [
        RawBody(name, frame, *(np.array(values[:, at, axis], dtype=np.float64) for axis in (0, 1)))
        for at, name in enumerate(names)
    ]
    return _recording(bodies, "frame", probabilities, attributes, options)


def _recording(
    bodies: list[RawBody],
    clock_unit: str,
    probabilities: Probabilities,
    attributes: dict[str, Any],
    options: ReadOptions,
) -> RawRecording:
    notes = _unit_note(attributes)
    if options.min_confidence is not None:
        notes.append(_drop_unsure(bodies, probabilities(), options.min_confidence))
    rate = _rate(attributes)
    facts: dict[str, Any] = {"frame_rate_hz": rate, "has_confidence": True, "notes": notes}
    return RawRecording(bodies, clock_unit, "px", **facts)


def _labels(stated: Any, count: int) -> list[str]:
    labels = [str(label) for label in stated] if isinstance(stated, list | tuple) else []
    usable = len(labels) == count and len(set(labels)) == count
    return labels if usable else [str(at + 1) for at in range(count)]


def _unit_note(attributes: dict[str, Any]) -> list[str]:
    """Say what the file knows of its scale: pixels per a unit that it does not name."""
    unit = attributes.get("length_unit")
    if not isinstance(unit, int | float) or not unit > 0:
        return []
    return [
        f"the file states {unit:g} pixels to its user's unit of length, without naming that: if it "
        f"is 1 cm, `metres_per_pixel` is {0.01 / unit:.6g}"
    ]


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
    return _of_arrays(trajectories, lambda: array(PROBABILITIES), found, options)


def _of_hdf5(path: Path, options: ReadOptions) -> RawRecording:
    with opened_hdf5(path) as contents:
        trajectories = contents.array("trajectories")
        stored = contents.file.attrs
        attributes = {name: np.asarray(stored[name]).tolist() for name in KNOWN if name in stored}
        known = contents.array(PROBABILITIES) if PROBABILITIES in contents.file else None
    return _of_arrays(trajectories, lambda: known, attributes, options)


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

    return _of_arrays(trajectories, probabilities, attributes, options)


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
    attributes = _attributes(path.with_name(TIDY_ATTRIBUTES))
    by_frames = _rate(attributes) is not None or options.frame_rate_hz is not None
    clock, clock_unit = (frame, "frame") if by_frames else (time, "s")
    rows = RawBody("", clock, x, y)
    raw = _recording([rows], clock_unit, lambda: known[:, None], attributes, options)
    codes, _ = number_codes(individual)
    labels = _labels(attributes.get("identities_labels"), int(codes.max()) + 1)
    return replace(raw, bodies=split_bodies(rows, codes, labels))


LOADERS = (IdTrackerLoader(), IdTrackerAiLoader())
