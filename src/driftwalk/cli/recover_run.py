"""A recovery study in a run directory: resumable, with its figures and manifest."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.cli.calibration_run import dataset_hash, netcdf_bytes
from driftwalk.cli.run_folder import open_run
from driftwalk.cli.terminal.progress import ProgressReporter

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


@dataclass(frozen=True)
class RecoverWork:
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


def run_recovery(work: RecoverWork, folder: Path, *, overwrite: bool) -> xr.Dataset:
    """Do a recovery study in a run directory.

    Writes ``recovery.nc``, ``figures/`` and, last, ``manifest.json``. Killed at any moment and
    started again it continues with the recordings that are not done.

    Parameters
    ----------
    work : RecoverWork
        What to do.
    folder : Path
        The run directory.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.

    Raises
    ------
    InputError
        When the truth is not whole or cannot be fitted; nothing is written then.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.
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
    ) as run:
        with ProgressReporter("recover") as progress:
            found = recovery_study(
                work.study,
                work.flow,
                store=run.store("recordings"),
                threads=work.threads or _processors(),
                tell=lambda done, total: progress.update(done, total, "fits"),
            )
        run.write("recovery.nc", netcdf_bytes(found))
        write_recovery_figures(run.folder("figures"), recovery=found)
    return found


def _processors() -> int:
    """Return how many processors this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _specification(work: RecoverWork) -> dict[str, Any]:
    """Return what determines the numbers of a run."""
    flow = work.flow
    return {
        "kind": "recovery",
        "study": work.study.to_dict(),
        "flow_sha256": None if flow is None else dataset_hash(flow, ("u", "v")),
    }
