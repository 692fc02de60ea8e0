"""Write a flow field: NetCDF with CF units, or plain CSV."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.files.atomic import atomic_path, require_target, write_atomic
from driftwalk.schema import check_flow_field
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

CONVENTIONS = "CF-1.11"


def save_flow(flow: xr.Dataset, path: str | PathLike[str], *, existing: str = "error") -> Path:
    """Write a flow field as NetCDF (``.nc``) or CSV (``.csv``), by the name's ending.

    NetCDF holds everything, follows the CF conventions, and opens in plain xarray. CSV has the
    columns x, y, u, v in SI, a row per node, x fastest, with as many digits as it takes to read the
    same numbers back; counts, errors, flags and attributes are lost.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field`.
    path : path-like
        Where to write. The file appears whole or not at all.
    existing : {"error", "replace"}
        Behaviour if the file exists already.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the file exists, its ending is neither ``.nc`` nor ``.csv``, or the field has frames
        and is to be CSV.
    RunDirectoryError
        When the place cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from driftwalk.flow import uniform_flow
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_flow(uniform_flow(0.1, 0.0), f"{folder}/flow.nc").name
    'flow.nc'
    """
    check_flow_field(flow)
    target = Path(path)
    require_target(target, existing=existing, endings=(".nc", ".csv"))
    if target.suffix.lower() == ".csv":
        _write_csv(flow, target)
        return target
    write_atomic(target, netcdf_bytes(flow.assign_attrs(Conventions=CONVENTIONS)))
    return target


def _write_csv(flow: xr.Dataset, path: Path) -> None:
    import pandas as pd

    if "time" in flow["u"].dims:
        raise InputError(f"{path}: a flow field that changes in time is kept as .nc")
    x, y = np.meshgrid(flow["x"].values, flow["y"].values)
    columns = {"x": x, "y": y, "u": flow["u"].values, "v": flow["v"].values}
    table = pd.DataFrame({name: values.ravel() for name, values in columns.items()})
    with atomic_path(path) as temporary:
        table.to_csv(temporary, index=False)
