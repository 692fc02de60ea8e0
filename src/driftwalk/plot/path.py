"""The path of one body in the tank, or an excerpt of it (Fig. 5a)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.plot.parts.arena import CM_PER_M, arena_of, draw_arena, label_position
from driftwalk.plot.parts.style import INK, TIME_COLORMAP, add_colorbar, axes_or_new
from driftwalk.schema import Track, body_track

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

# Neighbours further apart than this many usual intervals have a gap between them.
GAP_INTERVALS = 1.5
# Beyond this many segments a vector file holds a picture of the path, not its every segment.
VECTOR_SEGMENTS = 3000


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
    ax = axes_or_new(ax, layout="compressed")
    points = CM_PER_M * np.column_stack([track.x, track.y])
    joined = joined_neighbours(track.time)
    segments = np.stack([points[:-1][joined], points[1:][joined]], axis=1)
    path = LineCollection(
        list(segments), cmap=TIME_COLORMAP, linewidths=0.9, capstyle="round", label="path"
    )
    path.set_array(track.time[:-1][joined])
    path.set_clim(track.time[0], track.time[-1])
    path.set_rasterized(len(segments) > VECTOR_SEGMENTS)
    ax.add_collection(path)
    ax.plot(*points[0], "o", ms=4.5, mfc="white", mec=INK, mew=1.0, zorder=5, label="start")
    if draw_arena(ax, arena_of(trajectory, arena)) is None:
        ax.autoscale_view()
    label_position(ax)
    if colorbar == "beside":
        add_colorbar(path, ax, "time (s)")
    return ax


def joined_neighbours(time: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Return, for samples i and i + 1, whether no gap lies between them; shape (n - 1,)."""
    interval = np.diff(time)
    joined: npt.NDArray[np.bool_] = interval <= GAP_INTERVALS * np.median(interval)
    return joined


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
