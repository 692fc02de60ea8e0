"""Flow fields in files: NetCDF with CF units, plain CSV, and those of PIV programs.

Recordings have the same file endings as flow fields.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.files.atomic import atomic_path, require_target, write_atomic
from driftwalk.core.text_files import text_of_name
from driftwalk.flow.arena import outline_of
from driftwalk.flow.cell_means import fill_velocity
from driftwalk.flow.grid import Grid, grid_rows
from driftwalk.flow.readers import pivlab, text
from driftwalk.flow.readers.columns import FIELD, column_of, holds_field, names_a_time
from driftwalk.flow.readers.netcdf import holds_velocities, to_si
from driftwalk.flow.readers.programs import HEAD
from driftwalk.flow.readers.text import Layout, TextOptions
from driftwalk.flow.readers.units import FieldOptions, RawField, raw_to_si, y_words
from driftwalk.schema import FLAGS, build_flow_field, check_flow_field
from driftwalk.schema.check import check_contents
from driftwalk.schema.kinds import find_kind
from driftwalk.schema.kinds.flow import FLOW_FIELD
from driftwalk.schema.stores.netcdf import is_netcdf, kind_of_file, netcdf_bytes, open_netcdf
from driftwalk.schema.trajectory import read_arena

if TYPE_CHECKING:
    import xarray as xr

_ONLY_TEXT: Final = "`columns`, `header_line` and `delimiter` are for text, and this is {}"


def load_flow(
    path: str | PathLike[str],
    *,
    arena: Mapping[str, Any] | str | None = None,
    own_flags: Literal["refuse", "keep"] = "refuse",
    metres_per_pixel: float | None = None,
    frame_interval: float | None = None,
    length_unit: str | None = None,
    y_axis: str | None = None,
    origin: tuple[float, float] | None = None,
    variables: Mapping[str, str] | None = None,
    columns: Mapping[str, str | int] | None = None,
    header_line: int | None = None,
    delimiter: str | None = None,
) -> xr.Dataset:
    """Load a flow field from NetCDF, CSV or the file of a PIV program, recognised by content.

    Parameters
    ----------
    path : path-like
        NetCDF that `save_flow` wrote; any other NetCDF with velocities over ([time,] y, x) and
        coordinates x, y, each with its attribute ``units``; CSV with the columns x, y, u, v in m
        and m/s, a row for every node of a regular grid, in any order; text of PIVlab, OpenPIV,
        Insight (``.vec``), DaVis, Dantec, Tecplot, the PIV plugin of ImageJ, or any other with a
        header that names x, y, u, v; ``.mat`` of PIVlab.
    arena : mapping or str, optional
        The tank, for a file that does not know it: nodes beyond its wall are flagged *outside*.
    own_flags : {"refuse", "keep"}
        Behaviour of `arena` for a file with its own flags: "keep" ignores it.
    metres_per_pixel : float, optional
        Scale of a field in pixels [m].
    frame_interval : float, optional
        Time between the two images of a pair [s], where velocities are shifts in pixels.
    length_unit : {"m", "cm", "mm", "um", "px"}, optional
        Unit of positions, and per second of velocities, of a file that does not say.
    y_axis : {"up", "down"}, optional
        Direction of y in the file; None: as its format has it. Where it is down, y and v are
        negated.
    origin : (float, float), optional
        Point of the field that becomes its origin, such as the centre of the tank [m], y up.
    variables : mapping, optional
        From u, v, x, y, time or mask to the variable of a NetCDF file, where names and attributes
        do not say it. Nodes whose mask is not zero are missing.
    columns : mapping, optional
        From x, y, u, v to the name or number (from 1) of the column of a text, where the header
        does not say it; ``":unit"`` may follow, such as ``{"u": "3:mm/s"}``.
    header_line : int, optional
        Line of a text, from 1, that names its columns; None: found.
    delimiter : str, optional
        Character between the fields of a text, or ``"tab"``, ``"space"``; None: found.

    Returns
    -------
    xarray.Dataset
        A `flow_field`. A file without flags has *measured* nodes, and where a velocity is missing
        (NaN in NetCDF, masked or rejected by a PIV program) *filled* ones, continued from their
        neighbours (`fill_velocity`). ``attrs["reading"]`` says what was taken for what,
        ``attrs["warning"]`` what was left out.

    Raises
    ------
    FormatError
        When the file is not one of these; with line and column for text.
    InputError
        When `arena` is not an arena, or the file knows its own; when a unit is missing, or given
        although the file names it.

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
    if y_axis not in (None, "up", "down"):
        raise InputError(f"`y_axis` is 'up' or 'down', got '{y_axis}'")
    options = FieldOptions(
        metres_per_pixel, frame_interval, length_unit, y_axis, origin, dict(variables or {})
    )
    said = TextOptions(
        {quantity: str(name) for quantity, name in (columns or {}).items()},
        header_line,
        {"tab": "\t", "space": " "}.get(delimiter or "", delimiter),
    )
    try:
        # PIVlab saves MATLAB files in HDF5, which looks like NetCDF.
        if not is_netcdf(source) or pivlab.is_pivlab(source):
            if options.variables:
                raise InputError(
                    "`variables` name the variables of a NetCDF file, and this is not one: leave "
                    "them out"
                )
            rows, notes, reading = raw_to_si(read_raw(source, said), options)
            time, (x, y, velocity) = None, grid_rows(rows)
        else:
            if said != TextOptions():
                raise InputError(_ONLY_TEXT.format("NetCDF"))
            dataset = open_netcdf(source)
            if find_kind(dataset) is FLOW_FIELD and "flag" in dataset:
                if arena is not None and own_flags == "refuse":
                    raise InputError("it has its own flags: leave the arena out")
                if options != FieldOptions():
                    raise InputError("the field is one of driftwalk's own: leave its units out")
                return check_flow_field(check_contents(dataset, source))
            si, notes = to_si(dataset, options)
            time = si["time"].values if "time" in si.dims else None
            velocity = np.stack([si["u"].values, si["v"].values], axis=-1)
            x, y = si["x"].values, si["y"].values
            reading = f"NetCDF; {y_words(options, down=options.y_axis == 'down')}"
        attrs = {"source": text_of_name(source.name), "reading": reading}
        attrs |= {"warning": "; ".join(notes)} if notes else {}
        return _new_field(x, y, velocity, time=time, arena=arena, attrs=attrs)
    except FormatError as error:
        path = error.path or source
        raise FormatError(error.reason, path=path, line=error.line, column=error.column) from error
    except InputError as error:
        raise FormatError(str(error), path=source) from error


