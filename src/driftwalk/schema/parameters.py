"""The parameters of a motion model and of a stored calibration: names, units, ranges, scales.

Grids, surfaces and regions are computed in the *coordinate* of a parameter: its value on a linear
scale, the decimal logarithm of its value on a logarithmic one. On a linear scale the two are the
same bits.

The parameters of a stored calibration are the dimensions of its map, with the units and labels of
their coordinates; without a map they are the block's.
"""

from __future__ import annotations

import keyword
import math
import re
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import ConfigurationError
from driftwalk.core.grid import check_axis, grid_values

if TYPE_CHECKING:
    import xarray as xr

Scale = Literal["linear", "log"]

USUAL_VALUES: Final = 41
"""Values of the coarse grid of a parameter whose step is left open; chosen by hand."""
REFINEMENT: Final = 5
"""How many steps of the refined grid a coarse step has, where that is left open; chosen by hand."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of a motion model, with the range in which it is searched.

    Attributes
    ----------
    name : str
        A Python name: the keyword of the model, and the dimension of every map.
    unit : str
        Such as "m/s"; "1" for a number without a unit.
    low, high : float
        Ends of the range, both included; a logarithmic scale needs low > 0.
    step : float
        Step of the coarse grid: in the unit, or in decades on a logarithmic scale. 0 divides the
        range into 40 steps.
    scale : {"linear", "log"}
        Whether equal steps are equal differences or equal ratios.
    label : str
        What figures and messages call it; default: the name with spaces.
    symbol : str
        What formulas call it; default: the label.
    refined_step : float
        Largest step of the refined grid; 0 takes a fifth of `step`.
    meaning : str
        What it is, in a sentence.

    Raises
    ------
    ConfigurationError
        When the name is none, the range is empty or not finite, or the scale is unknown.

    Examples
    --------
    >>> speed = Parameter("speed", "m/s", 0.0, 0.1, step=0.05)
    >>> speed.values, speed.key, speed.label
    ((0.0, 0.05, 0.1), 'speed_m_s', 'speed')
    >>> Parameter("rate", "1/s", 0.1, 10.0, step=1.0, scale="log").values
    (0.1, 1.0, 10.0)
    """

    name: str
    unit: str
    low: float
    high: float
    step: float = 0.0
    scale: Scale = "linear"
    label: str = ""
    symbol: str = ""
    refined_step: float = 0.0
    meaning: str = ""

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or keyword.iskeyword(self.name):
            raise ConfigurationError(
                f"a parameter is called {self.name!r}: its name must be one that Python takes as a "
                "keyword, such as 'turn_rate'"
            )
        if self.scale not in get_args(Scale):
            raise ConfigurationError(
                f"parameter {self.name}: scale must be one of {', '.join(get_args(Scale))}, "
                f"got {self.scale!r}"
            )
        self._check_range()
        self._fill("label", self.name.replace("_", " "))
        self._fill("symbol", self.label)
        span = float(self.to_coordinate(self.high) - self.to_coordinate(self.low))
        self._fill("step", span / (USUAL_VALUES - 1) if span > 0 else 1.0)
        self._fill("refined_step", self.step / REFINEMENT)
        check_axis(self.name, self._bottom, self._bottom + span, self.step)

    @property
    def key(self) -> str:
        """Name with the unit, for attributes and JSON: "force_std_N"."""
        return flat_name(self.name, self.unit)

    @property
    def coordinates(self) -> tuple[float, ...]:
        """Coordinates of the coarse grid."""
        return grid_values(self._bottom, float(self.to_coordinate(self.high)), self.step)

    @property
    def values(self) -> tuple[float, ...]:
        """Values of the coarse grid, in the unit."""
        return tuple(float(value) for value in self.to_value(self.coordinates))

    def to_coordinate(self, value: npt.ArrayLike) -> Floats:
        """Return the coordinates of values."""
        values = np.asarray(value, dtype=np.float64)
        return np.log10(values) if self.scale == "log" else values

    def to_value(self, coordinate: npt.ArrayLike) -> Floats:
        """Return the values at coordinates."""
        coordinates = np.asarray(coordinate, dtype=np.float64)
        return np.power(10.0, coordinates) if self.scale == "log" else coordinates

    def value_at(self, share: npt.ArrayLike) -> Floats:
        """Return the values at parts of the range, 0 to 1, on its scale.

        Examples
        --------
        >>> float(Parameter("speed", "m/s", 0.01, 1.0, scale="log").value_at(0.5))
        0.1
        """
        low, high = (float(self.to_coordinate(end)) for end in (self.low, self.high))
        return self.to_value(low + (high - low) * np.asarray(share, dtype=np.float64))

    def describe(self) -> dict[str, Any]:
        """Return it as JSON values: ``Parameter(**described)`` is the same parameter."""
        return asdict(self)

    @property
    def _bottom(self) -> float:
        return float(self.to_coordinate(self.low))

    def _check_range(self) -> None:
        numbers = (self.low, self.high, self.step, self.refined_step)
        if not all(math.isfinite(number) for number in numbers):
            raise ConfigurationError(f"parameter {self.name}: a number of its range is not finite")
        if self.scale == "log" and self.low <= 0.0:
            raise ConfigurationError(
                f"parameter {self.name}: a logarithmic scale begins above 0, got {self.low:g}"
            )
        if self.high < self.low:
            raise ConfigurationError(
                f"parameter {self.name}: its range ends at {self.high:g}, below its beginning "
                f"{self.low:g}"
            )
        if self.step < 0.0 or self.refined_step < 0.0:
            raise ConfigurationError(f"parameter {self.name}: a step is below 0")

    def _fill(self, field: str, value: Any) -> None:
        if not getattr(self, field):
            object.__setattr__(self, field, value)


def unit_suffix(unit: str) -> str:
    """Return a unit as it stands in a key: "m_s" for "m/s", "per_s" for "1/s", "" for "1".

    Examples
    --------
    >>> unit_suffix("rad2/s"), unit_suffix("1/s"), unit_suffix("1")
    ('rad2_s', 'per_s', '')
    """
    words = re.sub(r"^1\s*/\s*", "per ", unit.strip())
    return "" if words == "1" else re.sub(r"\W+", "_", words.replace("^", "")).strip("_")


def flat_name(name: str, unit: str) -> str:
    """Return a name with its unit, as attributes and JSON have it.

    Examples
    --------
    >>> flat_name("speed", "m/s"), flat_name("linear_drag", "kg s-1"), flat_name("share", "1")
    ('speed_m_s', 'linear_drag_kg_s', 'share')
    """
    suffix = unit_suffix(unit.replace(" s-1", "/s"))
    return f"{name}_{suffix}" if suffix else name


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
    """Return whether a calibration or a simulation is about the block in a stirred tank.

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
