"""An HDF5 file whose objects are looked up once: h5netcdf asks for each some thirty times.

The class stands alone, as its base needs h5py, which is imported only where a file is opened.
"""

from __future__ import annotations

from typing import Any

import h5py


class OpenHdf5(h5py.File):  # type: ignore[misc]
    """A file that keeps the objects that it was asked for until it is closed."""

    def __init__(self, path: Any, mode: str = "r") -> None:
        # NetCDF-4 keeps the order in which things were written.
        super().__init__(path, mode, track_order=None if mode == "r" else True)
        # The root is asked for most often. It has to be this file, which keeps what it hands out.
        self._kept: dict[str, Any] = {"/": self}

    def __getitem__(self, name: Any) -> Any:
        """Return the object of a name, or of a reference, which is no name."""
        if not isinstance(name, str):
            return super().__getitem__(name)
        if name not in self._kept:
            self._kept[name] = super().__getitem__(name)
        return self._kept[name]

    def __delitem__(self, name: str) -> None:
        """Remove the object of a name, which another one may get."""
        super().__delitem__(name)
        for kept in (name, f"/{name}"):
            self._kept.pop(kept, None)
