"""Recognise flow-field files and their program: recordings have the same file endings."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from driftwalk.core.errors import InputError
from driftwalk.flow.read import piv_format
from driftwalk.flow.readers import openpiv
from driftwalk.flow.readers.netcdf import holds_velocities
from driftwalk.flow.readers.pivlab import holds_velocities as holds_pivlab, is_pivlab
from driftwalk.flow.readers.table import is_field_table
from driftwalk.flow.rows import grid_rows
from driftwalk.schema.stores.netcdf import is_netcdf, kind_of_file, open_netcdf


def flow_format(path: str | PathLike[str]) -> str | None:
    """Return what kind of flow field a file holds, None of a recording or any other file.

    Rows of numbers without a header are a field when they fill a grid, a row for each node.

    Parameters
    ----------
    path : path-like
        Any file or folder.

    Returns
    -------
    str or None
        ``"driftwalk"``, ``"netcdf"``, ``"csv"``, ``"openpiv"``, ``"insight"``, ``"davis"`` or
        ``"pivlab"``.

    Raises
    ------
    FormatError
        When it is a field that only its own program reads.

    Examples
    --------
    >>> from importlib.resources import files
    >>> flow_format(str(files("driftwalk.datasets") / "tank30_ode_a" / "flow_true.csv"))
    'csv'
    >>> flow_format(str(files("driftwalk.datasets") / "tank30_ode_a" / "recording.csv"))
    """
    source = Path(path)
    if not source.is_file():
        return None
    if is_netcdf(source) and not is_pivlab(source):
        return _netcdf_format(source)
    name = piv_format(source)
    if name == "openpiv" and not openpiv.has_header(source):
        return name if _fills_a_grid(source) else None
    if name == "pivlab" and not holds_pivlab(source):
        return None
    return name or ("csv" if is_field_table(source) else None)


def _netcdf_format(path: Path) -> str | None:
    kind = kind_of_file(path)
    if kind is not None:
        return "driftwalk" if kind == "flow_field" else None
    try:
        return "netcdf" if holds_velocities(open_netcdf(path)) else None
    except InputError:
        return None


def _fills_a_grid(path: Path) -> bool:
    # Rows without a header in a larger file are taken for a recording.
    if path.stat().st_size > 64 << 20:
        return False
    try:
        grid_rows(openpiv.read(path).rows, path)
    except InputError:
        return False
    return True
