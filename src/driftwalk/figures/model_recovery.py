"""The figure of a recovery study of a motion model: every estimate over its truth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from driftwalk.figures.write import Figures
from driftwalk.plot.parts.style import (
    BLUE,
    DOUBLE_COLUMN_MM,
    INK,
    ORANGE,
    PALE,
    axes_or_new,
    new_figure,
)
from driftwalk.schema.check import require_kind

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]

ROW_MM: Final = 13.0
AROUND_MM: Final = 24.0
SPREAD: Final = 0.7
"""Part of a row over which its recordings stand."""
MOST_SHOWN: Final = 2.0
"""Intervals are drawn to this error, in either direction."""


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
    ax = axes_or_new(ax)
    names = [str(name) for name in recovery["parameter"].values]
    count = recovery.sizes["recording"]
    errors, ends = _percent(recovery, "error"), _percent(recovery, "error_interval", "bound")
    offsets = SPREAD * ((np.arange(count) + 0.5) / count - 0.5)
    known = recovery["determined"].transpose("recording", "parameter").values.astype(bool)
    ax.axvline(0.0, color=INK, lw=0.7, zorder=0)
    for row in range(len(names)):
        for kept, color, marker, face, words in (
            (known[:, row], BLUE, "o", BLUE, "determined"),
            (~known[:, row], ORANGE, "s", "white", "not determined"),
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
            ax.axhline(row - 0.5, color=PALE, lw=0.8, zorder=0)
    ax.set_yticks(np.arange(len(names)), [name.replace("_", " ") for name in names])
    ax.tick_params(axis="y", length=0.0)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_xlim(*_limits(errors, ends))
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
    return {"errors": lambda: _figure(model_recovery)}


def _figure(recovery: xr.Dataset) -> Figure:
    rows = recovery.sizes["parameter"]
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=ROW_MM * rows + AROUND_MM)
    ax = plot_model_recovery(recovery, figure.add_subplot())
    facts = recovery.attrs
    ax.set_title(
        f"{facts['model']}: {recovery.sizes['recording']} recordings of "
        f"{float(facts['duration_s']):g} s, {float(facts['confidence']):.0%} intervals",
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
    most = 100.0 * MOST_SHOWN
    reach = float(np.abs(both).max()) if both.size else most
    reach = 1.08 * min(reach, most) or 1.0
    return -reach, reach
