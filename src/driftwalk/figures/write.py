"""A table of figures written into a folder, each in several formats or as its numbers."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.files.atomic import atomic_path
from driftwalk.core.provenance import file_sha256
from driftwalk.plot.parts.style import add_footer, figure_of, print_style

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# What would make two files of the same figure differ (the date) or says nothing of the data.
METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}
Figures = dict[str, Callable[[], "Figure"]]
"""A table of figures: by name, what draws each."""
DATA = "csv"
"""The format that holds the numbers that a figure draws."""
SENTENCE = {"png": "Description", "svg": "Description", "pdf": "Subject"}
"""Under which key of its metadata a file says where the numbers are."""


def write_figures(
    figures: Mapping[str, Callable[[], Figure]],
    folder: str | Path,
    formats: Sequence[str] = ("png", "svg"),
) -> list[Path]:
    """Draw every figure of a table and write it by its name.

    The same datasets give the same files, byte for byte, with one version of matplotlib. With
    ``csv`` among the formats the drawn numbers lie next to each figure, which names their file and
    its hash in its metadata.

    Parameters
    ----------
    figures : mapping of str to callable
        Result of one of the functions of this room, such as `calibration_figures`. A name with a
        "/" puts the figure into a subfolder.
    folder : path-like
        Where to write; made when absent.
    formats : sequence of {"png", "svg", "pdf", "csv"}
        File formats.

    Returns
    -------
    list of pathlib.Path
        The files.

    Raises
    ------
    InputError
        When a format is not known, before anything is drawn, or a dataset lacks what a figure
        draws.
    RunDirectoryError
        When a figure cannot be written.

    Examples
    --------
    ``write_figures(calibration_figures(calibration, recording, flow=flow), "figures")``
    """
    known = (*METADATA, DATA)
    unknown = [name for name in formats if name not in known]
    if unknown:
        raise InputError(
            f"no figure can be written as {', '.join(unknown)}: choose from {', '.join(known)}"
        )
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    with print_style():
        for name, make in figures.items():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            written += _save(make(), target / name, formats)
    return written


def plotted(found: xr.Dataset, **plots: Callable[[xr.Dataset], Axes]) -> Figures:
    """Return a table of figures of one axes each, which these functions draw from a dataset."""

    def draw(plot: Callable[[xr.Dataset], Axes]) -> Figure:
        return figure_of(plot(found))

    return {name: partial(draw, plot) for name, plot in plots.items()}


def marked_simulated(figures: Figures, found: xr.Dataset) -> Figures:
    """Return a table whose figures say that the recording was simulated, where it was."""
    if found.attrs.get("simulated_recording") != "yes":
        return figures

    def marked(draw: Callable[[], Figure]) -> Figure:
        figure = draw()
        add_footer(figure, "simulated recording, not measured")
        return figure

    return {name: partial(marked, draw) for name, draw in figures.items()}


def _save(figure: Figure, stem: Path, formats: Sequence[str]) -> list[Path]:
    """Lay the figure out once and draw it once for every format.

    `Figure.savefig` draws twice for a file: the first time it only measures, for a layout.
    """
    from matplotlib import rcParams

    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    figure.set_dpi(rcParams["savefig.dpi"])
    written: list[Path] = []
    sentence = ""
    if DATA in formats:
        table = stem.with_suffix(f".{DATA}")
        with atomic_path(table) as temporary:
            write_drawn_data(figure, temporary)
        written.append(table)
        sentence = f"The drawn numbers are in {table.name}, SHA-256 {file_sha256(table)}"
    for name in (name for name in formats if name != DATA):
        path = stem.with_suffix(f".{name}")
        with atomic_path(path) as temporary:
            _print(figure, name, temporary, sentence)
        written.append(path)
    return written


def _print(figure: Figure, name: str, path: Path, sentence: str) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    canvases: dict[str, Any] = {
        "png": FigureCanvasAgg,
        "svg": FigureCanvasSVG,
        "pdf": FigureCanvasPdf,
    }
    # The methods have no types.
    about = {**METADATA[name], **({SENTENCE[name]: sentence} if sentence else {})}
    getattr(canvases[name](figure), f"print_{name}")(path, metadata=about)


COLUMNS: Final = (
    *("panel", "title", "x_axis", "y_axis", "artist", "kind", "label", "part"),
    *("x", "y", "dx", "dy", "value"),
)
"""The head of the table. x and y are in the units that the labels of the axes name."""

Rows = Iterator[tuple[int, Floats]]
"""The number of a part of an artist, and its rows of x, y, dx, dy and value; NaN where it has
none."""


def write_drawn_data(figure: Figure, path: Path) -> None:
    """Write every number that is drawn in the axes of a figure as CSV.

    One row per point: the panel with its title and the labels of its axes, the artist, what kind it
    is and its label in the legend, and the numbers. A line, the outline of an area and a contour
    have x and y; an arrow also has dx and dy, a rectangle its lower left corner and its width
    and height; points, cells of a map and contours have the value that is their colour. A legend
    and other artists that are placed relative to the axes are no data, and left out.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        The figure, laid out.
    path : Path
        The file to make.

    Examples
    --------
    >>> from driftwalk.plot.parts.style import new_figure
    >>> write_drawn_data(new_figure(width_mm=90, height_mm=60), Path("a.csv"))  # doctest: +SKIP
    """
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for panel, ax in enumerate(_axes_of(figure), start=1):
            title = ax.get_title(loc="left") or ax.get_title()
            head = [panel, title, ax.get_xlabel(), ax.get_ylabel()]
            for number, artist in enumerate(_artists(ax), start=1):
                label = str(artist.get_label())
                about = [number, type(artist).__name__, "" if label.startswith("_") else label]
                for part, rows in _rows_of(artist):
                    for row in rows.tolist():
                        table.writerow([*head, *about, part, *map(_text, row)])


def _axes_of(figure: Figure) -> list[Axes]:
    """Return the axes of a figure and those inside others, such as insets."""
    found: list[Any] = list(figure.axes)
    for ax in found:  # those that are found on the way have their turn
        found += [inside for inside in ax.child_axes if inside not in found]
    return found


def _artists(ax: Axes) -> list[Any]:
    """Return what is drawn in the data's own coordinates, in the order in which it was added."""
    return [
        artist
        for artist in (*ax.lines, *ax.collections, *ax.images, *ax.patches)
        if artist.get_visible() and _in_data(artist, ax)
    ]