def _new_field(
    x: Floats,
    y: Floats,
    velocity: Floats,
    *,
    time: Floats | None,
    arena: Mapping[str, Any] | str | None,
    attrs: Mapping[str, str],
) -> xr.Dataset:
    """Return the flow field of a file without flags, with its missing nodes filled."""
    described = None if arena is None else read_arena(arena)
    outline = None if described is None else outline_of(described)
    grid = Grid(x, y, float(x[1] - x[0]))
    frames = velocity.reshape(-1, y.size, x.size, 2)
    fastest = float(np.abs(frames[np.isfinite(frames)]).max(initial=0.0))
    # Beyond a few times the speed of sound in water, the unit is wrong.
    if fastest > 1e4:
        raise InputError(
            f"the flow reaches {fastest:.3g} m/s, as no water does: is its unit right?"
        )
    known = np.asarray(np.isfinite(frames).all(axis=-1))
    flag = np.where(known, FLAGS["measured"], FLAGS["filled"])
    if outline is not None:
        at_x, at_y = (part.ravel() for part in grid.nodes())
        outside = outline.depth(at_x, at_y) < 0.0
        if outside.all():
            box = f"x from {x[0]:.4g} to {x[-1]:.4g} m, y from {y[0]:.4g} to {y[-1]:.4g} m"
            raise InputError(
                f"no node of the field ({box}) lies in the tank: say with `origin` where the "
                "centre of the tank is, which driftwalk flow FILE -o flow.nc takes"
            )
        flag[:, outside.reshape(grid.shape)] = FLAGS["outside"]
    pairs = zip(frames, known, strict=True)
    filled = np.stack([fill_velocity(grid, one, known=at, outline=outline) for one, at in pairs])
    filled = filled.reshape(velocity.shape)
    facts = {"method": "file", "cell_size_m": grid.cell_size, **attrs}
    facts |= {} if described is None else {"arena": json.dumps(described)}
    return build_flow_field(
        x,
        y,
        time=time,
        u=filled[..., 0],
        v=filled[..., 1],
        flag=flag.reshape(velocity.shape[:-1]),
        attrs=facts,
    )


