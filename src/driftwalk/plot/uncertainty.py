"""How well the estimate is known: distance around the optimum, noise floor, bootstrap cloud."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.plot.distances import draw_optimum, draw_region
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import (
    PlotParameter,
    interval_of,
    logarithmic,
    number_fact,
    parameter_named,
    plane_of,
    plot_parameters,
    require_variables,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

ESTIMATES_LABEL = "bootstrap estimates"
DISTANCES = ("ks_distance", "ks_distance_standard_error", "ks_distance_replicate")


def plot_validation(calibration: xr.Dataset, axes: Any = None) -> list[Axes]:
    """Draw the distance along every parameter, and the bootstrap estimates, a panel each.

    Parameters
    ----------
    calibration : xarray.Dataset
        What `driftwalk.calibration.calibrate` returns.
    axes : sequence of matplotlib.axes.Axes, optional
        Where to draw, one for every parameter and one more; a new figure with one row when left
        out.

    Returns
    -------
    list of matplotlib.axes.Axes
        The axes: three for the block.

    Raises
    ------
    InputError
        When the dataset lacks the map, the optimum or the bootstrap estimates.

    Examples
    --------
    ``plot_validation(calibration)[0].figure.savefig("validation.png")``
    """
    parameters = plot_parameters(calibration)
    row = style.axes_grid_or_new(axes, count=len(parameters) + 1)
    for parameter, ax in zip(parameters, row, strict=False):
        plot_distance_profile(calibration, ax, parameter=parameter.name)
    plot_bootstrap(calibration, row[-1])
    return row


def plot_distance_profile(
    calibration: xr.Dataset, ax: Axes | None = None, *, parameter: str | None = None
) -> Axes:
    """Draw the KS distance along one parameter, the others at the grid value next to the optimum.

    Dots are the replicates, the line joins their means with one standard error either way. The
    diamond is the distance at the optimum, the dashed line the noise floor: the distance between
    two runs of one and the same model. The shaded band is the interval of the parameter. With a
    single parameter the curve fitted to the refined map is there too.

    Parameters
    ----------
    calibration : xarray.Dataset
        Result of `driftwalk.calibration.calibrate`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    parameter : str, optional
        Name of the parameter along the axis; default: the first.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the calibration has no such parameter, or lacks the map.

    Examples
    --------
    ``plot_distance_profile(calibration, parameter="force_std")``
    """
    along = parameter_named(calibration, parameter)
    require_variables(calibration, *DISTANCES, along.name)
    best, factor = along.best(calibration), along.factor
    line = through_optimum(calibration, along)
    values = factor * np.asarray(line[along.name].values, dtype=np.float64)
    ax = style.axes_or_new(ax)
    if (interval := interval_of(calibration, f"{along.key}_interval")) is not None:
        ax.axvspan(
            factor * interval[0], factor * interval[1], color=style.PALE, lw=0, label="interval"
        )
    replicates = line["ks_distance_replicate"].transpose(along.name, ...).values
    ax.plot(
        np.repeat(values, replicates.shape[1]), replicates.ravel(), "o", ms=2.2, mew=0.0,
        color=style.MUTED, alpha=0.6, label="replicates",
    )  # fmt: skip
    ax.errorbar(
        values, line["ks_distance"].values, yerr=line["ks_distance_standard_error"].values,
        color=style.BLUE, lw=1.0, elinewidth=0.8, label="mean ± standard error",
    )  # fmt: skip
    if len(plot_parameters(calibration)) == 1 and "refined_surface" in calibration:
        fine = along.values(calibration, "refined_")
        fitted = calibration["refined_surface"].values
        ax.plot(fine, fitted, color=style.ORANGE, lw=1.0, label="fitted curve", zorder=5)
    floor = number_fact(calibration, "noise_floor")
    if np.isfinite(floor):
        ax.axhline(floor, color=style.INK, lw=0.8, dashes=(4, 2.5), label="noise floor")
    distance = number_fact(calibration, "ks_distance")
    ax.plot(
        [best],
        [distance],
        "D",
        ms=4.5,
        mfc=style.ORANGE,
        mec="white",
        mew=0.7,
        zorder=6,
        label="optimum",
    )
    # On a logarithmic scale the optimum and the noise floor, both far below 1, can be
    # distinguished.
    ax.set(yscale="log", ylim=(None, 1.15))
    logarithmic(ax, "y")
    along.scale(ax, "x")
    ax.set(xlabel=along.label(calibration), ylabel="KS distance D")
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def plot_bootstrap(calibration: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the bootstrap estimates: in the plane of two parameters, as a histogram of one.

    The plane has the optimum and the 90 % region as well, the histogram the optimum and its
    interval.

    Parameters
    ----------
    calibration : xarray.Dataset
        Result of `driftwalk.calibration.calibrate`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset lacks the bootstrap estimates.

    Examples
    --------
    ``plot_bootstrap(calibration).figure.savefig("bootstrap.png")``
    """
    parameters = plot_parameters(calibration)
    require_variables(calibration, *(f"bootstrap_{one.name}" for one in parameters))
    ax = style.axes_or_new(ax)
    if len(parameters) == 1:
        _histogram(calibration, ax, parameters[0])
    else:
        _cloud(calibration, ax)
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def _cloud(calibration: xr.Dataset, ax: Axes) -> None:
    across, up = plane_of(calibration)
    ax.plot(
        across.values(calibration, "bootstrap_"), up.values(calibration, "bootstrap_"), "o",
        ms=2.6, mew=0.0, color=style.BLUE, alpha=0.45, label=ESTIMATES_LABEL,
    )  # fmt: skip
    draw_region(ax, calibration, lw=0.8)
    draw_optimum(ax, calibration, color=style.ORANGE)
    ax.autoscale_view()
    across.scale(ax, "x")
    up.scale(ax, "y")
    ax.set(xlabel=across.label(calibration), ylabel=up.label(calibration))


def _histogram(calibration: xr.Dataset, ax: Axes, parameter: PlotParameter) -> None:
    values = parameter.values(calibration, "bootstrap_")
    if (ends := interval_of(calibration, f"{parameter.key}_interval")) is not None:
        low, high = (parameter.factor * end for end in ends)
        ax.axvspan(low, high, color=style.PALE, lw=0, label="interval")
    is_log = parameter.stored.scale == "log"
    # Counted on the scale of the axis: an edge that was raised to a power may leave its value out.
    counts, bins = np.histogram(np.log10(values) if is_log else values, "auto")
    edges = np.power(10.0, bins) if is_log else bins
    ax.stairs(counts, edges, fill=True, color=style.BLUE, alpha=0.6, label=ESTIMATES_LABEL)
    ax.axvline(parameter.best(calibration), color=style.ORANGE, lw=1.4, label="optimum")
    parameter.scale(ax, "x")
    ax.set(xlabel=parameter.label(calibration), ylabel="recordings")


def through_optimum(calibration: xr.Dataset, along: PlotParameter) -> xr.Dataset:
    """Return the line of the coarse map next to the optimum in the other parameters."""
    others = [one for one in plot_parameters(calibration) if one.name != along.name]
    best = {one.name: one.best(calibration) / one.factor for one in others}
    return calibration[[*DISTANCES]].sel(best, method="nearest")
