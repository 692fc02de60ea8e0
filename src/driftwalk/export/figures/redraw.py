"""The figures of a finished run, drawn again from what it stores."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from driftwalk.core.errors import InputError
from driftwalk.core.files.run_layout import run_file, state_of
from driftwalk.schema.runs import StoredRun, open_run_folder
from driftwalk.schema.stores.contents import check_contents
from driftwalk.schema.stores.netcdf import open_netcdf

if TYPE_CHECKING:
    import xarray as xr


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
