"""Keypoints: DeepLabCut and Lightning Pose, SLEAP, and NetCDF of the `movement` package.

DeepLabCut: a table with header rows of scorer, individuals, bodyparts, coords, as CSV or in HDF5
(``df_with_missing``), pixels, one row per frame; files of one animal have no row of individuals.
SLEAP: pixels, no clock, HDF5 over track, xy, node and frame, or CSV of
``track,frame_idx,instance.score,NODE.x,NODE.y,NODE.score,...``, one row per instance.

`movement`: ``position`` over time, space, keypoints and individuals, or the same in the singular;
bounding boxes have no keypoints. Where driftwalk wrote the file, positions state their unit, an
``orientation`` lies next to them, and an attribute holds what was known of the recording.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.core.text_files import parse_json
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.cleaning.clean import split_bodies
from driftwalk.record.containers import Hdf5Contents, frame_in, names_in, opened_hdf5, text_of
from driftwalk.record.pose import Confidence, Places, choose_keypoints, recording_of_poses
from driftwalk.record.raw import LENGTH_UNITS, Array, Marks, RawRecording, ReadOptions, TableLayout
from driftwalk.record.tables.text_source import first_names, first_row
from driftwalk.record.text import header_rows, read_table
from driftwalk.schema.stores.netcdf import HDF5, MAGIC, file_start, open_netcdf, text_attribute

if TYPE_CHECKING:
    import xarray as xr

OF_DEEPLABCUT: Final = (0.6, "DeepLabCut's pcutoff")
"""Least likelihood of a point that is read, as DeepLabCut itself has it."""
OF_SLEAP: Final = (0.2, "SLEAP's threshold of peaks")
"""The same as SLEAP has it."""
OF_MOVEMENT: Final = (0.6, "movement's threshold")
"""The same as the package movement has it."""


def _places(columns: Iterable[tuple[int, tuple[str, ...]]]) -> dict[str, dict[str, dict[str, int]]]:
    """Return the columns of coordinates of individuals' keypoints; other ones are left out."""
    found: dict[str, dict[str, dict[str, int]]] = {}
    for at, (individual, part, coordinate) in columns:
        if coordinate in ("x", "y", "likelihood"):
            found.setdefault(individual, {}).setdefault(part, {})[coordinate] = at
    return found


def _used(places: Places, options: ReadOptions) -> set[int]:
    """Return the columns of the chosen keypoints."""
    names = choose_keypoints(places, options)
    used = (own.get(name, {}) for own in places.values() for name in names)
    return {at for place in used for at in place.values()}


def _of_arrays(
    position: xr.DataArray,
    confidence: xr.DataArray | None,
    names: tuple[Sequence[str], Sequence[str]],
    clock: Array,
    options: ReadOptions,
    usual: Confidence,
) -> RawRecording:
    """Return the recording of arrays over time, x and y, keypoint, individual; of those the names.

    The confidence has not the axis of x and y.
    """
    if confidence is not None and confidence.shape != (position.shape[0], *position.shape[2:]):
        raise FormatError(f"'{confidence.name}' has another shape than '{position.name}'")

    arrays = {"x": position.values[:, 0], "y": position.values[:, 1]}
    arrays |= {} if confidence is None else {"likelihood": confidence.values}
    places = {
        individual: {
            keypoint: {name: array[:, at, of] for name, array in arrays.items()}
            for at, keypoint in enumerate(names[0])
        }
        for of, individual in enumerate(names[1])
    }
    return recording_of_poses(places, partial(np.array, dtype=np.float64), clock, options, usual)


def _in_order(values: xr.DataArray, *order: str) -> xr.DataArray:
    """Return an array with its dimensions in this order."""
    if sorted(map(str, values.dims)) != sorted(order):
        found = ", ".join(map(str, values.dims))
        raise FormatError(f"'{values.name}' is over {found}, expected {', '.join(order)}")
    return values.transpose(*order)


LEVELS: Final = ("individuals", "bodyparts", "coords")
KEYS: Final = ("df_with_missing", "tracks")
"""Names under which DeepLabCut stores its table."""


