"""Parts that all figures share: sizes, colours, the print style, and axes that need no display.

Figures are made from `matplotlib.figure.Figure` with the Agg canvas, never through pyplot, so
that drawing opens no window, holds no global list of figures, and leaves the reader's own style
alone. A plotting function given an ``ax`` draws with whatever style that figure has; only the
writers of files apply `print_style`.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import QuadMesh
    from matplotlib.colorbar import Colorbar
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure
    from matplotlib.patheffects import AbstractPathEffect

SINGLE_COLUMN_MM = 90.0
"""Width of a figure of one column, as journals of two columns ask."""
DOUBLE_COLUMN_MM = 180.0
"""The same across both columns."""
MM_PER_INCH = 25.4
"""By definition of the inch."""
BAR_WIDTH = 0.76
"""Part of its place that a bar takes, so that neighbours stay apart. Chosen by eye."""

# Perceptually uniform, readable in grey and with every common colour vision deficiency.
SCORE_COLORMAP = "viridis"
TIME_COLORMAP = "viridis"
# From light to dark, so that a bin with nothing in it (white) is not mistaken for a large value.
DENSITY_COLORMAP = "magma_r"

INK = "#1a1a1a"
MUTED = "#6b6b6b"
PALE = "#e6e6e6"
# Over a field and under its arrows.
HATCH = "#a0a0a0"
# Okabe and Ito's palette for colour-blind readers.
BLUE = "#0072B2"
ORANGE = "#D55E00"
# Without black and the pale yellow.
PALETTE = (BLUE, ORANGE, "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7A4B9A")

# One size for all words of a figure.
FONT_PT = 7.0

STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": FONT_PT,
    "axes.titlesize": FONT_PT,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.titlepad": 4.0,
    "axes.labelpad": 3.0,
    "text.color": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "legend.columnspacing": 1.2,
    "lines.linewidth": 1.0,
    "hatch.linewidth": 0.5,
    "figure.titlesize": FONT_PT,
    "figure.labelsize": FONT_PT,
    "figure.constrained_layout.h_pad": 0.03,
    "figure.constrained_layout.w_pad": 0.03,
    "savefig.dpi": 300.0,
    # The same data give the same file: ids in an SVG are drawn from this salt, and text is
    # stored as outlines so that a reader's fonts do not matter.
    "svg.hashsalt": "driftwalk",
    "svg.fonttype": "path",
    # Fonts that a journal's printer can edit and embed: TrueType, not matplotlib's outlines.
    "pdf.fonttype": 42,
}

# matplotlib's parameters are one global table: two threads must not swap them at a time.
_STYLE_LOCK = threading.Lock()


@contextmanager
def print_style() -> Iterator[None]:
    """Apply the print style to what is drawn inside, and restore the old one after.

    The base is matplotlib's default and not the reader's own settings, so that the files of a run
    look alike on every machine.
    """
    import matplotlib
    from cycler import cycler

    with _STYLE_LOCK, matplotlib.rc_context():
        matplotlib.rcdefaults()
        parameters: Any = matplotlib.rcParams
        parameters.update(STYLE)
        parameters["axes.prop_cycle"] = cycler(color=PALETTE)
        yield


Layout = Literal["constrained", "compressed"]


def new_figure(*, width_mm: float, height_mm: float, layout: Layout = "constrained") -> Figure:
    """Return an empty figure of that size [mm] with the Agg canvas.

    `layout` is matplotlib's: "compressed" is the one for axes of equal aspect.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_mm / MM_PER_INCH, height_mm / MM_PER_INCH), layout=layout)
    FigureCanvasAgg(figure)
    return figure


def new_panels(
    rows: int,
    columns: int,
    *,
    height_mm: float,
    width_mm: float = DOUBLE_COLUMN_MM,
    layout: Layout = "constrained",
    **options: Any,
) -> tuple[Figure, list[Axes]]:
    """Return a new figure and its axes, row by row; `options` are those of `Figure.subplots`."""
    figure = new_figure(width_mm=width_mm, height_mm=height_mm, layout=layout)
    return figure, list(figure.subplots(rows, columns, squeeze=False, **options).flat)


def axes_or_new(
    ax: Axes | None,
    *,
    height_mm: float = 75.0,
    wide: bool = False,
    layout: Layout = "constrained",
) -> Axes:
    """Return `ax`, or when it is None the only axes of a new figure, one column wide or two."""
    if ax is not None:
        return ax
    width_mm = DOUBLE_COLUMN_MM if wide else SINGLE_COLUMN_MM
    return new_figure(width_mm=width_mm, height_mm=height_mm, layout=layout).add_subplot()


