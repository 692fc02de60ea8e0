"""The figures of a calibration of many parameters: draws of pairs, profiles, and the quality."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.figures.write import Figures
from driftwalk.plot.model_check import label_checks, plot_check_ratios, plot_own_aspects
from driftwalk.plot.parts import style
from driftwalk.schema.check import require_kind

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import Locator

PANEL_MM: Final = 24.0
LEAST_MM: Final = 90.0
ABOVE_MM: Final = 14.0
PROFILE_MM: Final = 42.0
BINS: Final = 24
WORDS: Final = 11
"""Letters in a line of a label."""
PROFILES_ACROSS: Final = 4
HIGHEST_RISE: Final = 9.0
"""Top of a profile's panel: three standard deviations."""


def model_calibration_figures(model_calibration: xr.Dataset) -> Figures:
    """Return the figures of a calibration of more than two parameters.

    Parameters
    ----------
    model_calibration : xarray.Dataset
        A `model_calibration`.

    Returns
    -------
    dict of str to callable
        ``quality`` and, where they were found, ``pairs`` and ``profiles``.

    Raises
    ------
    InputError
        When the dataset is of another kind.

    Examples
    --------
    ``write_figures(model_calibration_figures(calibration), "run/figures")``
    """
    found = require_kind(model_calibration, "model_calibration")
    figures: Figures = {"quality": lambda: quality_figure(found)}
    if "draws" in found:
        figures["pairs"] = lambda: pairs_figure(found)
    if "profile_misfit" in found:
        figures["profiles"] = lambda: profiles_figure(found)
    return figures


def pairs_figure(calibration: xr.Dataset) -> Figure:
    """Return the draws of each pair of parameters, with those of each on the diagonal."""
    names = [str(name) for name in calibration["parameter"].values]
    count = len(names)
    width = max(style.DOUBLE_COLUMN_MM, PANEL_MM * count)
    figure = style.new_figure(width_mm=width, height_mm=max(LEAST_MM, PANEL_MM * count) + ABOVE_MM)
    axes = figure.subplots(count, count, sharex="col", squeeze=False)
    for row in range(count):
        for column in range(count):
            ax = axes[row, column]
            if column > row:
                ax.set_visible(False)
            elif column == row:
                _plot_one(calibration, row, ax)
            else:
                _plot_pair(calibration, column, row, ax)
            if row == count - 1:
                ax.set_xlabel(_label(calibration, column))
            if column == 0 and row:
                ax.set_ylabel(_label(calibration, row))
            elif column:
                ax.tick_params(labelleft=False)
            ax.tick_params(labelsize="x-small")
            ax.tick_params(axis="x", labelrotation=45.0)
    axes[0, 0].set_yticks([])
    figure.suptitle(
        f"{calibration.attrs['model']}: values that could have given the recording "
        "(orange: estimate)"
        + ("" if _counts(calibration) else "; they do not count, the estimate is the search's")
    )
    return figure


def profiles_figure(calibration: xr.Dataset) -> Figure:
    """Return how the misfit rises along each parameter, the others at their best."""
    from scipy.stats import chi2

    names = [str(name) for name in calibration["parameter"].values]
    across = min(PROFILES_ACROSS, len(names))
    rows = -(-len(names) // across)
    figure = style.new_figure(
        width_mm=style.DOUBLE_COLUMN_MM, height_mm=PROFILE_MM * rows + ABOVE_MM
    )
    axes = figure.subplots(rows, across, sharey=True, squeeze=False)
    confidence = float(calibration.attrs["confidence"])
    level = float(chi2.ppf(confidence, 1))
    for index, ax in enumerate(axes.flat):
        if index >= len(names):
            ax.set_visible(False)
            continue
        _plot_profile(calibration, index, level, ax)
    for ax in axes[:, 0]:
        ax.set_ylabel("rise of the misfit")
    figure.suptitle(
        f"{calibration.attrs['model']}: misfit along each parameter, the others at their best "
        f"(grey: {confidence:.0%} level; dashed: interval)"
    )
    return figure


def quality_figure(calibration: xr.Dataset) -> Figure:
    """Return the distances in each aspect, and facts that were not fitted."""
    figure = style.new_figure(width_mm=style.DOUBLE_COLUMN_MM, height_mm=72.0)
    aspects, checks = figure.subplots(1, 2)
    held = calibration["held_out_distance"].values
    name = str(calibration.attrs["model"])
    aspects.plot(held, np.arange(held.size), "o", ms=3.5, color=style.BLUE, label=name)
    plot_own_aspects(calibration, aspects, label="the recording's own parts")
    plot_check_ratios(calibration, checks, color=style.BLUE)
    label_checks(calibration, checks)
    style.letter_panels(
        [aspects, checks], ["distance from blocks not seen", "not fitted, 20 worlds"]
    )
    figure.legend(*aspects.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _plot_one(calibration: xr.Dataset, index: int, ax: Axes) -> None:
    """Draw the histogram of a parameter's draws, its interval and its estimate."""
    one = calibration.isel(parameter=index)
    values = one["draws"].values
    ax.hist(values, bins=BINS, color=style.MUTED)
    _plot_answer(one, ax)
    ax.set_yticks([])
    ax.xaxis.set_major_locator(_few_ticks())


def _plot_profile(calibration: xr.Dataset, index: int, level: float, ax: Axes) -> None:
    """Draw a parameter's profile, the level of the interval, and the interval of the draws."""
    one = calibration.isel(parameter=index)
    ax.plot(one["profile_value"].values, one["profile_misfit"].values, color=style.BLUE)
    ax.axhline(level, color=style.MUTED, lw=0.8)
    _plot_answer(one, ax)
    ax.set_ylim(0.0, HIGHEST_RISE)
    ax.xaxis.set_major_locator(_few_ticks())
    ax.set_xlabel(_label(calibration, index))


def _plot_answer(one: xr.Dataset, ax: Axes) -> None:
    """Draw a parameter's interval and estimate, and say where it is not determined."""
    for end in one["interval"].values:
        if np.isfinite(end):
            ax.axvline(float(end), color=style.BLUE, lw=0.8, ls="--")
    ax.axvline(float(one["estimate"]), color=style.ORANGE, lw=1.2)
    if not bool(one["determined"]):
        ax.set_title("not determined", loc="left", fontsize="x-small", color=style.INK)


def _plot_pair(calibration: xr.Dataset, column: int, row: int, ax: Axes) -> None:
    """Draw the draws of two parameters and the estimate."""
    across, up = (calibration.isel(parameter=index) for index in (column, row))
    ax.plot(across["draws"].values, up["draws"].values, ".", ms=1.2, color=style.BLUE, alpha=0.6)
    ax.plot(
        float(across["estimate"]), float(up["estimate"]), "+", ms=5.0, mew=1.2, color=style.ORANGE
    )
    ax.yaxis.set_major_locator(_few_ticks())


def _few_ticks() -> Locator:
    """Return ticks whose labels do not meet in a small panel: two or three."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=2, steps=[1, 2, 4, 5, 10])


def _label(calibration: xr.Dataset, index: int) -> str:
    one = calibration.isel(parameter=index)
    unit = str(one["unit"].values)
    words = fill(str(one["parameter"].values).replace("_", " "), width=WORDS)
    return words if unit == "1" else f"{words}\n[{unit}]"


def _counts(calibration: xr.Dataset) -> bool:
    return bool(calibration.attrs["estimate_from"] == "summaries")
