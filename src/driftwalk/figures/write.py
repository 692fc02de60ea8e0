"""Writing a table of figures into a folder, each in several formats."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.errors import InputError
from driftwalk.core.files.atomic import atomic_path
from driftwalk.core.provenance import file_sha256
from driftwalk.figures.drawn_data import write_drawn_data
from driftwalk.plot.parts.style import add_footer, print_style

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# What would make two files of the same figure differ (the date) or says nothing of the data.
METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}
FOOTER = "simulated recording, not measured"
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


def marked_simulated(figures: Figures, found: xr.Dataset) -> Figures:
    """Return a table whose figures say that the recording was simulated, where it was."""
    if found.attrs.get("simulated_recording") != "yes":
        return figures

    def marked(draw: Callable[[], Figure]) -> Figure:
        figure = draw()
        add_footer(figure, FOOTER)
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
