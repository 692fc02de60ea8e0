"""A recovery study of a motion model in a run directory: resumable, with its figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from driftwalk.core.run_stages import Course
from driftwalk.runs.folder import Progress, open_run, silent
from driftwalk.runs.stored import dataset_hash
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.motion import MotionModel


@dataclass(frozen=True)
class ModelRecoveryWork:
    """Everything that a recovery study of a motion model needs.

    Attributes
    ----------
    model : MotionModel
        The model; its parameters are those that are estimated.
    truth : mapping of str to float
        Their true values.
    study : Study
        Tank, camera, search, and the section [recover].
    flow : xarray.Dataset or None
        The water's velocity.
    like : xarray.Dataset or None
        A `trajectory` that gives start, time stamps, gaps and camera.
    body : str or None
        Its body.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    noise : {"estimated", "known"}
        Whether the calibrations know the noise of the camera.
    """

    model: MotionModel
    truth: Mapping[str, float]
    study: Study
    flow: xr.Dataset | None
    like: xr.Dataset | None
    body: str | None
    inputs: Mapping[str, Path]
    threads: int | None = None
    noise: Literal["estimated", "known"] = "estimated"


def run_model_recovery(
    work: ModelRecoveryWork,
    folder: Path,
    *,
    overwrite: bool = False,
    executor: Executor | None = None,
    progress: Progress = silent,
    command: str | Sequence[str] = "driftwalk.runs.run_model_recovery(...)",
) -> xr.Dataset:
    """Do a recovery study of a motion model in a run directory.

    Writes ``model_recovery.nc``, ``figures/`` and, last, ``manifest.json``. Killed at any moment
    and started again it continues with the recordings that are not done.

    Parameters
    ----------
    work : ModelRecoveryWork
        The work to do.
    folder : Path
        The run directory.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere; the result does not depend on it.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    command : str, optional
        The command line or the call, for the manifest.

    Returns
    -------
    xarray.Dataset
        A `model_recovery`.

    Raises
    ------
    ConfigurationError
        When a true value is missing, is none, or belongs to no parameter.
    InputError
        When such recordings cannot be made or calibrated; nothing is written then.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> model, truth = dw.motion_model("inertial"), {"speed_std": 0.02, "memory_time": 1.0}
    >>> work = ModelRecoveryWork(model, truth, dw.Study(), None, None, None, {})
    >>> found = run_model_recovery(work, Path("recovery"))  # doctest: +SKIP
    """
    from driftwalk.calibration import check_model_recovery, recover_model
    from driftwalk.figures import write_model_recovery_figures

    conditions: dict[str, Any] = {
        "flow": work.flow, "like": work.like, "body": work.body, "noise": work.noise,
    }  # fmt: skip
    check_model_recovery(work.model, work.truth, work.study, **conditions)
    with open_run(
        folder,
        specification=_specification(work),
        study=work.study,
        seeds={"recovery": work.study.recover.seed},
        inputs=work.inputs,
        overwrite=overwrite,
        command=command,
    ) as run:
        found = recover_model(
            work.model,
            work.truth,
            work.study,
            **conditions,
            threads=work.threads,
            executor=executor,
            store=run.store("recordings"),
            tell=Course(progress, {"recordings": 1.0}).stage("recordings"),
        )
        run.write("model_recovery.nc", netcdf_bytes(found))
        write_model_recovery_figures(run.folder("figures"), recovery=found)
    return found


def _specification(work: ModelRecoveryWork) -> dict[str, Any]:
    """Return what determines the numbers of a run."""
    like, flow = work.like, work.flow
    return {
        "kind": "model_recovery",
        "model": work.model.describe(),
        "truth": dict(work.truth),
        "study": work.study.to_dict(),
        "body": work.body,
        "noise": work.noise,
        "like_sha256": None if like is None else dataset_hash(like, ("x", "y", "theta")),
        "flow_sha256": None if flow is None else dataset_hash(flow, ("u", "v")),
    }
