"""The answer of a dataset as a person reads it: its parameters, their intervals, the verdict."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple

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

NOT_DETERMINED: Final = "not determined by this recording"
"""Said in the place of a number with an open interval."""


class Estimate(NamedTuple):
    """An estimate in the unit of a reader."""

    value: float
    unit: str
    """Such as "mN"; empty for a number without a unit."""
    ends: tuple[float, float] | None
    """Its interval, where it has one."""

    @property
    def open(self) -> bool:
        """Whether the interval has no upper end: the recording does not determine the number."""
        return self.ends is not None and math.isinf(self.ends[1])


def symbol_of(parameter: str) -> str:
    """Return the symbol of a parameter, its name in words where it has none."""
    return SYMBOLS.get(parameter, parameter.replace("_", " "))


def reader_unit(unit: str) -> tuple[float, str]:
    """Return the unit in which a person reads numbers, and their factor.

    Examples
    --------
    >>> reader_unit("N"), reader_unit("1"), reader_unit("m/s")
    ((1000.0, 'mN'), (1.0, ''), (1.0, 'm/s'))
    """
    return SMALL_UNITS.get(unit, (1.0, "" if unit == "1" else unit))


def estimate_of(found: xr.Dataset, parameter: str) -> Estimate:
    """Return the estimate of a parameter with its interval.

    Parameters
    ----------
    found : xarray.Dataset
        With ``estimate`` by ``parameter`` and their ``unit``; ``interval`` may be absent.
    parameter : str
        One of them.

    Raises
    ------
    KeyError
        When it has no such parameter.
    """
    one = found.sel(parameter=parameter)
    scale, unit = reader_unit(str(one["unit"].values))
    ends = None
    if "interval" in found.variables:
        low, high = (scale * float(end) for end in one["interval"].values)
        ends = None if math.isnan(low) else (low, high)
    return Estimate(scale * float(one["estimate"]), unit, ends)


def undetermined(found: xr.Dataset) -> list[str]:
    """Return which of C_d and σ_F a recording does not determine: both are needed to simulate.

    Parameters
    ----------
    found : xarray.Dataset
        A `fit` or a `calibration` of the block.
    """
    unknown = [name for name in ("drag_coefficient", "force_std") if estimate_of(found, name).open]
    # Where the drag is linear but for a trace, nothing depends on C_d.
    if "linear_drag" in found["parameter"].values and not estimate_of(found, "linear_drag").open:
        unknown = [name for name in unknown if name != "drag_coefficient"]
    return unknown


def answer_lines(found: xr.Dataset) -> list[str]:
    """Return what a fit, a calibration or a comparison of models says, a line each.

    Parameters
    ----------
    found : xarray.Dataset
        With ``estimate`` by parameter, as a `fit` and a `calibration` have it, or with ``score`` by
        model; of any other dataset nothing is said.

    Returns
    -------
    list of str
        The parameters in the units of a reader, what the intervals hold for, the verdict of the
        check, findings and warnings; or the models with their distances, findings and warnings.

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
    needed = ("estimate", "parameter", "unit")
    if "score" in found.variables and "model" in found.dims:
        return [*_ranking(found), *_remarks(found)]
    if any(name not in found.variables for name in needed) or found["estimate"].ndim != 1:
        return []
    names = [str(name) for name in found["parameter"].values]
    heads = [symbol_of(name) for name in names]
    width = max(map(len, heads), default=0)
    lines = [
        f"{head:{width}}  {_text(estimate_of(found, name))}{_open(found, name)}"
        for head, name in zip(heads, names, strict=True)
    ]
    lines += _conditions(found)
    if "explained" in found:
        lines.append(f"explains the recording: {'yes' if bool(found['explained']) else 'NO'}")
    elif "check_left_out" in found.attrs:
        lines.append(f"not checked: {found.attrs['check_left_out']}")
    return [*lines, *_remarks(found)]


def _open(found: xr.Dataset, name: str) -> str:
    """Return a remark on a parameter that the recording does not determine."""
    known = "determined" not in found or bool(found["determined"].sel(parameter=name))
    return "" if known or estimate_of(found, name).open else "  not determined"


def _ranking(found: xr.Dataset) -> list[str]:
    """Return the models of a comparison with their distances."""
    names = [str(name) for name in found["model"].values]
    width = max(map(len, names), default=0)
    return [
        f"{name:{width}}  {score:.2f} ± {std:.2f}{'  explains the recording' if explained else ''}"
        for name, score, std, explained in zip(
            names,
            found["score"].values,
            found["score_std"].values,
            found["explained"].values,
            strict=True,
        )
    ]


def _remarks(found: xr.Dataset) -> list[str]:
    return [
        f"{name}: {text}"
        for name in ("finding", "warning")
        if name in found.variables
        for text in found[name].values
    ]


def _text(found: Estimate) -> str:
    if found.open:
        return NOT_DETERMINED
    text = f"{found.value:.4g} {found.unit}".rstrip()
    return text if found.ends is None else f"{text}  [{found.ends[0]:.4g}, {found.ends[1]:.4g}]"


def _conditions(found: xr.Dataset) -> list[str]:
    """Return what the numbers hold under: the confidence, and the interval of the force."""
    said = []
    if "confidence" in found:
        said.append(f"intervals of {float(found['confidence']):.0%}".replace("%", " %"))
    if "force_interval" in found:
        said.append(f"force redrawn every {1e3 * float(found['force_interval']):g} ms")
    return ["; ".join(said)] if said else []
