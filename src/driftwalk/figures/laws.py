"""The figure of compared force laws."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.figures.write import write_each
from driftwalk.plot.parts.style import SINGLE_COLUMN_MM, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEAST_SHOWN = 1e-5
"""Smallest loss on the axis [nats a sample]."""


def write_laws_figure(
    folder: str | Path, *, fit: xr.Dataset, formats: Sequence[str] = ("png", "svg")
) -> list[Path]:
    """Write the figure of the laws that a fit has compared.

    Parameters
    ----------
    folder : path-like
        Where to write; made when absent.
    fit : xarray.Dataset
        A `fit` whose laws were compared.
    formats : sequence of {"png", "svg", "pdf"}
        File formats.

    Returns
    -------
    list of pathlib.Path
        ``laws`` in every format.

    Raises
    ------
    InputError
        When a format is not known, or no laws were compared.
    RunDirectoryError
        When a figure cannot be written.

    Examples
    --------
    ``write_laws_figure("fit/figures", fit=fit)``
    """
    if "compared_law" not in fit.dims:
        raise InputError("the fit has compared no force laws: `compare_laws` adds them")
    return write_each({"laws": lambda: _laws_figure(fit)}, folder, formats)


def _laws_figure(fit: xr.Dataset) -> Figure:
    figure = new_figure(width_mm=1.4 * SINGLE_COLUMN_MM, height_mm=55.0)
    plot_laws(fit, figure.add_subplot())
    return figure


def plot_laws(fit: xr.Dataset, ax: Axes) -> Axes:
    """Plot by how much each law predicts held out samples worse than the best.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit` whose laws were compared.
    ax : matplotlib.axes.Axes
        Where to plot.

    Returns
    -------
    matplotlib.axes.Axes
        The same axes.

    Examples
    --------
    ``plot_laws(fit, ax)``
    """
    known = fit.isel(compared_law=np.flatnonzero(np.isfinite(fit["compared_log_score"].values)))
    order = np.argsort(known["compared_log_score"].values)
    score = known["compared_log_score"].values[order]
    std = known["compared_log_score_std"].values[order]
    names = [str(name) for name in known["compared_law"].values[order]]
    lost = np.maximum(score.max() - score, LEAST_SHOWN)
    place = np.arange(len(names))
    ax.errorbar(lost, place, xerr=std, fmt="o", color="C0", capsize=2.0)
    ax.set_xscale("symlog", linthresh=max(float(std.max()), LEAST_SHOWN))
    ax.axvline(0.0, color="0.6", linewidth=0.8)
    ax.set_yticks(place, names)
    ax.set_ylim(-0.6, len(names) - 0.4)
    ax.set_xlabel("held out samples: loss against the best law [nats a sample]")
    return ax
