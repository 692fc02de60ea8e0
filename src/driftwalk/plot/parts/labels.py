"""Labels in the units of a figure (cm, mm, mN, degrees), and the parameters of a calibration."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.units import raised_powers
from driftwalk.schema.answers.facts import facts_of
from driftwalk.schema.description import Number
from driftwalk.schema.parameters import StoredParameter, is_block, stored_parameters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

# (unit in the dataset, unit in the figure) -> factor
FACTORS: dict[tuple[str, str], float] = {
    ("m", "cm"): 1e2,
    ("m", "mm"): 1e3,
    ("m s-1", "cm/s"): 1e2,
    ("N", "mN"): 1e3,
    ("rad", "°"): 180.0 / math.pi,
}


def in_unit(variable: xr.DataArray, unit: str, *, stored: str) -> Floats:
    """Return the values of a variable in `unit`.

    Parameters
    ----------
    variable : xarray.DataArray
        Its ``units`` attribute, when it has one, says what it is stored in.
    unit : str
        Unit of the figure, such as ``"cm"``.
    stored : str
        Unit that a variable without a ``units`` attribute has by its schema.

    Raises
    ------
    InputError
        When there is no way from the variable's unit to `unit`.
    """
    have = str(variable.attrs.get("units", stored))
    if (have, unit) not in FACTORS:
        raise InputError(
            f"'{variable.name}' is in '{have}', expected '{stored}': convert it and set its "
            "attribute 'units'"
        )
    return np.asarray(variable.values, dtype=np.float64) * FACTORS[have, unit]


def force_interval_text(calibration: xr.Dataset) -> str:
    """Return "redrawn every 16 ms" for the force interval of the calibration."""
    interval_s = required_fact(calibration, "force_interval_s")
    return f"redrawn every {1e3 * float(interval_s):.4g} ms"


def force_label(dataset: xr.Dataset) -> str:
    """Return the label of an axis of σ_F, in one line; it says how often the force is redrawn."""
    return rf"force $\sigma_F$ (mN), {force_interval_text(dataset)}"


DRAG_LABEL = r"drag coefficient $C_d$"
LENGTH_LABEL = "step length (mm)"
# The paper says step angle for what the field calls turning angle.
ANGLE_LABEL = "turning (step) angle (°)"


def set_symbols(text: str) -> str:
    """Return a text whose symbols are set as mathematics.

    Examples
    --------
    >>> set_symbols("C_d = 0.4, run_rest")
    '$C_d$ = 0.4, run_rest'
    """
    return re.sub(r"(?<!\w)([^\W\d_]_[^\W\d_])(?!\w)", r"$\1$", text)


def model_words(name: str) -> str:
    """Return the name of a motion model as text, "run-rest + wall" of "run_rest+wall"."""
    return name.replace("_", "-").replace("+", " + ")


def number_label(number: Number) -> str:
    """Return the label of an axis: words, symbol, and the unit in round brackets."""
    unit = f" ({number.reader_unit})" if number.reader_unit else ""
    return f"{set_symbols(number.words)}{unit}"


def required_fact(dataset: xr.Dataset, name: str) -> Any:
    """Return a fact of the dataset, see `facts_of`, or raise `InputError` naming it."""
    facts = facts_of(dataset)
    if name not in facts:
        raise InputError(f"the calibration has no '{name}': it is not complete")
    return facts[name]


def require_variables(dataset: xr.Dataset, *names: str) -> None:
    """Raise `InputError` naming the variables that the dataset lacks."""
    missing = [name for name in names if name not in dataset.variables]
    if missing:
        raise InputError(f"the calibration lacks {', '.join(missing)}: nothing to draw")


def interval_of(calibration: xr.Dataset, name: str) -> tuple[float, float] | None:
    """Return an interval [low, high] of the facts, None when absent or not finite."""
    ends = np.asarray(facts_of(calibration).get(name), dtype=np.float64)
    if ends.shape != (2,) or not np.isfinite(ends).all():
        return None
    return float(ends[0]), float(ends[1])


def number_fact(dataset: xr.Dataset, name: str) -> float:
    """Return a number of the facts, NaN when it is absent."""
    return float(facts_of(dataset).get(name, math.nan))


def logarithmic(ax: Axes, which: Literal["x", "y"]) -> None:
    """Make an axis with its limits logarithmic; over less than three decades it has plain numbers.

    The numbers have room: 0.5, 1, 2 over a decade or more, and even steps over less, where
    matplotlib would write 3 × 10⁻¹ next to 4 × 10⁻¹.
    """
    from matplotlib.ticker import FormatStrFormatter, LogLocator, MaxNLocator, NullLocator

    axis = ax.xaxis if which == "x" else ax.yaxis
    (ax.set_xscale if which == "x" else ax.set_yscale)("log")
    low, high = ax.get_xlim() if which == "x" else ax.get_ylim()
    if high > 1e3 * low:
        return
    even = MaxNLocator(5, steps=[1, 2, 5, 10])
    axis.set_major_locator(even if high < 10.0 * low else LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_locator(NullLocator())


@dataclass(frozen=True)
class PlotParameter:
    """A parameter along an axis of a figure.

    Attributes
    ----------
    stored : StoredParameter
        Name, unit and scale in the dataset.
    symbol : str
        What titles call it.
    unit : str
        Unit of the figure; empty for none.
    factor : float
        From the dataset's unit to the figure's.
    """

    stored: StoredParameter
    symbol: str
    unit: str
    factor: float = 1.0

    @property
    def name(self) -> str:
        """Name of its dimension."""
        return self.stored.name

    @property
    def key(self) -> str:
        """Flat name of its estimate."""
        return self.stored.key

    def label(self, calibration: xr.Dataset) -> str:
        """Return the label of an axis; that of σ_F says how often the force is drawn."""
        if self.symbol == DRAG.symbol:
            return DRAG_LABEL
        if self.symbol == FORCE.symbol:
            return force_label(calibration)
        return f"{self.symbol} ({self.unit})" if self.unit else self.symbol

    def values(self, calibration: xr.Dataset, prefix: str = "") -> Floats:
        """Return a variable of the parameter in the figure's unit: its axis, its estimates."""
        variable = calibration[f"{prefix}{self.name}"]
        if self.factor != 1.0:
            return in_unit(variable, self.unit, stored=self.stored.unit)
        return np.asarray(variable.values, dtype=np.float64)

    def best(self, calibration: xr.Dataset) -> float:
        """Return the estimate in the figure's unit, or raise `InputError`."""
        return self.factor * float(required_fact(calibration, self.key))

    def words(self, value: float) -> str:
        """Return a value of the dataset with its unit, for a sentence."""
        return f"{self.symbol} = {self._number(value)}"

    def title(self, value: float) -> str:
        """Return the same for the title of a panel: a name in words has a line of its own."""
        if self in (DRAG, FORCE):
            return self.words(value)
        return f"{self.symbol}\n= {self._number(value)}"

    def _number(self, value: float) -> str:
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.factor * value:.3g}{unit}"

    def scale(self, ax: Axes, which: Literal["x", "y"]) -> None:
        """Give an axis of a figure that has its limits the parameter's scale."""
        if self.stored.scale == "log":
            logarithmic(ax, which)


