"""The figures of recovery studies: estimates next to the truth, and how their error falls."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.units import percent
from driftwalk.figures.write import Figures
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import logarithmic
from driftwalk.schema.check import require_kind

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN: Final = {
    "drag_coefficient": ("drag_coefficient", 1.0, "$C_d$"),
    "force_std": ("force_std_N", 1e3, "$\\sigma_F$ (mN)"),
    "tracking_noise": ("tracking_noise_m", 1e3, "tracking noise (mm)"),
}
"""Attribute that holds the truth, factor to the unit shown, and label."""
COLORS: Final = (style.BLUE, style.ORANGE, "#009E73", "#CC79A7")
"""By use of the angle."""
BETWEEN_GROUPS: Final = 2.0
"""Empty places between two groups of bars; chosen by eye."""


def plot_recovery(
    recovery: xr.Dataset, parameter: str = "drag_coefficient", ax: Axes | None = None
) -> Axes:
    """Draw the estimates of a parameter with their intervals, and the truth as a line.

    Recordings stand side by side, grouped by their length. Those that are left out of the summary
    are open.

    Parameters
    ----------
    recovery : xarray.Dataset
        Result of `recovery_study`.
    parameter : {"drag_coefficient", "force_std", "tracking_noise"}
        The parameter to draw.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is no recovery study, or the parameter is unknown.

    Examples
    --------
    ``plot_recovery(recovery, "force_std")``
    """
    require_kind(recovery, "recovery", "recovery_study makes one")
    if parameter not in SHOWN:
        raise InputError(f"parameter must be one of {', '.join(SHOWN)}, got {parameter!r}")
    attribute, factor, label = SHOWN[parameter]
    ax = style.axes_or_new(ax)
    for at, look, part in _groups(recovery):
        value, low, high = (
            factor * part[f"{parameter}{end}"].values for end in ("", "_low", "_high")
        )
        # A missing estimate is NaN, and not drawn.
        bars = {"yerr": [value - low, high - value], "ecolor": look["mec"], "elinewidth": 0.7}
        ax.errorbar(at, value, fmt="o", **bars, **look)
    truth = factor * float(recovery.attrs[attribute])
    ax.axhline(truth, color=style.INK, lw=0.7, zorder=0, label="truth")
    ax.set_ylabel(label)
    _label_groups(ax, recovery)
    return ax


def plot_flow_recovery(recovery: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the error of the flow in every recording, averaged over the block, in percent.

    Parameters
    ----------
    recovery : xarray.Dataset
        Result of `recovery_study`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is no recovery study.

    Examples
    --------
    ``plot_flow_recovery(recovery)``
    """
    require_kind(recovery, "recovery", "recovery_study makes one")
    ax = style.axes_or_new(ax)
    for at, look, part in _groups(recovery):
        ax.plot(at, 100.0 * part["flow_error"].values, "o", **look)
    # Room above: nearly equal errors would lie on the edge.
    ax.set(ylim=(0.0, 1.08 * ax.get_ylim()[1]), ylabel="flow error (% of rms speed)")
    _label_groups(ax, recovery)
    return ax