class DeepLabCutLoader:
    """Bodyparts of every individual; of several one has to be named."""

    name = "deeplabcut"
    description = "DeepLabCut and Lightning Pose, CSV and HDF5 (scorer, bodyparts, coords; pixels)"
    marks = (
        Marks("table", ("scorer", "bodyparts", "coords", "x", "y", "likelihood")),
        Marks("HDF5", ("df_with_missing",)),
    )

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the first header row, or the name of the table in HDF5."""
        known = head.startswith(b"scorer,") or KEYS[0] in names_in(path, head)
        return 0.95 if known else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the chosen bodyparts of every individual."""
        if file_start(path) == HDF5:
            with opened_hdf5(path) as contents:
                key = next((key for key in KEYS if key in contents.file), KEYS[0])
                frame = frame_in(contents, key)
                levels = [*frame.columns]
                if any(len(column) not in (3, 4) for column in levels):
                    raise FormatError(f"'{key}' has no columns of scorer, bodyparts, coords")
                places, clock = _bodyparts(levels, 0), frame.labels()
                return recording_of_poses(places, frame.numbers, clock, options, OF_DEEPLABCUT)
        header = _header(path)
        columns = [*zip(*header, strict=True)]
        places = _bodyparts(columns[1:], 1)
        names = [".".join(filter(None, column)) for column in columns]
        wanted = (0, *sorted(_used(places, options)))
        numbers = read_table(path, TableLayout(",", names, len(header), wanted)).numbers
        return recording_of_poses(places, numbers.__getitem__, numbers[0], options, OF_DEEPLABCUT)


def _header(path: Path) -> list[list[str]]:
    """Return the header rows, equally long."""
    rows = [split_fields(line, ",") or [""] for line in header_rows(path, 5)]
    count = next((at for at, row in enumerate(rows[:4]) if row[0] == "coords"), -1) + 1
    first = [row[0] for row in rows[:count]]
    if first not in (["scorer", *LEVELS[-2:]], ["scorer", *LEVELS]):
        what = "the first column of the header is not scorer, (individuals,) bodyparts, coords"
        raise FormatError(f"{what}: is it DeepLabCut's?", line=1)
    if any(len(row) != len(rows[0]) for row in rows[:count]):
        raise FormatError("the header rows have different numbers of fields", line=count)
    if len(rows) > count and not is_number(rows[count][0]):
        raise FormatError(
            "the rows are named by images, as labelled training frames are; they are not a track: "
            "give the file of the analysed video",
            line=count + 1,
        )
    return rows[:count]


def _bodyparts(columns: Sequence[tuple[str, ...]], first: int) -> Places:
    """Return the places of bodyparts, of columns by scorer, (individual,) bodypart, coordinate."""
    levels = (("0", *column[1:]) if len(column) == 3 else column[1:] for column in columns)
    found = _places(enumerate(levels, start=first))
    for individual, parts in found.items():
        for part, place in parts.items():
            if missing := {"x", "y"} - set(place):
                whose = f"bodypart '{part}' of individual '{individual}'"
                raise FormatError(f"no column of {min(missing)} for {whose}")
    if not found:
        raise FormatError("no columns of x and y below any bodypart")
    return found


class SleapLoader:
    """Nodes of every track; of several one has to be named."""

    name = "sleap"
    description = "SLEAP analysis HDF5 (tracks, node_names; pixels, no clock)"
    marks = (Marks("HDF5", ("tracks", "node_names", "track_names", "track_occupancy")),)

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the names of its arrays."""
        return 0.95 if {"tracks", "node_names"} <= names_in(path, head) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the chosen nodes of every track."""
        with opened_hdf5(path) as contents:
            nodes = contents.texts("node_names")
            tracks = _sleap_array(contents, "tracks", "track", "xy", "node", "frame")
            count, *shape = tracks.shape
            if shape[:2] != [2, len(nodes)]:
                raise FormatError(
                    f"'tracks' has the shape {tracks.shape}, expected track, xy, node, frame with "
                    f"{len(nodes)} nodes"
                )
            names = contents.texts("track_names") if "track_names" in contents.file else []
            scores = None
            if "point_scores" in contents.file:
                scores = _sleap_array(contents, "point_scores", "track", "node", "frame").T
        individuals = names if len(names) == count else [*map(str, range(count))]
        tracks = tracks.transpose("frame", "xy", "node", "track")
        frame = np.arange(len(tracks), dtype=np.float64)
        return _of_arrays(tracks, scores, (nodes, individuals), frame, options, OF_SLEAP)