def _in_data(artist: Any, ax: Axes) -> bool:
    moves: Any = artist.get_transform()
    places = getattr(artist, "get_offset_transform", artist.get_transform)()
    return bool(moves.contains_branch(ax.transData) or places.contains_branch(ax.transData))


def _rows_of(artist: Any) -> Rows:
    """Give the rows of an artist: of a line, a field or points, else of an outline."""
    from matplotlib.collections import PathCollection, QuadMesh
    from matplotlib.contour import ContourSet
    from matplotlib.image import AxesImage
    from matplotlib.lines import Line2D
    from matplotlib.quiver import Quiver

    if isinstance(artist, Line2D):
        yield 0, _points(artist.get_xydata())
    elif isinstance(artist, Quiver):
        yield 0, _table(artist.X, artist.Y, artist.U, artist.V, artist.get_array())
    elif isinstance(artist, QuadMesh):
        yield 0, _of_mesh(artist)
    elif isinstance(artist, AxesImage):
        yield 0, _of_image(artist)
    elif isinstance(artist, ContourSet):
        for part, (level, path) in enumerate(zip(artist.levels, artist.get_paths(), strict=False)):
            yield part, _points(path.vertices, value=level)
    elif isinstance(artist, PathCollection):
        yield 0, _points(artist.get_offsets(), value=artist.get_array())
    else:
        yield from _outlines(artist)


def _outlines(artist: Any) -> Rows:
    from matplotlib.patches import Circle, Rectangle

    if isinstance(artist, Rectangle):
        x, y = artist.get_xy()
        yield 0, _table(x, y, artist.get_width(), artist.get_height())
    elif isinstance(artist, Circle):
        x, y = artist.center
        yield 0, _table(x, y, 2.0 * artist.radius, 2.0 * artist.radius)
    elif hasattr(artist, "get_paths"):
        for part, path in enumerate(artist.get_paths()):
            yield part, _points(path.vertices)
    elif hasattr(artist, "get_path"):
        own = artist.get_path().transformed(artist.get_patch_transform())
        yield 0, _points(own.vertices)


def _of_mesh(mesh: Any) -> Floats:
    corners = np.asarray(mesh.get_coordinates(), dtype=np.float64)
    middle = (corners[:-1, :-1] + corners[1:, :-1] + corners[:-1, 1:] + corners[1:, 1:]) / 4.0
    values = _filled(mesh.get_array())
    # Colours that go smoothly from corner to corner have a value at each corner.
    places = middle if values.size == middle[..., 0].size else corners
    return _table(places[..., 0], places[..., 1], value=values)


def _of_image(image: Any) -> Floats:
    """Return the cells of an image, or nothing of a picture that has colours and no values."""
    values = _filled(image.get_array())
    if values.ndim != 2:
        return np.zeros((0, 5))
    left, right, bottom, top = image.get_extent()
    rows, columns = values.shape
    if image.origin == "upper":
        bottom, top = top, bottom
    x = left + (np.arange(columns) + 0.5) * (right - left) / columns
    y = bottom + (np.arange(rows) + 0.5) * (top - bottom) / rows
    across, up = np.meshgrid(x, y)
    return _table(across, up, value=values)


def _points(places: Any, value: Any = None) -> Floats:
    found = _filled(places).reshape(-1, 2)
    return _table(found[:, 0], found[:, 1], value=value)


def _filled(values: Any) -> Floats:
    return np.ma.filled(np.ma.asarray(values, dtype=np.float64), np.nan)


def _table(x: Any, y: Any, dx: Any = None, dy: Any = None, value: Any = None) -> Floats:
    columns = [_filled(np.nan if one is None else one).ravel() for one in (x, y, dx, dy, value)]
    return np.stack(np.broadcast_arrays(*columns), axis=1)


def _text(number: float) -> str:
    """Return a number with all of its digits, nothing where there is none."""
    return "" if np.isnan(number) else repr(number)
