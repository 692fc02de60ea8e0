"""Pictures of model checks: whiteness, residuals, predicted steps; facts that were not fitted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.units import percent
from driftwalk.plot.parts import style
from driftwalk.plot.parts.arena import arena_of, draw_arena, label_position
from driftwalk.plot.parts.labels import ANGLE_LABEL, LENGTH_LABEL, in_unit, logarithmic
from driftwalk.schema.answers.fit import residuals_of
from driftwalk.schema.answers.model_comparison import ASPECT_WORDS, CHECK_LABELS
from driftwalk.schema.check import require_kind

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


BAND_STDS = 1.96
"""95 % of a normal."""
LEAST_TOP = 4.0
"""Least upper end of the colours of the residual map [sd], so that chance looks pale."""
COLORS = (style.BLUE, style.ORANGE, style.INK)
MARKERS = ("o", "s", "^")


def plot_innovations(check: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the autocorrelation of the errors of prediction, with the band of 95 %.

    Parameters
    ----------
    check : xarray.Dataset
        A `model_check`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is no model check.

    Examples
    --------
    >>> plot_innovations(check)  # doctest: +SKIP
    """
    from matplotlib.ticker import MaxNLocator

    _require(check)
    ax = style.axes_or_new(ax)
    lag = check["lag"].values
    expected = check["autocorrelation_expected"].values.mean(axis=0)
    reach = BAND_STDS * check["autocorrelation_std"].values.mean(axis=0)
    # A step for each lag: points of several components lie on both sides of it.
    edges = np.append(lag - 0.5, lag[-1] + 0.5)
    ax.stairs(
        expected + reach, edges, baseline=expected - reach, fill=True, color=style.PALE, lw=0,
        label="95 % if the model is right",
    )  # fmt: skip
    ax.axhline(0.0, color=style.MUTED, lw=0.6)
    names = [str(name) for name in check["component"].values]
    aside = np.linspace(-0.15, 0.15, len(names)) if len(names) > 1 else np.zeros(1)
    rows = zip(names, aside, check["autocorrelation"].values, COLORS, MARKERS, strict=False)
    for name, shift, values, color, marker in rows:
        shown = "θ" if name == "theta" else name
        ax.plot(lag + shift, values, marker, color=color, ms=3.0, label=f"error in {shown}")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set(xlim=edges[[0, -1]], xlabel="lag (samples)", ylabel="autocorrelation")
    # Room below the lowest step.
    ax.use_sticky_edges = False
    return ax


def plot_residual_map(
    found: xr.Dataset, ax: Axes | None = None, *, show: Literal["mean", "noise"] = "mean"
) -> Axes:
    """Draw where in the tank the prediction errors disagree with the model.

    Parameters
    ----------
    found : xarray.Dataset
        A `model_check`, or a `fit` that was checked.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    show : {"mean", "noise"}
        The mean error: its distance from zero in standard deviations as colour, its direction as
        arrows, cells beyond what chance gives framed. Or the mean square relative to that of all.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is neither, or the fit was not checked.

    Examples
    --------
    >>> plot_residual_map(check)  # doctest: +SKIP
    """
    residuals = residuals_of(found)
    ax = style.axes_or_new(ax, layout="compressed")
    if show == "mean":
        _draw_means(ax, residuals)
    else:
        _draw_noise(ax, residuals)
    draw_arena(ax, arena_of(residuals, None))
    label_position(ax)
    return ax


