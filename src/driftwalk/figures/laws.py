"""The figure of compared force laws."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.figures.write import Figures
from driftwalk.plot.parts.style import BLUE, MUTED, SINGLE_COLUMN_MM, new_figure
from driftwalk.schema.answers.force_law import compared_laws

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEAST_SHOWN = 1e-5
"""Smallest width of the even part of the axis [nats]."""
MOST_EVEN = 20.0
"""Largest loss, in standard errors, up to which the axis is even; beyond it is logarithmic."""


def laws_figures(fit: xr.Dataset) -> Figures:
    """Return the figure of the laws that a fit has compared.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit` whose laws were compared.

    Returns
    -------
    dict of str to callable
        ``laws``.

    Raises
    ------
    InputError
        When no laws were compared.

    Examples
    --------
    ``write_figures(laws_figures(fit), "fit/figures")``
    """
    if "compared_law" not in fit.dims:
        raise InputError("the fit has compared no force laws: `compare_laws` adds them")
    return {"laws": lambda: _laws_figure(fit)}


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
    every = compared_laws(fit)
    known = [law for law in reversed(every) if law.solved]
    if not known:
        ax.set_title("no law has a solution")
        return ax
    names = [law.name for law in known]
    lost, std = (np.array(one) for one in zip(*((law.loss, law.std) for law in known), strict=True))
    place = np.arange(len(names))
    ax.errorbar(lost, place, xerr=std, fmt="o", ms=3.0, lw=0.9, capsize=2.0, color=BLUE)
    even = max(float(std.max()), LEAST_SHOWN)
    if float(lost.max()) > MOST_EVEN * even:
        # From a power of ten on: no other label of the axis is then next to that of 0.
        ax.set_xscale("symlog", linthresh=10.0 ** math.ceil(math.log10(even)))
    else:
        ax.locator_params(axis="x", nbins=5)
    ax.axvline(0.0, color=MUTED, lw=0.6)
    ax.set_yticks(place, names)
    ax.set_ylim(-0.6, len(names) - 0.4)
    ax.set_xlabel("loss per held out sample, against the best law (nats)")
    unsolved = len(every) - len(known)
    if unsolved:
        ax.set_title(f"not shown, without a solution: {unsolved}")
    return ax