DRAG = PlotParameter(StoredParameter("drag_coefficient", "1", "C_d", "linear"), "$C_d$", "")
FORCE = PlotParameter(
    StoredParameter("force_std", "N", "sigma_F", "linear"), r"$\sigma_F$", "mN", 1e3
)
"""The stochastic force, shown in millinewtons."""


def plot_parameters(calibration: xr.Dataset) -> tuple[PlotParameter, ...]:
    """Return the parameters of a calibration, in the order of its dimensions."""
    if is_block(calibration):
        return DRAG, FORCE
    return tuple(
        PlotParameter(
            stored, stored.label, "" if stored.unit == "1" else raised_powers(stored.unit)
        )
        for stored in stored_parameters(calibration)
    )


def parameter_named(calibration: xr.Dataset, name: str | None) -> PlotParameter:
    """Return the parameter of a name, the first when there is none.

    Raises
    ------
    InputError
        When the calibration has no parameter of that name.
    """
    known = {one.name: one for one in plot_parameters(calibration)}
    chosen = next(iter(known)) if name is None else name
    if chosen not in known:
        raise InputError(f"parameter='{chosen}': choose one of {', '.join(known)}")
    return known[chosen]


def plane_of(calibration: xr.Dataset) -> tuple[PlotParameter, PlotParameter]:
    """Return the two parameters of a plane.

    Raises
    ------
    InputError
        When the calibration has one parameter, or more than two.
    """
    found = plot_parameters(calibration)
    if len(found) != 2:
        raise InputError(
            f"the calibration has {len(found)} parameter{'' if len(found) == 1 else 's'}, and a "
            "map shows two: plot_distance_profile draws the distance along one"
        )
    return found[0], found[1]
