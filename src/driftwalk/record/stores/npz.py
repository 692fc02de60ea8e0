"""NumPy's ``.npz`` files: arrays of numbers in a zip file, no larger than the file can hold."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import damaged_as
from driftwalk.schema.stores.netcdf import refuse_huge

ZIP: Final = b"PK\x03\x04"
NPY: Final = b"\x93NUMPY"
"""First letters of a single array, ``.npy``."""


def members(path: Path) -> set[str]:
    """Return the names of the arrays in a file, {} when it is no zip file or damaged."""
    return {name.removesuffix(".npy") for name in zip_names(path) if name.endswith(".npy")}


def zip_names(path: Path) -> set[str]:
    """Return the names in a zip file, {} when it is none or damaged."""
    try:
        with zipfile.ZipFile(path) as file:
            return set(file.namelist())
    except (OSError, ValueError, zipfile.BadZipFile, NotImplementedError):
        return set()


def refuse_huge_zip(path: Path) -> None:
    """Refuse a zip file that declares more than a file of its size can hold."""
    with zipfile.ZipFile(path) as file:
        refuse_huge(sum(entry.file_size for entry in file.infolist()), path)


@contextmanager
def opened_npz(path: Path) -> Iterator[Mapping[str, npt.NDArray[Any]]]:
    """Open a file of arrays, which are read when they are asked for; pickles are refused.

    Raises
    ------
    FormatError
        When it is none, is damaged, or declares more than it can hold.
    """
    with damaged_as("as NumPy's .npz", path):
        refuse_huge_zip(path)
        with np.load(path, allow_pickle=False) as arrays:
            yield arrays
