"""The targets of figures: a run's figures for print, and the numbers that they draw."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Final

from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.files.file_names import text_of_name
from driftwalk.export.figures.redraw import draw_run
from driftwalk.export.target import Source, Target

README: Final = """\
# Figures of {source}

driftwalk {version} drew these figures from what the run stores.

Each is 90 mm or 180 mm wide, one or two columns of a journal, with letters of 7 to 8 points.{fonts}
Next to each lies a table of the same name (`.csv`) with every number that is drawn: a row per
point, with the panel, the labels of its axes, which hold the units, and the artist. The figure
names the table and its SHA-256 in its metadata.

`driftwalk cite {source}` says what to cite.
"""
FONTS: Final = {
    "pdf": "\nFonts are embedded as TrueType.",
    "svg": "\nText is stored as outlines, so that it looks the same everywhere.",
    "png": "\nThere are 300 dots per inch.",
}


def _write(format: str, source: Source, folder: Path) -> list[Path]:
    from driftwalk import __version__

    files = draw_run(source.path, folder, ["csv", format])
    page = folder / "README.md"
    text = README.format(source=text_of_name(source.path), version=__version__, fonts=FONTS[format])
    write_atomic(page, text.encode())
    return [*files, page]


FIGURE_TARGETS: Final = tuple(
    Target(
        name,
        f"the figures as {name.upper()}, and the numbers that they draw",
        partial(_write, name),
        options=(),
    )
    for name in FONTS
)
