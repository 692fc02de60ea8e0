"""Self-assembly in a run directory: resumable, with its distributions, figures and manifest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.run_stages import Course, tell_nobody
from driftwalk.runs.folder import Progress, open_run, silent
from driftwalk.runs.stored import dataset_hash
from driftwalk.schema.stores.netcdf import netcdf_bytes, open_netcdf

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.core.files.rundir import RunDirectory
    from driftwalk.model import Study

FIXED_TRIAL: Final = 0
DRAWN_TRIAL: Final = 1
"""The two kinds of runs have random numbers of their own, so that they can be compared."""
LABELS: Final = ("parameters found", "parameters drawn")
REGION: Final = ("region_drag_coefficient", "region_force_std", "refined_surface")
"""Variables of a calibration that parameters are drawn from."""
PATH_RUNS: Final = 4
PATH_INTERVAL_S: Final = 0.1
PATH_SAMPLES: Final = 6000
"""Most samples of a path that is kept; longer runs are sampled more rarely."""


@dataclass(frozen=True)
class AssemblyWork:
    """Everything that a run directory of self-assembly needs.

    Attributes
    ----------
    study : Study
        The model, and what is simulated.
    flow : xarray.Dataset
        The flow field.
    calibration : xarray.Dataset or None
        A `calibration` or a `fit` to draw parameters from, too.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    """

    study: Study
    flow: xr.Dataset
    calibration: xr.Dataset | None
    inputs: Mapping[str, Path]
    threads: int | None = None


@dataclass(frozen=True)
class AssemblyResult:
    """Results.

    Attributes
    ----------
    distribution : xarray.Dataset
        Kind "outcome_distribution", of runs with the study's parameters.
    times : xarray.Dataset
        Kind "class_times", of the same runs.
    drawn : xarray.Dataset or None
        Kind "outcome_distribution", of runs with drawn parameters.
    sizes, sizes_drawn : xarray.Dataset or None
        Kind "assembly_sizes", of the same two sets of runs; beyond 8 blocks only.
    """

    distribution: xr.Dataset
    times: xr.Dataset
    drawn: xr.Dataset | None
    sizes: xr.Dataset | None = None
    sizes_drawn: xr.Dataset | None = None


def run_assembly(
    work: AssemblyWork,
    folder: Path,
    *,
    film: str = "none",
    overwrite: bool = False,
    begun: Callable[[], None] = tell_nobody,
    executor: Executor | None = None,
    progress: Progress = silent,
    command: str | Sequence[str] = "driftwalk.runs.run_assembly(...)",
) -> AssemblyResult:
    """Simulate self-assembly in a run directory and return the distributions of outcomes.

    Writes ``assembly.nc``, ``distribution.nc``, ``class_times.nc``, ``path.nc``, and with drawn
    parameters ``assembly_drawn.nc``, ``distribution_drawn.nc``; beyond 8 blocks ``sizes.nc`` and
    ``sizes_drawn.nc``; ``figures/`` and, last, ``manifest.json``. Killed at any moment and started
    again it continues.

    Parameters
    ----------
    work : AssemblyWork
        The work to do.
    folder : Path
        The run directory.
    film : {"gif", "mp4", "none"}
        Whether the first run is filmed too.
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
    AssemblyResult
        Distributions of outcomes and times.

    Raises
    ------
    InputError
        When the blocks do not fit or the flow does not cover the tank; nothing is written then.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> work = AssemblyWork(dw.Study(), dw.tank30_flow(), None, {})
    >>> result = run_assembly(work, Path("four"))  # doctest: +SKIP
    """
    _check(work)
    with open_run(
        folder,
        specification=_specification(work),
        study=work.study,
        seeds={"assembly": work.study.assembly.seed},
        inputs=work.inputs,
        overwrite=overwrite,
        command=command,
    ) as run:
        begun()
        course = Course(progress, _usual_parts(work, film))
        result = _simulate(work, run, executor, course)
        if film != "none":
            course.begin("film")
            _write_film(run, film)
    return result


def _usual_parts(work: AssemblyWork, film: str) -> dict[str, float]:
    """Return how long each stage takes, of hundred runs: the figures are a small part of it."""
    return {
        "runs": 8.0,
        **({} if work.calibration is None else {"runs, drawn parameters": 8.0}),
        "figures": 1.0,
        **({} if film == "none" else {"film": 1.0}),
    }


def _check(work: AssemblyWork) -> None:
    """Refuse what cannot be simulated before anything is written for it."""
    from driftwalk.assembly import check_assembly

    trials = (FIXED_TRIAL,) if work.calibration is None else (FIXED_TRIAL, DRAWN_TRIAL)
    for trial in trials:
        check_assembly(work.study, work.flow, trial=trial, threads=work.threads)


def _simulate(
    work: AssemblyWork, run: RunDirectory, executor: Executor | None, course: Course
) -> AssemblyResult:
    from driftwalk.assembly import (
        assemble,
        assemble_drawn,
        assembly_path,
        assembly_sizes,
        class_times,
        outcome_distribution,
    )
    from driftwalk.assembly.outcomes.classes import MOST_BLOCKS
    from driftwalk.figures import write_assembly_figures

    settings = work.study.assembly
    confidence = settings.confidence
    many = settings.blocks > MOST_BLOCKS
    drawn = sizes = sizes_drawn = None
    assembly = assemble(
        work.study,
        work.flow,
        trial=FIXED_TRIAL,
        store=run.store("fixed"),
        progress=course.stage("runs"),
        threads=work.threads,
        executor=executor,
    )
    run.write("assembly.nc", netcdf_bytes(assembly))
    distribution = outcome_distribution(assembly, confidence=confidence)
    run.write("distribution.nc", netcdf_bytes(distribution))
    times = class_times(assembly, confidence=confidence)
    run.write("class_times.nc", netcdf_bytes(times))
    if many:
        sizes = assembly_sizes(assembly, confidence=confidence)
        run.write("sizes.nc", netcdf_bytes(sizes))
    if work.calibration is not None:
        assembly_drawn = assemble_drawn(
            work.study,
            work.flow,
            work.calibration,
            trial=DRAWN_TRIAL,
            store=run.store("drawn"),
            progress=course.stage("runs, drawn parameters"),
            threads=work.threads,
            executor=executor,
        )
        run.write("assembly_drawn.nc", netcdf_bytes(assembly_drawn))
        drawn = outcome_distribution(assembly_drawn, confidence=confidence)
        run.write("distribution_drawn.nc", netcdf_bytes(drawn))
        if many:
            sizes_drawn = assembly_sizes(assembly_drawn, confidence=confidence)
            run.write("sizes_drawn.nc", netcdf_bytes(sizes_drawn))
    path = assembly_path(
        work.study,
        work.flow,
        runs=range(min(settings.runs, PATH_RUNS)),
        sample_interval=max(PATH_INTERVAL_S, settings.duration_s / PATH_SAMPLES),
        trial=FIXED_TRIAL,
        threads=work.threads,
    )
    run.write("path.nc", netcdf_bytes(path))
    course.begin("figures")
    write_assembly_figures(
        run.folder("figures"),
        distribution=distribution,
        beside=drawn,
        labels=LABELS if drawn is not None else ("", ""),
        times=times,
        path=path,
        sizes=sizes,
        sizes_drawn=sizes_drawn,
    )
    return AssemblyResult(distribution, times, drawn, sizes, sizes_drawn)


def _write_film(run: RunDirectory, film: str) -> None:
    """Film the first run from what is stored of it."""
    from driftwalk.plot import write_animation

    write_animation(open_netcdf(run.path / "path.nc"), run.folder("figures") / f"run.{film}")


def _specification(work: AssemblyWork) -> dict[str, Any]:
    """Return what determines the numbers of a run."""
    found = work.calibration
    is_fit = found is not None and found.attrs.get("kind") == "fit"
    names = ("u", "v", *(f"{part}_standard_error" for part in "uv"))
    return {
        "study": work.study.to_dict(),
        "flow_sha256": dataset_hash(work.flow, tuple(n for n in names if n in work.flow)),
        "calibration_sha256": None
        if found is None
        else dataset_hash(found, ("estimate", "covariance") if is_fit else REGION),
    }
