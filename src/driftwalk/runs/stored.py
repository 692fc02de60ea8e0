"""Datasets as they are stored in a run directory, and what tells two of them apart."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def netcdf_bytes(dataset: xr.Dataset) -> bytes:
    """Return a dataset as the bytes of a NetCDF-4 file, numbers compressed.

    Parameters
    ----------
    dataset : xarray.Dataset
        Any dataset of driftwalk.

    Examples
    --------
    >>> import driftwalk as dw
    >>> netcdf_bytes(dw.tank30_flow())[1:4]
    b'HDF'
    """
    packed = {
        name: {"zlib": True, "complevel": 4, "shuffle": True}
        for name, variable in dataset.data_vars.items()
        if variable.dtype.kind in "fiu" and variable.size > 1000
    }
    return bytes(dataset.to_netcdf(engine="h5netcdf", encoding=packed))


def dataset_hash(dataset: xr.Dataset, names: tuple[str, ...]) -> str:
    """Return a hash of the coordinates and the named variables of a dataset."""
    digest = hashlib.sha256()
    for name in (*sorted(str(name) for name in dataset.indexes), *names):
        values = dataset[name].values
        digest.update(
            repr(values.tolist()).encode() if values.dtype == object else values.tobytes()
        )
    return digest.hexdigest()
