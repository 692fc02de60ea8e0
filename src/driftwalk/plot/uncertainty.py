"""How well the estimate is known: distance around the optimum, noise floor, bootstrap cloud."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.plot.distances import REGION_LABEL, draw_optimum, region_of
from driftwalk.plot.panels import Parameter
from driftwalk.plot.parts.labels import (
    DRAG_LABEL,
    MN_PER_N,
    force_label,
    in_unit,
    interval_of,
    number_attribute,
    require_variables,
    required_attribute,
)
from driftwalk.plot.parts.style import BLUE, INK, MUTED, ORANGE, PALE, axes_or_new, axes_row_or_new

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]
# parameter -> attribute of its estimate, factor to the unit of the figure
ESTIMATES: dict[str, tuple[str, float]] = {
    "drag_coefficient": ("drag_coefficient", 1.0),
    "force_std": ("force_std_N", MN_PER_N),
}


def plot_validation(calibration: xr.Dataset, axes: Any = None) -> list[Axes]:
    """Draw the distance along either parameter, and the bootstrap estimates, in three panels.

    Parameters
    ----------
    calibration : xarray.Dataset
        Result of `driftwalk.calibration.calibrate`.
    axes : sequence of 3 matplotlib.axes.Axes, optional
        Where to draw; a new figure with one row when left out.

    Returns
    -------
    list of matplotlib.axes.Axes
        The three axes.

    Raises
    ------
    InputError
        When the dataset lacks the map, the optimum or the bootstrap estimates.

    Examples
    --------
    ``plot_validation(calibration)[0].figure.savefig("validation.png")``
    """
    row = axes_row_or_new(axes, count=3)
    plot_distance_profile(calibration, row[0], parameter="drag_coefficient")
    plot_distance_profile(calibration, row[1], parameter="force_std")
    plot_bootstrap(calibration, row[2])
    return row


def plot_distance_profile(
    calibration: xr.Dataset, ax: Axes | None = None, *, parameter: Parameter = "drag_coefficient"
) -> Axes:
    """Draw the KS distance along one parameter, the other at the grid value next to its optimum.

    Dots are the replicates, the line joins their means with one standard error either way. The
    diamond is the distance at the optimum, the dashed line the noise floor: the distance between
    two runs of the same model. The shaded band is the interval of the parameter.

    Parameters
    ----------
    calibration : xarray.Dataset
        Result of `driftwalk.calibration.calibrate`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    parameter : {"drag_coefficient", "force_std"}
        The parameter along the axis.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the parameter is neither of the two, or the dataset lacks the map.

    Examples
    --------
    ``plot_distance_profile(calibration, parameter="force_std")``
    """
    from matplotlib.ticker import LogLocator, NullLocator

    if parameter not in ESTIMATES:
        raise InputError(f"parameter='{parameter}': choose one of {', '.join(ESTIMATES)}")
    require_variables(calibration, "ks_distance", "ks_distance_replicate", parameter)
    attribute, factor = ESTIMATES[parameter]
    best = factor * float(required_attribute(calibration, attribute))
    line = _through_optimum(calibration, parameter)
    values = factor * np.asarray(line[parameter].values, dtype=np.float64)
    ax = axes_or_new(ax)
    interval = interval_of(calibration, f"{attribute}_interval")
    if interval is not None:
        ax.axvspan(factor * interval[0], factor * interval[1], color=PALE, lw=0, label="interval")
    replicates = line["ks_distance_replicate"].transpose(parameter, ...).values
    ax.plot(
        np.repeat(values, replicates.shape[1]), replicates.ravel(), "o", ms=2.2, mew=0.0,
        color=MUTED, alpha=0.6, label="replicates",
    )  # fmt: skip
    error = line.get("ks_distance_standard_error")
    ax.errorbar(
        values, line["ks_distance"].values, yerr=None if error is None else error.values,
        color=BLUE, lw=1.0, elinewidth=0.8, label="mean ± standard error",
    )  # fmt: skip
    floor = number_attribute(calibration, "noise_floor")
    if np.isfinite(floor):
        ax.axhline(floor, color=INK, lw=0.8, dashes=(4, 2.5), label="noise floor")
    distance = number_attribute(calibration, "ks_distance")
    ax.plot(
        [best], [distance], "D", ms=4.5, mfc=ORANGE, mec="white", mew=0.7, zorder=6, label="optimum"
    )
    # On a logarithmic scale the optimum and the noise floor, both far below 1, can be
    # distinguished.
    ax.set_yscale("log")
    ax.set_ylim(top=1.15)
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_locator(NullLocator())
    ax.set_xlabel(DRAG_LABEL if parameter == "drag_coefficient" else force_label(calibration))
    ax.set_ylabel("KS distance D")
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def plot_bootstrap(calibration: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the bootstrap estimates in the plane of the parameters, with optimum and 90 % region.

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
    from matplotlib.patches import Polygon

    require_variables(calibration, "bootstrap_drag_coefficient", "bootstrap_force_std")
    ax = axes_or_new(ax)
    drag = np.asarray(calibration["bootstrap_drag_coefficient"].values, dtype=np.float64)
    force = in_unit(calibration["bootstrap_force_std"], "mN", stored="N")
    ax.plot(drag, force, "o", ms=2.6, mew=0.0, color=BLUE, alpha=0.45, label="bootstrap estimates")
    region = region_of(calibration)
    if region is not None:
        ax.add_patch(
            Polygon(
                region, closed=True, facecolor="none", edgecolor=INK, lw=0.8, label=REGION_LABEL
            )
        )
    draw_optimum(ax, calibration, color=ORANGE)
    ax.autoscale_view()
    ax.set_xlabel(DRAG_LABEL)
    ax.set_ylabel(force_label(calibration))
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def _through_optimum(calibration: xr.Dataset, parameter: Parameter) -> xr.Dataset:
    """Return the row of the coarse map next to the optimum in the other parameter."""
    other = next(name for name in ESTIMATES if name != parameter)
    best = float(required_attribute(calibration, ESTIMATES[other][0]))
    wanted = [
        name
        for name in ("ks_distance", "ks_distance_standard_error", "ks_distance_replicate")
        if name in calibration
    ]
    line: xr.Dataset = calibration[wanted].sel({other: best}, method="nearest")
    return line
