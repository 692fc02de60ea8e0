"""The velocity field in the tank: the block's own, or the water's after correction (Fig. 2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError
from driftwalk.plot.parts import style
from driftwalk.plot.parts.arena import arena_of, draw_arena, label_position
from driftwalk.plot.parts.labels import in_unit
from driftwalk.schema import FLAGS, check_flow_field

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colorbar import Colorbar

Field = Literal["water", "block"]
COMPONENTS: dict[Field, tuple[str, str]] = {"water": ("u", "v"), "block": ("u_block", "v_block")}
SPEED_LABEL = "speed (cm/s)"


def plot_flow(
    flow: xr.Dataset,
    ax: Axes | None = None,
    *,
    field: Field = "water",
    arena: Mapping[str, Any] | str | None = None,
    speed_limit: float | None = None,
    colorbar: Literal["beside", "none"] = "beside",
) -> Axes:
    """Draw a velocity field: speed as colour, direction as arrows, in cm and cm/s.

    Nodes that were measured are plain, nodes that were filled are hatched with grey arrows, nodes
    outside the tank are blank. A field that changes in time is drawn as its mean over time.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field`, or a `fit` with one flow.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    field : {"water", "block"}
        The water's velocity, or the mean velocity of the block in each cell before the correction
        for its inertia.
    arena : mapping or str, optional
        Outline of the tank; default: the dataset's own.
    speed_limit : float, optional
        Top of the colour scale [m/s], so that two fields can share it; default: the largest speed
        that was measured. Filled nodes may be faster: the colour bar then ends in a tip.
    colorbar : {"beside", "none"}
        Whether to add a colour bar.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When `field` is not one of the two, or the dataset has no block velocity.

    Examples
    --------
    >>> from driftwalk.schema import build_flow_field
    >>> ones = [[1.0, 1.0], [1.0, 1.0]]
    >>> flow = build_flow_field([0.0, 0.1], [0.0, 0.1], u=ones, v=ones, flag=ones)
    >>> plot_flow(flow).get_xlabel()
    'x (cm)'
    """
    if "flow" in flow.dims:
        raise InputError(
            f"the fit has {flow.sizes['flow']} flows: draw one, "
            "such as dw.fitted_flow(fit, interval=0)"
        )
    u, v, flag = velocity_of(flow, field)
    x, y = (in_unit(flow[axis], "cm", stored="m") for axis in ("x", "y"))
    ax = style.axes_or_new(ax, layout="compressed")
    speed = np.hypot(u, v)
    filled = (flag == FLAGS["filled"]) & np.isfinite(speed)
    top = 100.0 * (top_speed(flow, field) if speed_limit is None else speed_limit)
    tank = arena_of(flow, arena)
    shown, hatched = (speed, filled) if tank is None else _to_the_wall(speed, filled, flag)
    mesh = style.speed_mesh(ax, x, y, shown, top or 1.0)
    drawn = [mesh, *_hatch_cells(ax, x, y, hatched), *_draw_arrows(ax, x, y, u, v, filled)]
    if (outline := draw_arena(ax, tank)) is not None:
        # Cells at the wall reach over it by up to a cell; what is drawn ends at the wall.
        for artist in drawn:
            artist.set_clip_path(outline)
    label_position(ax)
    if colorbar == "beside":
        add_speed_bar(mesh, ax)
    return ax


def add_speed_bar(mesh: ScalarMappable, axes: Axes | list[Axes]) -> Colorbar:
    """Add the colour bar of a drawn velocity field, with a tip where filled nodes are faster."""
    fastest = np.nanmax(np.asarray(mesh.get_array(), dtype=np.float64), initial=0.0)
    beyond = bool(fastest > 1.001 * mesh.get_clim()[1])
    return style.add_colorbar(mesh, axes, SPEED_LABEL, extend="max" if beyond else "neither")


def top_speed(flow: xr.Dataset, field: Field) -> float:
    """Return the largest measured speed [m/s]: a guess must not make what was measured pale."""
    u, v, flag = velocity_of(flow, field)
    speed = np.hypot(u, v) / 100.0
    known = np.isfinite(speed) & (flag != FLAGS["filled"])
    return float(np.max(speed[known] if known.any() else np.nan_to_num(speed), initial=0.0))


def _to_the_wall(speed: Floats, filled: Bools, flag: npt.NDArray[np.int8]) -> tuple[Floats, Bools]:
    """Return the field with the cells that the wall cuts, as the next node inside has them.

    Their centres lie outside of the tank; without them white corners stay inside of the wall.
    """
    from scipy.ndimage import distance_transform_edt

    outside = flag == FLAGS["outside"]
    if not outside.any() or outside.all():
        return speed, filled
    off, (row, column) = distance_transform_edt(outside, return_indices=True)
    # One cell further, corners included.
    cut = outside & (off < 1.5)
    return np.where(cut, speed[row, column], speed), filled | (cut & filled[row, column])


def velocity_of(flow: xr.Dataset, field: Field) -> tuple[Floats, Floats, npt.NDArray[np.int8]]:
    """Return u, v [cm/s], NaN where nothing is to be drawn, and the flag, shapes (ny, nx)."""
    check_flow_field(flow)
    if field not in COMPONENTS:
        raise InputError(f"field='{field}' is not a field: choose one of {', '.join(COMPONENTS)}")
    absent = [name for name in COMPONENTS[field] if name not in flow]
    if absent:
        raise InputError(
            f"the flow field has no {' and '.join(absent)}: it was not made from a recording; "
            "draw field='water'"
        )
    components = [flow[name] for name in COMPONENTS[field]]
    flag = flow.get("flag")
    if "time" in flow.dims:
        components = [component.mean("time", keep_attrs=True) for component in components]
        flag = flag.max("time") if flag is not None else None
    u, v = (in_unit(component, "cm/s", stored="m s-1") for component in components)
    flags = np.full(u.shape, FLAGS["measured"], np.int8) if flag is None else flag.values
    outside = flags == FLAGS["outside"]
    return np.where(outside, np.nan, u), np.where(outside, np.nan, v), flags


def _hatch_cells(ax: Axes, x: Floats, y: Floats, chosen: Bools) -> list[Artist]:
    """Hatch the chosen cells as one patch, so that the pattern runs on across cells."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if not chosen.any():
        return []
    half_x, half_y = (x[1] - x[0]) / 2.0, (y[1] - y[0]) / 2.0
    rows, columns = np.nonzero(chosen)
    cell = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * (half_x, half_y)
    corners = cell[None] + np.column_stack([x[columns], y[rows]])[:, None]
    codes = np.tile([Path.MOVETO, *[Path.LINETO] * 3, Path.CLOSEPOLY], rows.size)
    patch = PathPatch(
        Path(corners.reshape(-1, 2), codes),
        facecolor="none",
        edgecolor=style.HATCH,
        linewidth=0.0,
        hatch="/////",
        label="filled, not measured",
        zorder=2,
    )
    return [ax.add_patch(patch)]


def _draw_arrows(
    ax: Axes, x: Floats, y: Floats, u: Floats, v: Floats, filled: Bools
) -> list[Artist]:
    """Draw every n-th arrow, the longest about one and a half arrow spacings."""
    # About 17 arrows lie across the field.
    stride = max(1, round(max(x.size, y.size) / 17))
    thin = (slice(stride // 2, None, stride), slice(stride // 2, None, stride))
    speed = np.hypot(u[thin], v[thin])
    # An arrow too short to show its direction would be drawn as a dot.
    shown = speed > 0.03 * np.nanmax(speed, initial=0.0)
    if not shown.any():
        return []
    scale = np.percentile(speed[shown], 98.0) / (1.5 * stride * (x[1] - x[0]))
    grid = (*np.meshgrid(x, y), u, v)
    drawn: list[Artist] = []
    for chosen, color, label in (
        (~filled[thin], style.INK, "measured"),
        (filled[thin], style.MUTED, "filled"),
    ):
        if (here := shown & chosen).any():
            drawn.append(
                ax.quiver(
                    *(part[thin][here] for part in grid),
                    color=color, angles="xy", scale_units="xy", scale=scale, pivot="middle",
                    width=0.0042, headwidth=3.6, headlength=4.2, headaxislength=3.8,
                    label=f"{label} velocity", zorder=3,
                )
            )  # fmt: skip
    return drawn
