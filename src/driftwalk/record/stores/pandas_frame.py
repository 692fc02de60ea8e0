"""Tables that pandas stored in HDF5, read without PyTables: the fixed and the table format.

The fixed format keeps blocks of columns of one type each, the table format one compound array. The
names of the columns are arrays in the first, and pickled lists in attributes in the second.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError
from driftwalk.record.raw import Array
from driftwalk.record.stores.hdf5 import Hdf5Contents, text_of
from driftwalk.record.stores.plain_pickle import unpickle

Column = tuple[str, ...]
_SAVE_ELSE = "save the table as CSV (DataFrame.to_csv) and give that"


@dataclass
class Frame:
    """A table in an HDF5 file, whose columns are read when they are asked for."""

    contents: Hdf5Contents
    key: str
    places: dict[Column, tuple[str, int]]
    """From the name of each column, by level, to its block and the place in it."""
    blocks: dict[str, npt.NDArray[Any]] = field(default_factory=dict)
    """Blocks that are in memory, shape (row, column)."""
    rows: Array | None = None

    @property
    def columns(self) -> list[Column]:
        """Names of the columns, by level."""
        return [*self.places]

    def numbers(self, column: int) -> Array:
        """Return a column as float64.

        Raises
        ------
        FormatError
            When it holds no numbers.
        """
        name = self.columns[column]
        block, place = self.places[name]
        if block not in self.blocks:
            self.blocks[block] = self.contents.array(block)
        values = self.blocks[block]
        if values.ndim != 2 or place >= values.shape[1] or values.dtype.kind not in "fiub":
            raise FormatError(f"column '{'.'.join(name)}' of '{self.key}' holds no numbers")
        return np.array(values[:, place], dtype=np.float64)

    def index(self) -> Array:
        """Return the labels of the rows; they are numbered where they are no numbers."""
        if self.rows is None:
            count = self.numbers(0).size
            self.rows = np.arange(count, dtype=np.float64)
        return self.rows


def frame_in(contents: Hdf5Contents, key: str) -> Frame:
    """Return the table that lies under a key.

    Parameters
    ----------
    contents : Hdf5Contents
        The file.
    key : str
        Name of the group.

    Raises
    ------
    FormatError
        When there is no table that is understood.
    """
    import h5py

    group = contents.file.get(key)
    if not isinstance(group, h5py.Group):
        raise FormatError(f"has no table '{key}'")
    kind = text_of(group.attrs.get("pandas_type", b""))
    if kind == "frame_table" and isinstance(group.get("table"), h5py.Dataset):
        frame = _table(contents, key, group)
    elif kind == "frame":
        frame = _fixed(contents, key, group)
    else:
        raise FormatError(
            f"'{key}' is no table of pandas that can be read (it says '{kind}'): {_SAVE_ELSE}"
        )
    if not frame.places:
        raise FormatError(f"the table '{key}' has no columns")
    return frame


def _fixed(contents: Hdf5Contents, key: str, group: Any) -> Frame:
    places: dict[Column, tuple[str, int]] = {}
    for block in range(int(group.attrs.get("nblocks", 0))):
        items = _labels(contents, key, f"block{block}_items", group)
        places |= {item: (f"{key}/block{block}_values", at) for at, item in enumerate(items)}
    frame = Frame(contents, key, places)
    if "axis1" in group and group["axis1"].dtype.kind in "iuf":
        frame.rows = contents.numbers(f"{key}/axis1")
    return frame


def _labels(contents: Hdf5Contents, key: str, name: str, group: Any) -> list[Column]:
    """Return the names of the columns of a block, of one level or of several."""
    if text_of(group.attrs.get(f"{name}_variety", b"regular")) != "multi":
        return [(text,) for text in contents.texts(f"{key}/{name}")]
    levels = range(int(group.attrs.get(f"{name}_nlevels", 0)))
    texts = [contents.texts(f"{key}/{name}_level{level}") for level in levels]
    codes = [contents.array(f"{key}/{name}_label{level}").tolist() for level in levels]
    if any(
        not 0 <= code < len(of) for of, column in zip(texts, codes, strict=True) for code in column
    ):
        raise FormatError(f"the names of the columns of '{key}' are damaged")
    return [
        tuple(texts[level][code] for level, code in enumerate(row))
        for row in zip(*codes, strict=True)
    ]


def _table(contents: Hdf5Contents, key: str, group: Any) -> Frame:
    stored = contents.array(f"{key}/table")
    fields = stored.dtype.names or ()
    places: dict[Column, tuple[str, int]] = {}
    blocks: dict[str, npt.NDArray[Any]] = {}
    for name in fields:
        if name == "index":
            continue
        values = stored[name]
        blocks[name] = values.reshape(len(values), -1) if len(values) else values[:, None]
        names = _pickled(group, f"{name}_kind")
        places |= {column: (name, at) for at, column in enumerate(names)}
    frame = Frame(contents, key, places, blocks)
    if "index" in fields and stored["index"].dtype.kind in "iuf":
        frame.rows = np.array(stored["index"], dtype=np.float64)
    return frame


def _pickled(group: Any, attribute: str) -> list[Column]:
    """Return the names of columns that pandas pickled into an attribute of the table."""
    stored = group["table"].attrs.get(attribute, b"")
    names = unpickle(bytes(stored), where=f"attribute '{attribute}'")
    if not isinstance(names, list):
        raise FormatError(f"the attribute '{attribute}' names no columns")
    return [tuple(map(str, name)) if isinstance(name, tuple) else (str(name),) for name in names]
