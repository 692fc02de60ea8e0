"""The targets of figures: a run's figures for print, and the numbers that they draw."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from driftwalk.core.errors import InputError
from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.files.run_layout import run_file, state_of
from driftwalk.core.text_files import text_of_name
from driftwalk.export.target import Source, Target
from driftwalk.schema.check import check_contents
from driftwalk.schema.runs import StoredRun, open_run_folder
from driftwalk.schema.stores.netcdf import open_netcdf

if TYPE_CHECKING:
    import xarray as xr

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


def draw_run(run: Path, folder: Path, formats: Sequence[str]) -> list[Path]:
    """Write all figures of a run.

    Parameters
    ----------
    run : Path
        The directory of a finished run.
    folder : Path
        Where to write.
    formats : sequence of {"png", "svg", "pdf", "csv"}
        File formats; ``csv`` holds the numbers that are drawn.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    InputError
        When it is no finished run, or one without figures.

    Examples
    --------
    >>> draw_run(Path("fit"), Path("paper"), ["pdf", "csv"])  # doctest: +SKIP
    """
    from driftwalk.figures import write_figures

    if state_of(run) != "finished":
        raise InputError(f"{run} is not the directory of a finished run, so it has no figures")
    stored = _CheckedRun(**vars(open_run_folder(run)))
    if stored.kind is None or stored.kind.figures is None:
        raise InputError(f"{run} is a run without figures")
    table = stored.make(stored.kind, stored.kind.figures, lacking="its figures cannot be drawn")
    return write_figures(table, folder, formats)


class _CheckedRun(StoredRun):
    """A run of which a damaged dataset ends the work instead of being left out."""

    def dataset(self, name: str) -> xr.Dataset | None:
        path = run_file(self.folder, name)
        return None if path is None else check_contents(open_netcdf(path), path)
