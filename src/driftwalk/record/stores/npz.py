"""NumPy's ``.npz`` files: arrays of numbers in a zip file, no larger than the file can hold."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, InputError
from driftwalk.schema.stores.netcdf import refuse_huge

ZIP: Final = b"PK\x03\x04"
_NPY: Final = ".npy"


def members(path: Path) -> set[str]:
    """Return the names of the arrays in a file, {} when it is no zip file or damaged."""
    try:
        with zipfile.ZipFile(path) as file:
            names = file.namelist()
    except (OSError, ValueError, zipfile.BadZipFile, NotImplementedError):
        return set()
    return {name.removesuffix(_NPY) for name in names if name.endswith(_NPY)}


@contextmanager
def opened_npz(path: Path) -> Iterator[Mapping[str, npt.NDArray[Any]]]:
    """Open a file of arrays, which are read when they are asked for; pickles are refused.

    Raises
    ------
    FormatError
        When it is none, is damaged, or declares more than it can hold.
    """
    try:
        with zipfile.ZipFile(path) as file:
            refuse_huge(sum(entry.file_size for entry in file.infolist()), path)
        with np.load(path, allow_pickle=False) as arrays:
            yield arrays
    except InputError:
        raise
    except Exception as error:
        # On a damaged file the libraries fail with whatever the damage leads them to.
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise FormatError(f"cannot be read as NumPy's .npz: {reason}", path=path) from error
