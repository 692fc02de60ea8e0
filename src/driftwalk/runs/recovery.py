"""A recovery study in a run directory: resumable, with its figures and manifest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.processors import default_threads
from driftwalk.runs.folder import Progress, open_run, silent
from driftwalk.runs.stored import dataset_hash
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


@dataclass(frozen=True)
class RecoveryWork:
    """Everything that a recovery study needs.

    Attributes
    ----------
    study : Study
        The truth and the section [recover].
    flow : xarray.Dataset or None
        The true flow; None for random ones.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Fits at once; None for as many as there are processors.
    """

    study: Study
    flow: xr.Dataset | None
    inputs: Mapping[str, Path]
    threads: int | None = None


def run_recovery(
    work: RecoveryWork,
    folder: Path,
    *,
    overwrite: bool = False,
    executor: Executor | None = None,
    progress: Progress = silent,
    command: str | Sequence[str] = "driftwalk.runs.run_recovery(...)",
) -> xr.Dataset:
    """Do a recovery study in a run directory.

    Writes ``recovery.nc``, ``figures/`` and, last, ``manifest.json``. Killed at any moment and
    started again it continues with the recordings that are not done.

    Parameters
    ----------
    work : RecoveryWork
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
        A `recovery`.

    Raises
    ------
    InputError
        When the truth is not whole or cannot be fitted; nothing is written then.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> work = RecoveryWork(dw.Study(), dw.tank30_flow(), {})
    >>> found = run_recovery(work, Path("recovery"))  # doctest: +SKIP
    """
    from driftwalk.figures import write_recovery_figures
    from driftwalk.likelihood import check_recovery, recovery_study

    check_recovery(work.study, work.flow)
    with open_run(
        folder,
        specification=_specification(work),
        study=work.study,
        seeds={"recovery": work.study.recover.seed},
        inputs=work.inputs,
        overwrite=overwrite,
        command=command,
    ) as run:
        found = recovery_study(
            work.study,
            work.flow,
            store=run.store("recordings"),
            threads=work.threads or default_threads(),
            executor=executor,
            tell=lambda done, total: progress(done, total, "fits"),
        )
        run.write("recovery.nc", netcdf_bytes(found))
        write_recovery_figures(run.folder("figures"), recovery=found)
    return found


def _specification(work: RecoveryWork) -> dict[str, Any]:
    """Return what determines the numbers of a run."""
    flow = work.flow
    return {
        "kind": "recovery",
        "study": work.study.to_dict(),
        "flow_sha256": None if flow is None else dataset_hash(flow, ("u", "v")),
    }
