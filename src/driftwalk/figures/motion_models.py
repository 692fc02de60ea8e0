"""The figures of motion models: the calibration of one, and the comparison of several."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from textwrap import fill
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.units import percent, raised_powers
from driftwalk.figures.write import Figures
from driftwalk.plot.model_check import label_checks, plot_check_ratios, plot_own_aspects
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import model_words
from driftwalk.schema.answers.model_comparison import own_score
from driftwalk.schema.answers.parts import each
from driftwalk.schema.check import require_kind

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import Locator

LOOKS: Final = ((style.BLUE, "o"), (style.ORANGE, "s"), ("#009E73", "^"))
"""Colours and markers of the first models of a comparison, whose facts are drawn."""
NOT_FITTED: Final = "not fitted (bars: 20 simulations)"


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
    if "posterior_sample" in found:
        figures["pairs"] = lambda: pairs_figure(found)
    if "profile_discrepancy" in found:
        figures["profiles"] = lambda: profiles_figure(found)
    return figures


def pairs_figure(calibration: xr.Dataset) -> Figure:
    """Return the draws of each pair of parameters, with each parameter's on the diagonal."""
    from matplotlib.ticker import MaxNLocator

    count = calibration.sizes["parameter"]
    # 24 mm for a panel, 14 mm for the title.
    width, height = (max(least, 24.0 * count) for least in (style.DOUBLE_COLUMN_MM, 90.0))
    figure, axes = style.new_panels(
        count, count, width_mm=width, height_mm=height + 14.0, sharex="col"
    )
    for index, ax in enumerate(axes):
        row, column = divmod(index, count)
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
        ax.xaxis.set_major_locator(MaxNLocator(2))
    counts = calibration.attrs["estimate_from"] == "summaries"
    figure.suptitle(
        f"{model_words(calibration.attrs['model'])}: values that could have given the recording "
        "(orange: estimate, dashed: interval)"
        + ("" if counts else "; they do not count, the estimate is the search's")
    )
    return figure


