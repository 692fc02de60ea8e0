"""The blocks in the tank: one moment, and a strip of moments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.plot.parts.arena import CM_PER_M, arena_of, draw_arena, label_position
from driftwalk.plot.parts.assembly_labels import PALETTE
from driftwalk.plot.parts.scale_bar import draw_scale_bar
from driftwalk.plot.parts.style import DOUBLE_COLUMN_MM, INK, axes_or_new, new_figure
from driftwalk.schema.check import kind_name

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]
STRIP_COLUMNS: Final = 6
POSES: Final = ("x", "y", "theta", "assembly")


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
    ax = axes_or_new(ax, layout="compressed")
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
    panels = _strip_axes(axes, count)
    times = one["time"].values
    for ax, moment in zip(panels, np.linspace(times[0], times[-1], count), strict=True):
        plot_blocks(path, ax, run=run, time=float(moment))
        ax.set_axis_off()
    draw_scale_bar(panels[0])
    return panels


def block_corners(dataset: xr.Dataset) -> Array:
    """Return the corners of every block.

    Parameters
    ----------
    dataset : xarray.Dataset
        Poses ``x``, ``y`` [m] and ``theta`` [rad], last dimension ``block``, and the attribute
        ``block_side_m``.

    Returns
    -------
    numpy.ndarray, shape (..., block, 4, 2)
        Corners [cm], counter-clockwise from the one between the faces -x and -y.

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
    cos, sin = np.cos(theta)[..., None], np.sin(theta)[..., None]
    corner_x = CM_PER_M * x[..., None] + cos * own[:, 0] - sin * own[:, 1]
    corner_y = CM_PER_M * y[..., None] + sin * own[:, 0] + cos * own[:, 1]
    return np.stack([corner_x, corner_y], axis=-1)


def _one_run(dataset: xr.Dataset, run: int, *, kind: str = "") -> xr.Dataset:
    """Return the poses and assemblies of one run."""
    found = kind_name(dataset) or "a dataset of no kind"
    expected = [kind] if kind else ["assembly", "assembly_path"]
    if found not in expected:
        raise InputError(f"expected a dataset of kind '{' or '.join(expected)}', got '{found}'")
    missing = [name for name in POSES if name not in dataset]
    if missing:
        raise InputError(f"the dataset '{found}' lacks {', '.join(missing)}: nothing to draw")
    runs = dataset.sizes["run"]
    if not 0 <= run < runs:
        raise InputError(f"run={run}: the dataset has {runs} runs, counted from 0")
    one: xr.Dataset = dataset[list(POSES)].isel(run=run).transpose(..., "block")
    return one


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
        list(block_corners(moment)), facecolors=colors, edgecolors=INK, linewidths=0.6, zorder=3
    )
    ax.add_collection(blocks)


def _strip_axes(axes: Any, count: int) -> list[Axes]:
    if axes is None:
        rows = -(-count // STRIP_COLUMNS)
        columns = -(-count // rows)
        figure = new_figure(
            width_mm=DOUBLE_COLUMN_MM, height_mm=rows * (DOUBLE_COLUMN_MM / columns + 5.0)
        )
        axes = figure.subplots(rows, columns, squeeze=False)
        for spare in axes.ravel()[count:]:
            spare.remove()
        axes = axes.ravel()[:count]
    panels: list[Axes] = list(np.ravel(np.asarray(axes, dtype=object)))
    if len(panels) != count:
        raise InputError(f"got {len(panels)} axes, expected {count}: pass them as axes=[...]")
    return panels
