"""Calibrate a motion model on a recording, in memory or in a run directory that resumes."""

from __future__ import annotations

from concurrent.futures import Executor
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from driftwalk.conditions import require_motion, study_for
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import CALIBRATION_KEYS, study_overrides
from driftwalk.notebook.model_of import flow_field_of

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.motion import MotionModel
    from driftwalk.notebook.settings import CalibrationSettings
    from driftwalk.runs import Progress


def calibrate(
    recording: xr.Dataset,
    model: MotionModel | Study | None = None,
    *,
    study: Study | None = None,
    flow: xr.Dataset | None = None,
    body: str | None = None,
    folder: str | PathLike[str] | None = None,
    overwrite: bool = False,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    **settings: Unpack[CalibrationSettings],
) -> xr.Dataset:
    """Find the parameters of a motion model that explain a recording.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory` as `load` returns it; tank and block are those it was loaded with.
    model : MotionModel or Study, optional
        A `motion_model`, or the block of a study; default: the paper's block, whose drag
        coefficient and stochastic force are searched.
    study : Study, optional
        Tank, camera, step interval and search, with a `motion_model`; default: the paper's.
    flow : xarray.Dataset, optional
        The water's velocity: a `flow_field` or a `fit`. For the block it is extracted from the
        recording when left out.
    body : str, optional
        The body, where the recording has several.
    folder : path-like, optional
        Run directory to make or continue, the same as that of ``driftwalk calibrate``.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere, such as that of `driftwalk.cluster.connect`. The result does
        not depend on it.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    **settings
        Keys of the study by their short names: ``force_interval="16ms"``, ``bootstrap=50``.

    Returns
    -------
    xarray.Dataset
        A `calibration`, see `driftwalk.calibration.calibrate`. Printed, it begins with the answer.

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
    from driftwalk.calibration import calibrate as calibrate_model
    from driftwalk.model import Study
    from driftwalk.motion import BlockModel
    from driftwalk.notebook.result import as_result
    from driftwalk.runs import CalibrationWork, run_work
    from driftwalk.runs.resumable_run import silent

    given: dict[str, Any] = dict(settings)
    if isinstance(model, Study):
        if study is not None:
            raise InputError("two studies are given: give one, or a motion model and a study")
        model, study = None, model
    if isinstance(model, BlockModel) and study is None:
        study = model.study
    is_block = model is None or isinstance(model, BlockModel)
    require_motion(recording, body=body)
    overrides = study_overrides(keys=CALIBRATION_KEYS, **given)
    chosen = study_for([recording], study, overrides, body=body, needs_tank=is_block)
    field = None if flow is None else flow_field_of(flow)
    say = progress or silent
    if folder is None:
        found = calibrate_model(
            recording,
            model,
            study=chosen,
            flow=field,
            body=body,
            threads=threads,
            executor=executor,
            tell=lambda stage, done, total: say(done, total, stage),
        )
        return as_result(found)
    found = run_work(
        CalibrationWork(recording, chosen, field, body, {}, threads, model),
        Path(folder),
        overwrite=overwrite,
        executor=executor,
        progress=say,
        command=f"driftwalk.calibrate(..., folder={str(folder)!r})",
    )
    return as_result(found)
