"""A likelihood fit in a run directory, with its flow, figures and manifest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from driftwalk.core.run_stages import Course, tell_nobody
from driftwalk.runs.folder import Progress, open_run, silent
from driftwalk.runs.stored import dataset_hash
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


@dataclass(frozen=True)
class FitWork:
    """Everything that a fit needs.

    Attributes
    ----------
    recordings : sequence of xarray.Dataset
        The `trajectory` datasets.
    study : Study
        Block, tank and the section [fit].
    body : str or None
        The body.
    inputs : mapping of str to Path
        The files that were read, by their role.
    check : bool
        Whether the model is checked.
    compare_laws : bool
        Whether force laws are compared, which takes some eight fits.
    wall : bool
        Whether restitution and friction of the wall are estimated, which takes as long as a fit.
    """

    recordings: Sequence[xr.Dataset]
    study: Study
    body: str | None
    inputs: Mapping[str, Path]
    check: bool = True
    compare_laws: bool = False
    wall: bool = False


class Fitted(NamedTuple):
    """Results of a run."""

    fit: xr.Dataset
    check: xr.Dataset | None
    """Whether the model explains the recordings; None without a check."""


def run_fit(
    work: FitWork,
    folder: Path,
    *,
    overwrite: bool = False,
    begun: Callable[[], None] = tell_nobody,
    fitted: Callable[[xr.Dataset], None] = tell_nobody,
    checked: Callable[[xr.Dataset, xr.Dataset | None], None] = tell_nobody,
    progress: Progress = silent,
    command: str | Sequence[str] = "driftwalk.runs.run_fit(...)",
) -> Fitted:
    """Fit in a run directory, check the model, and return both.

    Writes ``fit.nc``, ``flow.nc``, ``recording.nc`` (``recording-2.nc``, ...), ``check.nc``,
    ``figures/`` and, last, ``manifest.json``.

    Parameters
    ----------
    work : FitWork
        What to do.
    folder : Path
        The run directory.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    begun : callable, optional
        Called when everything is checked and the work begins.
    fitted : callable, optional
        Called with the fit as soon as it is stored, before all that follows.
    checked : callable, optional
        Called with the whole fit and its check, or None without one, before the figures.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    command : str, optional
        The command line or the call, for the manifest.

    Returns
    -------
    Fitted
        The `fit` and its `model_check`.

    Raises
    ------
    InputError
        When a recording cannot be fitted; nothing is written then.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> work = FitWork([dw.tank30_recording()], dw.Study(), None, {})
    >>> found = run_fit(work, Path("fit"))  # doctest: +SKIP
    """
    from driftwalk.figures import write_check_figures, write_fit_figures, write_laws_figure
    from driftwalk.likelihood import (
        check_fit,
        compare_laws,
        estimate_wall,
        fit_motion,
        fitted_flow,
        judge_fit,
    )

    check_fit(work.recordings, work.study, body=work.body)
    with open_run(
        folder,
        specification=_specification(work),
        study=work.study,
        seeds={},
        inputs=work.inputs,
        overwrite=overwrite,
        command=command,
    ) as run:
        begun()
        course = Course(progress, _usual_parts(work))
        course.begin("fit")
        found = fit_motion(work.recordings, work.study, body=work.body, tell=course.stage("fit"))
        run.write("fit.nc", netcdf_bytes(found))
        run.write("flow.nc", netcdf_bytes(fitted_flow(found)))
        for number, recording in enumerate(work.recordings, start=1):
            name = "recording.nc" if number == 1 else f"recording-{number}.nc"
            run.write(name, netcdf_bytes(recording))
        fitted(found)
        check = None
        if work.compare_laws:
            tell = course.stage("laws")
            found = compare_laws(found, work.recordings, body=work.body, tell=tell)
        if work.wall:
            tell = course.stage("wall")
            found = estimate_wall(found, work.recordings, body=work.body, tell=tell)
        if work.check:
            course.begin("check")
            found, check = judge_fit(found, work.recordings, body=work.body)
            if check is not None:
                run.write("check.nc", netcdf_bytes(check))
        # The fit was stored before; now it says what was found beside it.
        run.write("fit.nc", netcdf_bytes(found))
        checked(found, check)
        course.begin("figures")
        write_fit_figures(
            run.folder("figures"),
            flow=steady_flows(found),
            trajectory=work.recordings[0],
            body=work.body,
            simulated=found.attrs["simulated_recording"] == "yes",
        )
        if work.compare_laws:
            write_laws_figure(run.folder("figures"), fit=found)
        if check is not None:
            course.begin("figures of the check")
            write_check_figures(run.folder("figures"), check=check)
    return Fitted(found, check)


def steady_flows(fit: xr.Dataset) -> list[xr.Dataset]:
    """Return the flows of a fit, one for all of it or one for each name.

    Parameters
    ----------
    fit : xarray.Dataset
        Kind "fit".

    Returns
    -------
    list of xarray.Dataset
        Kind "flow_field".

    Examples
    --------
    >>> steady_flows(found)[0].attrs["kind"]  # doctest: +SKIP
    'flow_field'
    """
    from driftwalk.likelihood import fitted_flow

    if "flow" not in fit.dims:
        return [fitted_flow(fit)]
    interval_flow = fit["interval_flow"].values.tolist()
    return [
        fitted_flow(fit, interval=interval_flow.index(flow)) for flow in range(fit.sizes["flow"])
    ]


def _usual_parts(work: FitWork) -> dict[str, float]:
    """Return how long each stage usually takes [s], as on the bundled recording and parts of it."""
    samples = sum(one.sizes["time"] for one in work.recordings)
    fit = 2.2 + 7.5e-4 * samples
    return {
        "fit": fit,
        **({"laws": 6.5 * fit} if work.compare_laws else {}),
        **({"wall": fit} if work.wall else {}),
        **({"check": 2.2 + 2.2e-4 * samples} if work.check else {}),
        "figures": 3.8,
        **({"figures of the check": 2.9} if work.check else {}),
    }


def _specification(work: FitWork) -> dict[str, Any]:
    """Return what determines the numbers of a run."""
    return {
        **({"compare_laws": True} if work.compare_laws else {}),
        **({"wall": True} if work.wall else {}),
        "kind": "fit",
        "study": work.study.to_dict(),
        "body": work.body,
        "check": work.check,
        "recordings_sha256": [dataset_hash(one, ("x", "y", "theta")) for one in work.recordings],
    }
