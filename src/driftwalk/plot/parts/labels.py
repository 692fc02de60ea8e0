"""Values and labels in the units that a reader of a figure expects (cm, mm, mN, degrees)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.schema.answers.facts import facts_of

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
MN_PER_N = FACTORS["N", "mN"]


def in_unit(variable: xr.DataArray, unit: str, *, stored: str) -> npt.NDArray[np.float64]:
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


def force_label(calibration: xr.Dataset) -> str:
    """Return the label of an axis of σ_F [mN], with the interval that gives it a meaning.

    Only σ_F² times the interval at which the force is redrawn is identifiable, so σ_F is never
    shown without it.
    """
    return r"stochastic force $\sigma_F$ (mN)," + f"\n{force_interval_text(calibration)}"


def force_interval_text(calibration: xr.Dataset) -> str:
    """Return "redrawn every 16 ms" for the force interval of the calibration."""
    interval_s = required_fact(calibration, "force_interval_s")
    return f"redrawn every {1e3 * float(interval_s):.4g} ms"


DRAG_LABEL = r"drag coefficient $C_d$"
LENGTH_LABEL = "step length (mm)"
# The paper says step angle for what the field calls turning angle.
ANGLE_LABEL = "turning (step) angle (°)"


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
    stored = facts_of(calibration).get(name)
    if stored is None:
        return None
    ends = np.asarray(stored, dtype=np.float64)
    if ends.shape != (2,) or not np.isfinite(ends).all():
        return None
    return float(ends[0]), float(ends[1])


def number_fact(dataset: xr.Dataset, name: str) -> float:
    """Return a number of the facts, NaN when it is absent."""
    return float(facts_of(dataset).get(name, math.nan))


def ratio_axis(ax: Axes) -> None:
    """Make the horizontal axis logarithmic, with plain numbers that have room: 0.5, 1, 2."""
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    ax.xaxis.set_minor_locator(NullLocator())