def plot_recovery_error(recovery: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw how the error of C_d falls with the length of a recording.

    Points are the rms of ln(estimate / truth), lines the law T^(-1/2) fitted to them with the band
    that the number of recordings leaves, crosses the median standard deviation that the fits state.

    Parameters
    ----------
    recovery : xarray.Dataset
        Result of `recovery_study`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is no recovery study.

    Examples
    --------
    ``plot_recovery_error(recovery)``
    """
    require_kind(recovery, "recovery", "recovery_study makes one")
    ax = style.axes_or_new(ax)
    minutes = recovery["duration"].values / 60.0
    needed = recovery["needed_duration"].values / 60.0
    drawn = np.geomspace(minutes[0] / 1.5, 1.5 * np.nanmax([minutes[-1], *needed]), 50)
    for color, angle in zip(COLORS, recovery["angle"].values, strict=False):
        part = recovery.sel(angle=angle)
        used = part["used"].values == 1
        of = f"{angle}: " if recovery.sizes["angle"] > 1 else ""
        stated = np.where(used, part["drag_coefficient_sd"].values, np.nan)
        known = used.any(axis=1)
        rms = part["rms_error"].sel(parameter="drag_coefficient").values
        ax.plot(minutes, 100.0 * rms, "o", ms=3.5, color=color, label=f"{of}measured")
        ax.plot(
            minutes[known], 100.0 * np.nanmedian(stated[known], axis=1), "x", ms=4.0, color=color,
            label=f"{of}stated by the fit",
        )  # fmt: skip
        scales = (part[f"drag_coefficient_error_scale{end}"] for end in ("_low", "", "_high"))
        low, middle, high = (100.0 * float(scale) / np.sqrt(60.0 * drawn) for scale in scales)
        law = f"{of}law $T^{{-1/2}}$ (band: {percent(recovery.attrs['needed_confidence'])})"
        ax.plot(drawn, middle, color=color, lw=0.9, label=law)
        ax.fill_between(drawn, low, high, color=color, alpha=0.15, lw=0.0)
    asked = float(recovery.attrs["drag_coefficient_precision"])
    if np.isfinite(asked):
        ax.axhline(100.0 * asked, color=style.MUTED, lw=0.7, dashes=(3, 3), label="wanted")
    if np.isfinite(recovery["drag_coefficient_error_scale"].values).any():
        # Without a point a logarithmic axis has no range.
        logarithmic(ax, "x")
        logarithmic(ax, "y")
    ax.set(xlabel="length of a recording (min)", ylabel="error of $C_d$, rms (%)")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return ax


def recovery_figures(recovery: xr.Dataset) -> Figures:
    """Return the figures of a recovery study.

    Parameters
    ----------
    recovery : xarray.Dataset
        Result of `recovery_study`.

    Returns
    -------
    dict of str to callable
        ``recovery`` and ``error_by_length``.

    Raises
    ------
    InputError
        When the dataset is no recovery study.

    Examples
    --------
    ``write_figures(recovery_figures(recovery), "recover/figures")``
    """
    require_kind(recovery, "recovery", "recovery_study makes one")
    return {
        "recovery": lambda: _recovery_figure(recovery),
        "error_by_length": lambda: style.figure_of(plot_recovery_error(recovery)),
    }


def _recovery_figure(recovery: xr.Dataset) -> Figure:
    figure, rows = style.new_panels(3, 1, height_mm=125.0, sharex=True)
    for name, ax in zip(("drag_coefficient", "force_std"), rows, strict=False):
        plot_recovery(recovery, name, ax)
    plot_flow_recovery(recovery, rows[-1])
    for ax in rows[:-1]:
        ax.set_xlabel("")
    handles, texts = rows[0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside upper right", ncols=len(texts))
    confidence = float(recovery.attrs["confidence"])
    drag = f"drag coefficient, {percent(confidence)} intervals"
    style.letter_panels(rows, [drag, "stochastic force", "flow"])
    return figure


def _groups(recovery: xr.Dataset) -> Iterator[tuple[Floats, dict[str, Any], xr.Dataset]]:
    """Give place, look and dataset of each group: recordings that are used, or left out."""
    angles = recovery["angle"].values
    count = recovery.sizes["recording"]
    for number in range(recovery.sizes["duration"]):
        for index, angle in enumerate(angles):
            part = recovery.isel(duration=number, angle=index)
            shift = 0.5 * ((index + 0.5) / len(angles) - 0.5)
            at = number * (count + BETWEEN_GROUPS) + np.arange(count) + shift
            # The legend has one entry for all lengths.
            name = f"angle {angle}" if len(angles) > 1 else "estimate"
            name = name if number == 0 else "_"
            color = COLORS[index % len(COLORS)]
            used = part["used"].values == 1
            for kept, face, label in ((used, color, name), (~used, "white", None)):
                look = {"ms": 2.4, "mfc": face, "mec": color, "mew": 0.6, "label": label}
                yield at[kept], look, part.isel(recording=kept)


def _label_groups(ax: Axes, recovery: xr.Dataset) -> None:
    """Name the lengths below the groups, and set them apart."""
    count, groups = recovery.sizes["recording"], recovery.sizes["duration"]
    first = np.arange(groups) * (count + BETWEEN_GROUPS)
    ax.set_xticks(first + 0.5 * (count - 1), [_length(s) for s in recovery["duration"].values])
    ax.tick_params(axis="x", length=0.0)
    for begin in first[1:]:
        ax.axvline(begin - 0.5 * (BETWEEN_GROUPS + 1.0), color=style.PALE, lw=0.8)
    ax.set_xlim(-1.5, first[-1] + count + 0.5)
    ax.set_xlabel(f"length of the recording; each point is one of {count}")


def _length(seconds: float) -> str:
    return f"{seconds / 60.0:g} min" if seconds >= 60.0 else f"{seconds:g} s"


def plot_model_recovery(recovery: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the errors of every parameter, with the intervals of all recordings.

    A row holds the recordings of a parameter, the first one on top. Estimates of parameters that
    their recording determines are filled circles, the others open squares.

    Parameters
    ----------
    recovery : xarray.Dataset
        A `model_recovery`.
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
    ``plot_model_recovery(recovery)``
    """
    require_kind(recovery, "model_recovery", "recover_model makes one")
    ax = style.axes_or_new(ax)
    names = [str(name) for name in recovery["parameter"].values]
    count = recovery.sizes["recording"]
    errors, ends = _percent(recovery, "error"), _percent(recovery, "error_interval", "bound")
    # The recordings of a parameter stand over seven tenths of its row.
    offsets = 0.7 * ((np.arange(count) + 0.5) / count - 0.5)
    known = recovery["determined"].transpose("recording", "parameter").values.astype(bool)
    ax.axvline(0.0, color=style.INK, lw=0.7, zorder=0)
    for row in range(len(names)):
        for kept, color, marker, face, words in (
            (known[:, row], style.BLUE, "o", style.BLUE, "determined"),
            (~known[:, row], style.ORANGE, "s", "white", "not determined"),
        ):
            at, value = (row + offsets)[kept], errors[kept, row]
            low, high = ends[kept, row].T
            # A calibration without draws has an estimate and no interval.
            ax.hlines(at, np.fmin(low, value), np.fmax(high, value), color=color, lw=0.7)
            ax.plot(
                value, at, marker, ms=2.6, mfc=face, mec=color, mew=0.7, ls="",
                label=words if row == 0 else None,
            )  # fmt: skip
        if row:
            ax.axhline(row - 0.5, color=style.PALE, lw=0.8, zorder=0)
    ax.set_yticks(np.arange(len(names)), [name.replace("_", " ") for name in names])
    ax.tick_params(axis="y", length=0.0)
    ax.set(xlim=_limits(errors, ends), ylim=(len(names) - 0.5, -0.5))
    ax.set_xlabel("error of the estimate (%)")
    return ax


def model_recovery_figures(model_recovery: xr.Dataset) -> Figures:
    """Return the figure of a recovery study of a motion model.

    Parameters
    ----------
    model_recovery : xarray.Dataset
        A `model_recovery`.

    Returns
    -------
    dict of str to callable
        ``errors``.

    Raises
    ------
    InputError
        When the dataset is of another kind.

    Examples
    --------
    ``write_figures(model_recovery_figures(recovery), "recovery/figures")``
    """
    require_kind(model_recovery, "model_recovery", "recover_model makes one")
    return {"errors": lambda: _model_figure(model_recovery)}


def _model_figure(recovery: xr.Dataset) -> Figure:
    # 13 mm for the row of a parameter, 24 mm for axis, title and legend.
    figure, (ax,) = style.new_panels(1, 1, height_mm=13.0 * recovery.sizes["parameter"] + 24.0)
    plot_model_recovery(recovery, ax)
    facts = recovery.attrs
    ax.set_title(
        f"{facts['model']}: {recovery.sizes['recording']} recordings of "
        f"{float(facts['duration_s']):g} s, {percent(facts['confidence'])} intervals",
        loc="left",
    )
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower right", ncols=2)
    return figure


def _percent(recovery: xr.Dataset, name: str, *dims: str) -> Floats:
    return np.asarray(100.0 * recovery[name].transpose("recording", "parameter", *dims).values)


def _limits(errors: Floats, ends: Floats) -> tuple[float, float]:
    """Return what is shown: everything that is finite, and not far off for a few wide ones."""
    both = np.concatenate([errors.ravel(), ends.ravel()])
    both = both[np.isfinite(both)]
    # In percent: intervals are drawn to twice the truth, in either direction.
    most = 200.0
    reach = float(np.abs(both).max()) if both.size else most
    reach = 1.08 * min(reach, most) or 1.0
    return -reach, reach
