"""The tank: the path of one body (Fig. 5a), and its blocks at one or several moments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.plot.parts import style
from driftwalk.plot.parts.arena import (
    CM_PER_M,
    arena_of,
    draw_arena,
    draw_scale_bar,
    label_position,
)
from driftwalk.plot.parts.outcome_classes import empty_bars, poles_of, set_pole_bars
from driftwalk.plot.parts.style import PALETTE
from driftwalk.schema import Track, body_track
from driftwalk.schema.check import require_kind

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

POSES: Final = ("x", "y", "theta", "assembly")

# Neighbours further apart than this many usual intervals have a gap between them; chosen by hand.
GAP_INTERVALS = 1.5


def plot_trajectory(
    trajectory: xr.Dataset,
    ax: Axes | None = None,
    *,
    body: str | None = None,
    start: float | None = None,
    stop: float | None = None,
    arena: Mapping[str, Any] | str | None = None,
    colorbar: Literal["beside", "none"] = "beside",
) -> Axes:
    """Draw the path of one body in cm, coloured by time, with its first position marked.

    A gap in the recording stays a gap: positions further apart in time than 1.5 usual intervals
    are not joined.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    body : str, optional
        Which body; may be left out when there is only one.
    start, stop : float, optional
        Times [s] between which the path is drawn, both included; default: all of it.
    arena : mapping or str, optional
        Outline of the tank; default: the dataset's own.
    colorbar : {"beside", "none"}
        Whether to add a colour bar of the time.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When there are fewer than 2 positions between `start` and `stop`.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> plot_trajectory(build_trajectory([0, 0.1, 0.2], [0, 0.01, 0.02], [0, 0, 0])).get_ylabel()
    'y (cm)'
    """
    from matplotlib.collections import LineCollection

    track = _excerpt(body_track(trajectory, body), start, stop)
    ax = style.axes_or_new(ax, layout="compressed")
    points = CM_PER_M * np.column_stack([track.x, track.y])
    interval = np.diff(track.time)
    joined = interval <= GAP_INTERVALS * np.median(interval)
    segments = np.stack([points[:-1][joined], points[1:][joined]], axis=1)
    path = LineCollection(
        list(segments), cmap=style.TIME_COLORMAP, linewidths=0.9, capstyle="round", label="path"
    )
    path.set_array(track.time[:-1][joined])
    path.set_clim(track.time[0], track.time[-1])
    # Of a longer path a vector file holds a picture of the path, not its every segment.
    path.set_rasterized(len(segments) > 3000)
    ax.add_collection(path)
    ax.plot(*points[0], "o", ms=4.5, mfc="white", mec=style.INK, mew=1.0, zorder=5, label="start")
    if draw_arena(ax, arena_of(trajectory, arena)) is None:
        ax.autoscale_view()
    label_position(ax)
    if colorbar == "beside":
        style.add_colorbar(path, ax, "time (s)")
    return ax


def _excerpt(track: Track, start: float | None, stop: float | None) -> Track:
    first = -np.inf if start is None else start
    last = np.inf if stop is None else stop
    inside = (track.time >= first) & (track.time <= last)
    if inside.sum() < 2:
        raise InputError(
            f"fewer than 2 positions between start={first:g} s and stop={last:g} s: the body was "
            + (
                f"seen from {track.time[0]:g} s to {track.time[-1]:g} s"
                if track.time.size
                else "never seen"
            )
        )
    return Track(*(values[inside] for values in track))


def plot_blocks(
    dataset: xr.Dataset, ax: Axes | None = None, *, run: int = 0, time: float | None = None
) -> Axes:
    """Draw the blocks of one run in the tank at one moment, coloured by assembly.

    Parameters
    ----------
    dataset : xarray.Dataset
        An `assembly`, of which the end is drawn, or an `assembly_path`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    run : int
        Which run, counted from 0.
    time : float, optional
        Moment [s] in an `assembly_path`: the last sample up to it is drawn; default: the last of
        all. An `assembly` has none.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on, in cm.

    Raises
    ------
    InputError
        When the dataset is of another kind or has no such run or moment.

    Examples
    --------
    ``plot_blocks(path, run=3, time=60.0)``
    """
    one = _one_run(dataset, run)
    if "time" in one.dims:
        one = one.isel(time=_sample_at(one, time))
    elif time is not None:
        raise InputError("an 'assembly' holds the end of its runs only: leave out time")
    ax = style.axes_or_new(ax, layout="compressed")
    _draw_blocks(ax, one)
    if draw_arena(ax, arena_of(dataset)) is None:
        ax.autoscale_view()
    label_position(ax)
    if "time" in one.coords:
        ax.set_title(f"t = {float(one['time']):.4g} s", loc="left")
    return ax


def plot_film_strip(
    path: xr.Dataset, axes: Any = None, *, run: int = 0, count: int = 6
) -> list[Axes]:
    """Draw a run as a strip of moments, equally far apart from its start to its end.

    Parameters
    ----------
    path : xarray.Dataset
        An `assembly_path`.
    axes : sequence of matplotlib.axes.Axes, optional
        Where to draw, one per moment; a new figure when left out.
    run : int
        Which run, counted from 0.
    count : int
        Number of moments, at least 2.

    Returns
    -------
    list of matplotlib.axes.Axes
        The axes, one per moment.

    Raises
    ------
    InputError
        When the dataset is of another kind or has no such run, or the count does not fit.

    Examples
    --------
    ``plot_film_strip(path, run=0, count=8)[0].figure.savefig("strip.png")``
    """
    one = _one_run(path, run, kind="assembly_path")
    if count < 2:
        raise InputError(f"a strip has at least 2 moments, got {count}")
    # A row has six moments at most.
    rows = -(-count // 6)
    columns = -(-count // rows)
    height_mm = rows * (style.DOUBLE_COLUMN_MM / columns + 5.0)
    panels = style.axes_grid_or_new(axes, count=count, columns=columns, height_mm=height_mm)
    times = one["time"].values
    for ax, moment in zip(panels, np.linspace(times[0], times[-1], count), strict=True):
        plot_blocks(path, ax, run=run, time=float(moment))
        ax.set_axis_off()
    draw_scale_bar(panels[0])
    return panels


def block_corners(dataset: xr.Dataset) -> Floats:
    """Return the corners of every block.

    Parameters
    ----------
    dataset : xarray.Dataset
        Poses ``x``, ``y`` [m] and ``theta`` [rad], last dimension ``block``, and the attribute
        ``block_side_m``; of rectangles ``block_width_m`` too.

    Returns
    -------
    numpy.ndarray, shape (..., block, 4, 2)
        Corners [cm], counter-clockwise from the one between the faces -x and -y; of discs 48 points
        of the outline.

    Raises
    ------
    InputError
        When the side of the blocks is not known.
    """
    if "block_side_m" not in dataset.attrs:
        raise InputError(
            "the dataset has no attribute 'block_side_m': the size of the blocks is unknown"
        )
    half = CM_PER_M * float(dataset.attrs["block_side_m"]) / 2.0
    x, y, theta = (
        np.asarray(dataset[name].transpose(..., "block").values, dtype=np.float64)
        for name in POSES[:3]
    )
    own = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    if "block_width_m" in dataset.attrs:
        own[:, 1] *= dataset.attrs["block_width_m"] / dataset.attrs["block_side_m"]
    if dataset.attrs.get("block_shape") == "disc":
        angle = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
        own = half * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    cos, sin = np.cos(theta)[..., None], np.sin(theta)[..., None]
    corner_x = CM_PER_M * x[..., None] + cos * own[:, 0] - sin * own[:, 1]
    corner_y = CM_PER_M * y[..., None] + sin * own[:, 0] + cos * own[:, 1]
    return np.stack([corner_x, corner_y], axis=-1)


def _one_run(dataset: xr.Dataset, run: int, *, kind: str = "") -> xr.Dataset:
    """Return the poses and assemblies of one run."""
    require_kind(dataset, kind or "assembly assembly_path")
    missing = [name for name in POSES if name not in dataset]
    if missing:
        raise InputError(f"the dataset lacks {', '.join(missing)}: nothing to draw")
    runs = dataset.sizes["run"]
    if not 0 <= run < runs:
        raise InputError(f"run={run}: the dataset has {runs} runs, counted from 0")
    shown = [*POSES, *(["pole"] if "pole" in dataset else [])]
    one: xr.Dataset = dataset[shown].isel(run=run)
    return one.transpose("time", "block", ..., missing_dims="ignore")


def _sample_at(one: xr.Dataset, time: float | None) -> int:
    """Return the index of the last sample up to a moment; a hair of rounding is forgiven."""
    times = np.asarray(one["time"].values, dtype=np.float64)
    moment = times[-1] if time is None else time
    slack = 1e-9 * max(1.0, abs(times[-1]))
    if not times[0] - slack <= moment <= times[-1] + slack:
        raise InputError(f"time={moment:g} s: the run lasts from {times[0]:g} s to {times[-1]:g} s")
    return max(0, int(np.searchsorted(times, moment + slack, side="right")) - 1)


def _draw_blocks(ax: Axes, moment: xr.Dataset) -> None:
    from matplotlib.collections import PolyCollection

    colors = [PALETTE[int(index) % len(PALETTE)] for index in moment["assembly"].values]
    blocks = PolyCollection(
        list(block_corners(moment)),
        facecolors=colors,
        edgecolors=style.INK,
        linewidths=style.edge_width(len(colors)),
        zorder=3,
    )
    ax.add_collection(blocks)
    if (pole := poles_of(moment)) is not None:
        half = CM_PER_M * float(moment.attrs["block_side_m"]) / 2.0
        x, y = (CM_PER_M * moment[name].values for name in "xy")
        bars = empty_bars()
        set_pole_bars(bars, x, y, moment["theta"].values, pole, half)
        ax.add_collection(bars)
