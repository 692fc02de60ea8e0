"""Open NetCDF-4 that anyone may have written, without a word of the libraries below."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

UNREADABLE = (OSError, ValueError, KeyError, TypeError, RuntimeError, IndexError, AttributeError)
"""What xarray, h5netcdf and h5py raise for files that are damaged, or no NetCDF."""


def open_hdf5(path: Path, **options: Any) -> xr.Dataset:
    """Open an HDF5 file as NetCDF; the caller closes it.

    Parameters
    ----------
    path : Path
        The file.
    **options
        More words for `xarray.open_dataset`.

    Raises
    ------
    OSError, ValueError, KeyError, TypeError, RuntimeError, IndexError, AttributeError
        `UNREADABLE`: when it is damaged, or holds what NetCDF does not know.
    """
    import xarray as xr

    with warnings.catch_warnings():
        # A variable may state two numbers that mean "missing". xarray makes both NaN and warns;
        # NaN is what both are here.
        warnings.simplefilter("ignore", xr.SerializationWarning)
        # Dimensions without a name, in HDF5 of another program, get one when they are asked for.
        return xr.open_dataset(path, engine="h5netcdf", phony_dims="access", **options)


def stored_kind(path: Path) -> str | None:
    """Return which kind of driftwalk's own datasets a file holds, None for any other file."""
    if not path.is_file():
        return None
    try:
        # Nothing is decoded: only an attribute is looked at.
        with open_hdf5(path, decode_cf=False) as stored:
            kind = stored.attrs.get("kind")
    except UNREADABLE:
        return None
    return None if kind is None else str(kind)
