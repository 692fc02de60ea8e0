"""The score 1 − D over two parameters, and its optimum (the paper's Fig. 6 for the block)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import interval_of, number_fact, plane_of, require_variables

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.colorbar import Colorbar

# CF flag of `status` -> what the legend says, and the hatch of its cells.
CAUSES: dict[int, tuple[str, str]] = {
    1: ("no motion (D = 1)", "//////"),
    2: ("not finite", "xxxxxx"),
    4: ("too few steps", "------"),
}
UNKNOWN_CAUSE = ("not computed", "\\\\\\\\\\\\")
OPTIMUM_LABEL, REGION_LABEL = "optimum and interval", "90 % region"
LEGEND_ORDER = [
    OPTIMUM_LABEL,
    REGION_LABEL,
    *(name for name, _ in (*CAUSES.values(), UNKNOWN_CAUSE)),
]


def plot_ks_map(
    calibration: xr.Dataset,
    ax: Axes | None = None,
    *,
    colorbar: Literal["beside", "none"] = "beside",
) -> Axes:
    """Draw the score 1 − D over the whole box that was searched.

    The optimum carries bars of its interval and the outline of its 90 % region. A setting that
    gave no distance is hatched by its cause, never left out; one in which nothing moves is as far
    from the recording as can be (D = 1). The line in the colour bar is the score that two runs of
    one and the same model reach (noise floor).

    Parameters
    ----------
    calibration : xarray.Dataset
        Result of `driftwalk.calibration.calibrate`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    colorbar : {"beside", "none"}
        Whether to add a colour bar.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset lacks the map, the optimum or, of the block, the force interval; when it
        has not two parameters.

    Examples
    --------
    ``plot_ks_map(calibration).figure.savefig("ks_map.png")``
    """
    require_variables(
        calibration, "ks_distance", "status", *(one.name for one in plane_of(calibration))
    )
    ax = style.axes_or_new(ax)
    mesh, _ = _draw_scores(ax, calibration, prefix="")
    mesh.set_clim(0.0, 1.0)
    _finish(ax, calibration, mesh, colorbar)
    return ax


def plot_refined_map(
    calibration: xr.Dataset,
    ax: Axes | None = None,
    *,
    colorbar: Literal["beside", "none"] = "beside",
) -> Axes:
    """Draw the score 1 − D of the refined map near the optimum, with its fitted surface.

    White contour lines, repeated in the colour bar, are those of the smooth surface fitted to the
    map.

    Parameters
    ----------
    calibration : xarray.Dataset
        Result of `driftwalk.calibration.calibrate`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    colorbar : {"beside", "none"}
        Whether to add a colour bar.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset lacks the refined map.

    Examples
    --------
    ``plot_refined_map(calibration).figure.savefig("refined.png")``
    """
    from matplotlib.ticker import MaxNLocator

    require_variables(calibration, "refined_ks_distance", "refined_surface")
    ax = style.axes_or_new(ax)
    mesh, score = _draw_scores(ax, calibration, prefix="refined_")
    if np.isfinite(score).any():
        low, high = np.nanquantile(score, [0.02, 1.0])
        high = np.nanmax([high, 1.0 - number_fact(calibration, "noise_floor")])
        mesh.set_clim(low, high + 0.06 * (high - low))
    across, up = plane_of(calibration)
    dims = (f"refined_{up.name}", f"refined_{across.name}")
    surface = 1.0 - calibration["refined_surface"].transpose(*dims).values
    lines = None
    if min(surface.shape) >= 2 and np.isfinite(surface).any():
        at_x, at_y = (one.values(calibration, "refined_") for one in (across, up))
        # Only levels of the colour bar: a polynomial may leave what a score can be.
        low, high = mesh.get_clim()
        levels = np.asarray(MaxNLocator(7).tick_values(low, high))
        lines = ax.contour(
            *_finely(at_x, at_y, surface), levels=levels[(low < levels) & (levels < high)],
            colors="white", linewidths=0.6,
        )  # fmt: skip
    x_edge, y_edge = edges_of(calibration, prefix="refined_")
    ax.set(xlim=x_edge[[0, -1]], ylim=y_edge[[0, -1]])
    bar = _finish(ax, calibration, mesh, colorbar)
    if bar is not None and lines is not None:
        bar.add_lines(lines)
    return ax


def _finely(x: Floats, y: Floats, surface: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a surface on a grid so fine that its contours are smooth: a cubic spline through it.

    The surface that was fitted is a polynomial, which the spline follows more closely than a line
    is wide. Where it is not known everywhere its own grid stays.
    """
    from scipy.interpolate import RectBivariateSpline

    # A cubic spline needs four points each way.
    if not np.isfinite(surface).all() or min(surface.shape) < 4:
        return x, y, surface
    fine_x, fine_y = (
        np.interp(np.linspace(0.0, axis.size - 1.0, 10 * axis.size), np.arange(axis.size), axis)
        for axis in (x, y)
    )
    return fine_x, fine_y, RectBivariateSpline(y, x, surface)(fine_y, fine_x)


def edges_of(calibration: xr.Dataset, *, prefix: str) -> tuple[Floats, Floats]:
    """Return the edges of the cells of the coarse or refined map, in the figure's units."""
    edges = []
    for one in plane_of(calibration):
        center = one.values(calibration, prefix)
        is_log = one.stored.scale == "log"
        edges.append(10.0 ** cell_edges(np.log10(center)) if is_log else cell_edges(center))
    return edges[0], edges[1]


