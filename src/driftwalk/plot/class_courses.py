"""How the outcome classes come about over time, and how long contact and completion take."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.plot.parts.assembly_labels import (
    OTHER,
    check_kind,
    class_colors,
    class_names,
    classes_to_show,
    is_complete,
    percent,
    runs_text,
)
from driftwalk.plot.parts.labels import number_fact
from driftwalk.plot.parts.polyomino_sketch import (
    NAME_SIZE_PT,
    axes_points,
    class_cells,
    name_text,
    place_sketch,
    sketch_size,
)
from driftwalk.plot.parts.style import BLUE, INK, MUTED, ORANGE, axes_or_new

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]
# Share of the height between two labels at the right edge, and their largest sketch [pt].
LABEL_GAP: Final = 0.012
SKETCH_PT: Final = 9.0
TIME_LABEL: Final = "time (s)"
SURVIVAL: Final = {
    "first_contact": ("no two blocks have met", BLUE, "-"),
    "completion": ("more than one assembly", ORANGE, (0, (5, 2))),
}


def plot_class_times(
    times: xr.Dataset, ax: Axes | None = None, *, form: Literal["lines", "stacked"] = "stacked"
) -> Axes:
    """Draw the proportion of runs in every outcome class over time, labelled at the right edge.

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
    ax = axes_or_new(ax, height_mm=75.0)
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
        labelled = proportion[:, -1] > 0.0
    else:
        for name, line in zip(names, proportion, strict=True):
            ax.plot(
                time, line, color=colors[name], label=name, ls="-" if is_complete(name) else "--"
            )
        ax.set_ylim(0.0, min(1.0, 1.08 * float(np.nanmax(proportion))) or 1.0)
        height = proportion[:, -1]
        labelled = proportion.max(axis=1) > 0.0
    kept = np.flatnonzero(labelled)
    _label_right(ax, [names[index] for index in kept], height[kept], colors)
    ax.set_xlabel(TIME_LABEL)
    ax.set_ylabel("proportion of runs")
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_title(runs_text(times), loc="left")
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
    ax = axes_or_new(ax, height_mm=65.0)
    time = np.asarray(times["time"].values, dtype=np.float64)
    for name in curves:
        text, color, dashes = SURVIVAL[name]
        ax.plot(time, times[name].values, color=color, ls=dashes, label=text, lw=1.3)
        if f"{name}_low" in times and f"{name}_high" in times:
            ax.fill_between(
                time, times[f"{name}_low"].values, times[f"{name}_high"].values, color=color,
                alpha=0.2, lw=0,
            )  # fmt: skip
    ax.set_xlim(time[0], time[-1])
    ax.set_ylim(0.0, 1.02)
    ax.set_xlabel(TIME_LABEL)
    ax.set_ylabel("proportion of runs")
    ax.spines[["top", "right"]].set_visible(False)
    confidence = number_fact(times, "confidence")
    bands = f"bands: {percent(confidence)}" if np.isfinite(confidence) else ""
    ax.set_title(", ".join(part for part in (runs_text(times), bands) if part), loc="left")
    ax.legend(loc="upper right")
    return ax


def _shown(times: xr.Dataset) -> tuple[list[str], Array]:
    """Return the names drawn and their proportions (class, time)."""
    names = class_names(times)
    proportion = np.asarray(times["proportion"].transpose("class", "time").values, dtype=np.float64)
    shown = classes_to_show(names, proportion.max(axis=1))
    drawn, kept = [names[index] for index in shown], proportion[shown]
    if len(shown) < len(names):
        drawn.append(OTHER)
        kept = np.vstack([kept, np.delete(proportion, shown, axis=0).sum(axis=0)])
    return drawn, kept


def _label_right(ax: Axes, names: list[str], height: Array, colors: dict[str, str]) -> None:
    """Put sketch and name of every class at its end, moved apart where they would meet."""
    total_pt = float(axes_points(ax)[1])
    low, high = ax.get_ylim()
    share = (height - low) / (high - low)
    known = [name != OTHER for name in names]
    tall = np.array(
        [
            sketch_size(class_cells(name))[1] if there else 1.0
            for name, there in zip(names, known, strict=True)
        ]
    )
    free_pt = (1.0 - LABEL_GAP * len(names)) * total_pt
    cell_pt = min(SKETCH_PT / 2.0, free_pt / max(float(tall.sum()), 1.0))
    needed = np.maximum(tall * cell_pt, NAME_SIZE_PT) / total_pt
    place = spread_apart(share, needed + LABEL_GAP)
    wide = max(
        (sketch_size(class_cells(n))[0] for n, there in zip(names, known, strict=True) if there),
        default=1.0,
    )
    for name, there, at, end in zip(names, known, place, share, strict=True):
        ax.annotate(
            "", (1.0, end), xytext=(8.0, (at - end) * total_pt), xycoords="axes fraction",
            textcoords="offset points", annotation_clip=False,
            arrowprops={"arrowstyle": "-", "lw": 0.4, "color": MUTED, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip
        if there:
            _sketch_at(ax, name, at, cell_pt, colors[name])
        ax.annotate(
            name_text(name), (1.0, at), xytext=(13.0 + wide * cell_pt, 0.0),
            xycoords="axes fraction", textcoords="offset points", va="center",
            size=NAME_SIZE_PT, color=INK, annotation_clip=False,
        )  # fmt: skip


def _sketch_at(ax: Axes, name: str, at: float, cell_pt: float, color: str) -> None:
    artist = place_sketch(
        ax, name, (1.0, at), transform="axes fraction", alignment=(0.0, 0.5), cell_pt=cell_pt,
        color=color,
    )  # fmt: skip
    artist.xybox = (10.0, 0.0)


def spread_apart(wanted: Array, size: Array) -> Array:
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
    size = size / max(1.0, float(size.sum()))
    order = np.argsort(wanted, kind="stable")
    half = size[order] / 2.0
    # What lies before a thing, packed tightly: the middles minus this need only not decrease.
    packed = np.cumsum(size[order]) - half
    level = _isotonic(wanted[order] - packed)
    level = np.clip(level, 0.0, 1.0 - float(size.sum()))
    place = np.empty_like(wanted, dtype=np.float64)
    place[order] = level + packed
    return place


def _isotonic(values: Array) -> Array:
    """Return the nearest sequence that does not decrease: neighbours that do are pooled."""
    blocks: list[tuple[float, int]] = []
    for value in values:
        mean, count = float(value), 1
        while blocks and blocks[-1][0] > mean:
            before, many = blocks.pop()
            mean, count = (mean * count + before * many) / (count + many), count + many
        blocks.append((mean, count))
    return np.concatenate([np.full(count, mean) for mean, count in blocks] or [np.empty(0)])