def profiles_figure(calibration: xr.Dataset) -> Figure:
    """Return how the discrepancy rises along each parameter, the others at their best."""
    from scipy.stats import chi2

    count = calibration.sizes["parameter"]
    across = min(4, count)
    rows = -(-count // across)
    # 42 mm for a profile, 14 mm for the title.
    figure, axes = style.new_panels(rows, across, height_mm=42.0 * rows + 14.0, sharey=True)
    confidence = float(calibration.attrs["confidence"])
    level = float(chi2.ppf(confidence, 1))
    for index, ax in enumerate(axes[:count]):
        _plot_profile(calibration, index, level, ax)
    for ax in axes[count:]:
        ax.set_visible(False)
    for ax in axes[::across]:
        ax.set_ylabel("rise of the discrepancy")
    figure.suptitle(
        f"{model_words(calibration.attrs['model'])}: discrepancy along each parameter, the others "
        f"at their best (orange: estimate, dashed: interval, grey: {percent(confidence)} level)"
    )
    return figure


def quality_figure(calibration: xr.Dataset) -> Figure:
    """Return the distances in each aspect, and facts that were not fitted."""
    figure, row = style.new_panels(1, 2, height_mm=72.0)
    aspects, checks = row
    held = calibration["held_out_distance"].values
    name = model_words(calibration.attrs["model"])
    aspects.plot(held, np.arange(held.size), "o", ms=3.5, color=style.BLUE, label=name)
    plot_own_aspects(calibration, aspects)
    plot_check_ratios(calibration, checks, color=style.BLUE)
    label_checks(calibration, checks)
    style.letter_panels(row, ["distance from blocks not seen", NOT_FITTED])
    style.legend_above(figure, aspects, 2)
    return figure


def _plot_one(calibration: xr.Dataset, index: int, ax: Axes) -> None:
    """Draw the histogram of a parameter's draws, its interval and its estimate."""
    one = calibration.isel(parameter=index)
    look: dict[str, Any] = {"color": style.PALE, "ec": style.MUTED, "lw": 0.8}
    ax.hist(one["posterior_sample"].values, bins=24, histtype="stepfilled", **look)
    _plot_answer(one, ax)
    ax.set_yticks([])


def _plot_profile(calibration: xr.Dataset, index: int, level: float, ax: Axes) -> None:
    """Draw a parameter's profile, the level of the interval, and the interval of the draws."""
    one = calibration.isel(parameter=index)
    ax.plot(one["profile_value"].values, one["profile_discrepancy"].values, color=style.BLUE)
    ax.axhline(level, color=style.MUTED, lw=0.8)
    _plot_answer(one, ax)
    # Three standard deviations.
    ax.set_ylim(0.0, 9.0)
    ax.xaxis.set_major_locator(_few_ticks())
    ax.set_xlabel(_label(calibration, index))


def _plot_answer(one: xr.Dataset, ax: Axes) -> None:
    """Draw a parameter's interval and estimate, and say whether it is determined."""
    for end in one["interval"].values:
        if np.isfinite(end):
            ax.axvline(float(end), color=style.BLUE, lw=0.8, ls="--")
    ax.axvline(float(one["estimate"]), color=style.ORANGE, lw=1.2)
    # In every panel: rows with and without a title would be unequal.
    word = "determined" if bool(one["determined"]) else "not determined"
    ax.set_title(f"{word}\n{_width(one)}", loc="left")


def _width(one: xr.Dataset) -> str:
    """Return how wide the interval of a parameter is, nothing where there is none."""
    half, value = float(one["half_width"]), float(one["estimate"])
    if np.isnan(half):
        return ""
    if np.isinf(half):
        return "(to an end of the range)"
    if str(one["scale"].values) == "log":
        return f"(± {100.0 * half:.2g} %)"
    low, high = one["interval"].values
    # Next to 0 a part of the value says nothing.
    return f"(± {50.0 * (high - low) / abs(value):.2g} %)" if low * high > 0.0 else "(0 is within)"


def _plot_pair(calibration: xr.Dataset, column: int, row: int, ax: Axes) -> None:
    """Draw the draws of two parameters and the estimate."""
    both = [calibration.isel(parameter=index) for index in (column, row)]
    draws = (one["posterior_sample"].values for one in both)
    ax.plot(*draws, ".", ms=1.2, color=style.BLUE, alpha=0.6)
    ax.plot(*(float(one["estimate"]) for one in both), "+", ms=5.0, mew=1.2, color=style.ORANGE)
    ax.yaxis.set_major_locator(_few_ticks())


def _few_ticks() -> Locator:
    """Return ticks whose labels do not meet in a small panel: two or three."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=2, steps=[1, 2, 4, 5, 10])


def _label(calibration: xr.Dataset, index: int) -> str:
    one = calibration.isel(parameter=index)
    unit = str(one["unit"].values)
    words = fill(str(one["parameter"].values).replace("_", " "), width=11)
    return words if unit == "1" else f"{words}\n({raised_powers(unit)})"


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
    # 5 mm for a model, 12 mm for the axis below them, 60 mm for the panels in the second row.
    ranking_mm = 5.0 * comparison.sizes["model"]
    figure = style.new_figure(width_mm=style.DOUBLE_COLUMN_MM, height_mm=ranking_mm + 82.0)
    grid = figure.add_gridspec(2, 2, height_ratios=(ranking_mm + 12.0, 60.0))
    parts: dict[str, tuple[Any, Callable[..., object]]] = {
        "held-out blocks": (grid[0, :], plot_models),
        "the same by aspect": (grid[1, 0], _plot_aspects),
        NOT_FITTED: (grid[1, 1], _plot_checks),
    }
    panels = [figure.add_subplot(place) for place, _ in parts.values()]
    for ax, (_, draw) in zip(panels, parts.values(), strict=True):
        draw(comparison, ax)
    style.letter_panels(panels, list(parts))
    # Of the colours of both panels of the second row.
    handles, names = panels[1].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=len(names))
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
    # The colours of LOOKS belong to single models.
    walks = shown["baseline"].values.astype(bool)
    draw = partial(ax.errorbar, ms=3.5, lw=0.9, capsize=2.0)
    for of, color, marker, label in (
        (~walks, style.INK, "o", "motion model"),
        (walks, style.MUTED, "D", "walk of recorded steps"),
    ):
        if of.any():
            score, error = (shown[name].values[of] for name in ("score", "score_std"))
            draw(score, place[of], xerr=error, fmt=marker, color=color, label=label)
    own = own_score(comparison)
    ax.axvline(own, color=style.INK, lw=0.6, ls="--", label="the recording's own parts")
    columns = (shown[of].values for of in ("model", "baseline", "verdict"))
    names = [
        name if walk else f"{model_words(name)} ({verdict})"
        for name, walk, verdict in zip(*columns, strict=True)
    ]
    ax.set_yticks(place, names)
    ax.set(xlim=(0.0, None), ylim=(-0.6, place.size - 0.4))
    ax.set_xlabel("distance, mean of D / floor over the aspects")
    # Above: points and the line of the recording's own parts are anywhere.
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.0)
    return ax


def _plot_aspects(comparison: xr.Dataset, ax: Axes) -> None:
    """Draw the distances of the first models in each aspect, and the recording's own."""
    place = np.arange(comparison.sizes["aspect"])
    for index, (one, (color, marker)) in enumerate(_first(comparison)):
        held, name = one["held_out_distance"].values, model_words(str(one["model"].values))
        ax.plot(held, place + 0.2 * (index - 1), marker, ms=3.5, color=color, label=name)
    plot_own_aspects(comparison, ax)


def _plot_checks(comparison: xr.Dataset, ax: Axes) -> None:
    """Draw facts that were not fitted, over the recording's."""
    for index, (one, (color, marker)) in enumerate(_first(comparison)):
        plot_check_ratios(one, ax, color=color, marker=marker, shift=0.2 * (index - 1))
    label_checks(comparison.isel(model=slice(len(LOOKS))), ax)


def _first(comparison: xr.Dataset) -> list[tuple[xr.Dataset, tuple[str, str]]]:
    """Return the first models with their colours and markers."""
    return list(zip(each(comparison, "model"), LOOKS, strict=False))
