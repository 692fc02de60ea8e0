"""Joint densities of step length and turning angle (Fig. 5b), side by side too (Figs. 7 and 8)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.plot.distances import CAUSES
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import (
    ANGLE_LABEL,
    FACTORS,
    FORCE,
    LENGTH_LABEL,
    force_interval_text,
    parameter_named,
    plot_parameters,
    require_variables,
    required_fact,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

Marginals = Literal["shown", "none"]
BINS = 48
"""Bins along each axis, fine enough for the eye; chosen by eye."""
# Axes and bins reach over the central part of the steps; one wild step must not squeeze the rest;
# chosen by hand.
SHOWN_FRACTION = 0.9995
DENSITY_LABEL = "density of steps (% mm⁻¹ °⁻¹)"
MM_PER_M = FACTORS["m", "mm"]
DEGREES = FACTORS["rad", "°"]
# Where "low" and "high" lie, as multiples of the optimum, unless the caller says.
LOW_FACTOR, HIGH_FACTOR = 0.25, 1.8


def plot_steps(
    step_length: npt.ArrayLike,
    turning_angle: npt.ArrayLike,
    ax: Axes | None = None,
    *,
    bins: int = BINS,
    marginals: Marginals = "shown",
) -> Axes:
    """Draw the joint density of steps as a histogram, with the two marginals at its sides.

    Bins span the central 99.95 % of either quantity; steps beyond are left out of the picture, yet
    count in the shares.

    Parameters
    ----------
    step_length : array_like, shape (n,)
        Step lengths [m].
    turning_angle : array_like, shape (n,)
        Turning angles [rad, in (-pi, pi]] (the paper's step angles).
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    bins : int
        Bins along either axis.
    marginals : {"shown", "none"}
        Whether to draw the marginals.

    Returns
    -------
    matplotlib.axes.Axes
        The axes of the joint density.

    Raises
    ------
    InputError
        When the two differ in length, or no step is finite.

    Examples
    --------
    >>> plot_steps([0.005, 0.006], [0.1, 0.2]).get_xlabel()
    'step length (mm)'
    """
    length, angle = (
        np.asarray(values, dtype=np.float64) for values in (step_length, turning_angle)
    )
    if length.shape != angle.shape or length.ndim != 1:
        raise InputError(
            f"step lengths {length.shape} and turning angles {angle.shape} are not two lists of "
            "the same length"
        )
    finite = np.isfinite(length) & np.isfinite(angle)
    if not finite.any():
        raise InputError("there is no step to draw: no pair of length and angle is finite")
    length, angle = length[finite], angle[finite]
    edges = tuple(_edges(values, bins) for values in (length, angle))
    count, length_edge, angle_edge = np.histogram2d(length, angle, bins=edges)
    return plot_step_density(
        count / length.size, length_edge, angle_edge, ax, marginals=marginals, limits="all"
    )


def plot_step_density(
    density: npt.ArrayLike,
    step_length_edge: npt.ArrayLike,
    turning_angle_edge: npt.ArrayLike,
    ax: Axes | None = None,
    *,
    marginals: Marginals = "shown",
    limits: Literal["filled", "all"] = "filled",
    colorbar: Literal["beside", "none"] = "beside",
) -> Axes:
    """Draw steps that are already binned, as a calibration stores them, as a density.

    Parameters
    ----------
    density : array_like, shape (lengths, angles)
        Fraction of the steps in each bin.
    step_length_edge : array_like, shape (lengths + 1,)
        Edges of the bins [m].
    turning_angle_edge : array_like, shape (angles + 1,)
        Edges of the bins [rad].
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    marginals : {"shown", "none"}
        Whether to draw the marginals.
    limits : {"filled", "all"}
        Show the bins that hold the central 99.95 % of the steps, or every bin.
    colorbar : {"beside", "none"}
        Whether to add a colour bar.

    Returns
    -------
    matplotlib.axes.Axes
        The axes of the joint density.

    Raises
    ------
    InputError
        When the shape does not belong to the edges.

    Examples
    --------
    >>> plot_step_density([[0.5, 0.5]], [0.0, 0.01], [-1.0, 0.0, 1.0]).get_ylabel()
    'turning (step) angle (°)'
    """
    share, length_mm, angle_deg = _checked(density, step_length_edge, turning_angle_edge)
    ax = style.axes_or_new(ax)
    mesh = density_mesh(ax, share, length_mm, angle_deg)
    if limits == "filled":
        ax.set_xlim(*filled_range(share.sum(axis=1), length_mm))
        ax.set_ylim(*filled_range(share.sum(axis=0), angle_deg))
    ax.set(xlabel=LENGTH_LABEL, ylabel=ANGLE_LABEL)
    if marginals == "shown":
        _draw_marginals(ax, share, length_mm, angle_deg)
    if colorbar == "beside":
        style.add_colorbar(mesh, ax, DENSITY_LABEL)
    return ax


def density_mesh(
    ax: Axes, share: Floats, length_mm: Floats, angle_deg: Floats, *, top: float | None = None
) -> QuadMesh:
    """Draw shares [fraction per bin] as a density [% mm⁻¹ °⁻¹]; empty bins stay white.

    `top` is the top of the colour scale in the same unit; default: the largest density.
    """
    from matplotlib.colors import PowerNorm

    density = density_of(share, length_mm, angle_deg)
    highest = (float(density.max(initial=0.0)) if top is None else top) or 1.0
    # Colour grows with the root of the density: the tails show, and so does the shape of the peak.
    mesh = ax.pcolormesh(
        length_mm,
        angle_deg,
        np.ma.masked_equal(density.T, 0.0),
        cmap=style.DENSITY_COLORMAP,
        norm=PowerNorm(0.5, vmin=0.0, vmax=highest),
    )
    mesh.set_rasterized(True)
    ax.axhline(0.0, color=style.MUTED, lw=0.5, dashes=(4, 3))
    return mesh


def density_of(share: Floats, length_mm: Floats, angle_deg: Floats) -> Floats:
    """Return shares per bin [1] as a density [% mm⁻¹ °⁻¹], whatever the sizes of the bins."""
    return 100.0 * share / np.outer(np.diff(length_mm), np.diff(angle_deg))


def filled_range(marginal: Floats, edge: Floats) -> tuple[float, float]:
    """Return the outer edges of the bins that hold the central 99.95 % of a marginal."""
    total = marginal.sum()
    if not total > 0.0:
        return float(edge[0]), float(edge[-1])
    below = np.cumsum(marginal) / total
    tail = (1.0 - SHOWN_FRACTION) / 2.0
    first = int(np.searchsorted(below, tail, side="right"))
    last = int(np.searchsorted(below, 1.0 - tail, side="left"))
    return float(edge[first]), float(edge[min(last, marginal.size - 1) + 1])


def _draw_marginals(ax: Axes, share: Floats, length_mm: Floats, angle_deg: Floats) -> None:
    """Add the two marginals along the upper and right edges."""
    from matplotlib.ticker import NullLocator

    top = ax.inset_axes((0.0, 1.02, 1.0, 0.16), sharex=ax)
    right = ax.inset_axes((1.02, 0.0, 0.16, 1.0), sharey=ax)
    look: dict[str, Any] = {"fill": True, "facecolor": style.PALE, "edgecolor": style.MUTED}
    length, angle = share.sum(axis=1) / np.diff(length_mm), share.sum(axis=0) / np.diff(angle_deg)
    top.stairs(length, length_mm, linewidth=0.7, **look)
    right.stairs(angle, angle_deg, orientation="horizontal", linewidth=0.7, **look)
    top.set_ylim(bottom=0.0)
    right.set_xlim(left=0.0)
    for side, name in ((top, "step length"), (right, "turning angle")):
        side.set_label(f"marginal of {name}")
        side.spines[["top", "right", "left", "bottom"]].set_visible(False)
        side.tick_params(bottom=False, left=False, labelbottom=False, labelleft=False)
    top.yaxis.set_major_locator(NullLocator())
    right.xaxis.set_major_locator(NullLocator())


def _edges(values: Floats, bins: int) -> Floats:
    """Return even bin edges over the central part of the values."""
    tail = (1.0 - SHOWN_FRACTION) / 2.0
    low, high = np.quantile(values, [tail, 1.0 - tail])
    margin = 0.03 * (high - low) or 0.5 * abs(high) or 1.0
    return np.linspace(low - margin, high + margin, bins + 1)


def _checked(
    density: npt.ArrayLike, step_length_edge: npt.ArrayLike, turning_angle_edge: npt.ArrayLike
) -> tuple[Floats, Floats, Floats]:
    share = np.nan_to_num(np.asarray(density, dtype=np.float64))
    length_mm = MM_PER_M * np.asarray(step_length_edge, dtype=np.float64)
    angle_deg = DEGREES * np.asarray(turning_angle_edge, dtype=np.float64)
    if share.shape != (length_mm.size - 1, angle_deg.size - 1):
        raise InputError(
            f"a density of shape {share.shape} does not belong to {length_mm.size} edges of step "
            f"length and {angle_deg.size} edges of turning angle: expected one bin less than edges"
        )
    return share, length_mm, angle_deg


def plot_density_panels(
    calibration: xr.Dataset,
    axes: Any = None,
    *,
    parameter: str | None = None,
    low: float | None = None,
    high: float | None = None,
    colorbar: Literal["beside", "none"] = "beside",
) -> list[Axes]:
    """Draw four densities: recording, low, best and high value of one parameter.

    Other parameters stay at their optimum. Simulated panels show the settings of the coarse map
    nearest to the values asked for, and their titles name the values shown; with the optimum at an
    end of the map, the second of them is halfway. All four share their axes and their colour scale.

    Parameters
    ----------
    calibration : xarray.Dataset
        Result of `driftwalk.calibration.calibrate`.
    axes : sequence of 4 matplotlib.axes.Axes, optional
        Where to draw, in one row or two; a new figure with one row when left out.
    parameter : str, optional
        Name of the parameter that differs between the panels; default: the first.
    low, high : float, optional
        Its low and high value, in its SI unit; default: 0.25 and 1.8 times the optimum.
    colorbar : {"beside", "none"}
        Whether to add the common colour bar.

    Returns
    -------
    list of matplotlib.axes.Axes
        The four axes.

    Raises
    ------
    InputError
        When the calibration has no such parameter, or lacks the densities.

    Examples
    --------
    ``plot_density_panels(calibration, parameter="force_std", low=0.0, high=0.001)``
    """
    from matplotlib.ticker import MaxNLocator

    along = parameter_named(calibration, parameter)
    settings = choose_settings(calibration, parameter=along.name, low=low, high=high)
    every = [calibration["recording_step_density"], *(one["step_density"] for one in settings)]
    bins = ("density_step_length", "density_turning_angle")
    densities = [np.nan_to_num(one.transpose(*bins).values.astype(np.float64)) for one in every]
    length_mm = MM_PER_M * calibration["step_length_edge"].values
    angle_deg = DEGREES * calibration["turning_angle_edge"].values
    # One scale of colour for all panels: they are compared with each other.
    top = max(
        float(density_of(density, length_mm, angle_deg).max(initial=0.0)) for density in densities
    )
    row = style.axes_grid_or_new(axes, count=4, sharex=True, sharey=True)
    limits = _common_limits(densities, length_mm, angle_deg)
    for ax, density in zip(row, densities, strict=True):
        mesh = density_mesh(ax, density, length_mm, angle_deg, top=top)
        ax.set(xlim=limits[0], ylim=limits[1])
        ax.xaxis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 5, 10]))
        ax.set(xlabel=LENGTH_LABEL, ylabel=ANGLE_LABEL)
        ax.label_outer()
    for ax, setting in zip(row[1:], settings, strict=True):
        _mark_cause(ax, int(setting.get("status", 0)))
    titles = [along.title(float(setting[along.name])) for setting in settings]
    style.letter_panels(row, ["recording", *titles])
    if colorbar == "beside":
        style.add_colorbar(mesh, row, DENSITY_LABEL)
    heaped = []
    if max(abs(angle_deg[[0, -1]])) < 179.0 and limits[1] == (angle_deg[0], angle_deg[-1]):
        heaped.append(f"angles beyond ±{angle_deg[-1]:.0f}°")
    if limits[0][1] == length_mm[-1]:
        heaped.append(f"steps longer than {length_mm[-1]:.3g} mm")
    if heaped:
        style.add_footer(
            style.figure_of(row[0]), f"the outermost bins hold all {' and all '.join(heaped)}"
        )
    return row


def choose_settings(
    calibration: xr.Dataset,
    *,
    parameter: str,
    low: float | None = None,
    high: float | None = None,
) -> list[xr.Dataset]:
    """Return the low, best and high setting of the coarse map nearest to the values wanted.

    Where the best is at an end of the map, the second is halfway to the other end.
    """
    require_variables(
        calibration, "step_density", "recording_step_density", "step_length_edge",
        "turning_angle_edge", *(one.name for one in plot_parameters(calibration)),
    )  # fmt: skip
    along = parameter_named(calibration, parameter)
    best = {
        one.name: float(required_fact(calibration, one.key)) for one in plot_parameters(calibration)
    }
    wanted = (
        LOW_FACTOR * best[along.name] if low is None else low,
        best[along.name],
        HIGH_FACTOR * best[along.name] if high is None else high,
    )
    cells = calibration[along.name].sel({along.name: list(wanted)}, method="nearest")
    first, middle, last = cells.values.tolist()
    if middle in (first, last):  # an optimum at an end of the map is not shown twice
        middle = (first + last) / 2.0
    return [
        calibration.sel({**best, along.name: value}, method="nearest")
        for value in (first, middle, last)
    ]


def shared_setting_text(calibration: xr.Dataset, *, parameter: str) -> str:
    """Return what stays the same in the simulated panels: "σ_F = 0.55 mN, new every 16 ms".

    Empty for a model of one parameter.
    """
    along = parameter_named(calibration, parameter)
    setting = choose_settings(calibration, parameter=along.name)[1]
    words = [
        one.words(float(setting[one.name]))
        + (f" ({force_interval_text(calibration)})" if one == FORCE else "")
        for one in plot_parameters(calibration)
        if one.name != along.name
    ]
    if along == FORCE:
        words.append(f"{FORCE.symbol} {force_interval_text(calibration)}")
    return "; ".join(words)


def _common_limits(
    densities: list[Floats], length_mm: Floats, angle_deg: Floats
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return limits that show the central part of every panel."""
    ranges = []
    for axis, edge in ((1, length_mm), (0, angle_deg)):
        filled = [
            filled_range(density.sum(axis=axis), edge) for density in densities if density.any()
        ]
        ends = filled or [(float(edge[0]), float(edge[-1]))]
        ranges.append((min(low for low, _ in ends), max(high for _, high in ends)))
    return ranges[0], ranges[1]


def _mark_cause(ax: Axes, status: int) -> None:
    """Hatch a panel whose setting made no steps, and say why."""
    causes = [cause for bit, cause in CAUSES.items() if status & bit]
    if not causes:
        return
    name, hatch = causes[0]
    ax.set_facecolor("white")
    ax.axhspan(
        *ax.get_ylim(),
        facecolor="none",
        edgecolor=style.MUTED,
        linewidth=0.0,
        hatch=hatch,
        gid=name,
    )
    ax.text(
        0.5, 0.5, name, transform=ax.transAxes, ha="center", va="center",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 3.0},
    )  # fmt: skip
