"""Fit a recording: flow, drag, stochastic force and tracking noise together."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from driftwalk.conditions import require_motion, study_for
from driftwalk.core.study_keys import FIT_KEYS, study_overrides

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.notebook.settings import FitSettings
    from driftwalk.runs import Progress


def fit(
    recordings: xr.Dataset | Sequence[xr.Dataset],
    study: Study | None = None,
    *,
    body: str | None = None,
    folder: str | PathLike[str] | None = None,
    check: bool = True,
    overwrite: bool = False,
    progress: Progress | None = None,
    **settings: Unpack[FitSettings],
) -> xr.Dataset:
    """Fit flow, drag coefficient, stochastic force and tracking noise to recordings, together.

    Parameters
    ----------
    recordings : xarray.Dataset or sequence of xarray.Dataset
        A `trajectory` as `load` returns it, or several of one block in one tank and flow. Tank and
        block are those that they were loaded with.
    study : Study, optional
        Default: the paper's.
    body : str, optional
        The body, where a recording has several.
    folder : path-like, optional
        Run directory to make or continue, the same as that of ``driftwalk fit``: fit, flow,
        recording, check of the model, figures and manifest.
    check : bool
        Whether to check if the model explains the recordings: some seconds. The fit then holds the
        verdict (``explained``, ``finding``, ``p_value``) and the residuals by cell; `check_model`
        returns all of the check.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    **settings
        Keys of the study by their short names, numbers in SI units or texts with a unit:
        ``force_interval="16ms"``.

    Returns
    -------
    xarray.Dataset
        A `fit`, see `driftwalk.likelihood.fit_motion`. Printed, it begins with the answer.

    Raises
    ------
    InputError
        When a recording cannot be fitted, or recording and study state two tanks or two blocks.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> found = dw.fit(dw.tank30_recording(), force_interval="16ms")  # doctest: +SKIP
    """
    import xarray as xr

    from driftwalk.likelihood import fit_motion, judge_fit
    from driftwalk.notebook.result import as_result
    from driftwalk.runs import FitWork, run_work
    from driftwalk.runs.resumable_run import silent

    many = [recordings] if isinstance(recordings, xr.Dataset) else list(recordings)
    given: dict[str, Any] = dict(settings)
    for one in many:
        require_motion(one, body=body)
    chosen = study_for(many, study, study_overrides(keys=FIT_KEYS, **given), body=body)
    if folder is None:
        found = fit_motion(many, chosen, body=body, tell=progress)
        return as_result(judge_fit(found, many, body=body).fit if check else found)
    done = run_work(
        FitWork(many, chosen, body, {}, check=check),
        Path(folder),
        overwrite=overwrite,
        progress=progress or silent,
        command=f"driftwalk.fit(..., folder={str(folder)!r})",
    )
    return as_result(done.fit)
