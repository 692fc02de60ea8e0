"""Compare two motions, or motion models on a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from os import PathLike
from typing import TYPE_CHECKING, Literal, Unpack

from driftwalk.conditions import require_motion, study_for
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import CALIBRATION_KEYS, CalibrationSettings, study_overrides
from driftwalk.notebook.simulating import flow_field_of

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.comparison.ks import Ties
    from driftwalk.model import Study
    from driftwalk.motion import MotionModel
    from driftwalk.runs import Progress


def compare(
    trajectory_a: xr.Dataset,
    trajectory_b: xr.Dataset,
    *,
    body_a: str | None = None,
    body_b: str | None = None,
    step_interval: float | None = None,
    ties: Ties = "strict",
    block_length: int | None = None,
    permutations: int = 999,
    seed: int = 1,
) -> xr.Dataset:
    """Compare the step lengths and turning angles of two motions.

    Parameters
    ----------
    trajectory_a : xarray.Dataset
        A `trajectory`.
    trajectory_b : xarray.Dataset
        Another one; or a simulation, of which every replicate is compared with the first motion.
    body_a, body_b : str, optional
        Names of the bodies, where there are several.
    step_interval : float, optional
        Time between the positions of a step [s], the same for both; default: the longer of the two
        median sampling intervals.
    ties : {"strict", "limits"}
        As in `ks_distance`.
    block_length, permutations, seed
        Of two single motions: as in `driftwalk.comparison.block_permutation_test`.

    Returns
    -------
    xarray.Dataset
        Of two single motions a `comparison`, see `driftwalk.comparison.compare`; with several
        replicates a `replicate_comparison`, see `driftwalk.comparison.compare_replicates`. Both
        have ``ks_distance``, ``noise_floor`` and ``p_value``.

    Raises
    ------
    InputError
        When a body is not there or no steps can be formed.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording().isel(time=slice(0, 600))
    >>> run = dw.simulate(dw.Study(), dw.tank30_flow(), like=recording, replicates=3)
    >>> 0.25 <= float(dw.compare(recording, run)["p_value"]) <= 1.0
    True
    """
    from driftwalk.comparison import compare as compare_two, compare_replicates

    if trajectory_a.sizes.get("replicate", 1) > 1:
        raise InputError("the simulation comes second: compare(recording, simulation)")
    first = trajectory_a.isel(replicate=0) if "replicate" in trajectory_a.dims else trajectory_a
    if trajectory_b.sizes.get("replicate", 1) > 1:
        if body_b is not None or block_length is not None:
            raise InputError("`body_b` and `block_length` are for two single motions")
        return compare_replicates(
            first, trajectory_b, body=body_a, step_interval=step_interval, ties=ties
        )
    second = trajectory_b.isel(replicate=0) if "replicate" in trajectory_b.dims else trajectory_b
    return compare_two(
        first,
        second,
        body_a=body_a,
        body_b=body_b,
        step_interval=step_interval,
        ties=ties,
        block_length=block_length,
        permutations=permutations,
        seed=seed,
    )


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
    from driftwalk.calibration import ALL_MODELS, DEFAULT_MODELS, compare_models as compare_all
    from driftwalk.motion import models_knowing
    from driftwalk.notebook.result import as_result, run_in_folder
    from driftwalk.runs import ModelComparisonWork
    from driftwalk.runs.resumable_run import silent

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
    say = progress or silent
    if folder is not None:
        work = ModelComparisonWork(recording, chosen, conditions, field, body, {}, threads)
        found = run_in_folder(folder, "compare_models", work, overwrite, say, executor)
        return as_result(found)
    found = compare_all(
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
