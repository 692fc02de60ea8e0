"""A dataset that shows its answer first when a notebook prints it, and the run that makes one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from html import escape
from os import PathLike
from pathlib import Path
from typing import Any

import xarray as xr

from driftwalk.core.progress import ignore_progress
from driftwalk.runs import Progress, Work, run_work
from driftwalk.schema.answers.parts import lines_of
from driftwalk.schema.runs import answer_of


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
    progress: Progress | None,
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
        progress=progress or ignore_progress,
        warnings=warnings,
        command=f"driftwalk.{call}(..., folder={str(folder)!r})",
    )


def counted(progress: Progress | None, words: str) -> Callable[[int, int], None]:
    """Return what tells a progress how much of something is done."""
    return lambda done, total: (progress or ignore_progress)(done, total, words)


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