def plot_residual_time(
    check: xr.Dataset, ax: Axes | None = None, *, show: Literal["flow", "noise"] = "flow"
) -> Axes:
    """Draw the apparent change of the flow's strength, or of the noise, during the recording.

    Parameters
    ----------
    check : xarray.Dataset
        A `model_check`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    show : {"flow", "noise"}
        The flow's strength against its mean, or the mean square of the errors against that of all.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is no model check.

    Examples
    --------
    >>> plot_residual_time(check)  # doctest: +SKIP
    """
    _require(check)
    ax = style.axes_or_new(ax)
    start, end = running_time(check)
    middle, half = 0.5 * (start + end) / 60.0, 0.5 * (end - start) / 60.0
    name, shift = ("flow_change", 0.0) if show == "flow" else ("part_noise_ratio", 1.0)
    value = 100.0 * (check[name].values - shift)
    reach = 100.0 * BAND_STDS * check[f"{name}_std"].values
    ax.axhline(0.0, color=style.MUTED, lw=0.6)
    ax.errorbar(middle, value, xerr=half, yerr=reach, fmt="o", ms=3.0, lw=0.9, color=style.BLUE)
    if show == "flow" and np.isnan(value).any():
        words = "no point: absorbed by the fit"
        # A strip below the error bars, for the words.
        low, high = ax.get_ylim()
        ax.set_ylim(low - 0.12 * (high - low), high)
        ax.text(0.98, 0.03, words, ha="right", color=style.MUTED, transform=ax.transAxes)
    for edge in start[1:][np.diff(check["part_recording"].values) > 0] / 60.0:
        ax.axvline(edge, color=style.MUTED, lw=0.6, ls=":")
    ax.set_xlabel("time (min)")
    ax.set_ylabel(
        ("strength of the flow" if show == "flow" else "squared errors") + ", off the mean (%)"
    )
    return ax


def plot_predicted_steps(
    check: xr.Dataset,
    ax: Axes | None = None,
    *,
    show: Literal["step_length", "turning_angle"] = "step_length",
) -> Axes:
    """Draw the density of the recording's steps over the band that the fitted model makes likely.

    Parameters
    ----------
    check : xarray.Dataset
        A `model_check` with simulated recordings.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    show : {"step_length", "turning_angle"}
        Which of the two.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is no model check, or no recordings were simulated for it.

    Examples
    --------
    >>> plot_predicted_steps(check)  # doctest: +SKIP
    """
    _require(check)
    if f"{show}_edge" not in check:
        raise InputError(
            f"the check holds no simulated steps: {check.attrs.get('ks_left_out', 'left out')}"
        )
    ax = style.axes_or_new(ax)
    unit, stored, label, each = (
        ("mm", "m", LENGTH_LABEL, "% per mm")
        if show == "step_length"
        else ("°", "rad", ANGLE_LABEL, "% per degree")
    )
    edge = in_unit(check[f"{show}_edge"], unit, stored=stored)
    scale = 100.0 * float(np.ptp(check[f"{show}_edge"].values) / np.ptp(edge))
    low, median, high, real = (
        scale * check[f"{show}_density_{part}"].values
        for part in ("low", "median", "high", "recording")
    )
    band = f"{percent(check.attrs['band'])} of simulated recordings"
    ax.stairs(high, edge, baseline=low, fill=True, color=style.BLUE, alpha=0.3, lw=0, label=band)
    ax.stairs(median, edge, color=style.BLUE, lw=0.9, label="their median", baseline=None)
    ax.stairs(real, edge, color=style.ORANGE, lw=1.1, label="recording", baseline=None)
    ax.set(
        xlim=_shown(real + median, edge), ylim=(0.0, None), xlabel=label, ylabel=f"density ({each})"
    )
    return ax


def _require(check: xr.Dataset) -> None:
    require_kind(check, "model_check", "check_model makes one")


def _draw_means(ax: Axes, check: xr.Dataset) -> None:
    from matplotlib.patches import Rectangle

    x, y = (in_unit(check[axis], "cm", stored="m") for axis in ("x", "y"))
    size = 100.0 * float(check.attrs["cell_size_m"])
    distance = check["residual_distance"].values
    limit = float(check["residual_distance"].attrs["limit"])
    top = max(LEAST_TOP, float(np.nanmax(distance, initial=0.0)))
    mesh = style.speed_mesh(ax, x, y, distance, top)
    u, v = check["residual"].values[:2]
    known = np.isfinite(distance)
    # As long as the error is far from zero: a mean of few samples is large by chance.
    longer = distance / np.where(known, np.hypot(u, v), 1.0)
    u, v = u * longer, v * longer
    at_x, at_y = np.meshgrid(x, y)
    ax.quiver(
        at_x[known], at_y[known], u[known], v[known], color=style.INK, angles="xy",
        scale_units="xy", scale=top / (1.3 * size), pivot="middle", width=0.004, zorder=3,
    )  # fmt: skip
    for row, column in np.argwhere(known & (distance > limit)):
        corner = (x[column] - 0.5 * size, y[row] - 0.5 * size)
        ax.add_patch(
            Rectangle(corner, size, size, fill=False, edgecolor=style.ORANGE, lw=1.4, zorder=5)
        )
    style.add_colorbar(mesh, ax, "distance from zero (sd)")
    if (distance[known] > limit).any():
        # The limit is that of the largest of all cells.
        words = f"framed: above {limit:.1f}, by chance in one recording of twenty"
        style.add_footer(style.figure_of(ax), words)


