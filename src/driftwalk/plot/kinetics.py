"""Kinetics of self-assembly: the graph of classes with their rates, and shares over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.units import percent
from driftwalk.plot.assembly_courses import TIME_LABEL, label_right
from driftwalk.plot.parts import style
from driftwalk.plot.parts.outcome_classes import (
    are_discs,
    check_kind,
    class_cells,
    class_colors,
    class_names,
    name_text,
    place_sketch,
    sketch_size,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

SHOWN_SHARE = 0.01
"""Classes that reach this share are drawn, and the transitions with this part of what leaves;
chosen by hand."""
MOST_ROWS: Final = 8
"""Classes of one column: as many as one page is high enough for; chosen by eye."""
CLASS_PT = 28.0
"""Diameter of the circle about the sketch of a class [pt]; chosen by eye."""
APART_PT = 3.5
"""Half of the distance between an arrow there and the one back [pt]; chosen by eye."""
MARGINS_PT: Final = ((30.0, 30.0), (30.0, 17.0))
"""Room around the middle of a circle for itself and its name, across and up [pt]; chosen by eye."""
WORD: Final = np.array([0.5, 1.0])
"""A word is twice as wide as high: how near two are counts by these weights, across and up."""
GRAPH_TITLE: Final = "rates (per 1000 s); width: share of what leaves the class"
GROUND: Final[dict[str, Any]] = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none"}
WORDS_ZORDER: Final = 5.0
"""Above all arrows, on a white ground: none crosses a word."""


def plot_class_graph(kinetics: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the outcome classes by their number of assemblies, and the rates between them.

    The width of an arrow is the share of the transitions that leave its class.

    Parameters
    ----------
    kinetics : xarray.Dataset
        A `kinetics`.
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
    ``plot_class_graph(found)``
    """
    place, rows, kept, title = class_graph_of(kinetics)
    # Nine classes crowd one column of a page.
    wide = len(place) > 6
    ax = style.axes_or_new(ax, height_mm=max(80.0, 20.0 * rows) if wide else 90.0, wide=wide)
    ax.set_axis_off()
    ax.set_title(title, loc="left")
    style.settle_layout(ax)
    _fill(ax, np.array([*place.values()]))
    unit = style.axes_points(ax) / np.array([np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim())])
    discs = are_discs(*place)
    for arrow in placed_arrows(place, kept, unit):
        ax.annotate(
            "", xy=tuple(arrow.last), xytext=tuple(arrow.first),
            arrowprops={
                "arrowstyle": "-|>", "lw": 0.4 + 2.6 * arrow.share, "color": style.MUTED,
                "shrinkA": CLASS_PT / 2.0 + 2.0, "shrinkB": CLASS_PT / 2.0 + 2.0,
            },
        )  # fmt: skip
        x, y = arrow.first + arrow.at * (arrow.last - arrow.first)
        ax.text(x, y, arrow.label, ha="center", va="center", zorder=WORDS_ZORDER, bbox=GROUND)
    colors = class_colors(class_names(kinetics))
    for name, at in place.items():
        ax.plot(*at, "o", ms=CLASS_PT, color="white", mec=colors[name], mew=0.8)
        side = 20.0 / float(sketch_size(class_cells(name)).max())
        place_sketch(ax, name, at, cell_pt=min(side, 6.0), color=colors[name], discs=discs)
        ax.annotate(
            name_text(name), at, xytext=(0, -17), textcoords="offset points", ha="center",
            va="top", zorder=WORDS_ZORDER, bbox=GROUND,
        )  # fmt: skip
    return ax


class Arrow(NamedTuple):
    """A transition of the graph of classes, drawn by matplotlib and by a page."""

    first: Floats
    """Its two ends, shape (2,), from 0 to 1 across and up."""
    last: Floats
    at: float
    """Place of its label along it, from 0 to 1."""
    share: float
    """Of the transitions that leave its class."""
    label: str
    """Its rate per 1000 s."""


Transition = tuple[str, str, float, float]
"""Two classes, the rate [1/s], and the share of what leaves the first."""


def class_graph_of(
    kinetics: xr.Dataset,
) -> tuple[dict[str, tuple[float, float]], int, list[Transition], str]:
    """Return places of the classes, how many stand in a column, the transitions, and a title."""
    check_kind(kinetics, "kinetics", "rate", "count", "share")
    rates, counts = (kinetics[name].isel(source=0).values for name in ("rate", "count"))
    pairs = [str(name).split(" -> ") for name in kinetics["transition"].values]
    leaving: dict[str, int] = {}
    for (start, _), count in zip(pairs, counts, strict=True):
        leaving[start] = leaving.get(start, 0) + int(count)
    kept = [
        (start, end, float(rate), float(count / leaving[start]))
        for (start, end), rate, count in zip(pairs, rates, counts, strict=True)
        if count > SHOWN_SHARE * leaving[start]
    ]
    every = list(dict.fromkeys(name for one in kept for name in one[:2]))
    largest = dict(zip(class_names(kinetics), kinetics["share"].values.max(axis=0), strict=True))
    place, rows = _places(_largest(every, largest))
    kept = [one for one in kept if one[0] in place and one[1] in place]
    left_out = len(every) - len(place)
    title = f"{GRAPH_TITLE}; {left_out} rarer classes are left out" if left_out else GRAPH_TITLE
    return place, rows, kept, title


