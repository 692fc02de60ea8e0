"""Fit a recording by likelihood, or calibrate and compare motion models on it by simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Unpack

from driftwalk.conditions import one_body_each, require_motion, study_for
from driftwalk.core.errors import InputError
from driftwalk.core.progress import ignore_progress
from driftwalk.core.study_keys import (
    CALIBRATION_KEYS,
    FIT_KEYS,
    CalibrationSettings,
    FitSettings,
    study_overrides,
)
from driftwalk.model import Study, apply_overrides
from driftwalk.motion import BlockModel, MotionModel, models_knowing
from driftwalk.notebook.simulating import flow_field_of
from driftwalk.runs import (
    CalibrationWork,
    FitWork,
    ModelComparisonWork,
    Progress,
    read_earlier_fit,
)

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.likelihood import EarlierFit


def fit(
    recordings: xr.Dataset | Sequence[xr.Dataset],
    study: Study | None = None,
    *,
    flow: xr.Dataset | None = None,
    earlier: str | PathLike[str] | xr.Dataset | EarlierFit | None = None,
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
    flow : xarray.Dataset, optional
        A steady flow that was measured, a `flow_field`; with its errors it is the prior of the
        fitted flow.
    earlier : path-like, xarray.Dataset or EarlierFit, optional
        Of glued blocks, ``body_shape="xx"``: a finished fit of one block in the same water, by its
        run directory, as a `fit` that was read from one or made with `folder`, or with its
        recordings, ``dw.likelihood.EarlierFit(fit, [recording])``. Tank, side, water and law come
        from that fit.
    body : str, optional
        The body, where a recording has several; ``interaction=True`` takes all of them.
    folder : path-like, optional
        Run directory to make or continue, the same as for ``driftwalk fit``: fit, flow,
        recording, check of the model, figures and manifest.
    check : bool
        Whether to check if the model explains the recordings: some seconds. The fit then holds the
        ``verdict`` with each ``verdict_reason``, ``p_value`` by criterion and the residuals by
        cell; `check_model` returns all of the check.
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
        When a recording cannot be fitted, recording and study state two tanks or two blocks, or
        the earlier fit is not one of a single block with its recordings.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> found = dw.fit(dw.tank30_recording(), force_interval="16ms")  # doctest: +SKIP
    >>> pair = dw.fit(dw.load("dimer.csv"), body_shape="xx", earlier="fit")  # doctest: +SKIP
    """
    import xarray as xr

    from driftwalk.likelihood import EarlierFit, fit_motion, glued_study, judge_fit
    from driftwalk.notebook.result import as_result, run_in_folder

    many = [recordings] if isinstance(recordings, xr.Dataset) else list(recordings)
    overrides = study_overrides(keys=FIT_KEYS, **settings)
    many = one_body_each(many, apply_overrides(study or Study(), overrides))
    for one in many:
        require_motion(one, body=body)
    if earlier is not None:
        if not isinstance(earlier, EarlierFit):
            known = earlier if isinstance(earlier, xr.Dataset) else Path(earlier)
            earlier = read_earlier_fit(known)
        study = glued_study(apply_overrides(study or Study(), overrides), earlier.fit)
        overrides = {}
    chosen = study_for(many, study, overrides, body=body)
    if folder is not None:
        work = FitWork(many, chosen, body, {}, check=check, flow=flow, earlier=earlier)
        return as_result(run_in_folder(folder, "fit", work, overwrite, progress).fit)
    found = fit_motion(many, chosen, body=body, flow=flow, earlier=earlier, tell=progress)
    return as_result(judge_fit(found, many, body=body).fit if check else found)


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
        Run directory to make or continue, the same as for ``driftwalk calibrate``.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere, for example from `driftwalk.cluster.connect`. The result does
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
    from driftwalk.notebook.result import as_result, run_in_folder

    if isinstance(model, Study):
        if study is not None:
            raise InputError("two studies are given: give one, or a motion model and a study")
        model, study = None, model
    if isinstance(model, BlockModel) and study is None:
        study = model.study
    is_block = model is None or isinstance(model, BlockModel)
    require_motion(recording, body=body)
    overrides = study_overrides(keys=CALIBRATION_KEYS, **settings)
    chosen = study_for([recording], study, overrides, body=body, needs_tank=is_block)
    field = None if flow is None else flow_field_of(flow)
    # In a folder it is the run of the command line: either continues what the other began.
    if folder is not None:
        work = CalibrationWork(recording, chosen, field, body, {}, threads, model)
        return as_result(run_in_folder(folder, "calibrate", work, overwrite, progress, executor))
    found = calibrate_model(
        recording,
        model,
        study=chosen,
        flow=field,
        body=body,
        threads=threads,
        executor=executor,
        tell=lambda stage, done, total: (progress or ignore_progress)(done, total, stage),
    )
    return as_result(found)


