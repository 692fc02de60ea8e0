"""Parameters from outcomes alone: the joint posterior, and what each kind of data tells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.units import percent
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import number_label, set_symbols
from driftwalk.plot.parts.outcome_classes import check_kind
from driftwalk.schema.answers.outcome_posterior import condition, number_of
from driftwalk.schema.answers.parts import each

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

BINS = 48
"""Bins of each axis of the joint posterior; chosen by hand."""


def plot_outcome_posterior(
    posterior: xr.Dataset, ax: Axes | None = None, *, pair: tuple[int, int] = (0, 1)
) -> Axes:
    """Draw the joint posterior of two parameters, its region, and the nodes of the emulator.

    Parameters
    ----------
    posterior : xarray.Dataset
        An `outcome_posterior`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    pair : tuple of int
        Which parameters, by their place.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is of another kind.

    Examples
    --------
    ``plot_outcome_posterior(found)``
    """
    from scipy.ndimage import gaussian_filter

    check_kind(posterior, "outcome_posterior", "value", "weight", "node_value")
    ax = style.axes_or_new(ax, height_mm=80.0)
    chosen = [posterior.isel(parameter=at) for at in pair]
    numbers = [number_of(one) for one in chosen]
    low, high = (
        np.array([n.factor * float(one[end]) for n, one in zip(numbers, chosen, strict=True)])
        for end in ("low", "high")
    )
    x, y = (n.factor * one["value"].values for n, one in zip(numbers, chosen, strict=True))
    edges = [np.linspace(a, b, BINS + 1) for a, b in zip(low, high, strict=True)]
    counted = np.histogram2d(x, y, edges, weights=posterior["weight"].values)[0]
    # Smoothed by the spread of the sample's points.
    mass: Floats = gaussian_filter(counted, 1.0, mode="reflect")
    middle = [0.5 * (edge[1:] + edge[:-1]) for edge in edges]
    confidence = float(posterior.attrs["confidence"])
    levels = [_level(mass, share) for share in (confidence, 0.5)]
    if 0.0 < levels[0] < levels[1] < mass.max():
        colours = "Greys" if condition(posterior) else style.speed_colormap()
        # As far as the range reaches: bins end half a bin beyond their middle.
        mass = np.pad(mass, 1, mode="edge")
        middle = [np.r_[edge[0], at, edge[-1]] for edge, at in zip(edges, middle, strict=True)]
        ax.contourf(*middle, mass.T, [*levels, mass.max()], cmap=colours, alpha=0.7)
        ax.contour(*middle, mass.T, levels, colors=style.MUTED, linewidths=0.7)
    nodes = [n.factor * one["node_value"].values for n, one in zip(numbers, chosen, strict=True)]
    ax.plot(*nodes, ".", ms=1.5, color=style.MUTED)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    ax.set(xlabel=number_label(numbers[0]), ylabel=number_label(numbers[1]))
    regions = f"{percent(confidence)} and 50 % regions"
    # A posterior that the outcomes refuse is from none.
    if posterior.attrs["used"] != "none":
        regions = f"{posterior.attrs['used']}: {regions}"
    words = [condition(posterior).replace(" (", "\n("), regions, "dots: simulated settings"]
    ax.set_title("\n".join(filter(None, words)), loc="left")
    return ax


def _level(mass: Floats, share: float) -> float:
    """Return the density above which a share of the mass lies."""
    ordered = np.sort(mass.ravel())[::-1]
    at = int(np.searchsorted(np.cumsum(ordered), share * ordered.sum()))
    return float(ordered[min(at, ordered.size - 1)])


def plot_data_widths(posterior: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw how wide the intervals from each kind of data are, over those without data.

    Kinds of data whose regions do not cover are left out.

    Parameters
    ----------
    posterior : xarray.Dataset
        An `outcome_posterior`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is of another kind.

    Examples
    --------
    ``plot_data_widths(found)``
    """
    check_kind(posterior, "outcome_posterior", "expected_width", "offered")
    ax = style.axes_or_new(ax, height_mm=60.0)
    kinds = [str(name) for name in posterior["data"].values]
    offered = posterior["offered"].values
    size = posterior.sizes["parameter"]
    place = np.arange(len(kinds))
    for at, one in enumerate(each(posterior, "parameter")):
        width = np.where(offered, one["expected_width"].values, np.nan)
        rows = place + 0.8 * ((at + 0.5) / size - 0.5)
        ax.barh(rows, width, height=0.8 / size, label=set_symbols(number_of(one).words))
    for row, there in enumerate(offered):
        if not there:
            ax.text(0.01, row, "not offered: regions do not cover", va="center")
    ax.axvline(1.0, color=style.MUTED, lw=0.7)
    ax.set_yticks(place, kinds)
    ax.invert_yaxis()
    ax.set(xlabel="median 90 % interval over that without data", xlim=(0.0, 1.1))
    ax.set_title(f"{posterior.attrs['runs']} runs", loc="left")
    ax.spines[["top", "right"]].set_visible(False)
    style.legend_below(ax, 2)
    return ax
