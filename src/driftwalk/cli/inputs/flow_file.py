"""A flow field from a file of another program, with what the options say about it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.cli.options.recording import RecordingOptions, parse_columns, tank_text
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def read_flow_file(
    path: Path,
    how: RecordingOptions,
    *,
    frame_interval: float | None,
    variables: str | None,
) -> xr.Dataset | None:
    """Load a flow field in the frame of its tank; None of a recording.

    Parameters
    ----------
    path : Path
        Any file. It is a recording where an option says how to read one.
    how : RecordingOptions
        Its scale, unit, direction of y and tank.
    frame_interval : float or None
        Time between the two images of a pair [s].
    variables : str or None
        ``u=NAME,v=NAME`` of a NetCDF file.

    Raises
    ------
    InputError
        When the field cannot be read, or ``--frame-interval`` is given for a recording.
    """
    from driftwalk.flow import flow_format, load_flow

    columns = parse_columns(how.columns or [])
    velocities = bool({"u", "v"} & set(columns))
    recording = how.format, how.x, how.sheet, None if velocities else how.columns
    said = any(one is not None for one in recording)
    if variables is None and not velocities and (said or flow_format(path) is None):
        if frame_interval is not None:
            raise InputError(
                f"{path}: --frame-interval is for a flow field, and this is read as a recording; "
                "--columns x=NAME,y=NAME,u=NAME,v=NAME makes it a flow field"
            )
        return None
    values: dict[str, Any] = {
        "metres_per_pixel": how.scale,
        "frame_interval": frame_interval,
        "length_unit": how.length_unit,
        "y_axis": how.y_axis,
        "variables": None if variables is None else parse_columns([variables], "--flow-variables"),
        "columns": columns,
        "header_line": how.header_line,
        "delimiter": how.delimiter,
    }
    return load_flow(path, **values, **({} if how.tank is None else _placed(tank_text(how.tank))))


def _placed(tank: str) -> dict[str, Any]:
    """Return where the tank lies in the field: an arena with its centre at the origin."""
    from driftwalk.record import place_arena

    kind, _, rest = tank.partition(":")
    if kind == "fit":
        raise InputError("--tank fit is for recordings: state the tank, as in 40cm@X,Y")
    if "@" not in rest and kind != "polygon":
        tank = f"{tank}@0,0"
    # Its centre is stated, so that no positions have to say where it is.
    nowhere = np.empty(0)
    placed = place_arena(tank, nowhere, nowhere)
    return {"arena": json.dumps(placed.arena), "origin": placed.origin}


def describe_field(field: xr.Dataset) -> dict[str, Any]:
    """Return what a flow field holds, with units in the keys.

    Parameters
    ----------
    field : xarray.Dataset
        A `flow_field`.
    """
    speed = np.hypot(field["u"].values, field["v"].values)
    measured = field["flag"].values == 1
    known = speed[measured] if measured.any() else speed
    attrs = field.attrs
    facts: dict[str, float] = {
        key: int(attrs[key]) for key in ("samples_used", "tracks_used") if key in attrs
    }
    if "u_standard_error" in field:
        error = np.hypot(field["u_standard_error"].values, field["v_standard_error"].values)
        if np.isfinite(error).any():
            facts["standard_error_median_m_s"] = float(np.nanmedian(error))
    return {
        **{key: attrs.get(key) for key in ("source", "reading", "method")},
        "columns": field.sizes["x"],
        "rows": field.sizes["y"],
        "frames": field.sizes.get("time", 1),
        **{
            f"{axis}_{side}_m": float(getattr(np, side)(field[axis].values))
            for axis in ("x", "y")
            for side in ("min", "max")
        },
        "measured_share": float(measured.mean()),
        "speed_mean_m_s": float(known.mean()),
        "speed_max_m_s": float(known.max()),
        **facts,
        "warnings": [attrs["warning"]] if attrs.get("warning") else [],
    }
