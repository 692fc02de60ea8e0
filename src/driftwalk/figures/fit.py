"""The figures of a likelihood fit: the flow with its standard error, and the path."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.figures.calibration import FOOTER, trajectory_figure
from driftwalk.figures.write import write_each
from driftwalk.plot.flow_field import plot_flow
from driftwalk.plot.parts.arena import arena_of, draw_arena, label_position
from driftwalk.plot.parts.labels import in_unit
from driftwalk.plot.parts.style import (
    DOUBLE_COLUMN_MM,
    add_colorbar,
    axes_or_new,
    letter_panels,
    new_figure,
    speed_colormap,
)
from driftwalk.schema import FLAGS

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ERROR_LABEL = "standard error (mm/s)"
TITLE_WIDTH = 90
"""Letters of a title over the whole figure."""


def plot_flow_error(flow: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the uncertainty of a flow: the larger standard error of its two components.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field` with standard errors. Nodes without one are blank.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the flow field has no standard errors.

    Examples
    --------
    >>> from driftwalk.schema import build_flow_field
    >>> ones = np.ones((2, 2))
    >>> error = {"u_standard_error": 0.001 * ones, "v_standard_error": 0.002 * ones}
    >>> flow = build_flow_field([0.0, 0.1], [0.0, 0.1], u=ones, v=ones, flag=ones, **error)
    >>> float(plot_flow_error(flow).collections[0].get_array().max())
    2.0
    """
    names = ("u_standard_error", "v_standard_error")
    absent = [name for name in names if name not in flow]
    if absent:
        raise InputError(f"the flow field has no {' and '.join(absent)}")
    ax = axes_or_new(ax, layout="compressed")
    error = 10.0 * np.maximum(*(in_unit(flow[name], "cm/s", stored="m s-1") for name in names))
    shown = np.where(flow["flag"].values == FLAGS["measured"], error, np.nan)
    x, y = (in_unit(flow[axis], "cm", stored="m") for axis in ("x", "y"))
    mesh = ax.pcolormesh(x, y, shown, cmap=speed_colormap(), vmin=0.0, shading="nearest")
    mesh.set_rasterized(True)
    outline = draw_arena(ax, arena_of(flow, None))
    if outline is not None:
        mesh.set_clip_path(outline)
    label_position(ax)
    add_colorbar(mesh, ax, ERROR_LABEL)
    return ax


def write_fit_figures(
    folder: str | Path,
    *,
    flow: xr.Dataset | Sequence[xr.Dataset],
    trajectory: xr.Dataset,
    body: str | None = None,
    simulated: bool = False,
    formats: Sequence[str] = ("png", "svg"),
) -> list[Path]:
    """Write the figures of a likelihood fit.

    Parameters
    ----------
    folder : path-like
        Where to write; made when absent.
    flow : xarray.Dataset or sequence of xarray.Dataset
        The fitted `flow_field`; several where the pumps were switched, each with its name in the
        attribute ``flow_label`` and its times in ``intervals``.
    trajectory : xarray.Dataset
        The recording.
    body : str, optional
        Body of the recording; may be left out when there is only one.
    simulated : bool, optional
        Whether the recording was simulated, which the figures then say.
    formats : sequence of {"png", "svg", "pdf"}
        File formats.

    Returns
    -------
    list of pathlib.Path
        The files: ``flow`` and ``trajectory`` in every format; ``flow_A`` and so on by name of
        the flow where there are several.

    Raises
    ------
    InputError
        When a format is not known, or a dataset lacks what a figure draws.
    RunDirectoryError
        When a figure cannot be written.

    Examples
    --------
    ``write_fit_figures("fit/figures", flow=flow, trajectory=recording)``
    """
    import xarray as xr

    flows = [flow] if isinstance(flow, xr.Dataset) else list(flow)
    makers: dict[str, Callable[[], Figure]] = {
        "_".join(["flow", *_label(one)]): partial(_flow_figure, one) for one in flows
    }
    makers["trajectory"] = lambda: trajectory_figure(trajectory, body=body)
    return write_each(makers, folder, formats, footer=FOOTER if simulated else "")


def _label(flow: xr.Dataset) -> list[str]:
    """Return the name of a flow, nothing where it has none."""
    return [str(flow.attrs["flow_label"])] if "flow_label" in flow.attrs else []


def _flow_figure(flow: xr.Dataset) -> Figure:
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=80.0, layout="compressed")
    row = list(figure.subplots(1, 2, sharex=True, sharey=True))
    plot_flow(flow, row[0])
    plot_flow_error(flow, row[1])
    row[1].set_ylabel("")
    filled = bool((flow["flag"].values == FLAGS["filled"]).any())
    title = " ".join(["fitted flow", *_label(flow)])
    letter_panels(row, [title + (" (hatched: filled)" if filled else ""), "its standard error"])
    if "intervals" in flow.attrs:
        figure.suptitle(textwrap.fill(f"from {flow.attrs['intervals']}", TITLE_WIDTH))
    return figure
