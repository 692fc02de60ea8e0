"""How often each outcome class occurs, with simultaneous intervals (Fig. 9)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.units import percent
from driftwalk.plot.parts import style
from driftwalk.plot.parts.outcome_classes import (
    OTHER,
    check_kind,
    class_names,
    classes_to_show,
    draw_sketches_below,
    is_complete,
    names_fit,
    runs_text,
    with_rest,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

# Width of axes in one column of a page; of its 255 pt the y axis and its label take the rest.
COLUMN_PT = 210.0


def plot_outcomes(
    distribution: xr.Dataset,
    ax: Axes | None = None,
    *,
    beside: xr.Dataset | None = None,
    labels: tuple[str, str] = ("", ""),
    realisations: xr.Dataset | None = None,
) -> Axes:
    """Draw the share of runs in every outcome class as a bar over the sketch of the class.

    Thin lines are simultaneous intervals: with the stated confidence all of them hold at once.
    Diamonds are mean ± standard deviation over realisations. Up to 16 classes are all shown; of
    more, those of at least 1 %, at most 20, and the sum of the rest as "other", without interval.

    Parameters
    ----------
    distribution : xarray.Dataset
        An `outcome_distribution`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out, two columns wide for two distributions, more
        than 12 classes, or long names.
    beside : xarray.Dataset, optional
        A second `outcome_distribution`, drawn next to the first. Classes are matched by name.
    labels : tuple of str
        Names of the first and the second, for the legend.
    realisations : xarray.Dataset, optional
        Repetitions of the first distribution: ``proportion`` on (realisation, class), at least 2.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When a dataset is of another kind or lacks what is drawn, the two count mirror images
        differently, or there are fewer than 2 realisations.

    Examples
    --------
    ``plot_outcomes(distribution, beside=other, labels=("fixed", "drawn"))``
    """
    both = [distribution] if beside is None else [distribution, beside]
    for dataset in both:
        check_kind(
            dataset, "outcome_distribution", "proportion", "interval_low", "interval_high", "class"
        )
    if len({dataset.attrs.get("chirality") for dataset in both}) > 1:
        raise InputError(
            "the distributions count mirror images differently: classify both in the same way"
        )
    names = list(dict.fromkeys(name for dataset in both for name in class_names(dataset)))
    full = np.array([_on_classes(dataset["proportion"], names) for dataset in both])
    shown = classes_to_show(names, full)
    drawn = [names[index] for index in shown]
    if len(shown) < len(names):
        drawn.append(OTHER)
    # Twelve classes have room in one column of a page, if their names do.
    wide = len(both) > 1 or len(drawn) > 12 or not names_fit(drawn, COLUMN_PT)
    ax = style.axes_or_new(ax, height_mm=76.0, wide=wide)
    place = np.arange(len(drawn), dtype=np.float64)
    width = style.BAR_WIDTH / len(both)
    for index, (dataset, color) in enumerate(zip(both, (style.BLUE, style.ORANGE), strict=False)):
        at = place + (index - (len(both) - 1) / 2.0) * width
        _draw_bars(
            ax, at, _bars(dataset, names, shown), width=width, color=color,
            label=_legend_text(dataset, labels[index]),
        )  # fmt: skip
    if realisations is not None:
        at = place - (len(both) - 1) / 2.0 * width
        _draw_realisations(ax, at + 0.22 * width, realisations, names, shown)
    ax.set(xlim=(-0.6, len(drawn) - 0.4), ylim=(0.0, None), ylabel="share of runs")
    ax.spines[["top", "right"]].set_visible(False)
    notes = ["right of the line: several assemblies"] if _divide(ax, drawn) else []
    notes += [f"other: {len(names) - len(shown)} rarer classes"] if OTHER in drawn else []
    rest = f" ({'; '.join(notes)})" if notes else ""
    _legend(ax, both)
    style.settle_layout(ax)
    ax.set_xlabel(f"outcome class{rest}", labelpad=draw_sketches_below(ax, list(place), drawn))
    return ax


def _on_classes(values: xr.DataArray, names: list[str], absent: float = 0.0) -> Floats:
    """Return shares or limits in the order of `names`, with a value for those that are absent."""
    aligned = values.reindex({"class": np.array(names, dtype=object)}, fill_value=absent)
    return np.asarray(aligned.values, dtype=np.float64)


def _bars(dataset: xr.Dataset, names: list[str], shown: list[int]) -> Floats:
    """Return proportion, low and high of the classes that are drawn, shape (3, shown)."""
    proportion = _on_classes(dataset["proportion"], names)
    # A class that the dataset does not list has a share of 0, and no interval.
    ends = (_on_classes(dataset[f"interval_{end}"], names, np.nan) for end in _ENDS)
    # The rest has no interval of its own.
    none = [np.nan] * (len(shown) < len(names))
    return np.array([with_rest(proportion, shown), *(np.append(end[shown], none) for end in ends)])


_ENDS = ("low", "high")


def _draw_bars(ax: Axes, at: Floats, bars: Floats, *, width: float, color: str, label: str) -> None:
    proportion, low, high = bars
    ax.bar(at, proportion, width=0.94 * width, color=color, alpha=0.75, label=label)
    known = np.isfinite(low) & np.isfinite(high)
    # A proportion lies within its interval; rounding must not make a length negative.
    below = np.maximum(proportion - low, 0.0)[known]
    above = np.maximum(high - proportion, 0.0)[known]
    ax.errorbar(
        at[known], proportion[known], yerr=[below, above], fmt="none", ecolor=style.INK,
        elinewidth=0.8, capsize=1.6, capthick=0.8,
    )  # fmt: skip


def _draw_realisations(
    ax: Axes, at: Floats, realisations: xr.Dataset, names: list[str], shown: list[int]
) -> None:
    """Draw mean ± standard deviation over the realisations, "other" among them."""
    if "proportion" not in realisations or set(realisations["proportion"].dims) != {
        "realisation",
        "class",
    }:
        raise InputError("realisations need 'proportion' with dimensions (realisation, class)")
    table = realisations["proportion"].transpose("realisation", "class")
    if table.sizes["realisation"] < 2:
        raise InputError("one realisation has no spread: give at least 2")
    every = np.array([_on_classes(row, names) for row in table])
    kept = with_rest(every, shown, axis=1)
    ax.errorbar(
        at, kept.mean(axis=0), yerr=kept.std(axis=0, ddof=1), fmt="D", ms=2.6, mfc="white",
        mec=style.INK, mew=0.7, ecolor=style.INK, elinewidth=1.6, capsize=0.0,
        label=f"mean ± s.d. of {len(every)} realisations",
    )  # fmt: skip


def _divide(ax: Axes, drawn: list[str]) -> bool:
    """Draw a line between the classes of one assembly and those of several, where both are."""
    complete = [is_complete(name) for name in drawn]
    both = any(complete) and not all(complete[: drawn.index(OTHER) if OTHER in drawn else None])
    if both:
        ax.axvline(complete.index(False) - 0.5, color=style.MUTED, lw=0.6, dashes=(3, 3), zorder=0)
    return both


def _legend_text(dataset: xr.Dataset, label: str) -> str:
    """Return what is drawn, of how many runs, and how many of them ended as one assembly."""
    text = ": ".join(part for part in (label, runs_text(dataset)) if part)
    if "complete" in dataset.attrs:
        ends = [dataset.attrs.get(f"complete_{end}") for end in _ENDS]
        known = None not in ends
        between = f" ({percent(ends[0]).removesuffix(' %')}–{percent(ends[1])})" if known else ""
        text += f"\none assembly in {percent(dataset.attrs['complete'])}{between}"
    return text


def _legend(ax: Axes, both: list[xr.Dataset]) -> None:
    from matplotlib.lines import Line2D

    handles, texts = ax.get_legend_handles_labels()
    confidence = both[0].attrs.get("confidence")
    # The first words of the method are its name, the rest explains.
    method = str(both[0].attrs.get("method", "")).partition(",")[0].partition(";")[0]
    name = "simultaneous intervals" + (f", {method}" if method else "")
    handles.append(Line2D([], [], color=style.INK, lw=0.8, marker="_", ms=4.0))
    texts.append(f"{percent(confidence)} {name}" if confidence is not None else name)
    ax.legend(
        handles, texts, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2,
        fontsize=style.FONT_PT, frameon=False,
        ncols=2 if len(handles) > 2 and style.axes_points(ax)[0] > 380.0 else 1,
    )  # fmt: skip
