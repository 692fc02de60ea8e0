"""A comparison of motion models in a run directory: resumable, with its figures and manifest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.run_stages import tell_nobody
from driftwalk.runs.folder import Progress, naming_recording, open_run, silent
from driftwalk.runs.stored import dataset_hash
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.motion import MotionModel
    from driftwalk.sweep import Store


@dataclass(frozen=True)
class ModelComparisonWork:
    """Everything that a comparison of motion models needs.

    Attributes
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    models : sequence of str or MotionModel
        The models, or their names.
    study : Study
        Tank, camera, step interval and seed.
    flow : xarray.Dataset or None
        A given flow field; None takes it from the recording, for the block.
    body : str or None
        The body.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    """

    recording: xr.Dataset
    models: Sequence[str | MotionModel]
    study: Study
    flow: xr.Dataset | None
    body: str | None
    inputs: Mapping[str, Path]
    threads: int | None = None


def run_model_comparison(
    work: ModelComparisonWork,
    folder: Path,
    *,
    overwrite: bool = False,
    begun: Callable[[], None] = tell_nobody,
    executor: Executor | None = None,
    finished: Callable[[str, float, float, int], None] = tell_nobody,
    progress: Progress = silent,
    command: str | Sequence[str] = "driftwalk.runs.run_model_comparison(...)",
) -> xr.Dataset:
    """Compare motion models in a run directory and return the comparison.

    Writes ``comparison.nc``, ``recording.nc``, the given flow as ``flow.nc``, ``figures/`` and,
    last, ``manifest.json``. Killed at any moment and started again it continues with the model that
    it was at.

    Parameters
    ----------
    work : ModelComparisonWork
        The work to do.
    folder : Path
        The run directory.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    begun : callable, optional
        Called when everything is checked and the work begins.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere; the result does not depend on it.
    finished : callable, optional
        Called with each model's name, its distance, the standard error of that and the number of
        models, as soon as it is judged.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    command : str, optional
        The command line or the call, for the manifest.

    Returns
    -------
    xarray.Dataset
        A `model_comparison`.

    Raises
    ------
    InputError
        When the recording cannot be compared; nothing is written then.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> work = ModelComparisonWork(recording, ["block", "inertial"], dw.Study(), None, None, {})
    >>> found = run_model_comparison(work, Path("compare"))  # doctest: +SKIP
    """
    from driftwalk.calibration import check_models, compare_models
    from driftwalk.figures import write_model_figures

    with naming_recording(work.inputs):
        models = check_models(
            work.recording, work.models, study=work.study, flow=work.flow, body=work.body
        )
    with open_run(
        folder,
        specification=_specification(work, models),
        study=work.study,
        seeds={"calibration": work.study.calibration.seed},
        inputs=work.inputs,
        overwrite=overwrite,
        command=command,
    ) as run:
        begun()
        run.write("recording.nc", netcdf_bytes(work.recording))
        if work.flow is not None:
            run.write("flow.nc", netcdf_bytes(work.flow))

        def stores(name: str, fingerprint: dict[str, Any]) -> Store:
            return run.store(name, fingerprint=fingerprint)

        found = compare_models(
            work.recording,
            models,
            study=work.study,
            flow=work.flow,
            body=work.body,
            threads=work.threads,
            executor=executor,
            stores=stores,
            tell=progress,
            finished=finished,
        )
        run.write("comparison.nc", netcdf_bytes(found))
        write_model_figures(run.folder("figures"), comparison=found)
    return found


def _specification(work: ModelComparisonWork, models: Sequence[MotionModel]) -> dict[str, Any]:
    """Return what determines the numbers of a run."""
    return {
        "kind": "model_comparison",
        "models": [model.describe() for model in models],
        "study": work.study.to_dict(),
        "body": work.body,
        "recording_sha256": dataset_hash(work.recording, ("x", "y", "theta")),
        "flow_sha256": None if work.flow is None else dataset_hash(work.flow, ("u", "v")),
    }
