"""The answer of a dataset in a few lines of text: its parameters, their intervals, the verdict."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import xarray as xr

SYMBOLS: Final = MappingProxyType(
    {
        "drag_coefficient": "C_d",
        "force_std": "σ_F",
        "force_noise_intensity": "σ_F²·τ",
    }
)
"""Symbols of the block's parameters; any other parameter is called by its name."""
SMALL_UNITS: Final = MappingProxyType({"N": (1e3, "mN"), "m": (1e3, "mm")})
"""Units in which a person reads the numbers of a 3-cm block, and their number in the SI unit."""


def answer_lines(found: xr.Dataset) -> list[str]:
    """Return what a fit or a calibration says, a line each; nothing for any other dataset.

    Parameters
    ----------
    found : xarray.Dataset
        With ``estimate`` and ``interval`` by parameter, as a `fit` has them.

    Returns
    -------
    list of str
        The parameters in the units of a reader, what the intervals hold for, the verdict of the
        check, findings and warnings.

    Examples
    --------
    >>> import xarray as xr
    >>> values = {"estimate": ("parameter", [0.4])}
    >>> values["interval"] = (("parameter", "bound"), [[0.38, 0.42]])
    >>> names = {"parameter": ["drag_coefficient"], "unit": ("parameter", ["1"])}
    >>> found = xr.Dataset(values, names)
    >>> answer_lines(found.assign(confidence=0.9))
    ['C_d  0.4  [0.38, 0.42]', 'intervals of 90 %']
    """
    needed = ("estimate", "interval", "parameter", "unit")
    if any(name not in found.variables for name in needed) or found["estimate"].ndim != 1:
        return []
    names = [str(name) for name in found["parameter"].values]
    heads = [SYMBOLS.get(name, name.replace("_", " ")) for name in names]
    width = max(map(len, heads), default=0)
    lines = [
        f"{head:{width}}  {_estimate(found.sel(parameter=name))}"
        for head, name in zip(heads, names, strict=True)
    ]
    lines += _conditions(found)
    if "explained" in found:
        lines.append(f"explains the recording: {'yes' if bool(found['explained']) else 'NO'}")
    elif "check_left_out" in found.attrs:
        lines.append(f"not checked: {found.attrs['check_left_out']}")
    for name in ("finding", "warning"):
        if name in found.variables:
            lines += [f"{name}: {text}" for text in found[name].values]
    return lines


def _estimate(found: xr.Dataset) -> str:
    unit = str(found["unit"].values)
    scale, shown = SMALL_UNITS.get(unit, (1.0, "" if unit == "1" else unit))
    value = scale * float(found["estimate"])
    low, high = (scale * float(end) for end in found["interval"].values)
    text = f"{value:.4g} {shown}".rstrip()
    return text if math.isnan(low) else f"{text}  [{low:.4g}, {high:.4g}]"


def _conditions(found: xr.Dataset) -> list[str]:
    """Return what the numbers hold under: the confidence, and the interval of the force."""
    said = []
    if "confidence" in found:
        said.append(f"intervals of {float(found['confidence']):.0%}".replace("%", " %"))
    if "force_interval" in found:
        said.append(f"force redrawn every {1e3 * float(found['force_interval']):g} ms")
    return ["; ".join(said)] if said else []
