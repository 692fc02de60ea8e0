"""trackpy's linked features: a DataFrame of x, y, frame and particle, as CSV or in an HDF5 store.

The store is one table, or one table per frame (``PandasHDFStoreBig``). Positions in pixels.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from driftwalk.core.errors import FormatError
from driftwalk.record.cleaning.several_bodies import split_numbered
from driftwalk.record.raw import Array, Marks, RawBody, RawRecording, ReadOptions, TableLayout
from driftwalk.record.stores.hdf5 import Frame, Hdf5Contents, frame_in, names_in, opened_hdf5
from driftwalk.record.text import read_table
from driftwalk.record.text_head import first_names, first_row
from driftwalk.schema.stores.netcdf import HDF5, file_start

NEEDED: Final = ("x", "y", "frame", "particle")
OWN: Final = frozenset({"mass", "size", "ecc", "signal", "raw_mass", "ep"})
"""Columns that trackpy's features have; two of them tell its tables from others."""
OF_FRAME: Final = "Frame_"


class TrackpyLoader:
    """One body per particle."""

    name = "trackpy"
    description = "trackpy features, linked (x, y, frame, particle; CSV or HDF5; pixels, no clock)"
    marks = (
        Marks("table", (*NEEDED, "mass", "size", "ecc")),
        Marks("HDF5", ("PYTABLES_FORMAT_VERSION",)),
    )

    def sniff(self, head: bytes, path: Path) -> float:
        """Recognise the columns of features, or a store of pandas."""
        if head.startswith(HDF5):
            return 0.5 if "PYTABLES_FORMAT_VERSION" in names_in(path, head) else 0.0
        names = set(first_names(head))
        return 0.9 if set(NEEDED) <= names and len(OWN & names) > 1 else 0.0

    def read(self, path: Path, _options: ReadOptions) -> RawRecording:
        """Read every particle; rows that are linked to none are left out."""
        is_hdf5 = file_start(path) == HDF5
        columns = _of_store(path) if is_hdf5 else _of_csv(path)
        features = RawBody("", columns["frame"], columns["x"], columns["y"])
        bodies, loose = split_numbered(features, columns["particle"])
        if not bodies:
            raise FormatError("no feature is linked to a particle")
        note = f"features that are linked to no particle, and left out: {loose}"
        rows, notes = features.clock.size, [note] if loose else []
        return RawRecording(bodies, length_unit="px", rows=rows, notes=notes)


def _of_csv(path: Path) -> dict[str, Array]:
    names = first_row(path)
    places = _places(names)
    table = read_table(path, TableLayout(",", names, 1, tuple(sorted(places.values()))))
    return {name: table.numbers[place] for name, place in places.items()}


def _of_store(path: Path) -> dict[str, Array]:
    with opened_hdf5(path) as contents:
        groups = [str(name) for name in contents.file]
        frames = [name for name in groups if name.removeprefix(OF_FRAME).isdecimal()]
        frames.sort(key=lambda name: int(name.removeprefix(OF_FRAME)))
        if frames:
            parts = [_columns(frame_in(contents, name)) for name in frames]
            return {name: np.concatenate([part[name] for part in parts]) for name in NEEDED}
        return _columns(_only_table(contents, groups))


def _only_table(contents: Hdf5Contents, groups: list[str]) -> Frame:
    """Return the table of features; of several, the one of linked ones."""
    tables = {name: frame_in(contents, name) for name in groups}
    linked = [name for name, table in tables.items() if ("particle",) in table.columns]
    if len(tables) == 1:
        return next(iter(tables.values()))
    if len(linked) != 1:
        raise FormatError(
            f"holds the tables {', '.join(groups) or 'none'}, of which {len(linked)} have a column "
            "'particle': store the one of the recording alone"
        )
    return tables[linked[0]]


def _columns(frame: Frame) -> dict[str, Array]:
    places = _places([column[0] if len(column) == 1 else "" for column in frame.columns])
    return {name: frame.numbers(place) for name, place in places.items()}


def _places(names: list[str]) -> dict[str, int]:
    """Return the columns that are needed, or say which lack."""
    missing = [name for name in NEEDED if name not in names]
    if missing == ["particle"]:
        raise FormatError(
            "the features are not linked: let trackpy.link name their particles, and save again"
        )
    if missing:
        shown = ", ".join(names[:12])
        raise FormatError(f"no column {', '.join(missing)} as trackpy has it, among {shown}")
    return {name: names.index(name) for name in NEEDED}


LOADER = TrackpyLoader()