def cell_edges(center: Floats) -> Floats:
    """Return the edges of the cells around grid points: midpoints, and as far out at the ends.

    Examples
    --------
    >>> cell_edges(np.array([0.0, 1.0, 3.0])).tolist()
    [-0.5, 0.5, 2.0, 4.0]
    """
    if center.size < 2:
        half = 0.5 * abs(center) + 0.05 * (center == 0.0)
        return np.concatenate([center - half, center + half])
    middle = (center[1:] + center[:-1]) / 2.0
    first, last = 2.0 * center[0] - middle[0], 2.0 * center[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])


def draw_optimum(ax: Axes, calibration: xr.Dataset, *, color: str = "white") -> None:
    """Mark the estimate with bars of its intervals in the plane of the parameters."""
    places, bars = [], []
    for parameter in plane_of(calibration):
        best, factor = parameter.best(calibration), parameter.factor
        ends = interval_of(calibration, f"{parameter.key}_interval")
        places.append([best])
        # An estimate may lie on the end of its interval: rounding must not make a bar negative.
        bars.append(
            None
            if ends is None
            else [[max(best - factor * ends[0], 0.0)], [max(factor * ends[1] - best, 0.0)]]
        )
    outline = style.outlined(2.2, style.INK if color == "white" else "white")
    ax.errorbar(
        places[0], places[1], xerr=bars[0], yerr=bars[1], fmt="o", ms=3.5, color=color,
        elinewidth=1.0, capsize=0.0, zorder=6, label=OPTIMUM_LABEL, path_effects=outline,
    )  # fmt: skip


def draw_region(ax: Axes, calibration: xr.Dataset, **look: Any) -> None:
    """Outline the 90 % region of the estimate, where there is one."""
    from matplotlib.patches import Polygon

    if (outline := region_of(calibration)) is not None:
        ax.add_patch(
            Polygon(
                outline, closed=True, facecolor="none", edgecolor=style.INK, label=REGION_LABEL,
                **look,
            )
        )  # fmt: skip


def region_of(calibration: xr.Dataset) -> Floats | None:
    """Return the vertices of the 90 % region in the figure's units, None when there is none."""
    plane = plane_of(calibration)
    if any(f"region_{one.name}" not in calibration for one in plane):
        return None
    vertices = np.column_stack([one.values(calibration, "region_") for one in plane])
    vertices = vertices[np.isfinite(vertices).all(axis=1)]
    return vertices if len(vertices) >= 3 else None


def _draw_scores(ax: Axes, calibration: xr.Dataset, *, prefix: str) -> tuple[QuadMesh, Floats]:
    """Draw the scores of a map, and hatch every cell that has a cause, or no distance."""
    across, up = plane_of(calibration)
    dims = (f"{prefix}{up.name}", f"{prefix}{across.name}")
    score = 1.0 - calibration[f"{prefix}ks_distance"].transpose(*dims).values
    edges = edges_of(calibration, prefix=prefix)
    mesh = ax.pcolormesh(*edges, np.ma.masked_invalid(score), cmap=style.SCORE_COLORMAP)
    mesh.set_rasterized(True)
    status = np.zeros(score.shape, dtype=np.int64)
    if f"{prefix}status" in calibration:
        stored = calibration[f"{prefix}status"].transpose(*dims).values
        status = np.asarray(np.nan_to_num(stored), dtype=np.int64)
    named: set[str] = set()
    for row, column in zip(*np.nonzero((status != 0) | ~np.isfinite(score)), strict=True):
        causes = [cause for bit, cause in CAUSES.items() if status[row, column] & bit]
        hatch_cell(ax, edges, (column, row), cause=(*causes, UNKNOWN_CAUSE)[0], named=named)
    return mesh, score


def hatch_cell(
    ax: Axes,
    edges: tuple[Floats, Floats],
    cell: tuple[int, int],
    *,
    cause: tuple[str, str],
    named: set[str],
) -> None:
    """Cover a cell (column, row) by a hatched rectangle; a cause is named once, for the legend."""
    from matplotlib.patches import Rectangle

    (left, right), (low, high) = (edge[at : at + 2] for edge, at in zip(edges, cell, strict=True))
    name, hatch = cause
    ax.add_patch(
        Rectangle(
            (left, low), right - left, high - low, facecolor="white", edgecolor=style.INK,
            linewidth=0.0, hatch=hatch, label="" if name in named else name, gid=name,
        )
    )  # fmt: skip
    named.add(name)


def _finish(ax: Axes, calibration: xr.Dataset, mesh: QuadMesh, colorbar: str) -> Colorbar | None:
    """Mark the optimum, label the axes, and add the colour bar with the line of the noise floor."""
    draw_region(ax, calibration, lw=0.9, zorder=5, path_effects=style.outlined(2.0))
    draw_optimum(ax, calibration)
    across, up = plane_of(calibration)
    ax.set(xlabel=across.label(calibration), ylabel=up.label(calibration))
    across.scale(ax, "x")
    up.scale(ax, "y")
    if colorbar == "none":
        return None
    floor = number_fact(calibration, "noise_floor")
    bar = style.add_colorbar(mesh, ax, "score 1 − D")
    if np.isfinite(floor):
        bar.ax.axhline(1.0 - floor, color=style.INK, lw=1.4)
        bar.set_label("score 1 − D (line: noise floor)")
    return bar
