"""Writing figures into a folder, each in several formats."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.atomic import atomic_path
from driftwalk.core.errors import InputError
from driftwalk.plot.parts.style import add_footer, print_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# What would make two files of the same figure differ (the date) or says nothing of the data.
METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}


def write_each(
    makers: Mapping[str, Callable[[], Figure]],
    folder: str | Path,
    formats: Sequence[str],
    *,
    footer: str = "",
) -> list[Path]:
    """Make every figure and write it by its name; nothing is made when a format is not known."""
    unknown = [name for name in formats if name not in METADATA]
    if unknown:
        raise InputError(
            f"no figure can be written as {', '.join(unknown)}: choose from {', '.join(METADATA)}"
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
    written = []
    for name in formats:
        path = stem.with_suffix(f".{name}")
        with atomic_path(path) as temporary:
            _print(figure, name, temporary)
        written.append(path)
    return written


def _print(figure: Figure, name: str, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    canvases: dict[str, Any] = {
        "png": FigureCanvasAgg,
        "svg": FigureCanvasSVG,
        "pdf": FigureCanvasPdf,
    }
    # The methods have no types.
    getattr(canvases[name](figure), f"print_{name}")(path, metadata=METADATA[name])