def read_raw(path: Path, said: TextOptions) -> RawField:
    """Read a field that is no NetCDF file.

    Raises
    ------
    FormatError
        When it cannot be read.
    """
    text.refuse_binary(path)
    try:
        if not pivlab.is_pivlab(path):
            return text.read(path, said)
    except OSError as error:
        raise FormatError(f"cannot be opened: {error.strerror or error}", path=path) from error
    if said != TextOptions():
        raise InputError(_ONLY_TEXT.format("a MATLAB file"))
    return pivlab.read(path)


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
        ``"driftwalk"``, ``"netcdf"``, ``"csv"``, ``"openpiv"``, ``"insight"``, ``"davis"``,
        ``"pivlab"``, ``"dantec"``, ``"tecplot"`` or ``"fiji"``.

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
    text.refuse_binary(source)
    try:
        if pivlab.is_pivlab(source):
            return "pivlab" if pivlab.holds_velocities(source) else None
        if is_netcdf(source):
            return _netcdf_format(source)
        return _text_format(source)
    except OSError as error:
        raise FormatError(f"cannot be opened: {error.strerror or error}", path=source) from error


def _text_format(path: Path) -> str | None:
    """Return the program of a text whose names, or whose rows, are those of a field."""
    try:
        layout = text.layout_of(text.read_text(path, most=HEAD), TextOptions())
    except FormatError:
        # A damaged field is still one of its program.
        return None if path.stat().st_size == 0 else text.signed(path)
    names, program = layout.names, layout.program
    if names_a_time(names):
        return None
    named = layout.header > 0 and set(FIELD) <= {column_of(one).base for one in names}
    if named or (program.sign and holds_field(names)):
        return program.name
    along = holds_field(names) and _goes_along_a_line(layout)
    return program.name if along and _fills_a_grid(path) else None


def _goes_along_a_line(layout: Layout) -> bool:
    """Whether the first two rows share x or y, as neighbouring nodes of a grid do.

    In most recordings they do not, and no more is read of those.
    """
    known = [column_of(name).quantity for name in layout.names]
    rows = [line.split(layout.delimiter) for _, line in layout.rows[:2]]
    if len(rows) < 2 or any(len(row) < len(known) for row in rows):
        return False
    return any(rows[0][at] == rows[1][at] for at in (known.index("x"), known.index("y")))


def _netcdf_format(path: Path) -> str | None:
    if (kind := kind_of_file(path)) is not None:
        return "driftwalk" if kind == "flow_field" else None
    try:
        return "netcdf" if holds_velocities(open_netcdf(path)) else None
    except InputError:
        return None


def _fills_a_grid(path: Path) -> bool:
    # A larger file whose names do not say so is taken for a recording.
    if path.stat().st_size > 64 << 20:
        return False
    try:
        grid_rows(text.read(path, TextOptions()).rows)
    except InputError:
        return False
    return True


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
