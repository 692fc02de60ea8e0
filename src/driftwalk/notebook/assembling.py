"""Self-assembly with what a study, a fit or a calibration says."""

from __future__ import annotations

from concurrent.futures import Executor
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from driftwalk.core.study_keys import ASSEMBLY_KEYS, study_overrides
from driftwalk.notebook.model_of import model_of

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.notebook.settings import AssemblySettings
    from driftwalk.runs import Progress


def assemble(
    model: Study | xr.Dataset,
    flow: xr.Dataset | None = None,
    *,
    folder: str | PathLike[str] | None = None,
    overwrite: bool = False,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    **settings: Unpack[AssemblySettings],
) -> xr.Dataset:
    """Simulate what many blocks build.

    Parameters
    ----------
    model : Study or xarray.Dataset
        A study, a `fit`, a `calibration`, or a `model_comparison` whose best model is the block.
        With `folder`, a fit, or a calibration that has a joint region, is simulated with parameters
        drawn from its uncertainty, too.
    flow : xarray.Dataset, optional
        The water's velocity, a `flow_field`; a fit brings its own.
    folder : path-like, optional
        Run directory to make or continue, the same as that of ``driftwalk assemble``.
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
        Keys of the study by their short names: ``blocks=4``, ``runs=1000``, ``duration="10min"``.

    Returns
    -------
    xarray.Dataset
        An `assembly`, see `driftwalk.assembly.assemble`; `outcome_distribution` makes proportions
        of it.

    Raises
    ------
    InputError
        When there is no flow, the blocks do not fit, or the flow does not cover the tank.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> runs = dw.assemble(dw.Study(), dw.tank30_flow(), blocks=2, runs=4, duration="1s")
    >>> runs.sizes["run"]
    4
    """
    from driftwalk.assembly import assemble as assemble_study
    from driftwalk.runs import AssemblyWork, run_work
    from driftwalk.runs.resumable_run import silent

    given: dict[str, Any] = dict(settings)
    found = model_of(model, flow, study_overrides(keys=ASSEMBLY_KEYS, **given))
    say = progress or silent
    if folder is None:
        return assemble_study(
            found.study,
            found.flow,
            threads=threads,
            executor=executor,
            progress=lambda done, total: say(done, total, "runs"),
        )
    done = run_work(
        AssemblyWork(found.study, found.flow, found.uncertainty, {}, threads),
        Path(folder),
        overwrite=overwrite,
        executor=executor,
        progress=say,
        command=f"driftwalk.assemble(..., folder={str(folder)!r})",
    )
    made: xr.Dataset = done.assembly
    return made
