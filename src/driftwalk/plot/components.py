"""The settings of a sweep on two principal components, with the classes as arrows (Fig. 10)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.plot.parts import style
from driftwalk.plot.parts.outcome_classes import (
    LETTER_PT,
    NAME_SIZE_PT,
    are_discs,
    check_kind,
    class_cells,
    class_names,
    is_class,
    name_text,
    sketch_box,
    sketch_size,
)
from driftwalk.plot.sensitivity_maps import DISTANCE_COLORMAP, DISTANCE_LABEL

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

SKETCH_CELL_PT: Final = 3.0
"""Side of a block in the sketch of a label [pt]; chosen by eye."""
# Points of an arrow that a label had better not cover, as shares of its length.
ALONG: Final = np.linspace(0.1, 1.0, 19)
# How bad a place for a label is, by what it covers and how far it is [per pt].
COST_LABEL, COST_LINE, COST_DOT, MOST_DOTS, COST_PT, COST_BEHIND = 1000.0, 8.0, 1.5, 10, 0.5, 4.0
COLORS: Final = {
    "complete": ("share of runs with one assembly", style.SCORE_COLORMAP),
    "l1_distance": (DISTANCE_LABEL, DISTANCE_COLORMAP),
}


def plot_biplot(
    components: xr.Dataset,
    ax: Axes | None = None,
    *,
    sensitivity: xr.Dataset | None = None,
    color: Literal["complete", "l1_distance"] = "complete",
) -> Axes:
    """Draw the settings of a sweep on its first two components, and the classes as arrows.

    Both axes have one scale. An arrow is the loading of a class, all lengthened by the factor in
    the title; classes with almost no loading carry no label, and of many classes the 14 with the
    longest arrows do.

    Parameters
    ----------
    components : xarray.Dataset
        A `components` with at least two components.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    sensitivity : xarray.Dataset, optional
        The `sensitivity` from which the components were made; colours the settings.
    color : {"complete", "l1_distance"}
        Which of its variables is the colour.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When a dataset is of another kind, there is one component only, or the axes of the two
        datasets differ.

    Examples
    --------
    ``plot_biplot(components, sensitivity=sensitivity, color="l1_distance")``
    """
    found = biplot_of(components)
    points = found.points
    if color not in COLORS:
        raise InputError(f"color='{color}': choose one of {', '.join(COLORS)}")
    ax = style.axes_or_new(ax, height_mm=80.0)
    if sensitivity is None:
        ax.plot(*points.T, "o", ms=3.0, mew=0.0, color=style.BLUE, alpha=0.6, label="settings")
    else:
        text, colormap = COLORS[color]
        dots = ax.scatter(
            points[:, 0], points[:, 1], s=10.0, lw=0, cmap=colormap, label="settings",
            c=_colour_values(sensitivity, color, components["score"]),
        )  # fmt: skip
        style.add_colorbar(dots, ax, text)
    shares = 100.0 * found.shares
    ax.set_xlabel(f"component 1 ({shares[0]:.3g} % of the variance)")
    ax.set_ylabel(f"component 2 ({shares[1]:.3g} % of the variance)")
    title = f"dots: settings; arrows: loadings × {found.factor:.2g}"
    ax.set_title(title, loc="left", size=style.FONT_PT)
    _set_limits(ax, np.vstack([points, found.tips, np.zeros((1, 2))]))
    _draw_arrows(ax, found.tips, found.names, points)
    return ax


class Biplot(NamedTuple):
    """Settings and classes on two principal components, drawn by matplotlib and by a page."""

    points: Floats
    """The scores of the settings on the first two components, shape (settings, 2)."""
    tips: Floats
    """The loadings of the classes, lengthened, shape (classes, 2)."""
    names: list[str]
    """The classes."""
    factor: float
    """By what the loadings are lengthened."""
    shares: Floats
    """The share of the variance that each component explains."""


def biplot_of(components: xr.Dataset) -> Biplot:
    """Return the first two principal components of a study, or raise `InputError`."""
    check_kind(components, "components", "score", "loading", "explained_variance_ratio", "class")
    if components.sizes["component"] < 2:
        raise InputError("a biplot needs two components, the dataset has one")
    score, loading, shares = (
        np.asarray(components[name].transpose(..., "component").values, dtype=np.float64)[..., :2]
        for name in ("score", "loading", "explained_variance_ratio")
    )
    points = score.reshape(-1, 2)
    factor = _arrow_factor(points, loading)
    return Biplot(points, factor * loading, class_names(components), factor, shares)


def _colour_values(sensitivity: xr.Dataset, color: str, score: xr.DataArray) -> Floats:
    """Return the colour of every setting, in the order of the scores."""
    check_kind(sensitivity, "sensitivity", color)
    dims = [dim for dim in score.dims if dim != "component"]
    values = sensitivity[color]
    if set(values.dims) != set(dims) or any(values.sizes[dim] != score.sizes[dim] for dim in dims):
        raise InputError(
            "the components were made from another study: their axes are "
            f"{', '.join(map(str, dims))}, those of '{color}' {', '.join(map(str, values.dims))}"
        )
    return np.asarray(values.transpose(*dims).values, dtype=np.float64).ravel()


def _arrow_factor(points: Floats, loading: Floats) -> float:
    """Return by what the loadings are lengthened, rounded to two digits."""
    longest = float(np.nanmax(np.hypot(*loading.T)))
    reach = float(np.nanmax(np.hypot(*points.T), initial=0.0))
    if longest == 0.0 or reach == 0.0:
        return 1.0
    # The longest arrow reaches over nine tenths of the way to the farthest setting.
    return float(f"{0.9 * reach / longest:.2g}")


def _set_limits(ax: Axes, drawn: Floats) -> None:
    """Set limits with room for labels around all that is drawn, one scale for both axes."""
    low, high = np.nanmin(drawn, axis=0), np.nanmax(drawn, axis=0)
    middle, span = (low + high) / 2.0, (high - low) * 1.32
    style.settle_layout(ax)
    size = style.axes_points(ax)
    per_point = float((span / size).max()) or 1.0
    for axis, center, length in zip("xy", middle, per_point * size, strict=True):
        getattr(ax, f"set_{axis}lim")(center - length / 2.0, center + length / 2.0)
    ax.set_box_aspect(size[1] / size[0])


def _draw_arrows(ax: Axes, tips: Floats, names: list[str], points: Floats) -> None:
    length = np.hypot(*tips.T)
    # The longest 14 carry a label, and none that is short against the longest.
    order = np.argsort(-length, kind="stable")[:14]
    labelled = [i for i in order if length[i] > 0.06 * length.max()]
    for index, (name, tip) in enumerate(zip(names, tips, strict=True)):
        if length[index] == 0.0:
            continue
        ax.annotate(
            "", tuple(tip), xytext=(0.0, 0.0), gid=name,
            arrowprops={
                "arrowstyle": "-|>,head_length=0.3,head_width=0.15", "zorder": 4, "shrinkA": 0.0,
                "shrinkB": 0.0, "color": style.INK if index in labelled else style.MUTED,
                "lw": 0.9 if index in labelled else 0.4,
            },
        )  # fmt: skip
    boxes = np.array([_label_size(names[index]) for index in labelled]).reshape(-1, 2)
    low = np.array([ax.get_xlim()[0], ax.get_ylim()[0]])
    high = np.array([ax.get_xlim()[1], ax.get_ylim()[1]])
    room = style.axes_points(ax)
    per_point = (high - low) / room
    places = place_labels(
        (tips[labelled] - low) / per_point, boxes, origin=-low / per_point, room=room,
        dots=(points[np.isfinite(points).all(axis=1)] - low) / per_point,
    )  # fmt: skip
    for index, place in zip(labelled, places, strict=True):
        _draw_label(ax, names[index], tips[index], low + place * per_point, discs=are_discs(*names))


def _label_size(name: str) -> Floats:
    """Return width and height of the label of a class [pt]."""
    size = sketch_size(class_cells(name)) * SKETCH_CELL_PT if is_class(name) else np.zeros(2)
    if name_text(name):
        size = np.array([max(size[0], len(name) * LETTER_PT), size[1] + NAME_SIZE_PT + 3.0])
    return size


def _draw_label(ax: Axes, name: str, tip: Floats, place: Floats, *, discs: bool) -> None:
    from matplotlib.offsetbox import AnnotationBbox, TextArea, VPacker

    parts: list[Any] = []
    if is_class(name):
        parts.append(sketch_box(name, cell_pt=SKETCH_CELL_PT, color=style.INK, discs=discs))
    if name_text(name):
        parts.append(TextArea(name, textprops={"size": NAME_SIZE_PT, "color": style.INK}))
    ax.add_artist(
        AnnotationBbox(
            VPacker(children=parts, align="center", pad=0.0, sep=1.0), tuple(tip),
            xybox=tuple(place), boxcoords="data", pad=0.1, annotation_clip=False,
            gid=f"label {name}", bboxprops={"facecolor": "white", "alpha": 0.7, "lw": 0},
            arrowprops={"arrowstyle": "-", "lw": 0.4, "color": style.MUTED},
        )
    )  # fmt: skip


def place_labels(
    tips: Floats, boxes: Floats, *, origin: Floats, room: Floats, dots: Floats | None = None
) -> Floats:
    """Place one label near the tip of every arrow so that labels do not overlap.

    One after the other, every label takes the best of many places around its tip: free of other
    labels first, then of arrows and dots, near its tip, and beyond it. Labels that still overlap
    push each other apart.

    Parameters
    ----------
    tips : array, shape (n, 2)
        Tips of the arrows [pt].
    boxes : array, shape (n, 2)
        Width and height of the labels [pt].
    origin : array, shape (2,)
        Where the arrows start [pt].
    room : array, shape (2,)
        Upper right corner of the frame [pt], whose lower left one is (0, 0).
    dots : array, shape (m, 2), optional
        Points better not covered [pt].

    Returns
    -------
    array, shape (n, 2)
        Middles of the labels [pt].

    Examples
    --------
    >>> tips = np.array([[50.0, 20.0], [52.0, 20.0]])
    >>> boxes = np.full((2, 2), 10.0)
    >>> places = place_labels(tips, boxes, origin=np.zeros(2), room=np.full(2, 100.0))
    >>> bool((abs(places[0] - places[1]) >= 10.0).any())
    True
    """
    # 2 pt lie between two labels.
    half = boxes / 2.0 + 1.0
    lines = (origin + ALONG[:, None, None] * (tips - origin)).reshape(-1, 2)
    seen = np.empty((0, 2)) if dots is None else dots
    place = np.empty_like(tips, dtype=np.float64)
    for i, tip in enumerate(tips):
        tried = _places_around(tip, half[i])
        beyond = (tip - origin) / max(float(np.hypot(*(tip - origin))), 1e-9)
        away = tried - tip
        cost = COST_PT * np.hypot(*away.T) - COST_BEHIND * (away @ beyond) / np.hypot(*away.T)
        cost += COST_LINE * _covered(tried, half[i], lines)
        cost += COST_DOT * np.minimum(_covered(tried, half[i], seen), MOST_DOTS)
        for j in range(i):
            cost += COST_LABEL * (np.abs(tried - place[j]) < half[i] + half[j]).all(axis=1)
        cost += COST_LABEL * ((tried < half[i]) | (tried > room - half[i])).any(axis=1)
        place[i] = tried[int(np.argmin(cost))]
    for _ in range(400):
        np.clip(place, half, np.maximum(room - half, half), out=place)
        pairs = [(i, j) for i in range(len(place)) for j in range(i)]
        if not [pair for pair in pairs if _push_apart(place, half, *pair)]:
            break
    return place


def _places_around(tip: Floats, half: Floats) -> Floats:
    """Return places for the middle of a label whose edge is some distances from a tip."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    # Distance from the middle of a box to its edge in that direction.
    reach = (half / np.maximum(np.abs(direction), 1e-9)).min(axis=1)
    # Free space between tip and label [pt].
    away = np.concatenate(
        [direction * (reach + more)[:, None] for more in (2.0, 8.0, 16.0, 26.0, 38.0)]
    )
    places: Floats = tip + away
    return places


def _covered(places: Floats, half: Floats, points: Floats) -> Floats:
    """Return how many points a label covers at each of these places."""
    inside = (np.abs(places[:, None] - points[None]) < half).all(axis=2)
    return np.asarray(inside.sum(axis=1), dtype=np.float64)


def _push_apart(place: Floats, half: Floats, i: int, j: int) -> bool:
    gap = place[i] - place[j]
    depth = half[i] + half[j] - np.abs(gap)
    if (depth <= 1e-6).any():
        return False
    axis = int(np.argmin(depth))
    shift = 0.5 * depth[axis] * (1.0 if gap[axis] >= 0.0 else -1.0)
    place[i, axis] += shift
    place[j, axis] -= shift
    return True
