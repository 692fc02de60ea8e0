"""How assemblies grow over time: outcome classes, contact and completion, sizes."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.units import percent
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import number_fact
from driftwalk.plot.parts.outcome_classes import (
    NAME_SIZE_PT,
    OTHER,
    are_discs,
    check_kind,
    class_colors,
    class_names,
    classes_to_show,
    is_complete,
    name_text,
    place_sketch,
    runs_text,
    sketch_sizes,
    with_rest,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

# Share of the height between two labels at the right edge.
LABEL_GAP: Final = 0.012
TIME_LABEL: Final = "time (s)"
SURVIVAL: Final = {
    "first_contact": ("no two blocks have met", style.BLUE, "-"),
    "completion": ("not yet one assembly", style.ORANGE, (0, (5, 2))),
}
"""Words, colour and dashes of each time until an event."""

COMPACT: Final = "compactness"
DASHES: Final = ("-", (0, (5, 2)), (0, (1, 1.5)))
"""Of the curves of one figure, in their order: apart without colours; chosen by eye."""
GROWTH: Final = {
    "mean size": {"mean_size": "mean size"},
    "shares": {
        "largest_share": "in the largest assembly",
        "free_share": "alone",
        COMPACT: COMPACT,
    },
}


def plot_class_times(
    times: xr.Dataset, ax: Axes | None = None, *, form: Literal["lines", "stacked"] = "stacked"
) -> Axes:
    """Draw the share of runs in every outcome class over time, labelled at the right edge.

    Hues are classes of one assembly, greys those of several. Of more than 16 classes, those that
    reach 1 % at some time are shown, at most 20, and the sum of the rest as "other".

    Parameters
    ----------
    times : xarray.Dataset
        A `class_times`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    form : {"lines", "stacked"}
        One line per class, or areas on top of each other, the first class at the bottom.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is of another kind, or the form is not known.

    Examples
    --------
    ``plot_class_times(times, form="lines")``
    """
    if form not in ("lines", "stacked"):
        raise InputError(f"form='{form}': choose lines or stacked")
    check_kind(times, "class_times", "proportion", "time", "class")
    ax = style.axes_or_new(ax, height_mm=75.0)
    time = np.asarray(times["time"].values, dtype=np.float64)
    names, proportion = _shown(times)
    colors = class_colors(names)
    ax.set_xlim(time[0], time[-1])
    if form == "stacked":
        ax.stackplot(
            time, proportion, colors=[colors[name] for name in names], labels=names,
            edgecolor="white", linewidth=0.3,
        )  # fmt: skip
        ax.set_ylim(0.0, 1.0)
        # Rounding in the file: the top of the last area is the top of the axes.
        height = np.cumsum(proportion[:, -1]) - proportion[:, -1] / 2.0
    else:
        for name, line in zip(names, proportion, strict=True):
            ax.plot(
                time, line, color=colors[name], label=name, ls="-" if is_complete(name) else "--"
            )
        ax.set_ylim(0.0, min(1.0, 1.08 * float(np.nanmax(proportion))) or 1.0)
        height = proportion[:, -1]
    # Those too that are empty at the end: their areas have no other name.
    kept = np.flatnonzero(proportion.max(axis=1) > 0.0)
    label_right(ax, [names[index] for index in kept], height[kept], colors)
    ax.set(xlabel=TIME_LABEL, ylabel="share of runs")
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_title(runs_text(times), loc="left")
    return ax


def plot_attraction(attraction: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the force between two blocks against the gap between them.

    Parameters
    ----------
    attraction : xarray.Dataset
        An `attraction`.
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
    ``plot_attraction(dw.assembly.attraction(study)).figure.savefig("attraction.png")``
    """
    check_kind(attraction, "attraction", "gap", "force", "simulated_force")
    ax = style.axes_or_new(ax, height_mm=65.0)
    gap = 1e3 * np.asarray(attraction["gap"].values, dtype=np.float64)
    for name, text, color, dashes in (
        ("force", "as stated", style.BLUE, "-"),
        ("simulated_force", "in the simulation", style.ORANGE, (0, (5, 2))),
    ):
        force = 1e3 * np.asarray(attraction[name].values, dtype=np.float64)
        ax.plot(gap, np.where(force > 0.0, force, np.nan), color=color, ls=dashes, label=text)
    ax.set(
        xlabel="gap between the faces (mm)", ylabel="attraction (mN)", yscale="log",
        xlim=(0.0, gap[-1]),
    )  # fmt: skip
    stated = 1e3 * np.asarray(attraction["force"].values, dtype=np.float64)
    if (stated > 0.0).any():
        # That of the simulation goes to 0 at the end of its reach.
        ax.set_ylim(bottom=0.5 * stated[stated > 0.0].min())
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False)
    ax.set_title(fill(str(attraction.attrs["between"]), 56), loc="left")
    return ax


