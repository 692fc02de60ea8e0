"""DeepLabCut tables, also of Lightning Pose: header rows of scorer, individuals, bodyparts, coords.

CSV, or the same table in HDF5 (``df_with_missing``). Positions in pixels, one row per frame; files
of several animals have the row of individuals, those of one have not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.pose import Confidence, Point, choose_keypoints, recording_of_poses
from driftwalk.record.raw import Array, Marks, RawRecording, ReadOptions, TableLayout
from driftwalk.record.stores.hdf5 import names_in, opened_hdf5
from driftwalk.record.stores.pandas_frame import frame_in
from driftwalk.record.text import header_rows, read_table
from driftwalk.schema.stores.netcdf import HDF5, file_start

KEYS: Final = ("df_with_missing", "tracks")
"""Names under which DeepLabCut stores its table."""
LEVELS: Final = {3: (None, 1, 2), 4: (1, 2, 3)}
"""Rows of individual, bodypart and coordinate, by the number of header rows."""
USUAL: Final = Confidence(0.6, "DeepLabCut's pcutoff")

Places = dict[str, dict[str, dict[str, int]]]
"""Individual to bodypart to coordinate to column."""


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
        if head.startswith(b"scorer,"):
            return 0.95
        return 0.95 if KEYS[0] in names_in(path, head) else 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the chosen bodyparts of every individual."""
        is_hdf5 = file_start(path) == HDF5
        return _read_hdf5(path, options) if is_hdf5 else _read_csv(path, options)


def _read_csv(path: Path, options: ReadOptions) -> RawRecording:
    header = _header(path)
    names = [".".join(part for part in column if part) for column in zip(*header, strict=True)]

    def read(used: set[int]) -> tuple[dict[int, Array], Array]:
        wanted = (0, *sorted(at + 1 for at in used))
        table = read_table(path, TableLayout(",", names, len(header), wanted))
        return {at: table.numbers[at + 1] for at in used}, table.numbers[0]

    return _recording(list(zip(*(row[1:] for row in header), strict=True)), read, options)


def _read_hdf5(path: Path, options: ReadOptions) -> RawRecording:
    with opened_hdf5(path) as contents:
        key = next((key for key in KEYS if key in contents.file), KEYS[0])
        frame = frame_in(contents, key)
        if any(len(column) not in LEVELS for column in frame.columns):
            raise FormatError(f"'{key}' has no columns of scorer, bodyparts, coords")

        def read(used: set[int]) -> tuple[dict[int, Array], Array]:
            return {at: frame.numbers(at) for at in used}, frame.index()

        return _recording(frame.columns, read, options)


def _header(path: Path) -> list[list[str]]:
    """Return the header rows, equally long."""
    rows = [split_fields(line, ",") or [""] for line in header_rows(path, 5)]
    count = next((at for at, row in enumerate(rows[:4]) if row[0] == "coords"), -1) + 1
    first = [row[0] for row in rows[:count]]
    if first not in (
        ["scorer", "bodyparts", "coords"],
        ["scorer", "individuals", "bodyparts", "coords"],
    ):
        raise FormatError(
            "the first column of the header is not scorer, (individuals,) bodyparts, coords: is it "
            "DeepLabCut's?",
            line=1,
        )
    if any(len(row) != len(rows[0]) for row in rows[:count]):
        raise FormatError("the header rows have different numbers of fields", line=count)
    if len(rows) > count and not is_number(rows[count][0]):
        raise FormatError(
            "the rows are named by images, as those of labelled frames are, which are no track: "
            "give the file of the analysed video",
            line=count + 1,
        )
    return rows[:count]


def _places(columns: Sequence[tuple[str, ...]]) -> Places:
    """Return which column holds what; coordinates of other names are left out."""
    found: Places = {}
    for at, column in enumerate(columns):
        of_individual, of_part, of_coordinate = LEVELS[len(column)]
        individual = "0" if of_individual is None else column[of_individual]
        if column[of_coordinate] in ("x", "y", "likelihood"):
            parts = found.setdefault(individual, {})
            parts.setdefault(column[of_part], {})[column[of_coordinate]] = at
    for individual, parts in found.items():
        for part, coordinates in parts.items():
            missing = {"x", "y"} - set(coordinates)
            if missing:
                raise FormatError(
                    f"no column of {min(missing)} for bodypart '{part}' of individual "
                    f"'{individual}'"
                )
    if not found:
        raise FormatError("no columns of x and y below any bodypart")
    return found


def _recording(
    names: Sequence[tuple[str, ...]],
    read: Callable[[set[int]], tuple[dict[int, Array], Array]],
    options: ReadOptions,
) -> RawRecording:
    """Return the recording of columns by level, given what reads some of them and the frames."""
    places = _places(names)
    chosen = choose_keypoints([part for parts in places.values() for part in parts], options)
    used = {
        at
        for parts in places.values()
        for part in chosen.names()
        for at in parts.get(part, {}).values()
    }
    columns, frame = read(used)

    def read_point(place: Mapping[str, int]) -> Point:
        likelihood = columns[place["likelihood"]] if "likelihood" in place else None
        return columns[place["x"]], columns[place["y"]], likelihood

    return recording_of_poses(places, read_point, chosen, frame, options, usual=USUAL)


LOADER = DeepLabCutLoader()
