"""The axes of a sensitivity study on a page: their words, units and places."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from driftwalk.page.number_words import quantity
from driftwalk.page.parts import axis, require, value_of

if TYPE_CHECKING:
    import xarray as xr

AXES: Final = {
    "drag_coefficient": ("drag coefficient C_d", "1", ""),
    "force_std": ("stochastic force σ_F", "N", "_N"),
    "tank_diameter": ("tank diameter", "m", "_m"),
    "blocks": ("number of blocks", "1", ""),
}
"""Label, unit, and what an attribute's name has more, in the order from x to y."""
MAP_AXES: Final = 2


def require_axes(sensitivity: xr.Dataset) -> None:
    """Raise `InputError` unless the study has its distances and the values of its axes."""
    require(sensitivity, "l1_distance")
    require(sensitivity, *map(str, sensitivity["l1_distance"].dims))


def map_axes(part: xr.Dataset) -> tuple[str, str | None]:
    """Return which axis is x and which is y."""
    ranked = ranked_axes([str(dim) for dim in part["l1_distance"].dims])
    return ranked[0], ranked[1] if len(ranked) > 1 else None


def ranked_axes(names: Sequence[str]) -> list[str]:
    """Return axes in the order from x to y: the drag lies along x, as in the figures of a run.

    Examples
    --------
    >>> ranked_axes(["latching", "force_std", "drag_coefficient"])
    ['drag_coefficient', 'force_std', 'latching']
    """
    order = [*AXES]
    return sorted(names, key=lambda name: order.index(name) if name in order else len(order))


def is_words(part: xr.Dataset, name: str) -> bool:
    """Return whether the values of an axis are words, which have no place on a scale."""
    return part[name].dtype.kind not in "iuf"


def axis_of(part: xr.Dataset, name: str) -> dict[str, Any]:
    """Return an axis as maps have it, with its label, unit and values."""
    words, unit, _ = AXES.get(name, (axis_words(name), "1", ""))
    every = value_of(part, "force_interval_s")
    if name == "force_std" and every is not None:
        words += f", redrawn every {quantity(every, 's')}"
    return axis(name, words, unit, part[name].values)


def axis_words(name: str) -> str:
    """Return the name of an axis as it stands in a sentence."""
    return "stochastic force" if name == "force_std" else name.replace("_", " ")


def value_words(name: str, value: Any) -> str:
    """Return a value of an axis with its unit, as it stands in a sentence."""
    if isinstance(value, str):
        return value.replace("_", " ")
    return quantity(float(value), AXES.get(name, ("", "1", ""))[1])
