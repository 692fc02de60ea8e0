"""Write a trajectory: driftwalk's NetCDF, or plain CSV."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.files.atomic import atomic_path, require_target, write_atomic
from driftwalk.schema import body_names, check_trajectory
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

CSV_COLUMNS = ["t_s", "x_m", "y_m", "theta_rad", "body"]


def save_trajectory(
    dataset: xr.Dataset, path: str | PathLike[str], *, existing: str = "error"
) -> Path:
    """Write a trajectory as NetCDF (``.nc``) or plain CSV (``.csv``), by the name's ending.

    CSV has the columns t_s, x_m, y_m, theta_rad and body. Numbers have as many digits as it takes
    to read the same float64 back. Rows are the present samples, and one row with empty positions
    for a time at which no body is present; the arena and the other attributes are lost, so NetCDF
    is the format to keep.

    Parameters
    ----------
    dataset : xarray.Dataset
        A `trajectory`.
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
        When the file exists, its folder does not, or its ending is neither ``.nc`` nor ``.csv``.
    RunDirectoryError
        When the place cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from driftwalk.schema import build_trajectory
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_trajectory(build_trajectory([0.0], [0.1], [0.2]), f"{folder}/a.csv").name
    'a.csv'
    """
    check_trajectory(dataset)
    target = Path(path)
    require_target(target, existing=existing, endings=(".nc", ".csv"))
    if target.suffix.lower() == ".csv":
        with atomic_path(target) as partial:
            _write_csv(dataset, partial)
    else:
        write_atomic(target, netcdf_bytes(dataset))
    return target


def _write_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write block by block, so that the text never stands in memory as a whole."""
    import pandas as pd

    time = dataset["time"].values
    names = np.array(body_names(dataset), dtype=object)
    with path.open("w", encoding="utf-8", newline="") as file:
        pd.DataFrame(columns=CSV_COLUMNS).to_csv(file, index=False)
        for first in range(0, time.size, 200_000):
            block = slice(first, first + 200_000)
            x, y, theta = (dataset[name].values[block] for name in ("x", "y", "theta"))
            present = np.isfinite(x) & np.isfinite(y)
            present[:, 0] |= ~present.any(axis=1)
            row, body = np.nonzero(present)
            values = [time[block][row], x[row, body], y[row, body], theta[row, body], names[body]]
            pd.DataFrame(dict(zip(CSV_COLUMNS, values, strict=True))).to_csv(
                file, index=False, header=False
            )
