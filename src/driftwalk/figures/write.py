"""Writing figures into a folder, each in several formats."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.errors import InputError
from driftwalk.core.files.atomic import atomic_path
from driftwalk.core.provenance import file_sha256
from driftwalk.figures.drawn_data import write_drawn_data
from driftwalk.plot.parts.style import add_footer, print_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# What would make two files of the same figure differ (the date) or says nothing of the data.
METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}
DATA = "csv"
"""The format that holds the numbers that a figure draws."""
SENTENCE = {"png": "Description", "svg": "Description", "pdf": "Subject"}
"""Under which key of its metadata a file says where the numbers are."""


def write_each(
    makers: Mapping[str, Callable[[], Figure]],
    folder: str | Path,
    formats: Sequence[str],
    *,
    footer: str = "",
) -> list[Path]:
    """Make every figure and write it by its name; nothing is made when a format is not known.

    With ``csv`` among the formats the drawn numbers lie next to each figure, which names their file
    and its hash in its metadata.
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
        for name, make in makers.items():
            figure = make()
            if footer:
                add_footer(figure, footer)
            written += _save(figure, target / name, formats)
    return written


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
