"""Compare motion models on a recording, in memory or in a run directory that resumes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Unpack

from driftwalk.conditions import require_motion, study_for
from driftwalk.core.study_keys import CALIBRATION_KEYS, study_overrides
from driftwalk.notebook.model_of import flow_field_of

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.motion import MotionModel
    from driftwalk.notebook.settings import StudySettings
    from driftwalk.runs import Progress


def compare_models(
    recording: xr.Dataset,
    models: Sequence[str | MotionModel] | Literal["usual", "all"] = "usual",
    *,
    parameters: Mapping[str, float | tuple[float, float]] | None = None,
    study: Study | None = None,
    flow: xr.Dataset | None = None,
    body: str | None = None,
    folder: str | PathLike[str] | None = None,
    overwrite: bool = False,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    **settings: Unpack[StudySettings],
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
        units: for each of the named models that has it. ``clearance`` is the distance of the
        recorded point from the wall at contact [m]. Models of `motion_model` hold their own.
    study : Study, optional
        Tank, camera, step interval and seed; default: the paper's.
    flow : xarray.Dataset, optional
        The water's velocity: a `flow_field` or a `fit`. For the block it is extracted from the
        recording when left out.
    body : str, optional
        The body, where the recording has several.
    folder : path-like, optional
        Run directory to make or continue, the same as that of ``driftwalk compare-models``.
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
    from driftwalk.calibration import ALL_MODELS, DEFAULT_MODELS, compare_models as compare
    from driftwalk.motion import models_knowing
    from driftwalk.notebook.result import as_result
    from driftwalk.runs import ModelComparisonWork, run_work
    from driftwalk.runs.resumable_run import silent

    named = {"usual": DEFAULT_MODELS, "all": ALL_MODELS}
    asked = named.get(models, (models,)) if isinstance(models, str) else models
    chosen = models_knowing(asked, parameters or {})
    given: dict[str, Any] = dict(settings)
    require_motion(recording, body=body)
    overrides = study_overrides(keys=CALIBRATION_KEYS, **given)
    conditions = study_for([recording], study, overrides, body=body, needs_tank=chosen == ["block"])
    field = None if flow is None else flow_field_of(flow)
    say = progress or silent
    if folder is None:
        found = compare(
            recording,
            chosen,
            study=conditions,
            flow=field,
            body=body,
            threads=threads,
            executor=executor,
            tell=say,
        )
        return as_result(found)
    found = run_work(
        ModelComparisonWork(recording, chosen, conditions, field, body, {}, threads),
        Path(folder),
        overwrite=overwrite,
        executor=executor,
        progress=say,
        command=f"driftwalk.compare_models(..., folder={str(folder)!r})",
    )
    return as_result(found)
