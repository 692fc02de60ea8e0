"""The figures of a likelihood fit: the flow with its standard error, and the path."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.figures.calibration import trajectory_figure
from driftwalk.figures.laws import laws_figures
from driftwalk.figures.model_check import check_figures
from driftwalk.figures.write import Figures, marked_simulated
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


def fit_figures(
    fit: xr.Dataset,
    recording: xr.Dataset,
    *,
    flows: Sequence[xr.Dataset],
    body: str | None = None,
    check: xr.Dataset | None = None,
) -> Figures:
    """Return the figures of a likelihood fit, of the laws that it compared, and of its check.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`.
    recording : xarray.Dataset
        The `trajectory`.
    flows : sequence of xarray.Dataset
        The fitted `flow_field`; several where the pumps were switched, each with its name in the
        attribute ``flow_label`` and its times in ``intervals``.
    body : str, optional
        Body of the recording; may be left out when there is only one.
    check : xarray.Dataset, optional
        Its `model_check`.

    Returns
    -------
    dict of str to callable
        ``flow`` (``flow_A`` and so on by name of the flow where there are several) and
        ``trajectory``; with compared laws ``laws``; with a check those of `check_figures`.

    Examples
    --------
    ``write_figures(fit_figures(fit, recording, flows=[flow]), "fit/figures")``
    """
    figures: Figures = {
        "_".join(["flow", *_label(one)]): partial(_flow_figure, one) for one in flows
    }
    figures["trajectory"] = lambda: trajectory_figure(recording, body=body)
    figures = marked_simulated(figures, fit)
    if "compared_law" in fit.dims:
        figures |= laws_figures(fit)
    return figures if check is None else figures | check_figures(check)


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
