"""A calibration in a run directory: resumable, with its figures and its manifest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.run_stages import CALIBRATION_STAGES, Course, tell_nobody
from driftwalk.runs.folder import Progress, naming_recording, open_run, silent
from driftwalk.runs.stored import dataset_hash
from driftwalk.schema.parameters import unit_suffix
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.core.files.rundir import RunDirectory
    from driftwalk.model import Study
    from driftwalk.motion import MotionModel
    from driftwalk.sweep import Store


@dataclass(frozen=True)
class CalibrationWork:
    """Everything that a calibration run needs.

    Attributes
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    study : Study
        The model and the search.
    flow : xarray.Dataset or None
        A given flow field; None takes it from the recording.
    body : str or None
        The body.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    model : MotionModel or None
        The model to calibrate; None for the block of the study.
    posterior : bool
        Whether the values that could have given the recording are written as a table, too.
    """

    recording: xr.Dataset
    study: Study
    flow: xr.Dataset | None
    body: str | None
    inputs: Mapping[str, Path]
    threads: int | None = None
    model: MotionModel | None = None
    posterior: bool = False


def run_calibration(
    work: CalibrationWork,
    folder: Path,
    *,
    overwrite: bool = False,
    begun: Callable[[], None] = tell_nobody,
    executor: Executor | None = None,
    progress: Progress = silent,
    command: str | Sequence[str] = "driftwalk.runs.run_calibration(...)",
) -> xr.Dataset:
    """Calibrate in a run directory and return the calibration.

    Writes ``calibration.nc``, ``flow.nc``, ``recording.nc``, ``figures/`` and, last,
    ``manifest.json``; with more than two parameters ``model_calibration.nc``. Killed at any moment
    and started again it continues.

    Parameters
    ----------
    work : CalibrationWork
        The work to do.
    folder : Path
        The run directory.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    begun : callable, optional
        Called when everything is checked and the work begins.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere; the result does not depend on it.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    command : str, optional
        The command line or the call, for the manifest.

    Returns
    -------
    xarray.Dataset
        A `calibration`, or with more than two parameters a `model_calibration`.

    Raises
    ------
    InputError
        When the recording cannot be calibrated on; nothing is written then.
    ConfigurationError
        When a posterior is asked for of a model with one or two parameters, or without a bootstrap.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> work = CalibrationWork(dw.tank30_recording(), dw.Study(), dw.tank30_flow(), None, {})
    >>> found = run_calibration(work, Path("run"))  # doctest: +SKIP
    """
    from driftwalk.calibration import calibrate

    if work.posterior:
        _require_draws(work)
    flow = _checked_flow(work)
    with open_run(
        folder,
        specification=_specification(work),
        study=work.study,
        seeds={"calibration": work.study.calibration.seed},
        inputs=work.inputs,
        overwrite=overwrite,
        command=command,
    ) as run:
        begun()
        if flow is not None:
            run.write("flow.nc", netcdf_bytes(flow))
        run.write("recording.nc", netcdf_bytes(work.recording))
        tell = Course(progress, {"calibration": 1.0}).stage("calibration")
        found = calibrate(
            work.recording,
            work.model,
            study=work.study,
            flow=work.flow,
            body=work.body,
            threads=work.threads,
            executor=executor,
            stores=_stores(run),
            tell=lambda stage, done, total: tell(*_overall(stage, done, total)),
            meanwhile=lambda early: _write_figures(early, work, flow, run),
        )
        tell(100, 100, "results")
        run.write(result_file(work.model), netcdf_bytes(found))
        if work.posterior:
            run.write("posterior.csv", _posterior_table(found))
    return found


def result_file(model: MotionModel | None) -> str:
    """Return the name of the file that a calibration of a model writes.

    Parameters
    ----------
    model : MotionModel or None
        The model; None for the block.

    Examples
    --------
    >>> result_file(None)
    'calibration.nc'
    """
    return "model_calibration.nc" if _is_searched(model) else "calibration.nc"


def _is_searched(model: MotionModel | None) -> bool:
    from driftwalk.calibration import MOST_PARAMETERS

    return model is not None and len(model.parameters) > MOST_PARAMETERS


def _require_draws(work: CalibrationWork) -> None:
    """Refuse to write draws where there will be none."""
    if not _is_searched(work.model):
        raise ConfigurationError(
            "a posterior is drawn for models with more than two parameters; with one or two, the "
            "bootstrap's estimates are in the calibration"
        )
    if work.study.calibration.bootstrap < 2 or work.study.calibration.refine == "none":
        raise ConfigurationError(
            "a posterior needs the summaries: `calibration.bootstrap` of 2 or more"
        )


def _posterior_table(found: xr.Dataset) -> bytes:
    """Return the draws as CSV, a column for each parameter with its unit in the name."""
    names, units = found["parameter"].values.tolist(), found["unit"].values.tolist()
    suffixes = [unit_suffix(unit) for unit in units]
    keys = [f"{name}_{end}" if end else name for name, end in zip(names, suffixes, strict=True)]
    rows = [",".join(map(repr, row)) for row in found["draws"].values.tolist()]
    return "\n".join([",".join(keys), *rows, ""]).encode()


def _write_figures(
    found: xr.Dataset, work: CalibrationWork, flow: xr.Dataset | None, run: RunDirectory
) -> None:
    from driftwalk.figures import write_figures, write_model_calibration_figures

    folder = run.folder("figures")
    if _is_searched(work.model):
        write_model_calibration_figures(folder, calibration=found)
    else:
        write_figures(found, flow=flow, trajectory=work.recording, folder=folder, body=work.body)


def _checked_flow(work: CalibrationWork) -> xr.Dataset | None:
    """Return the flow field of a run; refuse a recording before anything is written for it.

    A model that needs no flow has one only if it was given.
    """
    from driftwalk.calibration import check_recording
    from driftwalk.conditions import recording_flow

    with naming_recording(work.inputs):
        flow = work.flow
        if flow is None and (work.model is None or work.model.needs_flow):
            flow = recording_flow(work.recording, work.study, body=work.body)
        check_recording(work.recording, work.study, flow=flow, body=work.body, model=work.model)
    return flow


def _specification(work: CalibrationWork) -> dict[str, Any]:
    """Return what determines the numbers of a run."""
    return {
        "study": work.study.to_dict(),
        "body": work.body,
        "recording_sha256": dataset_hash(work.recording, ("x", "y", "theta")),
        "flow_sha256": None if work.flow is None else dataset_hash(work.flow, ("u", "v")),
        # Runs of the block have no such entry: those begun by earlier versions go on.
        **({} if work.model is None else {"model": work.model.describe()}),
        **({"kind": "model_calibration"} if _is_searched(work.model) else {}),
    }


def _stores(run: RunDirectory) -> Any:
    def store(name: str, fingerprint: dict[str, Any]) -> Store:
        return run.store(name, fingerprint=fingerprint)

    return store


def _overall(name: str, done: int, total: int) -> tuple[float, int, str]:
    stage = CALIBRATION_STAGES[name]
    return stage.percent(done / total if total else 1.0), 100, stage.words
