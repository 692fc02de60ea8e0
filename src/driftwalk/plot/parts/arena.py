"""The tank on axes: its outline, from the arena of a dataset, and a bar for the scale."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.plot.parts.labels import FACTORS
from driftwalk.plot.parts.style import INK
from driftwalk.schema.trajectory import read_arena

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

CM_PER_M = FACTORS["m", "cm"]


def arena_of(dataset: xr.Dataset, arena: Mapping[str, Any] | str | None = None) -> dict[str, Any]:
    """Return the arena as a dictionary, empty when it is unknown.

    Parameters
    ----------
    dataset : xarray.Dataset
        Its attribute ``arena`` (JSON text) is used when `arena` is None.
    arena : mapping or str, optional
        ``{"shape": "circle", "diameter_m": 0.3, "center_m": [0, 0]}``, or a rectangle
        (``width_m``, ``height_m``, ``center_m``) or polygon (``vertices_m``), or its JSON text.

    Raises
    ------
    InputError
        When the text is not JSON.
    """
    described = dataset.attrs.get("arena") if arena is None else arena
    return read_arena(described) if described else {}


def arena_patch(arena: Mapping[str, Any]) -> Patch:
    """Return the outline of the arena as a patch in cm, not yet on any axes.

    Raises
    ------
    InputError
        When the shape is unknown or one of its sizes is missing.
    """
    from matplotlib.patches import Circle, Polygon, Rectangle

    style: dict[str, Any] = {"facecolor": "none", "edgecolor": INK, "linewidth": 0.8, "zorder": 4}
    try:
        center = CM_PER_M * np.asarray(arena.get("center_m", (0.0, 0.0)), dtype=np.float64)
        if arena["shape"] == "circle":
            return Circle((center[0], center[1]), CM_PER_M * arena["diameter_m"] / 2.0, **style)
        if arena["shape"] == "rectangle":
            size = CM_PER_M * np.array([arena["width_m"], arena["height_m"]])
            corner = center - size / 2.0
            return Rectangle((corner[0], corner[1]), size[0], size[1], **style)
        if arena["shape"] == "polygon":
            return Polygon(CM_PER_M * np.asarray(arena["vertices_m"]), closed=True, **style)
    except KeyError as error:
        raise InputError(f"the arena lacks {error}: got {dict(arena)}") from error
    raise InputError(
        f"the arena has shape '{arena['shape']}', expected circle, rectangle or polygon"
    )


def draw_arena(ax: Axes, arena: Mapping[str, Any]) -> Patch | None:
    """Draw the outline on axes in cm and frame it, equal aspect; None when there is no arena."""
    ax.set_aspect("equal")
    if not arena:
        return None
    patch = ax.add_patch(arena_patch(arena))
    extent = patch.get_path().get_extents(patch.get_patch_transform())
    margin = 0.03 * max(extent.width, extent.height)
    ax.set_xlim(extent.x0 - margin, extent.x1 + margin)
    ax.set_ylim(extent.y0 - margin, extent.y1 + margin)
    return patch


def label_position(ax: Axes) -> None:
    """Label axes that show positions in the tank, both with the same ticks."""
    from matplotlib.ticker import MaxNLocator

    # A fixed number of ticks: one that follows the size of the axes makes the layout, which
    # depends on the width of the labels, need several passes.
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(nbins=7, steps=[1, 2, 5, 10]))
    ax.set(xlabel="x (cm)", ylabel="y (cm)")


def draw_scale_bar(ax: Axes) -> None:
    """Draw a bar of a round length at the lower left corner of axes in cm."""
    low, high = ax.get_xlim()
    length = 10.0 ** np.floor(np.log10((high - low) / 5.0))
    length *= max(step for step in (1.0, 2.0, 5.0) if step * length <= (high - low) / 5.0)
    y = ax.get_ylim()[0]
    ax.plot([low, low + length], [y, y], color=INK, lw=1.5, clip_on=False, solid_capstyle="butt")
    ax.annotate(
        f"{length:g} cm", (low, y), xytext=(0.0, 2.5), textcoords="offset points",
        va="bottom",
    )  # fmt: skip