def compare_models(
    recording: xr.Dataset,
    models: Sequence[str | MotionModel] | Literal["usual", "all"] = "usual",
    *,
    parameters: Mapping[str, float | tuple[float, float]] | None = None,
    clearance: float | None = None,
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
    """Say which motion models explain a recording.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory` as `load` returns it.
    models : sequence of str or MotionModel, "usual" or "all"
        Names such as "block" and "run_tumble+wall", or models of `motion_model`. The usual ones are
        the block and the family with an interaction with the wall.
    parameters : mapping, optional
        From the name of a parameter to a value that is known, or to a range of the search, in SI
        units: for each of the named models that has it. Models of `motion_model` hold their own.
    clearance : float, optional
        Distance of the recorded point from the wall at contact [m], half the body's width, for the
        named models; default: estimated from the recording.
    study : Study, optional
        Tank, camera, step interval and seed; default: the paper's.
    flow : xarray.Dataset, optional
        The water's velocity: a `flow_field` or a `fit`. For the block it is extracted from the
        recording when left out.
    body : str, optional
        The body, where the recording has several.
    folder : path-like, optional
        Run directory to make or continue, the same as for ``driftwalk compare-models``.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere, for example from `driftwalk.cluster.connect`. The result does
        not depend on it.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    **settings
        Keys of the study by their short names: ``step_interval=0.2``, ``seed=3``. Summaries
        of the motion decide between the closest models; ``bootstrap=0`` leaves those out.

    Returns
    -------
    xarray.Dataset
        A `model_comparison`, the closest model first: see `driftwalk.calibration.compare_models`.
        Printed, it begins with the ranking.

    Raises
    ------
    InputError
        When the recording cannot be compared, or it and the study state two tanks or blocks.
    ConfigurationError
        When there is no such model, one is given twice, or none has a parameter that is given.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> found = dw.compare_models(recording, ["block", "run_tumble+wall"])  # doctest: +SKIP
    >>> found["model"].values[0]  # doctest: +SKIP
    'block'
    """
    from driftwalk.calibration import ALL_MODELS, DEFAULT_MODELS, compare_models as compare_all
    from driftwalk.notebook.result import as_result, run_in_folder

    named = {"usual": DEFAULT_MODELS, "all": ALL_MODELS}
    asked = named.get(models, (models,)) if isinstance(models, str) else models
    known = dict(parameters or {})
    if clearance is not None:
        known["clearance"] = clearance
    chosen = models_knowing(asked, known)
    require_motion(recording, body=body)
    overrides = study_overrides(keys=CALIBRATION_KEYS, **settings)
    conditions = study_for([recording], study, overrides, body=body, needs_tank=chosen == ["block"])
    field = None if flow is None else flow_field_of(flow)
    # In a folder it is the run of the command line: either continues what the other began.
    if folder is not None:
        work = ModelComparisonWork(recording, chosen, conditions, field, body, {}, threads)
        found = run_in_folder(folder, "compare_models", work, overwrite, progress, executor)
        return as_result(found)
    found = compare_all(
        recording,
        chosen,
        study=conditions,
        flow=field,
        body=body,
        threads=threads,
        executor=executor,
        tell=progress,
    )
    return as_result(found)