def plot_survival(times: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the shares of runs without contact yet, and without completion yet, with their bands.

    Parameters
    ----------
    times : xarray.Dataset
        A `class_times` with ``first_contact`` or ``completion``, or both.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is of another kind, or has neither curve.

    Examples
    --------
    ``plot_survival(times).figure.savefig("survival.png")``
    """
    check_kind(times, "class_times", "time")
    curves = [name for name in SURVIVAL if name in times]
    if not curves:
        raise InputError(f"the dataset 'class_times' lacks {' and '.join(SURVIVAL)}")
    ax = style.axes_or_new(ax, height_mm=65.0)
    time = np.asarray(times["time"].values, dtype=np.float64)
    for name in curves:
        text, color, dashes = SURVIVAL[name]
        ax.plot(time, times[name].values, color=color, ls=dashes, label=text, lw=1.3)
        if f"{name}_low" in times and f"{name}_high" in times:
            ax.fill_between(
                time, times[f"{name}_low"].values, times[f"{name}_high"].values, color=color,
                alpha=0.2, lw=0,
            )  # fmt: skip
    ax.set(xlim=(time[0], time[-1]), ylim=(0.0, 1.02), xlabel=TIME_LABEL, ylabel="share of runs")
    ax.spines[["top", "right"]].set_visible(False)
    confidence = number_fact(times, "confidence")
    bands = f"bands: {percent(confidence)}" if np.isfinite(confidence) else ""
    ax.set_title(", ".join(part for part in (runs_text(times), bands) if part), loc="left")
    style.legend_below(ax, 1)
    return ax


def drawn_classes(times: xr.Dataset) -> list[str]:
    """Return the names of the classes that `plot_class_times` labels."""
    return [name for name, share in zip(*_shown(times), strict=True) if share.max() > 0.0]


def _shown(times: xr.Dataset) -> tuple[list[str], Floats]:
    """Return the names drawn and their shares (class, time)."""
    names = class_names(times)
    proportion = np.asarray(times["proportion"].transpose("class", "time").values, dtype=np.float64)
    shown = classes_to_show(names, proportion.T)
    others = [OTHER] if len(shown) < len(names) else []
    return [*(names[index] for index in shown), *others], with_rest(proportion, shown)


def label_right(ax: Axes, names: list[str], height: Floats, colors: dict[str, str]) -> None:
    """Put sketch and name of every class at its end, moved apart where they would meet."""
    style.settle_layout(ax)
    total_pt = float(style.axes_points(ax)[1])
    low, high = ax.get_ylim()
    share = (height - low) / (high - low)
    across, tall = sketch_sizes(names).T
    free_pt = (1.0 - LABEL_GAP * len(names)) * total_pt
    # A shape of two rows is 9 pt high at most.
    cell_pt = min(4.5, free_pt / max(float(tall.sum()), 1.0))
    needed = np.maximum(tall * cell_pt, NAME_SIZE_PT) / total_pt
    place = spread_apart(share, needed + LABEL_GAP)
    wide = float(across.max(initial=1.0))
    leader = {"arrowstyle": "-", "lw": 0.4, "color": style.MUTED, "shrinkA": 0, "shrinkB": 0}
    for name, at, end in zip(names, place, share, strict=True):
        ax.annotate(
            "", (1.0, end), xytext=(8.0, (at - end) * total_pt), xycoords="axes fraction",
            textcoords="offset points", annotation_clip=False, arrowprops=leader,
        )  # fmt: skip
        if name != OTHER:
            place_sketch(
                ax, name, (1.0, at), transform="axes fraction", alignment=(0.0, 0.5),
                cell_pt=cell_pt, color=colors[name], shift_pt=(10.0, 0.0),
                discs=are_discs(*names),
            )  # fmt: skip
        ax.annotate(
            name_text(name), (1.0, at), xytext=(13.0 + wide * cell_pt, 0.0),
            xycoords="axes fraction", textcoords="offset points", va="center",
            size=NAME_SIZE_PT, color=style.INK, annotation_clip=False,
        )  # fmt: skip


def spread_apart(wanted: Floats, size: Floats) -> Floats:
    """Move places on a line apart so that things of these sizes do not overlap, within [0, 1].

    Parameters
    ----------
    wanted : array, shape (n,)
        Where the middles would be best.
    size : array, shape (n,)
        How long the things are; when their sum exceeds 1 they are shrunk to fit.

    Returns
    -------
    array, shape (n,)
        Middles, in the order of `wanted`, with the smallest sum of squared moves for this order.

    Examples
    --------
    >>> spread_apart(np.array([0.5, 0.5]), np.array([0.2, 0.2])).round(6).tolist()
    [0.4, 0.6]
    """
    from scipy.optimize import isotonic_regression

    size = size / max(1.0, float(size.sum()))
    order = np.argsort(wanted, kind="stable")
    half = size[order] / 2.0
    # What lies before a thing, packed tightly: the middles minus this need only not decrease.
    packed = np.cumsum(size[order]) - half
    # It refuses an empty sequence.
    level = isotonic_regression(wanted[order] - packed).x if wanted.size else packed
    level = np.clip(level, 0.0, 1.0 - float(size.sum()))
    place = np.empty_like(wanted, dtype=np.float64)
    place[order] = level + packed
    return place


def plot_assembly_sizes(
    sizes: xr.Dataset,
    ax: Axes | None = None,
    *,
    beside: xr.Dataset | None = None,
    labels: tuple[str, str] = ("", ""),
) -> Axes:
    """Draw which share of the blocks is in assemblies of each size at the end of the runs.

    Parameters
    ----------
    sizes : xarray.Dataset
        An `assembly_sizes`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    beside : xarray.Dataset, optional
        A second one of as many blocks, drawn next to the first.
    labels : tuple of str
        Names of the first and the second, for the legend.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When a dataset is of another kind or lacks what is drawn.

    Examples
    --------
    ``plot_assembly_sizes(sizes).figure.savefig("sizes.png")``
    """
    both = [sizes] if beside is None else [sizes, beside]
    for one in both:
        check_kind(one, "assembly_sizes", "size", "size_to", "block_share")
    ax = style.axes_or_new(ax, height_mm=65.0)
    place = np.arange(sizes.sizes["size"])
    height = style.BAR_WIDTH / len(both)
    for index, (one, color) in enumerate(zip(both, (style.BLUE, style.ORANGE), strict=False)):
        share, low, high = (one[f"block_share{end}"].values for end in ("", "_low", "_high"))
        ax.barh(
            place + (index - (len(both) - 1) / 2) * height, share, height, color=color,
            xerr=None if np.isnan(low).any() else [share - low, high - share],
            error_kw={"elinewidth": 0.8}, label=labels[index] or None,
        )  # fmt: skip
    ends = zip(sizes["size"].values, sizes["size_to"].values, strict=True)
    ax.set_yticks(place, [str(a) if a == b else f"{a}–{b}" for a, b in ends])
    ax.set(xlim=(0.0, None), xlabel="share of the blocks", ylabel="blocks in the assembly")
    ax.invert_yaxis()
    _finish(ax, both)
    return ax


def plot_growth(
    sizes: xr.Dataset,
    ax: Axes | None = None,
    *,
    beside: xr.Dataset | None = None,
    labels: tuple[str, str] = ("", ""),
    what: Literal["mean size", "shares"] = "mean size",
) -> Axes:
    """Draw how assemblies grow over time, with the bands of the means over runs.

    Parameters
    ----------
    sizes : xarray.Dataset
        An `assembly_sizes`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    beside : xarray.Dataset, optional
        A second one, drawn in the second colour.
    labels : tuple of str
        Names of the first and the second, for the legend.
    what : {"mean size", "shares"}
        The mean size of the assemblies, or the shares of the blocks that are in the largest
        assembly and alone, with the compactness.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When a dataset is of another kind or lacks what is drawn, or `what` is not known.

    Examples
    --------
    ``plot_growth(sizes, what="shares")``
    """
    if what not in GROWTH:
        raise InputError(f"what='{what}': choose {' or '.join(GROWTH)}")
    both = [sizes] if beside is None else [sizes, beside]
    # Older files have no compactness.
    curves = {
        name: words for name, words in GROWTH[what].items() if name in sizes or name != COMPACT
    }
    for one in both:
        check_kind(one, "assembly_sizes", "time", *curves)
    ax = style.axes_or_new(ax, height_mm=65.0)
    time = sizes["time"].values
    for one, color, label in zip(both, (style.BLUE, style.ORANGE), labels, strict=False):
        for (name, words), dashes in zip(curves.items(), DASHES, strict=False):
            # Dashes are named once, and then the colour of the second one.
            named = words if len(curves) > 1 and one is sizes else ""
            text = named or (label if name == next(iter(curves)) else "")
            ax.plot(one["time"], one[name], color=color, ls=dashes, lw=1.3, label=text or None)
            ends = (one[f"{name}_low"].values, one[f"{name}_high"].values)
            ax.fill_between(one["time"].values, *ends, color=color, alpha=0.2, lw=0)
    ax.set(xlim=(time[0], time[-1]), ylim=(0.0, None))
    if what == "shares":
        ax.set_ylim(0.0, 1.02)
    ax.set_xlabel(TIME_LABEL)
    share = "share of the blocks" + (f", {COMPACT}" if COMPACT in curves else "")
    ax.set_ylabel("blocks per assembly, mean" if what == "mean size" else share)
    _finish(ax, both)
    return ax


def _finish(ax: Axes, both: list[xr.Dataset]) -> None:
    """Say of how many runs it is, and name the curves where there are several."""
    ax.spines[["top", "right"]].set_visible(False)
    intervals = f"intervals: {percent(both[0].attrs['confidence'])}"
    ax.set_title(", ".join(part for part in (runs_text(both[0]), intervals) if part), loc="left")
    if ax.get_legend_handles_labels()[1]:
        style.legend_below(ax, 2)
