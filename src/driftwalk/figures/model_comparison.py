"""The figures of compared motion models: their ranking, and what was not fitted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.figures.write import Figures
from driftwalk.plot.model_check import label_checks, plot_check_ratios, plot_own_aspects
from driftwalk.plot.parts import style
from driftwalk.schema.answers.model_comparison import own_score
from driftwalk.schema.check import require_kind

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN: Final = 3
"""Models of which the facts that were not fitted are drawn."""
COLORS: Final = (style.BLUE, style.ORANGE, "#009E73")
ROW_MM: Final = 5.0
AXIS_MM: Final = 12.0
BELOW_MM: Final = 60.0
OTHERS_MM: Final = 82.0
MARKERS: Final = ("o", "s", "^")


def comparison_figures(comparison: xr.Dataset) -> Figures:
    """Return the figure of a comparison of motion models.

    Parameters
    ----------
    comparison : xarray.Dataset
        A `model_comparison`.

    Returns
    -------
    dict of str to callable
        ``models``.

    Raises
    ------
    InputError
        When the dataset is of another kind.

    Examples
    --------
    ``write_figures(comparison_figures(comparison), "compare/figures")``
    """
    require_kind(comparison, "model_comparison")
    return {"models": lambda: _figure(comparison)}


def _figure(comparison: xr.Dataset) -> Figure:
    rows = comparison.sizes["model"]
    figure = style.new_figure(width_mm=style.DOUBLE_COLUMN_MM, height_mm=ROW_MM * rows + OTHERS_MM)
    grid = figure.add_gridspec(2, 2, height_ratios=(ROW_MM * rows + AXIS_MM, BELOW_MM))
    scores = figure.add_subplot(grid[0, :])
    aspects, checks = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
    plot_models(comparison, scores)
    _plot_aspects(comparison, aspects)
    _plot_checks(comparison, checks)
    style.letter_panels(
        [scores, aspects, checks],
        ["on blocks that none was fitted to", "the same by aspect", "not fitted, 20 worlds"],
    )
    return figure


def plot_models(comparison: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Plot how far each motion model is from the part of a recording that none was fitted to.

    Parameters
    ----------
    comparison : xarray.Dataset
        A `model_comparison`.
    ax : matplotlib.axes.Axes, optional
        Where to plot; a new figure when left out.

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
    ``plot_models(comparison)``
    """
    require_kind(comparison, "model_comparison")
    ax = style.axes_or_new(ax)
    shown = comparison.isel(model=slice(None, None, -1))
    place = np.arange(shown.sizes["model"])
    for baseline, color, marker in ((False, style.BLUE, "o"), (True, style.MUTED, "D")):
        of = shown["baseline"].values.astype(bool) == baseline
        if of.any():
            ax.errorbar(
                shown["score"].values[of],
                place[of],
                xerr=shown["score_std"].values[of],
                fmt=marker,
                ms=3.5,
                lw=0.9,
                capsize=2.0,
                color=color,
                label="walk of recorded steps" if baseline else "motion model",
            )
    own = own_score(comparison)
    ax.axvline(own, color=style.INK, lw=0.6, ls="--", label="the recording's own parts")
    names = [
        str(name) if walk else f"{name} ({verdict})"
        for name, walk, verdict in zip(
            *(shown[of].values for of in ("model", "baseline", "verdict")), strict=True
        )
    ]
    ax.set_yticks(place, names)
    ax.set_ylim(-0.6, place.size - 0.4)
    ax.set_xlim(left=0.0)
    ax.set_xlabel("distance, mean of D / floor over the aspects")
    ax.legend(loc="lower left")
    return ax


def _plot_aspects(comparison: xr.Dataset, ax: Axes) -> None:
    """Draw the distances of the first models in each aspect, and the recording's own."""
    place = np.arange(comparison.sizes["aspect"])
    for one, color, marker in _first(comparison):
        held, name = one["held_out_distance"].values, str(one["model"].values)
        ax.plot(held, place, marker, ms=3.5, color=color, label=name)
    plot_own_aspects(comparison, ax, label="own")
    # Room for the names: points are anywhere on the left.
    ax.set_xlim(0.0, 1.6 * ax.get_xlim()[1])
    ax.legend(loc="best")


def _plot_checks(comparison: xr.Dataset, ax: Axes) -> None:
    """Draw facts that were not fitted, over those of the recording."""
    for index, (one, color, marker) in enumerate(_first(comparison)):
        plot_check_ratios(one, ax, color=color, marker=marker, shift=0.2 * (index - 1))
    label_checks(comparison, ax)


def _first(comparison: xr.Dataset) -> list[tuple[xr.Dataset, str, str]]:
    """Return the first models with their colours and markers."""
    count = min(SHOWN, comparison.sizes["model"])
    models = [comparison.isel(model=index) for index in range(count)]
    return list(zip(models, COLORS, MARKERS, strict=False))
