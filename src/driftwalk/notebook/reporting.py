"""One HTML page of everything that was found."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from driftwalk.core.errors import InputError
from driftwalk.schema.kinds import find_kind
from driftwalk.schema.kinds.motion import TRAJECTORY

if TYPE_CHECKING:
    import xarray as xr


def report(
    results: xr.Dataset | str | PathLike[str] | Sequence[xr.Dataset | str | PathLike[str]],
    path: str | PathLike[str] = "report.html",
    *,
    title: str = "Report",
    existing: Literal["error", "replace"] = "error",
) -> Path:
    """Write one page of results: a single HTML file that loads nothing from anywhere.

    Parameters
    ----------
    results : xarray.Dataset or path-like, or a sequence of them
        A recording, a `fit`, a `calibration`, an `assembly`, a `sensitivity`, a `recovery`; or the
        run directory of one. A result that was made with `folder` shows all that lies there; one
        that is only in memory shows what it holds itself.
    path : path-like
        The file, which ends in ``.html`` or ``.htm``.
    title : str
        Of the page, where it shows several results.
    existing : {"error", "replace"}
        What to do when the file is there already.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    InputError
        When there is nothing to show, a dataset is of a kind that no page shows, or the file is
        there already.

    Examples
    --------
    ``dw.report([fit, cal, four], "report.html")``
    """
    import xarray as xr

    from driftwalk.page import joined_page, name_apart, write_report

    if isinstance(results, (xr.Dataset, str, PathLike)):
        results = [results]
    pages = [_page(one) for one in results]
    if not pages:
        raise InputError("no result given: report needs one at least")
    if len(pages) > 1:
        name_apart(pages)
        pages = [joined_page(pages, title=title)]
    return write_report(pages[0], Path(path), existing=existing)


def _page(result: Any) -> dict[str, Any]:
    """Return the page of a dataset or a run directory."""
    import xarray as xr

    from driftwalk.page import dataset_page, recording_page, report_page
    from driftwalk.record import describe
    from driftwalk.runs import run_folder

    if not isinstance(result, xr.Dataset):
        return report_page(Path(result))
    folder = run_folder(result)
    if folder is not None:
        return report_page(folder)
    if find_kind(result) in (None, TRAJECTORY):
        return recording_page(result, describe(result))
    return dataset_page(result)
