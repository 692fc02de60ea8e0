"""A sensitivity analysis in a run directory: resumable, with its figures and manifest."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.errors import InputError
from driftwalk.core.run_stages import Course, tell_nobody
from driftwalk.runs.folder import Progress, open_run, silent
from driftwalk.runs.stored import dataset_hash
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.core.files.rundir import RunDirectory
    from driftwalk.model import Study

DRAWN_AXES: Final = 2
"""Axes that a figure has; a study of more has a folder of figures for each value of the others."""
SHARD_FORM: Final = 2
"""Results of a setting in a work unit; the second form adds the classes over time."""


@dataclass(frozen=True)
class SensitivityWork:
    """Everything that a run directory of a sensitivity analysis needs.

    Attributes
    ----------
    study : Study
        The reference, and what varies.
    flow : xarray.Dataset
        The flow field of the reference.
    flows : dict of str to xarray.Dataset
        Flow fields to compare, by name.
    samples : int or None
        Base samples for Sobol' indices.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    """

    study: Study
    flow: xr.Dataset
    flows: dict[str, xr.Dataset]
    samples: int | None
    inputs: Mapping[str, Path]
    threads: int | None = None

    @property
    def axes(self) -> dict[str, Any]:
        """The axes of the map, with the flow fields themselves."""
        axes: dict[str, Any] = dict(self.study.sensitivity.axes)
        return axes | ({"flow": self.flows} if "flow" in axes else {})


@dataclass(frozen=True)
class SensitivityResult:
    """Results.

    Attributes
    ----------
    reference : xarray.Dataset
        Kind "outcome_distribution", with its realisations.
    sensitivity : xarray.Dataset
        Kind "sensitivity".
    components : xarray.Dataset or None
        Kind "components", None where nothing varies.
    indices : xarray.Dataset or None
        Kind "sobol_indices", where they were asked for.
    """

    reference: xr.Dataset
    sensitivity: xr.Dataset
    components: xr.Dataset | None
    indices: xr.Dataset | None


def run_sensitivity(
    work: SensitivityWork,
    folder: Path,
    *,
    overwrite: bool = False,
    begun: Callable[[], None] = tell_nobody,
    executor: Executor | None = None,
    progress: Progress = silent,
    command: str | Sequence[str] = "driftwalk.runs.run_sensitivity(...)",
) -> SensitivityResult:
    """Analyse the sensitivity of self-assembly in a run directory.

    Writes ``reference.nc``, ``sensitivity.nc``, ``components.nc``, with Sobol' indices
    ``sobol.nc``; ``figures/`` and, last, ``manifest.json``. Killed at any moment and started again
    it continues.

    Parameters
    ----------
    work : SensitivityWork
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
    SensitivityResult
        Reference, map, components and indices.

    Raises
    ------
    InputError
        When blocks do not fit or a flow does not cover a tank; nothing is written then.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> work = SensitivityWork(dw.Study(), dw.tank30_flow(), {}, None, {})
    >>> result = run_sensitivity(work, Path("sensitivity"))  # doctest: +SKIP
    """
    sizes = _checked_sizes(work)
    with open_run(
        folder,
        specification=_specification(work),
        study=work.study,
        seeds={"sensitivity": work.study.sensitivity.seed},
        inputs=work.inputs,
        overwrite=overwrite,
        command=command,
    ) as run:
        begun()
        # A setting costs the same in each stage.
        course = Course(progress, {**sizes, "figures": 0.0})
        result = _simulate(work, run, executor, course)
        course.begin("figures")
        draw_sensitivity(
            run.folder("figures"),
            reference=result.reference,
            sensitivity=result.sensitivity,
            components=result.components,
        )
    return result


def _checked_sizes(work: SensitivityWork) -> dict[str, int]:
    """Return the settings of each stage, after refusing what cannot be simulated."""
    from driftwalk.assembly import check_indices, check_sensitivity

    options: dict[str, Any] = {"threads": work.threads}
    sizes = {
        "reference": work.study.sensitivity.reference_realisations,
        "map": check_sensitivity(work.study, work.flow, axes=work.axes, **options),
    }
    if work.samples is not None:
        sizes["Sobol"] = check_indices(work.study, work.flow, samples=work.samples, **options)
    return sizes


