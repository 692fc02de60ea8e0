"""Which parameters a stored calibration is about: their names, units and scales.

They are the dimensions of its map. Units and labels are those of the coordinates; without a map the
parameters are the block's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from driftwalk.schema.parameters import flat_name

if TYPE_CHECKING:
    import xarray as xr

BLOCK: Final = ("drag_coefficient", "force_std")
"""The parameters of the block in their order."""
_UNITS: Final = {"force_std": "N"}


class StoredParameter(NamedTuple):
    """A parameter of a stored calibration."""

    name: str
    unit: str
    label: str
    scale: str
    """"linear" or "log"."""

    @property
    def key(self) -> str:
        """Flat name of its estimate: its name with the unit."""
        return flat_name(self.name, self.unit)

    @property
    def is_log(self) -> bool:
        """Whether equal steps along it are equal ratios."""
        return self.scale == "log"


def stored_parameters(calibration: xr.Dataset) -> tuple[StoredParameter, ...]:
    """Return the parameters of a calibration, in the order of its dimensions.

    Parameters
    ----------
    calibration : xarray.Dataset
        A `calibration`; one without a map is taken for the block's.

    Examples
    --------
    >>> import xarray as xr
    >>> speed = ("speed", [0.1, 0.2], {"units": "m/s", "long_name": "speed"})
    >>> found = xr.Dataset({"ks_distance": ("speed", [0.3, 0.2])}, {"speed": speed})
    >>> [one.key for one in stored_parameters(found)]
    ['speed_m_s']
    """
    names: tuple[str, ...] = BLOCK
    if "ks_distance" in calibration.variables:
        dims = tuple(str(dim) for dim in calibration["ks_distance"].dims)
        # The order of the block's dimensions is known, however they were turned.
        names = dims if dims and set(dims) != set(BLOCK) else BLOCK
    return tuple(_parameter(calibration, name) for name in names)


def is_block(calibration: xr.Dataset) -> bool:
    """Return whether a calibration is about the block in a stirred tank.

    Another model names itself, and may have parameters of the same names.
    """
    names = tuple(one.name for one in stored_parameters(calibration))
    return names == BLOCK and "model" not in calibration.attrs


def _parameter(calibration: xr.Dataset, name: str) -> StoredParameter:
    facts = calibration.variables[name].attrs if name in calibration.variables else {}
    return StoredParameter(
        name,
        str(facts.get("units", _UNITS.get(name, "1"))),
        str(facts.get("long_name", name.replace("_", " "))),
        str(facts.get("scale", "linear")),
    )
