"""Read a flow field from a file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.file_names import text_of_name
from driftwalk.flow.arena import Outline, outline_of, read_arena
from driftwalk.flow.fill import fill_velocity
from driftwalk.flow.grid import Grid
from driftwalk.flow.readers.netcdf import to_si
from driftwalk.flow.readers.table import read_csv
from driftwalk.flow.rows import grid_rows
from driftwalk.schema import FLAGS, build_flow_field, check_flow_field
from driftwalk.schema.contents import check_contents
from driftwalk.schema.netcdf import is_netcdf, open_netcdf

if TYPE_CHECKING:
    import xarray as xr

Array = npt.NDArray[np.float64]


def load_flow(
    path: str | PathLike[str],
    *,
    arena: Mapping[str, Any] | str | None = None,
    own_flags: Literal["refuse", "keep"] = "refuse",
) -> xr.Dataset:
    """Load a flow field from NetCDF or CSV, recognised by content.

    Parameters
    ----------
    path : path-like
        NetCDF that `save_flow` wrote; any other NetCDF with variables u, v over ([time,] y, x) and
        coordinates x, y, each with its attribute ``units``; or CSV with the columns x, y, u, v in m
        and m/s, a row for every node of a regular grid, in any order.
    arena : mapping or str, optional
        The tank, for a file that does not know it: nodes beyond its wall are flagged *outside*.
    own_flags : {"refuse", "keep"}
        Behaviour of `arena` for a file with its own flags: "keep" ignores it.

    Returns
    -------
    xarray.Dataset
        A `flow_field`. A file without flags has *measured* nodes, and where a velocity is missing
        (NaN in NetCDF) *filled* ones, continued from their neighbours (`fill_velocity`).

    Raises
    ------
    FormatError
        When the file is not one of these; with line and column for CSV.
    InputError
        When `arena` is not an arena, or the file knows its own.

    Examples
    --------
    >>> from importlib.resources import files
    >>> truth = files("driftwalk.datasets") / "tank30_ode_a" / "flow_true.csv"
    >>> load_flow(str(truth)).sizes["x"]
    50
    """
    source = Path(path)
    if not source.is_file():
        raise FormatError("there is no such file", path=source)
    if not is_netcdf(source):
        field = grid_rows(read_csv(source), source)
        return _new_field(
            field.x,
            field.y,
            field.velocity,
            arena=arena,
            attrs={"source": text_of_name(source.name)},
        )
    dataset = open_netcdf(source)
    if str(dataset.attrs.get("kind")) == "flow_field" and "flag" in dataset:
        if arena is not None and own_flags == "refuse":
            raise InputError(f"{source} has its own flags: leave the arena out")
        return _checked(check_contents(dataset, source), source)
    si = to_si(dataset, source)
    time = si["time"].values if "time" in si.dims else None
    velocity = np.stack([si["u"].values, si["v"].values], axis=-1)
    try:
        return _new_field(
            si["x"].values,
            si["y"].values,
            velocity,
            time=time,
            arena=arena,
            attrs={"source": text_of_name(source.name)},
        )
    except InputError as error:
        raise FormatError(str(error), path=source) from error


def _checked(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    try:
        return check_flow_field(dataset)
    except InputError as error:
        raise FormatError(str(error), path=path) from error


def _new_field(
    x: Array,
    y: Array,
    velocity: Array,
    *,
    time: Array | None = None,
    arena: Mapping[str, Any] | str | None,
    attrs: dict[str, Any],
) -> xr.Dataset:
    """Return the flow field of a file without flags, with its missing nodes filled."""
    described = None if arena is None else read_arena(arena)
    outline = None if described is None else outline_of(described)
    grid = Grid(x, y, float(x[1] - x[0]))
    frames = velocity.reshape(-1, y.size, x.size, 2)
    known = np.asarray(np.isfinite(frames).all(axis=-1))
    flag = np.where(known, FLAGS["measured"], FLAGS["filled"])
    if outline is not None:
        at_x, at_y = (part.ravel() for part in grid.nodes())
        flag[:, (outline.depth(at_x, at_y) < 0.0).reshape(grid.shape)] = FLAGS["outside"]
    filled = np.stack([_fill(grid, *frame, outline) for frame in zip(frames, known, strict=True)])
    filled = filled.reshape(velocity.shape)
    facts = {"method": "file", "cell_size_m": grid.cell_size, **attrs}
    if described is not None:
        facts["arena"] = json.dumps(described)
    return build_flow_field(
        x,
        y,
        time=time,
        u=filled[..., 0],
        v=filled[..., 1],
        flag=flag.reshape(velocity.shape[:-1]),
        attrs=facts,
    )


def _fill(
    grid: Grid, velocity: Array, known: npt.NDArray[np.bool_], outline: Outline | None
) -> Array:
    return velocity if known.all() else fill_velocity(grid, velocity, known=known, outline=outline)
