"""Open NetCDF files whole, with an error that names the file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.errors import FormatError
from driftwalk.schema.hdf5 import UNREADABLE, open_hdf5

if TYPE_CHECKING:
    import xarray as xr

MAGIC = (b"\x89HDF\r\n\x1a\n", b"CDF\x01", b"CDF\x02")


def open_netcdf(path: Path) -> xr.Dataset:
    """Read a NetCDF file into memory and close it.

    Raises
    ------
    FormatError
        When it is no NetCDF file or damaged.
    """
    try:
        with path.open("rb") as file:
            magic = file.read(8)
    except OSError as error:
        raise FormatError(f"cannot be opened: {error.strerror or error}", path=path) from error
    if not magic.startswith(MAGIC):
        raise FormatError("is not a NetCDF file", path=path)
    try:
        # Plain numbers: a time coordinate in "s" is not to become dates.
        with _open(magic, path, decode_times=False) as dataset:
            return dataset.load()
    except UNREADABLE as error:
        raise FormatError(f"cannot be read as NetCDF: {error}", path=path) from error


def read_attributes(head: bytes, path: Path) -> dict[str, Any]:
    """Return the global attributes of a NetCDF file, {} when it is none or damaged."""
    if not head.startswith(MAGIC):
        return {}
    try:
        # Only the attributes: nothing is decoded, whatever a foreign file holds.
        with _open(head, path, decode_cf=False) as dataset:
            return {str(key): value for key, value in dataset.attrs.items()}
    except UNREADABLE:
        return {}


def _open(head: bytes, path: Path, **options: Any) -> xr.Dataset:
    import xarray as xr

    if head.startswith(MAGIC[0]):
        return open_hdf5(path, **options)
    return xr.open_dataset(path, engine="scipy", **options)