def _draw_noise(ax: Axes, check: xr.Dataset) -> None:
    from matplotlib.colors import CenteredNorm

    x, y = (in_unit(check[axis], "cm", stored="m") for axis in ("x", "y"))
    std = check["noise_ratio_std"].values
    # A cell with one error has no spread.
    off = (check["noise_ratio"].values - 1.0) / np.where(std > 0.0, std, np.nan)
    top = max(LEAST_TOP, float(np.nanmax(np.abs(off), initial=0.0)))
    # Purple and orange: apart for colour-blind readers, white where all is well.
    mesh = ax.pcolormesh(
        x, y, off, cmap="PuOr_r", norm=CenteredNorm(0.0, halfrange=top), shading="nearest"
    )
    mesh.set_rasterized(True)
    style.add_colorbar(mesh, ax, "squared error, against the mean of all (sd)")


def running_time(check: xr.Dataset) -> tuple[Floats, Floats]:
    """Return start and end of the parts [s], recordings one after the other."""
    recording = check["part_recording"].values
    start, end = check["part_start"].values, check["part_end"].values
    lengths = [float(end[recording == k].max(initial=0.0)) for k in range(int(recording.max()) + 1)]
    before = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])[recording]
    return start + before, end + before


def _shown(density: Floats, edge: Floats) -> tuple[float, float]:
    """Return the range that holds nearly all."""
    share = np.cumsum(density * np.diff(edge))
    share = share / share[-1]
    first, last = np.searchsorted(share, [0.001, 0.999])
    return float(edge[max(first - 1, 0)]), float(edge[min(last + 1, edge.size - 1)])


def plot_own_aspects(found: xr.Dataset, ax: Axes) -> None:
    """Draw how far the parts of the recording are from each other, and name the aspects."""
    aspects = [str(name) for name in found["aspect"].values]
    place = np.arange(len(aspects))
    label = "the recording's own parts"
    ax.plot(found["own_distance"].values, place, "|", ms=9.0, mew=1.4, color=style.INK, label=label)
    ax.set_yticks(place, [ASPECT_WORDS.get(name, name) for name in aspects])
    ax.set(xlim=(0.0, None), ylim=(len(aspects) - 0.4, -0.6), xlabel="KS distance D")


def plot_check_ratios(
    one: xr.Dataset, ax: Axes, *, color: str, marker: str = "o", shift: float = 0.0
) -> None:
    """Draw the facts of one model's worlds over those of the recording."""
    recorded = one["check_recorded"].values
    place = np.arange(recorded.size, dtype=np.float64)
    low, middle, high = (one[f"check_{name}"].values for name in ("low", "median", "high"))
    # On a logarithmic axis there is no place for what is 0.
    known = (low > 0.0) & (recorded > 0.0) & np.isfinite(low + middle + high)
    low, middle, high = (part[known] / recorded[known] for part in (low, middle, high))
    ax.errorbar(
        middle, place[known] + shift, xerr=[middle - low, high - middle], fmt=marker, ms=3.0,
        lw=0.9, color=color,
    )  # fmt: skip


def label_checks(found: xr.Dataset, ax: Axes) -> None:
    """Name the facts, and draw the line on which model and recording agree."""
    names = [str(name) for name in found["check"].values]
    ax.axvline(1.0, color=style.INK, lw=0.6)
    logarithmic(ax, "x")
    # A fact that is 0 in the recording or in a world has no ratio and no point.
    known = (found["check_low"] > 0.0) & (found["check_recorded"] > 0.0)
    shown = known.any([dim for dim in known.dims if dim != "check"]).values
    words = [
        CHECK_LABELS.get(name, name) + ("" if point else " (too rare)")
        for name, point in zip(names, shown, strict=True)
    ]
    ax.set_yticks(np.arange(len(names)), words)
    ax.set(ylim=(len(names) - 0.4, -0.6), xlabel="model / recording")
