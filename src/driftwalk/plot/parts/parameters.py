"""The parameters of a calibration as figures name and scale them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.plot.parts.labels import (
    DRAG_LABEL,
    MN_PER_N,
    force_interval_text,
    force_label,
    in_unit,
    number_fact,
    required_fact,
)
from driftwalk.schema.parameters import StoredParameter, is_block, stored_parameters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]


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

    def values(self, calibration: xr.Dataset, prefix: str = "") -> Array:
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

    def scale(self, ax: Axes, which: str) -> None:
        """Give an axis of a figure the parameter's scale."""
        if self.stored.is_log:
            (ax.set_xscale if which == "x" else ax.set_yscale)("log")


DRAG = PlotParameter(StoredParameter("drag_coefficient", "1", "C_d", "linear"), "$C_d$", "")
FORCE = PlotParameter(
    StoredParameter("force_std", "N", "sigma_F", "linear"), r"$\sigma_F$", "mN", MN_PER_N
)


def plot_parameters(calibration: xr.Dataset) -> tuple[PlotParameter, ...]:
    """Return the parameters of a calibration, in the order of its dimensions."""
    if is_block(calibration):
        return DRAG, FORCE
    return tuple(
        PlotParameter(stored, stored.label, "" if stored.unit == "1" else stored.unit)
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


def drawn_anew(calibration: xr.Dataset) -> str:
    """Return "redrawn every 16 ms" for the block's force, "" for other models."""
    if not np.isfinite(number_fact(calibration, "force_interval_s")):
        return ""
    return force_interval_text(calibration)