def _simulate(
    work: SensitivityWork, run: RunDirectory, executor: Executor | None, course: Course
) -> SensitivityResult:
    from driftwalk.assembly import sensitivity_indices, sensitivity_map, sensitivity_reference

    reference = sensitivity_reference(
        work.study,
        work.flow,
        store=run.store("reference"),
        progress=course.stage("reference"),
        threads=work.threads,
        executor=executor,
    )
    run.write("reference.nc", netcdf_bytes(reference))
    sensitivity = sensitivity_map(
        work.study,
        work.flow,
        axes=work.axes,
        reference=reference,
        store=run.store("map"),
        progress=course.stage("map"),
        threads=work.threads,
        executor=executor,
    )
    run.write("sensitivity.nc", netcdf_bytes(sensitivity))
    components = _components(sensitivity)
    if components is not None:
        run.write("components.nc", netcdf_bytes(components))
    indices = None
    if work.samples is not None:
        indices = sensitivity_indices(
            work.study,
            work.flow,
            samples=work.samples,
            store=run.store("sobol"),
            progress=course.stage("Sobol"),
            threads=work.threads,
            executor=executor,
        )
        run.write("sobol.nc", netcdf_bytes(indices))
    return SensitivityResult(reference, sensitivity, components, indices)


def _components(sensitivity: xr.Dataset) -> xr.Dataset | None:
    """Return the principal components; None where there is one setting or all are alike."""
    from driftwalk.assembly import principal_components

    try:
        return principal_components(sensitivity)
    except InputError:
        return None


def draw_sensitivity(
    folder: Path,
    *,
    reference: xr.Dataset,
    sensitivity: xr.Dataset,
    components: xr.Dataset | None,
    formats: Sequence[str] = ("png", "svg"),
) -> list[Path]:
    """Write all figures of a sensitivity study: a subfolder for each value of further axes.

    Parameters
    ----------
    folder : Path
        Where to write.
    reference, sensitivity, components : xarray.Dataset
        Results of the run, ``reference.nc``, ``sensitivity.nc`` and ``components.nc``.
    formats : sequence of {"png", "svg", "pdf", "csv"}
        File formats; ``csv`` holds the numbers that are drawn.

    Returns
    -------
    list of Path
        The files.

    Examples
    --------
    >>> draw_sensitivity(
    ...     Path("figures"), reference=reference, sensitivity=found, components=None
    ... )  # doctest: +SKIP
    """
    import xarray as xr

    from driftwalk.figures import write_assembly_figures, write_sensitivity_figures

    written = write_assembly_figures(
        folder,
        distribution=reference,
        realisations=xr.Dataset({"proportion": reference["realisation_proportion"]}),
        formats=formats,
    )
    if components is not None and components.sizes["component"] < 2:
        components = None
    for name, chosen in _slices(sensitivity):
        written += write_sensitivity_figures(
            folder / name,
            sensitivity=sensitivity.sel(chosen),
            components=None if components is None else components.sel(chosen),
            formats=formats,
        )
    return written


def _slices(sensitivity: xr.Dataset) -> Iterator[tuple[str, dict[str, Any]]]:
    """Give the parts of a study that can be drawn: name of the folder, and what to select."""
    axes = [str(name) for name in sensitivity["l1_distance"].dims]
    fixed = axes[: max(len(axes) - DRAWN_AXES, 0)]
    for values in product(*(sensitivity[name].values.tolist() for name in fixed)):
        chosen = dict(zip(fixed, values, strict=True))
        parts = [f"{name}_{value}" for name, value in chosen.items()]
        yield re.sub(r"[^A-Za-z0-9._-]+", "-", "_".join(parts)), chosen


def _specification(work: SensitivityWork) -> dict[str, Any]:
    """Return what determines the numbers of a run."""
    return {
        "study": work.study.to_dict(),
        "flow_sha256": dataset_hash(work.flow, ("u", "v")),
        "flows_sha256": {name: dataset_hash(flow, ("u", "v")) for name, flow in work.flows.items()},
        "sobol_samples": work.samples,
        "shard_form": SHARD_FORM,
    }
