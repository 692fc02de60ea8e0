"""Flow fields in NetCDF of any program: which variables are velocities, and their units."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.flow.grid import round_nodes
from driftwalk.flow.readers.units import FieldOptions, FieldScale, factor_to, words_of_unit

if TYPE_CHECKING:
    import xarray as xr


QUANTITIES: Final = ("u", "v", "x", "y", "time", "mask")
_STANDARD: Final = {
    "u": (
        "sea_water_x_velocity",
        "eastward_sea_water_velocity",
        "surface_eastward_sea_water_velocity",
        "x_sea_water_velocity",
    ),
    "v": (
        "sea_water_y_velocity",
        "northward_sea_water_velocity",
        "surface_northward_sea_water_velocity",
        "y_sea_water_velocity",
    ),
    "x": ("projection_x_coordinate", "longitude"),
    "y": ("projection_y_coordinate", "latitude"),
}
"""Names of the CF conventions, and those that OpenDrift has in their place."""
_AXES: Final = {"x": "X", "y": "Y"}
_USUAL: Final = {
    "u": ("U", "uo", "water_u", "vozocrtx"),
    "v": ("V", "vo", "water_v", "vomecrty"),
    "x": ("lon", "longitude", "nav_lon"),
    "y": ("lat", "latitude", "nav_lat"),
    "time": ("t", "time_counter", "ocean_time"),
}
"""Names that ocean models and Parcels write."""
_COUNTED: Final = ("frame", "frames", "", "1")
"""Units of a time that counts frames."""


def to_si(dataset: xr.Dataset, options: FieldOptions) -> tuple[xr.Dataset, list[str]]:
    """Return the field of any NetCDF in SI, and sentences for the person who loads the file.

    It has u and v [m/s] over (y, x) or (time, y, x), and x and y [m] rising.

    Raises
    ------
    FormatError
        When a variable, its dimensions or its unit is missing or unusable.
    InputError
        When a fact about its units is missing, or is given and of no use.
    """
    named = _named(dataset, options)
    for name in ("u", "v", "x", "y", *({"time", "mask"} & set(map(str, named.variables)))):
        if named[name].dtype.kind not in "fiub":
            raise FormatError(f"'{name}' holds no numbers")
        if name in ("x", "y") and named[name].dims != (name,):
            raise FormatError(
                f"'{name}' must have exactly one dimension, got {named[name].dims}: is the grid "
                "curved, or in longitude and latitude? Interpolate it to an even one in metres"
            )
    chosen = _planar(named)
    notes: list[str] = []
    if "time" in chosen.dims:
        chosen, notes = _with_times(chosen)
    scale = FieldScale(options)
    for name in map(str, chosen.variables):
        if name == "time":
            continue
        unit = _unit(chosen, name, options)
        try:
            factor = scale.velocity(unit) if name in ("u", "v") else scale.length(unit)
        except InputError as error:
            raise FormatError(f"the units of '{name}' are '{unit}': {error}") from error
        chosen[name] = (chosen[name].dims, factor * chosen[name].values.astype(np.float64))
    scale.refuse_unused()
    if options.y_axis == "down":
        chosen["y"] = ("y", -chosen["y"].values)
        chosen["v"] = (chosen["v"].dims, -chosen["v"].values)
    if options.origin is not None:
        for axis, shift in zip("xy", options.origin, strict=True):
            chosen[axis] = (axis, round_nodes(chosen[axis].values - shift))
    ordered = chosen.sortby([name for name in ("x", "y") if name in chosen.dims])
    return ordered.transpose("time", "y", "x", missing_dims="ignore"), notes


def holds_velocities(dataset: xr.Dataset) -> bool:
    """Return whether names or attributes say that variables are velocities of water."""
    return all(next(_candidates(dataset, quantity), None) is not None for quantity in "uv")


def _named(dataset: xr.Dataset, options: FieldOptions) -> xr.Dataset:
    """Return the variables under the names u, v, x, y, and time and mask where there are any."""
    if unknown := sorted(set(options.variables) - set(QUANTITIES)):
        raise InputError(f"`variables` are of {', '.join(QUANTITIES)}; got '{unknown[0]}'")
    found = {}
    for quantity in QUANTITIES:
        name = options.variables.get(quantity) or next(_candidates(dataset, quantity), None)
        if name is None and quantity in ("time", "mask"):
            continue
        if name is None or name not in dataset.variables:
            has = ", ".join(str(name) for name in dataset.variables)
            raise FormatError(
                f"there is no variable '{name or quantity}'; it has {has}: name them with "
                '`variables={"u": "NAME", "v": "NAME", "x": "NAME", "y": "NAME"}`'
            )
        found[quantity] = name
    if len(set(found.values())) < len(found):
        raise InputError("`variables` names one variable twice")
    kept = _straight(dataset[list(found.values())].reset_coords(), found)
    # A dimension takes the name of its coordinate, whatever it was called.
    for quantity in ("x", "y", "time"):
        name = found.get(quantity)
        if name is not None and kept[name].ndim == 1 and kept[name].dims[0] != name:
            kept = _free(kept, name, found).swap_dims({kept[name].dims[0]: name})
    kept = kept.drop_vars([str(c) for c in kept.coords if c not in found.values()])
    return kept.rename({name: quantity for quantity, name in found.items() if name != quantity})


def _straight(dataset: xr.Dataset, found: dict[str, str]) -> xr.Dataset:
    """Return the dataset with one dimension of x and of y, where they are written over both.

    Parcels and ocean models write coordinates of straight grids like those of curved ones.
    """
    for name in (found["x"], found["y"]):
        values = dataset[name]
        if values.ndim != 2:
            continue
        for dimension in values.dims:
            line = values.isel({dimension: 0}, drop=True)
            if bool((values == line).all()):
                dataset = dataset.drop_vars(name).assign({name: line})
                break
    return dataset


def _free(dataset: xr.Dataset, name: str, found: dict[str, str]) -> xr.Dataset:
    """Return the dataset without an index of the dimension that another coordinate names."""
    dimension = str(dataset[name].dims[0])
    index = dimension in dataset.coords and dimension not in found.values()
    return dataset.drop_vars(dimension) if index else dataset


def _candidates(dataset: xr.Dataset, quantity: str) -> Iterator[str]:
    """Yield the variables that may hold a quantity, the surest first."""
    names = [str(name) for name in dataset.variables]
    if quantity in names and quantity != "mask":
        yield quantity
    for name in names:
        standard = str(dataset[name].attrs.get("standard_name", ""))
        axis = str(dataset[name].attrs.get("axis", ""))
        if standard in _STANDARD.get(quantity, ()) or axis == _AXES.get(quantity):
            yield name
    yield from (name for name in _USUAL.get(quantity, ()) if name in names)


def _planar(named: xr.Dataset) -> xr.Dataset:
    """Return u and v over ([time,] y, x), missing where they are masked."""
    chosen = named[["u", "v"]]
    if "mask" in named:
        chosen = chosen.where(named["mask"] == 0)
    extra = [name for name in chosen.dims if name not in ("time", "y", "x")]
    long = [name for name in extra if chosen.sizes[name] > 1]
    if long or not {"x", "y"} <= set(chosen["u"].dims) & set(chosen["v"].dims):
        raise FormatError(
            f"u and v need the dimensions ([time,] y, x), got {dict(chosen.sizes)}: keep one layer "
            "or member in the file"
        )
    chosen = chosen.squeeze([str(name) for name in extra], drop=True)
    for axis in ("x", "y"):
        nodes = chosen[axis].values
        if nodes.size < 2 or not np.isfinite(nodes).all():
            raise FormatError(f"'{axis}' needs at least 2 finite positions")
    return chosen


def _with_times(chosen: xr.Dataset) -> tuple[xr.Dataset, list[str]]:
    """Return the frames at their times [s]; frames that are counted, or one alone, have none."""
    count = chosen.sizes["time"]
    unit = str(chosen["time"].attrs.get("units", "")).strip()
    if count == 1:
        return chosen.isel(time=0, drop=True), []
    if unit in _COUNTED:
        mean = chosen.mean("time", skipna=True, keep_attrs=True)
        return mean, [f"the flow is the mean of {count} frames: the file holds no times"]
    try:
        # "seconds since ..." counts from a date that nothing here needs.
        factor = factor_to(words_of_unit(unit.split(" since ")[0]), "s")
    except InputError as error:
        raise FormatError(f"the units of 'time' are '{unit}': {error}") from error
    return chosen.assign_coords(time=factor * chosen["time"].values.astype(np.float64)), []


def _unit(chosen: xr.Dataset, name: str, options: FieldOptions) -> str:
    """Return the unit of a variable, empty where there is none and the user states it."""
    text = chosen[name].attrs.get("units")
    if isinstance(text, str) and text.strip():
        return text
    if options.length_unit is not None or options.metres_per_pixel is not None:
        return ""
    example = "m/s" if name in ("u", "v") else "m"
    raise FormatError(
        f"'{name}' has no units; write its attribute 'units', such as '{example}', or state them "
        "with `length_unit`"
    )