def _largest(names: list[str], largest: dict[str, float]) -> list[str]:
    """Return the classes whose share is largest at some time, in each column as many as fit."""
    kept: list[str] = []
    for number in {name.count("+") for name in names}:
        column = [name for name in names if name.count("+") == number]
        kept += sorted(column, key=lambda name: -largest[name])[:MOST_ROWS]
    return [name for name in names if name in kept]


def placed_arrows(
    place: dict[str, tuple[float, float]], kept: list[Transition], unit: Floats
) -> list[Arrow]:
    """Return the arrows, the widest first; `unit` is the size of the graph, shape (2,) [pt]."""
    shown = {one[:2] for one in kept}
    taken = [np.array(one) for one in place.values()]
    made = []
    for start, end, rate, share in sorted(kept, key=lambda one: -one[3]):
        first, last = np.array(place[start]), np.array(place[end])
        if (end, start) in shown:  # there and back run next to each other
            along = unit * (last - first)
            aside = APART_PT * np.array([-along[1], along[0]]) / np.hypot(*along) / unit
            first, last = first + aside, last + aside
        at = _free_place(first, last, taken, unit)
        taken.append(first + at * (last - first))
        made.append(Arrow(first, last, at, share, _rate_text(1e3 * rate)))
    return made


def _rate_text(rate: float) -> str:
    """Return a rate with two digits, or all of those before the point."""
    return f"{rate:.2g}" if rate < 99.5 else f"{rate:.0f}"


def _fill(ax: Axes, places: Floats) -> None:
    """Let the outermost circles with their names reach to the edges of the axes."""
    for at, (low_pt, high_pt) in enumerate(MARGINS_PT):
        low, high = places[:, at].min(), places[:, at].max()
        pt = ((high - low) or 1.0) / (style.axes_points(ax)[at] - low_pt - high_pt)
        (ax.set_xlim, ax.set_ylim)[at](low - low_pt * pt, high + high_pt * pt)


def _free_place(first: Floats, last: Floats, taken: list[Floats], unit: Floats) -> float:
    """Return the share of an arrow that is farthest from all labels and classes so far."""
    shares = np.linspace(0.25, 0.7, 19)
    places = first + shares[:, None] * (last - first)
    off = [min(np.hypot(*(WORD * unit * (place - other))) for other in taken) for place in places]
    return float(shares[int(np.argmax(off))])


def _places(names: list[str]) -> tuple[dict[str, tuple[float, float]], int]:
    """Return a column for each number of assemblies, the most on the left, and the longest."""
    columns = sorted({name.count("+") for name in names}, reverse=True)
    place = {}
    for at, number in enumerate(columns):
        column = [name for name in names if name.count("+") == number]
        x = at / max(len(columns) - 1, 1)
        for row, name in enumerate(column):
            place[name] = (x, 1.0 - (row + 0.5) / len(column))
    heights = [sum(name.count("+") == number for name in names) for number in columns]
    return place, max(heights, default=1)


def plot_predicted_shares(kinetics: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw predicted shares of the classes over time with their bands, and those seen as points.

    Parameters
    ----------
    kinetics : xarray.Dataset
        A `kinetics`.
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
    ``plot_predicted_shares(found)``
    """
    check_kind(kinetics, "kinetics", "time", "share", "empirical")
    ax = style.axes_or_new(ax, height_mm=90.0)
    time: Floats = kinetics["time"].values
    largest = kinetics["share"].values.max(axis=0)
    names = class_names(kinetics)
    ranked = np.argsort(-largest, kind="stable")[:12].tolist()
    shown = sorted(at for at in ranked if largest[at] > SHOWN_SHARE)
    colors = class_colors(names)
    for at in shown:
        one, color = kinetics.isel({"class": at}), colors[names[at]]
        ax.fill_between(time, one["share_low"], one["share_high"], color=color, alpha=0.25, lw=0)
        ax.plot(time, one["share"], color=color, label=names[at])
        for source, marker in zip(range(kinetics.sizes["source"]), "ox", strict=False):
            seen = one["empirical"].values[source]
            ax.plot(time[::6], seen[::6], marker, color=color, ms=2.5, mew=0.7)
    ax.set(xlabel=TIME_LABEL, ylabel="share of runs", xlim=(time[0], time[-1]), ylim=(0.0, None))
    label_right(ax, [names[at] for at in shown], kinetics["share"].values[-1, shown], colors)
    ax.spines[["top", "right"]].set_visible(False)
    both = [f"{marker} {one}" for marker, one in zip("●×", kinetics["source"].values, strict=False)]
    points = " and ".join(both) if len(both) > 1 else "points"
    bands = percent(kinetics.attrs["confidence"])
    ax.set_title(f"predicted (lines, bands: {bands}), seen ({points})", loc="left")
    return ax
