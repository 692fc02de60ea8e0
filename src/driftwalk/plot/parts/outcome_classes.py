"""Outcome classes on figures: names, colours, axes of a sweep, and sketches of their shapes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.plot.parts.labels import force_label, in_unit, number_label
from driftwalk.plot.parts.style import BLUE, FONT_PT, INK, PALETTE, axes_points
from driftwalk.schema.check import require_kind
from driftwalk.schema.kinds.sensitivity import axis_number, ranked_axes
from driftwalk.schema.shapes import (
    NAMED_SHAPES,
    cells_of_shape,
    contacts_of,
    discs_of,
    is_one_assembly,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.collections import PolyCollection
    from matplotlib.offsetbox import AnnotationBbox, DrawingArea

GREYS: Final = ("#9a9a9a", "#6b6b6b", "#bdbdbd", "#4d4d4d", "#848484")
OTHER: Final = "other"


class SweepAxis(NamedTuple):
    """An axis of a sensitivity study as a figure shows it."""

    name: str
    """Dimension of the dataset."""
    label: str
    """Label with unit."""
    values: Floats
    """Places along the axis, in the unit of the label; 0, 1, ... for words."""
    words: list[str]
    """The words of a categorical axis; empty for numbers."""


def check_kind(dataset: xr.Dataset, kind: str, *variables: str) -> None:
    """Raise `InputError` unless the dataset is of this kind and has these variables."""
    require_kind(dataset, kind)
    missing = [name for name in variables if name not in dataset.variables]
    if missing:
        raise InputError(f"the dataset '{kind}' lacks {', '.join(missing)}: nothing to draw")


def class_names(dataset: xr.Dataset) -> list[str]:
    """Return the names of the outcome classes, in the order of the dataset."""
    return [str(name) for name in dataset["class"].values]


def is_complete(name: str) -> bool:
    """Return whether all blocks of a class are in one assembly.

    Examples
    --------
    >>> is_complete("T"), is_complete("2+2")
    (True, False)
    """
    return is_one_assembly(name) and name not in ("", OTHER)


def classes_to_show(names: list[str], share: Floats) -> list[int]:
    """Choose the classes that a figure shows one by one; the rest is summed as "other".

    Up to 16 classes are all shown. Of more, those that reach 1 % somewhere, and of these at most
    the 20 largest.

    Parameters
    ----------
    names : list of str
        Names of the classes.
    share : array, shape (..., classes)
        Proportions of the classes in all that is drawn; NaN where they are unknown.

    Returns
    -------
    list of int
        Indices of the classes to show, in their order.

    Examples
    --------
    >>> classes_to_show(["I", "O"], np.array([1.0, 0.0]))
    [0, 1]
    """
    if len(names) <= 16:
        return list(range(len(names)))
    largest = np.nan_to_num(share).reshape(-1, len(names)).max(axis=0, initial=0.0)
    ranked = np.argsort(-largest, kind="stable")[:20]
    return sorted(int(index) for index in ranked if largest[index] >= 0.01)


def with_rest(values: npt.NDArray[Any], shown: list[int], *, axis: int = 0) -> npt.NDArray[Any]:
    """Return the shown classes along an axis, and behind them the sum of the others."""
    kept = values.take(shown, axis=axis)
    rest = np.delete(values, shown, axis=axis)
    if not rest.shape[axis]:
        return kept
    return np.concatenate([kept, rest.sum(axis=axis, keepdims=True)], axis)


def class_colors(names: list[str]) -> dict[str, str]:
    """Return a colour for every class: hues for one assembly, greys for several.

    Examples
    --------
    >>> class_colors(["2", "1+1"])
    {'2': '#0072B2', '1+1': '#9a9a9a'}
    """
    colors: dict[str, str] = {}
    hues = greys = 0
    for name in names:
        if name == OTHER:
            colors[name] = "#ececec"
        elif is_complete(name):
            colors[name] = PALETTE[hues % len(PALETTE)]
            hues += 1
        else:
            colors[name] = GREYS[greys % len(GREYS)]
            greys += 1
    return colors


def sweep_axes(variable: xr.DataArray, dataset: xr.Dataset) -> list[SweepAxis]:
    """Return the axes of a study over which a variable is given, drag before force.

    Parameters
    ----------
    variable : xarray.DataArray
        A variable of the study whose dimensions are those of the sweep and perhaps ``class`` or
        ``component``.
    dataset : xarray.Dataset
        The study, for its coordinates and the interval of the force.
    """
    names = [str(dim) for dim in variable.dims if dim not in ("class", "component")]
    return [_sweep_axis(name, dataset) for name in ranked_axes(names)]


def reference_value(dataset: xr.Dataset, axis: SweepAxis) -> float:
    """Return where the reference lies on an axis, NaN when the dataset does not say."""
    number = axis_number(axis.name)
    found = dataset.attrs.get(f"reference_{number.key}")
    if found is None:
        return np.nan
    if axis.words:
        word = _word(found)
        return float(axis.words.index(word)) if word in axis.words else np.nan
    return number.factor * float(found)


def runs_text(dataset: xr.Dataset) -> str:
    """Return "4 blocks, 1000 runs" as far as the dataset says."""
    parts = []
    for name, word in (("blocks", "block"), ("runs", "run")):
        if name in dataset.attrs:
            number = int(dataset.attrs[name])
            parts.append(f"{number} {word}{'' if number == 1 else 's'}")
    return ", ".join(parts)


def _word(value: Any) -> str:
    return str(value).replace("_", " ")


def _sweep_axis(name: str, dataset: xr.Dataset) -> SweepAxis:
    coordinate, number = dataset[name], axis_number(name)
    if coordinate.dtype.kind not in "iuf":
        words = [_word(value) for value in coordinate.values]
        return SweepAxis(name, number.plain, np.arange(len(words), dtype=np.float64), words)
    label = number_label(number)
    if name == "force_std" and "force_interval_s" in dataset.attrs:
        label = force_label(dataset)
    values = np.asarray(coordinate.values, dtype=np.float64)
    if number.factor != 1.0:
        values = in_unit(coordinate, number.reader_unit, stored=number.unit)
    return SweepAxis(name, label, values, [])


Orientation = Literal["wide", "tall"]

# Empty space between the shapes of a class, in sides of a block.
GAP: Final = 0.6
# Font size of the names under sketches, and how wide its letters are [pt].
NAME_SIZE_PT: Final = FONT_PT
LETTER_PT: Final = 0.74 * NAME_SIZE_PT
"""Mean width of a letter of a name, with room; measured on the font of the figures."""
# Space between a sketch and its name [pt].
NAME_GAP_PT: Final = 2.0
MAX_CELL_PT: Final = 6.0
"""Largest side of a block in a sketch [pt]; chosen by eye."""
# Random starts from which a contact graph is laid out; with 8, all of up to 5 discs lie open.
SKETCH_STARTS: Final = 8


def shape_cells(shape: str) -> Integers:
    """Return the cells of a shape from its name.

    Parameters
    ----------
    shape : str
        ``1``, ``2``, ``I3``, ``L3``, a letter of a tetromino, or a code: rows from top to bottom,
        ``x`` for a cell and ``.`` for none, joined by ``/``.

    Returns
    -------
    numpy.ndarray of int, shape (cells, 2)
        Column and row of every cell, y upwards, both from 0.

    Raises
    ------
    InputError
        When the name is neither known nor a code.

    Examples
    --------
    >>> shape_cells("L3").tolist()
    [[0, 0], [0, 1], [1, 0]]
    """
    cells = cells_of_shape(shape)
    if not cells:
        raise InputError(
            f"'{shape}' is not a shape: expected one of {', '.join(NAMED_SHAPES)}, or rows such as "
            "xxx/.x. with x for a cell"
        )
    return np.array(cells, dtype=np.int64)


@lru_cache(maxsize=1024)
def disc_places(shape: str) -> Floats:
    """Return places for the discs of a contact graph, in diameters: those that touch are 1 apart.

    The others keep away from each other as far as they can.

    Parameters
    ----------
    shape : str
        Name of a graph, such as ``"star4"``.

    Returns
    -------
    numpy.ndarray, shape (discs, 2)
        Lower left corners of the squares about the discs; the longer side lies.

    Examples
    --------
    >>> disc_places("chain3").round(1).tolist()
    [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]
    """
    from scipy.optimize import minimize

    discs, contacts = discs_of(shape), contacts_of(shape)
    first, second = np.triu_indices(discs, 1)
    pairs = zip(first.tolist(), second.tolist(), strict=True)
    touch = np.array([pair in contacts for pair in pairs])

    def tension(flat: Floats) -> float:
        places = flat.reshape(-1, 2)
        apart = np.hypot(*(places[first] - places[second]).T)
        return float((100.0 * (apart[touch] - 1.0) ** 2).sum() + (0.3 / apart[~touch]).sum())

    # Of several starts the best end: from some, discs are folded over others.
    starts = np.random.default_rng(1).normal(0.0, 1.5, (SKETCH_STARTS, 2 * discs))
    ends = [minimize(tension, start) for start in starts]
    places = min(ends, key=lambda end: float(end.fun)).x.reshape(-1, 2)
    places -= places.mean(axis=0)
    lying = places @ np.linalg.svd(places, full_matrices=False)[2].T
    lying *= np.where(lying[-1] < 0.0, -1.0, 1.0)
    return np.asarray(lying - lying.min(axis=0))


def class_cells(name: str, *, orientation: Orientation = "wide") -> Floats:
    """Return the positions of the squares in the sketch of an outcome class, in sides of a block.

    The shapes keep the order of the name and are packed into a compact picture, 0.6 sides apart.

    Parameters
    ----------
    name : str
        Shapes joined by ``+``, such as ``"I3+1"``.
    orientation : {"wide", "tall"}
        Turn every shape so that its longer side lies or stands. Shapes are turned, never
        mirrored.

    Returns
    -------
    numpy.ndarray, shape (cells, 2)
        Lower left corners of the squares, y upwards; the picture starts at (0, 0).

    Raises
    ------
    InputError
        When a shape of the name is not known.

    Examples
    --------
    >>> class_cells("2+1").tolist()
    [[0.0, 1.6], [1.0, 1.6], [0.0, 0.0]]
    """
    shapes = [
        _turned(disc_places(shape) if contacts_of(shape) else shape_cells(shape), orientation)
        for shape in name.split("+")
    ]
    sizes = np.array([cells.max(axis=0) + 1 for cells in shapes], dtype=np.float64)
    # Shelves that stand are the same packing with the axes exchanged.
    along = slice(None, None, -1 if orientation == "tall" else 1)
    offsets = _packed(sizes[:, along])[:, along]
    height = float((offsets + sizes)[:, 1].max())
    placed = []
    for cells, (left, top), (_, tall) in zip(shapes, offsets, sizes, strict=True):
        placed.append(cells + np.array([left, height - top - tall]))
    # Rounded, so that the same square has the same place whatever was packed before it.
    return np.round(np.concatenate(placed), 9) + 0.0


def sketch_size(cells: Floats) -> Floats:
    """Return width and height of a sketch, in sides of a block."""
    size: Floats = cells.max(axis=0) + 1.0
    return size


def sketch_sizes(names: Sequence[str]) -> Floats:
    """Return the size of each sketch, and of what is no class that of one cell."""
    sizes = [sketch_size(class_cells(name)) if is_class(name) else (1.0, 1.0) for name in names]
    return np.array(sizes).reshape(-1, 2)


def sketch_box(
    name: str,
    *,
    cell_pt: float,
    color: Any = BLUE,
    orientation: Orientation = "wide",
    height_pt: float | None = None,
    discs: bool | None = None,
) -> DrawingArea:
    """Return the sketch of a class as a box of fixed size, to be placed by an offset box.

    Parameters
    ----------
    name : str
        Name of the outcome class.
    cell_pt : float
        Side of a square [pt].
    color : color
        Colour of the squares.
    orientation : {"wide", "tall"}
        See `class_cells`.
    height_pt : float, optional
        Height of the box [pt], the sketch at its top; default: that of the sketch.
    discs : bool, optional
        Whether the blocks are discs; default: whether the name says so.

    Returns
    -------
    matplotlib.offsetbox.DrawingArea
        The box; its artists are one square or disc per block.

    Examples
    --------
    >>> len(sketch_box("L3+1", cell_pt=4.0).get_children())
    4
    """
    from matplotlib.offsetbox import DrawingArea
    from matplotlib.patches import Circle, Rectangle

    cells = class_cells(name, orientation=orientation)
    width, height = sketch_size(cells) * cell_pt
    total = height if height_pt is None else height_pt
    box = DrawingArea(width, total, clip=False)
    style = {"facecolor": color, "edgecolor": "white", "linewidth": min(0.5, 0.12 * cell_pt)}
    for x, y in cells * cell_pt + (0.0, total - height):
        if are_discs(name) if discs is None else discs:
            box.add_artist(Circle((x + cell_pt / 2, y + cell_pt / 2), cell_pt / 2, **style))
        else:
            box.add_artist(Rectangle((x, y), cell_pt, cell_pt, **style))
    return box


def place_sketch(
    ax: Axes,
    name: str,
    xy: tuple[float, float],
    *,
    transform: Any = "data",
    alignment: tuple[float, float] = (0.5, 0.5),
    cell_pt: float = 3.0,
    color: Any = BLUE,
    shift_pt: tuple[float, float] = (0.0, 0.0),
    discs: bool | None = None,
) -> AnnotationBbox:
    """Put the sketch of a class on axes, also outside of their frame.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Where to draw.
    name : str
        Name of the outcome class.
    xy : tuple of float
        Place, in the coordinates of `transform`.
    transform : transform or str
        Coordinates of `xy`, as matplotlib's ``xycoords``.
    alignment : tuple of float
        Which point of the sketch lies at `xy`: (0, 0) is its lower left corner.
    cell_pt : float
        Side of a square [pt].
    color : color
        Colour of the squares.
    shift_pt : tuple of float
        How far it lies from there, to the right and up [pt].
    discs : bool, optional
        See `sketch_box`.

    Returns
    -------
    matplotlib.offsetbox.AnnotationBbox
        The artist.

    Examples
    --------
    ``place_sketch(ax, "T", (0.5, 1.05), transform="axes fraction")``
    """
    box = sketch_box(name, cell_pt=cell_pt, color=color, discs=discs)
    return _pinned(ax, box, xy, transform=transform, alignment=alignment, shift_pt=shift_pt)


def draw_sketches_below(ax: Axes, positions: Sequence[float], names: Sequence[str]) -> float:
    """Draw the sketches of classes below the x axis in place of tick labels, with their names.

    All have squares of one size. A name that holds no known shape ("other") is written out.
    Codes of shapes are not written: the sketch says the same and can be read.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Where to draw; its ticks are set to `positions`.
    positions : sequence of float
        Places along the x axis, equally spaced; the limits of the axis must be set already.
    names : sequence of str
        Names of the classes.

    Returns
    -------
    float
        Height of all below the axis [pt]: pass it to ``ax.set_xlabel`` as ``labelpad``.

    Raises
    ------
    InputError
        When the numbers of positions and names differ.

    Examples
    --------
    ``ax.set_xlabel("outcome", labelpad=draw_sketches_below(ax, range(2), ["2", "1+1"]))``
    """
    from matplotlib.offsetbox import TextArea, VPacker

    if len(positions) != len(names):
        raise InputError(f"{len(positions)} positions for {len(names)} classes")
    slot_pt = _slot_points(ax, positions)
    sizes = {
        name: sketch_size(class_cells(name, orientation="tall")) for name in names if is_class(name)
    }
    discs = are_discs(*names)
    largest = np.max([*sizes.values(), np.ones(2)], axis=0)
    side = min(MAX_CELL_PT, 0.72 * slot_pt / largest[0])
    ax.set_xticks(list(positions), labels=[""] * len(positions))
    ax.tick_params(axis="x", length=0.0)
    deepest = 0.0
    for position, name in zip(positions, names, strict=True):
        lines = _lines(name_text(name), int(slot_pt / LETTER_PT))
        parts: list[Any] = []
        depth = 0.0
        if name in sizes:
            depth = side * float(largest[1])
            parts.append(
                sketch_box(
                    name, cell_pt=side, color=INK, orientation="tall", height_pt=depth,
                    discs=discs,
                )
            )  # fmt: skip
        if lines:
            # One word that is wider than its place is set smaller, and not turned.
            widest = LETTER_PT * max(map(len, lines))
            size = NAME_SIZE_PT * min(1.0, slot_pt / widest)
            depth += NAME_GAP_PT + 1.2 * size * len(lines)
            style = {"size": size, "color": INK, "ha": "center"}
            parts.append(TextArea("\n".join(lines), textprops=style, multilinebaseline=True))
        stacked = VPacker(children=parts, align="center", pad=0.0, sep=NAME_GAP_PT)
        _pinned(
            ax, stacked, (position, 0.0), transform=ax.get_xaxis_transform(),
            alignment=(0.5, 1.0), shift_pt=(0.0, -4.0),
        )  # fmt: skip
        deepest = max(deepest, depth)
    # 4 pt lie above and below the sketches.
    return deepest + 8.0


def names_fit(names: Sequence[str], width_pt: float) -> bool:
    """Return whether `draw_sketches_below` writes all names in full size on axes of that width."""
    letters = int(width_pt / max(len(names), 1) / LETTER_PT)
    lines = [line for name in names for line in _lines(name_text(name), letters)]
    return max(map(len, lines), default=0) <= letters


def _lines(text: str, letters: int) -> list[str]:
    """Return the name of a class in lines of at most so many letters, broken before a plus.

    Examples
    --------
    >>> _lines("1+1+1+1", 4), _lines("L3+1", 4), _lines("", 4)
    (['1+1', '+1+1'], ['L3+1'], [])
    """
    lines: list[str] = []
    for part in text.replace("+", "\n+").splitlines():
        if lines and len(lines[-1] + part) <= letters:
            lines[-1] += part
        else:
            lines.append(part)
    return lines


def name_text(name: str) -> str:
    """Return the name of a class as a figure writes it: empty for a code, which has no meaning.

    Examples
    --------
    >>> name_text("L3+1"), name_text("xxx/x.x"), name_text("ab.ac.ad.be")
    ('L3+1', '', '')
    """
    return "" if "x" in name or "." in name else name


def is_class(name: str) -> bool:
    """Return whether a sketch of this name can be drawn.

    Examples
    --------
    >>> is_class("I3+1"), is_class("other")
    (True, False)
    """
    return all(cells_of_shape(shape) or contacts_of(shape) for shape in name.split("+"))


def are_discs(*names: str) -> bool:
    """Return whether classes are of discs, as far as the name of one of them says so.

    Examples
    --------
    >>> are_discs("chain3+1"), are_discs("I3+1"), are_discs("1+1"), are_discs("1+1", "star4")
    (True, False, False, True)
    """
    return any(contacts_of(shape) for name in names for shape in name.split("+"))


def _turned(cells: Floats | Integers, orientation: Orientation) -> Floats | Integers:
    """Turn a shape by a quarter when its longer side does not lie as asked."""
    width, height = cells.max(axis=0) + 1
    if (width >= height) if orientation == "wide" else (height >= width):
        return cells
    return np.column_stack([cells[:, 1].max() - cells[:, 1], cells[:, 0]])


def _packed(sizes: Floats) -> Floats:
    """Return left and top of every box, packed on shelves into the most compact picture.

    Every sensible width of the shelves is tried; the picture with the smallest longer side is
    taken, then the smallest area, then the flattest.
    """
    widths = sizes[:, 0]
    limits = {
        float(widths[first:last].sum() + GAP * (last - first - 1))
        for first in range(len(widths))
        for last in range(first + 1, len(widths) + 1)
    }
    tried = [_shelves(sizes, limit) for limit in sorted(limits) if limit >= widths.max() - 1e-9]

    def badness(offsets: Floats) -> tuple[float, float, float]:
        width, height = np.round((offsets + sizes).max(axis=0), 9)
        return max(width, height), width * height, height

    return min(tried, key=badness)


def _shelves(sizes: Floats, limit: float) -> Floats:
    """Return left and top of boxes put one after the other on shelves no wider than `limit`."""
    offsets = np.zeros_like(sizes)
    left = top = deepest = 0.0
    for index, (width, height) in enumerate(sizes):
        if left > 0.0 and left + width > limit + 1e-9:
            left, top, deepest = 0.0, top + deepest + GAP, 0.0
        offsets[index] = left, top
        left += width + GAP
        deepest = max(deepest, height)
    return offsets


def _slot_points(ax: Axes, positions: Sequence[float]) -> float:
    """Return the distance between neighbouring positions [pt] as the axes lie now."""
    low, high = ax.get_xlim()
    step = float(np.min(np.diff(positions))) if len(positions) > 1 else high - low
    return float(axes_points(ax)[0] * step / (high - low))


def _pinned(
    ax: Axes,
    box: Any,
    xy: tuple[float, float],
    *,
    transform: Any,
    alignment: tuple[float, float],
    shift_pt: tuple[float, float],
) -> AnnotationBbox:
    from matplotlib.offsetbox import AnnotationBbox

    artist = AnnotationBbox(
        box, xy, xybox=shift_pt, xycoords=transform, boxcoords="offset points",
        box_alignment=alignment, frameon=False, pad=0.0, annotation_clip=False,
    )  # fmt: skip
    ax.add_artist(artist)
    return artist


POLE_COLORS: Final = {1: "#C1121F", -1: "#FFFFFF"}
"""Bars along magnetic faces are red for N and white for S, which no assembly is."""


class PoleBarPolicy(NamedTuple):
    """Where a bar lies on its block, in shares of half a side."""

    inner: float = 0.62
    """Inner edge; chosen by eye."""
    outer: float = 0.94
    """Outer edge, within the block's own outline; chosen by eye."""
    length: float = 0.72
    """End of the bar, so that two bars do not meet; chosen by eye."""


