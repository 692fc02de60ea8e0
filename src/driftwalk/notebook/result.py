"""Results in a notebook: the answer first, runs in a folder, and one HTML page of everything."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import xarray as xr

from driftwalk.core.errors import InputError
from driftwalk.runs import Progress, Work, run_work
from driftwalk.schema.answers.parts import lines_of
from driftwalk.schema.check import kind_name
from driftwalk.schema.runs import answer_of

if TYPE_CHECKING:
    pass


class Result(xr.Dataset):  # type: ignore[no-untyped-call]
    """A fit, a calibration or a comparison: an `xarray.Dataset` whose text begins with the answer.

    Everything else is as in any dataset, and it is stored as one.

    Examples
    --------
    >>> answer = {"estimate": ("parameter", [2.0]), "interval": (("parameter", "bound"), [[1, 3]])}
    >>> names = {"parameter": ["speed"], "unit": ("parameter", ["m/s"])}
    >>> print(str(Result(answer, names, {"kind": "fit"})).splitlines()[0])
    speed                  2.000 m/s   interval 1.000 to 3.000
    """

    __slots__ = ()

    def __repr__(self) -> str:
        lines = answer_lines(self)
        if not lines:
            return super().__repr__()
        held = f"{len(self.data_vars)} variables, {len(self.attrs)} attributes"
        return "\n".join([*lines, f"<{type(self).__name__}: {held}>"])

    def _repr_html_(self) -> str:
        lines = answer_lines(self)
        head = f"<pre>{escape(chr(10).join(lines))}</pre>" if lines else ""
        return head + super()._repr_html_()


def as_result(dataset: xr.Dataset) -> Result:
    """Return the same dataset as a `Result`; it remembers the file that it was read from."""
    found = Result(dataset.data_vars, dataset.coords, dataset.attrs)
    found.encoding = dataset.encoding
    return found


def run_in_folder(
    folder: str | PathLike[str],
    call: str,
    work: Work,
    overwrite: bool,
    progress: Progress,
    executor: Executor | None = None,
    *,
    warnings: Sequence[str] = (),
) -> Any:
    """Make or continue the run of a call in a run directory, and return what it found."""
    return run_work(
        work,
        Path(folder),
        overwrite=overwrite,
        executor=executor,
        progress=progress,
        warnings=warnings,
        command=f"driftwalk.{call}(..., folder={str(folder)!r})",
    )


def answer_lines(found: xr.Dataset) -> list[str]:
    """Return the answer and its warnings as lines; none of a part that lacks some of it."""
    try:
        answer = answer_of(found)
    except (LookupError, TypeError, ValueError):
        # A dataset that was sliced is no whole result.
        return []
    if answer is None:
        return []
    return [*lines_of(answer.parts), *(f"warning: {text}" for text in answer.warnings)]


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
        many: list[Any] = [results]
    else:
        many = list(results)
    if not many:
        raise InputError("no result given: report needs one at least")
    pages = [_page(one) for one in many]
    if len(pages) > 1:
        name_apart(pages)
        return write_report(joined_page(pages, title=title), Path(path), existing=existing)
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
    if kind_name(result) in (None, "trajectory"):
        return recording_page(result, describe(result))
    return dataset_page(result)
