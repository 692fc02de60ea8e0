"""Flow fields in NetCDF of any program: u, v, x, y and their units."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import ConfigurationError, FormatError
from driftwalk.core.units import parse_quantity

if TYPE_CHECKING:
    import xarray as xr

Array = npt.NDArray[np.float64]

_LONG_WORDS = {"meters": "m", "metres": "m", "meter": "m", "metre": "m", "seconds": "s"}


def to_si(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Return u and v [m/s] over (y, x) or (time, y, x), x and y [m] rising, of any NetCDF.

    Raises
    ------
    FormatError
        When one of them, its dimensions or its unit is missing or unusable.
    """
    for required in ("u", "v", "x", "y"):
        if required not in dataset.variables:
            has = ", ".join(str(name) for name in dataset.variables)
            raise FormatError(f"there is no variable '{required}'; it has {has}", path=path)
    for name in ("u", "v", "x", "y", *({"time"} & set(map(str, dataset.variables)))):
        if dataset[name].dtype.kind not in "fiu":
            raise FormatError(f"'{name}' holds no numbers", path=path)
        if name in ("x", "y") and dataset[name].dims != (name,):
            raise FormatError(
                f"'{name}' needs the dimension {name} alone, got {dataset[name].dims}", path=path
            )
    chosen = dataset[["u", "v"]]
    extra = [name for name in chosen.dims if name not in ("time", "y", "x")]
    long = [name for name in extra if chosen.sizes[name] > 1]
    if long or not {"x", "y"} <= set(chosen["u"].dims) & set(chosen["v"].dims):
        raise FormatError(
            f"u and v need the dimensions ([time,] y, x), got {dict(chosen.sizes)}", path=path
        )
    chosen = chosen.squeeze([str(name) for name in extra], drop=True)
    for axis in ("x", "y"):
        nodes = chosen[axis].values
        if nodes.size < 2 or not np.isfinite(nodes).all():
            raise FormatError(f"'{axis}' needs at least 2 finite positions", path=path)
    for name in map(str, chosen.variables):
        unit = {"u": "m/s", "v": "m/s", "time": "s"}.get(name, "m")
        factor = _factor(dataset[name].attrs.get("units"), unit, name, path)
        chosen[name] = (chosen[name].dims, factor * chosen[name].values.astype(np.float64))
    return chosen.sortby([name for name in ("x", "y") if name in chosen.dims]).transpose(
        *[name for name in ("time", "y", "x") if name in chosen.dims]
    )


def _factor(text: object, unit: str, name: str, path: Path) -> float:
    """Return what one of the file's units is in SI."""
    if not isinstance(text, str) or not text.strip():
        raise FormatError(
            f"'{name}' has no units; write its attribute 'units', such as '{unit}'", path=path
        )
    # "seconds since ..." counts from a date that nothing here needs; UDUNITS joins with dots.
    words = text.split(" since ")[0].replace(".", " ").split()
    symbol = " ".join(_LONG_WORDS.get(word.lower(), word) for word in words)
    try:
        return parse_quantity(f"1 {symbol}", unit)
    except ConfigurationError as error:
        raise FormatError(f"the units of '{name}' are '{text}': {error}", path=path) from error
