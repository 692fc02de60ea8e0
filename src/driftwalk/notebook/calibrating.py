"""Calibrate a motion model on a recording, in memory or in a run directory that resumes."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from driftwalk.conditions import study_for
from driftwalk.core.study_keys import CALIBRATION_KEYS, study_overrides

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.notebook.settings import CalibrationSettings
    from driftwalk.runs import Progress


def calibrate(
    recording: xr.Dataset,
    study: Study | None = None,
    *,
    flow: xr.Dataset | None = None,
    body: str | None = None,
    folder: str | PathLike[str] | None = None,
    overwrite: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
    **settings: Unpack[CalibrationSettings],
) -> xr.Dataset:
    """Calibrate drag coefficient and stochastic force on a recording.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory` as `load` returns it; tank and block are those it was loaded with.
    study : Study, optional
        Model and search; default: the paper's.
    flow : xarray.Dataset, optional
        The water's velocity: a `flow_field` or a `fit`. Without it the field is extracted from the
        recording.
    body : str, optional
        The body, where the recording has several.
    folder : path-like, optional
        Run directory to make or continue, the same as that of ``driftwalk calibrate``.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    **settings
        Keys of the study by their short names: ``force_interval="16ms"``, ``bootstrap=50``.

    Returns
    -------
    xarray.Dataset
        A `calibration`, see `driftwalk.calibration.calibrate`.

    Raises
    ------
    InputError
        When the recording cannot be calibrated on, or it and the study state two tanks or blocks.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> found = dw.calibrate(dw.tank30_recording(), flow=dw.tank30_flow())  # doctest: +SKIP
    """
    from driftwalk.calibration import calibrate as calibrate_study
    from driftwalk.likelihood import fitted_flow
    from driftwalk.runs import CalibrationWork, run_calibration
    from driftwalk.runs.folder import silent
    from driftwalk.schema.netcdf import open_netcdf

    given: dict[str, Any] = dict(settings)
    overrides = study_overrides(keys=CALIBRATION_KEYS, **given)
    chosen = study_for([recording], study, overrides, body=body)
    field = fitted_flow(flow) if flow is not None and flow.attrs.get("kind") == "fit" else flow
    say = progress or silent
    if folder is None:
        return calibrate_study(
            recording,
            chosen,
            flow=field,
            body=body,
            threads=threads,
            tell=lambda stage, done, total: say(done, total, stage),
        )
    place = Path(folder)
    work = CalibrationWork(recording, chosen, field, body, {}, threads)
    run_calibration(
        work,
        place,
        overwrite=overwrite,
        progress=say,
        command=f"driftwalk.calibrate(..., folder={str(folder)!r})",
    )
    return open_netcdf(place / "calibration.nc")
