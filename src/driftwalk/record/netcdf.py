"""Open NetCDF files whole, with an error that names the file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.errors import FormatError

if TYPE_CHECKING:
    import xarray as xr

MAGIC = (b"\x89HDF\r\n\x1a\n", b"CDF\x01", b"CDF\x02")
_FAILURES = (OSError, ValueError, KeyError, TypeError, RuntimeError, IndexError, AttributeError)


def open_netcdf(path: Path) -> xr.Dataset:
    """Read a NetCDF file into memory and close it.

    Raises
    ------
    FormatError
        When it is no NetCDF file or damaged.
    """
    import xarray as xr

    try:
        with path.open("rb") as file:
            magic = file.read(8)
    except OSError as error:
        raise FormatError(f"cannot be opened: {error.strerror or error}", path=path) from error
    if not magic.startswith(MAGIC):
        raise FormatError("is not a NetCDF file", path=path)
    engine = "h5netcdf" if magic.startswith(MAGIC[0]) else "scipy"
    try:
        # Plain numbers: a time coordinate in "s" is not to become dates.
        with xr.open_dataset(path, engine=engine, decode_times=False) as dataset:
            return dataset.load()
    except _FAILURES as error:
        raise FormatError(f"cannot be read as NetCDF: {error}", path=path) from error


def read_attributes(head: bytes, path: Path) -> dict[str, Any]:
    """Return the global attributes of a NetCDF file, {} when it is none or damaged."""
    import xarray as xr

    if not head.startswith(MAGIC):
        return {}
    engine = "h5netcdf" if head.startswith(MAGIC[0]) else "scipy"
    try:
        with xr.open_dataset(path, engine=engine, decode_times=False) as dataset:
            return {str(key): value for key, value in dataset.attrs.items()}
    except _FAILURES:
        return {}
