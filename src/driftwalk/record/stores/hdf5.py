"""HDF5 files that are no NetCDF: what is in them, and arrays no larger than the file can hold."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, damaged_as
from driftwalk.record.raw import Array
from driftwalk.schema.stores.hdf5_texts import refuse_endless_texts
from driftwalk.schema.stores.netcdf import HDF5, declared_bytes, refuse_elsewhere, refuse_huge

if TYPE_CHECKING:
    import h5py


class Hdf5Contents:
    """An open HDF5 file, whose arrays are read within what its size allows."""

    def __init__(self, file: h5py.File, path: Path) -> None:
        self.file = file
        self.path = path
        self._declared = 0

    def array(self, name: str) -> npt.NDArray[Any]:
        """Return the values of an array.

        Raises
        ------
        FormatError
            When there is none of that name, or it declares more than the file can hold.
        """
        import h5py

        entry = self.file.get(name)
        if not isinstance(entry, h5py.Dataset) or entry.shape is None:
            raise FormatError(f"has no array '{name}'")
        steps = entry.id.get_create_plist()
        codes = (steps.get_filter(at)[0] for at in range(steps.get_nfilters()))
        if not all(map(h5py.h5z.filter_avail, codes)):
            raise FormatError(
                f"'{name}' is compressed by a filter that is not installed: save the file without "
                "compression or with gzip, or as CSV"
            )
        # A file may hold many arrays that each declare a little too much.
        self._declared += declared_bytes(entry)
        refuse_huge(self._declared, self.path)
        return np.asarray(entry[()])

    def numbers(self, name: str) -> Array:
        """Return the values of an array of numbers as float64, which nobody else holds.

        Raises
        ------
        FormatError
            As `array`, and when it holds no numbers.
        """
        values = self.array(name)
        if values.dtype.kind not in "fiub":
            raise FormatError(f"'{name}' holds no numbers")
        return np.array(values, dtype=np.float64)

    def texts(self, name: str) -> list[str]:
        """Return the values of a one-dimensional array of texts.

        Raises
        ------
        FormatError
            As `array`.
        """
        return [text_of(value) for value in self.array(name).ravel().tolist()]


def text_of(value: Any) -> str:
    """Return a text of HDF5, which may be stored as bytes.

    Examples
    --------
    >>> text_of(b"head")
    'head'
    """
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


@contextmanager
def opened_hdf5(path: Path) -> Iterator[Hdf5Contents]:
    """Open an HDF5 file; what goes wrong with it inside becomes a `FormatError`.

    Raises
    ------
    FormatError
        When it is none, or is damaged.
    """
    import h5py

    with damaged_as("as HDF5", path):
        refuse_endless_texts(path)
        with h5py.File(path, "r") as file:
            refuse_elsewhere(file, path)
            for name in file:
                # A damaged entry is found here, before the attributes.
                file[name]
            yield Hdf5Contents(file, path)


def names_in(path: Path, head: bytes) -> set[str]:
    """Return the names of what lies at the top of an HDF5 file; {} when it is none or damaged.

    Parameters
    ----------
    path : Path
        The file.
    head : bytes
        Its start.
    """
    if not head.startswith(HDF5):
        return set()
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return set(map(str, file)) | set(map(str, file.attrs))
    except Exception:  # whatever the damage of a file leads the library to
        return set()