POLE_BAR: Final = PoleBarPolicy()


def set_pole_bars(
    bars: PolyCollection, x: Floats, y: Floats, theta: Floats, pole: Any, half_side: float
) -> None:
    """Give corners and colours of the bars of some blocks to a collection.

    Parameters
    ----------
    bars : matplotlib.collections.PolyCollection
        As `empty_bars` makes it.
    x, y, theta : ndarray, shape (block,)
        Poses; angles in rad.
    pole : array_like of int, shape (block, 4)
        1 N, -1 S, 0 none, of the faces +x, +y, -x, -y.
    half_side : float
        In the unit of x and y.
    """
    near, far, end = POLE_BAR
    own = half_side * np.array([[near, -end], [far, -end], [far, end], [near, end]])
    corners, colors = [], []
    for block, face in np.argwhere(np.asarray(pole) != 0):
        turn = theta[block] + face * np.pi / 2.0
        cosine, sine = np.cos(turn), np.sin(turn)
        turned = own @ np.array([[cosine, sine], [-sine, cosine]])
        corners.append(turned + np.array([x[block], y[block]]))
        colors.append(POLE_COLORS[int(pole[block][face])])
    bars.set_verts(corners)
    bars.set_facecolor(colors)


def empty_bars() -> PolyCollection:
    """Return a collection to which the bars of a moment are given."""
    from matplotlib.collections import PolyCollection

    return PolyCollection([], edgecolors=INK, linewidths=0.3, zorder=3.5)


def poles_of(dataset: xr.Dataset) -> Any:
    """Return the poles of a dataset's blocks, (block, face); None where it states none."""
    return dataset["pole"].transpose("block", "face").values if "pole" in dataset else None