def axes_grid_or_new(
    axes: Any,
    *,
    count: int,
    columns: int | None = None,
    height_mm: float = 62.0,
    **options: Any,
) -> list[Axes]:
    """Return `axes` as a list of `count` axes, or those of a new figure, one row without `columns`.

    Raises
    ------
    InputError
        When `axes` does not hold exactly `count` axes.
    """
    if axes is None:
        columns = columns or count
        _, grid = new_panels(-(-count // columns), columns, height_mm=height_mm, **options)
        for spare in grid[count:]:
            spare.remove()
        axes = grid[:count]
    panels: list[Axes] = list(np.ravel(np.asarray(axes, dtype=object)))
    if len(panels) != count:
        raise InputError(f"got {len(panels)} axes, expected {count}: pass them as axes=[...]")
    return panels


def figure_of(ax: Axes) -> Figure:
    """Return the whole figure that axes lie in."""
    figure = ax.get_figure(root=True)
    if figure is None:
        raise InputError("the axes were removed from their figure")
    return figure


def axes_points(ax: Axes) -> Floats:
    """Return width and height of axes as they lie now [pt]."""
    return np.array([ax.bbox.width, ax.bbox.height]) / figure_of(ax).dpi * 72.0


def settle_layout(ax: Axes) -> None:
    """Give axes the size that they will have, so that sizes and places in points stay true."""
    figure = figure_of(ax)
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)


def edge_width(bodies: int) -> float:
    """Return the width of the edges of bodies [pt]: thinner where they are many, and so small."""
    return 0.6 * math.sqrt(min(1.0, 16 / max(bodies, 1)))


def outlined(width: float, color: str = "white") -> list[AbstractPathEffect]:
    """Return the effects that draw a line of that width [pt] behind a line."""
    from matplotlib.patheffects import Normal, Stroke

    return [Stroke(linewidth=width, foreground=color), Normal()]


def speed_colormap() -> Colormap:
    """Return one hue from light to middle: dark arrows stay readable, and blank differs from 0."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["Blues"](np.linspace(0.06, 0.68, 256)), name="light_blues")


def speed_mesh(ax: Axes, x: Floats, y: Floats, values: Floats, top: float) -> QuadMesh:
    """Draw values at nodes from light to middle blue, the darkest at the top and beyond."""
    mesh = ax.pcolormesh(x, y, values, cmap=speed_colormap(), vmin=0.0, vmax=top, shading="nearest")
    mesh.set_rasterized(True)
    return mesh


def add_colorbar(
    mappable: ScalarMappable,
    axes: Axes | list[Axes],
    label: str,
    *,
    extend: Literal["neither", "max"] = "neither",
) -> Colorbar:
    """Add a slim colour bar to the right of the axes; `extend` gives it a tip for larger values."""
    first = axes[0] if isinstance(axes, list) else axes
    bar = first.figure.colorbar(
        mappable, ax=axes, label=label, pad=0.02, aspect=22, fraction=0.06, extend=extend
    )
    bar.outline.set_linewidth(0.6)
    if bar.solids is not None:
        bar.solids.set_rasterized(True)
    return bar


def add_footer(figure: Figure, text: str) -> None:
    """Write a remark at the lower edge of the figure, after those that are there."""
    text = "; ".join(filter(None, (figure.get_supxlabel(), text)))
    figure.supxlabel(text, x=0.995, ha="right", color=MUTED)


def legend_above(figure: Figure, ax: Axes, columns: int) -> None:
    """Put a legend of what axes show above the whole figure."""
    figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=columns)


def legend_on_axes(ax: Axes) -> None:
    """Put a legend above axes, from their left edge on, where no data can be."""
    handles, labels = ax.get_legend_handles_labels()
    if labels:
        # Fifty letters fit abreast in one column of a page.
        narrow = 2 * max(map(len, labels)) <= 50
        ax.legend(
            handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0),
            ncols=2 if narrow else 1, borderaxespad=0.2, fontsize=FONT_PT, frameon=False,
        )  # fmt: skip


def legend_below(ax: Axes, columns: int, **named: Any) -> None:
    """Put a legend under the label of the horizontal axis, where no data can be."""
    from matplotlib.transforms import ScaledTranslation

    # Numbers and label of the axis are 28 pt high.
    down = ScaledTranslation(0.0, -30.0 / 72.0, figure_of(ax).dpi_scale_trans)
    ax.legend(
        **named, loc="upper center", ncols=columns, borderaxespad=0.0,
        bbox_to_anchor=(0.5, 0.0), bbox_transform=ax.transAxes + down,
    )  # fmt: skip


def letter_panels(axes: list[Axes], titles: list[str] | None = None) -> None:
    """Title panels "(a) …", "(b) …" at their left edge; without titles their own stay.

    One panel alone has no letter.
    """
    titles = [ax.get_title(loc="left") for ax in axes] if titles is None else titles
    for index, (ax, title) in enumerate(zip(axes, titles, strict=True)):
        letter = f"({chr(ord('a') + index)}) " if len(axes) > 1 else ""
        ax.set_title(f"{letter}{title}", loc="left")