def _sleap_array(contents: Hdf5Contents, name: str, *order: str) -> xr.DataArray:
    """Return an array of numbers over these dimensions.

    SLEAP writes them in this order; newer files name theirs in an attribute.
    """
    import xarray as xr

    values = contents.array(name)
    if values.dtype.kind not in "fiu" or values.ndim != len(order):
        raise FormatError(f"'{name}' has no numbers over {', '.join(order)}")
    stated = contents.file[name].attrs.get("dims")
    dims = order if stated is None else parse_json(text_of(stated), path=contents.path)
    return _in_order(xr.DataArray(values, dims=dims, name=name), *order)


class SleapCsvLoader:
    """Nodes of every track; of several one has to be named."""

    name = "sleap-csv"
    description = "SLEAP analysis CSV (track, frame_idx, NODE.x, NODE.y, NODE.score; pixels)"
    marks = (Marks("table", ("track", "frame_idx", "instance.score")),)

    def sniff(self, head: bytes, _path: Path) -> float:
        """Recognise the header."""
        names = first_names(head)
        return 0.95 if "frame_idx" in names and _nodes(names) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the chosen nodes of every track."""
        names = first_row(path)
        nodes = _nodes(names)
        if "frame_idx" not in names or not nodes:
            raise FormatError("no columns frame_idx, NODE.x and NODE.y", line=1)
        frame = names.index("frame_idx")
        track = names.index("track") if "track" in names else None
        places = {"0": nodes}
        wanted = tuple(sorted({frame, *_used(places, options)}))
        texts = () if track is None else (track,)
        table = read_table(path, TableLayout(",", names, 1, wanted, texts))
        numbers = table.numbers
        raw = recording_of_poses(places, numbers.__getitem__, numbers[frame], options, OF_SLEAP)
        if track is not None:
            raw.bodies = split_bodies(raw.bodies[0], table.codes[track], table.labels[track])
            for one in raw.bodies:
                if not one.name and np.unique(one.clock).size < one.clock.size:
                    what = "several instances of one frame have no track"
                    raise FormatError(f"{what}: let SLEAP track them, and export again")
                one.name = one.name or "0"
        return raw


def _nodes(names: list[str]) -> dict[str, dict[str, int]]:
    """Return the columns of the coordinates of each node that has x and y."""
    parts = (name.rpartition(".")[::2] for name in names)
    scored = ((part, {"score": "likelihood"}.get(end, end)) for part, end in parts)
    nodes = _places(enumerate(("0", *one) for one in scored)).get("0", {})
    return {node: place for node, place in nodes.items() if node and {"x", "y"} <= set(place)}


TEXTS: Final = (
    *("arena", "arena_found", "origin_shift_m", "simulated", "tracked_from", "complete"),
    *("interrupted", "block_shape"),
)
NUMBERS: Final = (
    *("block_side_m", "block_width_m", "block_mass_kg", "metres_per_pixel", "position_quantum_m"),
    *("sample_rate_Hz", "time_origin_unix_s"),
)
"""Attributes that are taken over of a recording that driftwalk wrote in this format."""


class MovementLoader:
    """Positions in pixels unless the file or an option says another unit."""

    name = "movement"
    description = "movement NetCDF (position over time, space, keypoints, individuals; pixels)"
    marks = (Marks("HDF5", ("position", "time", "space", "ds_type", "time_unit")),)

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the attributes that `movement` writes."""
        names = ("time_unit", "ds_type")
        known = head.startswith(MAGIC) and any(text_attribute(path, name) for name in names)
        return 0.9 if known else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read every individual; of several keypoints one has to be named."""
        dataset = open_netcdf(path)
        position = _array(dataset, "position")
        if not {"time", "space"} <= set(position.dims):
            raise FormatError("has no variable 'position' over time and space")
        space = [str(axis) for axis in position["space"].values]
        if not {"x", "y"} <= set(space):
            raise FormatError(f"the dimension 'space' has {space}, expected x and y")
        position = _whole(position.isel(space=[space.index(axis) for axis in "xy"]), "space")
        confidence = _whole(_array(dataset, "confidence")) if "confidence" in dataset else None
        keypoints, individuals = (
            [*map(str, position.get_index(name).to_numpy())] for name in ("keypoint", "individual")
        )
        time, unit = _clock(dataset)
        sleap = str(dataset.attrs.get("source_software")) == "SLEAP"
        usual, names = OF_SLEAP if sleap else OF_MOVEMENT, (keypoints, individuals)
        raw = _of_arrays(position, confidence, names, time, options, usual)
        own = "driftwalk" in dataset.attrs
        # Other programs may call something else so.
        if own and "orientation" in dataset and options.heading is None:
            angles = _orientation(dataset, individuals)
            for body in raw.bodies:
                theta = angles[body.name]
                body.theta = theta if np.isfinite(theta).any() else None
        rate = dataset.attrs.get("fps")
        stated = position.attrs.get("units")
        known = stated if stated in (*LENGTH_UNITS, "px") else options.length_unit or "px"
        raw.clock_unit, raw.length_unit = unit, known
        raw.frame_rate_hz = float(rate) if rate is not None and unit == "frame" else None
        raw.attrs = _known(dataset, path) if own else {}
        return raw


def _orientation(dataset: xr.Dataset, individuals: list[str]) -> dict[str, Array]:
    """Return the angles [rad] of every individual, which driftwalk writes next to the positions."""
    angles = _in_order(_array(dataset, "orientation"), "time", "individuals")
    if angles.attrs.get("units") != "rad":
        raise FormatError("'orientation' does not state its unit, rad")
    values = angles.values.astype(np.float64)
    return {name: np.ascontiguousarray(values[:, at]) for at, name in enumerate(individuals)}


def _known(dataset: xr.Dataset, path: Path) -> dict[str, Any]:
    """Return what driftwalk knew of the recording when it wrote the file."""
    known = parse_json(str(dataset.attrs["driftwalk"]), path=path)
    if not isinstance(known, dict):
        raise FormatError("the attribute 'driftwalk' is no JSON object")
    texts = {key: known[key] for key in TEXTS if isinstance(known.get(key), str)}
    numbers = {key: known[key] for key in NUMBERS if type(known.get(key)) in (int, float)}
    return {**texts, **numbers}


def _array(dataset: xr.Dataset, name: str) -> xr.DataArray:
    if name not in dataset:
        raise FormatError(f"has no variable '{name}' over time and space")
    if dataset[name].dtype.kind not in "fiu":
        raise FormatError(f"'{name}' holds no numbers")
    return dataset[name]


def _whole(values: xr.DataArray, *further: str) -> xr.DataArray:
    """Return an array over time, further dimensions, keypoint and individual.

    A dimension that is missing has the length one; its name is the singular or the plural.
    """
    values = values.rename(
        {dim: str(dim)[:-1] for dim in values.dims if dim in ("keypoints", "individuals")}
    )
    only = {"keypoint": "centroid", "individual": "0"}  # a bounding box has one point
    missing = {name: [one] for name, one in only.items() if name not in values.dims}
    return _in_order(values.expand_dims(missing), "time", *further, "keypoint", "individual")


def _clock(dataset: xr.Dataset) -> tuple[Array, str]:
    """Return the time stamps and their unit."""
    if "time" not in dataset.coords:
        return np.arange(dataset.sizes["time"], dtype=np.float64), "frame"
    unit = "s" if str(dataset.attrs.get("time_unit", "")).startswith("s") else "frame"
    return np.array(_array(dataset, "time").values, dtype=np.float64), unit


LOADERS = (DeepLabCutLoader(), SleapLoader(), SleapCsvLoader(), MovementLoader())
