"""Maximise the yield of an outcome class, as a study, a fit or a calibration says."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from os import PathLike
from typing import TYPE_CHECKING, Any, Unpack

from driftwalk.core.study_keys import ASSEMBLY_KEYS, AssemblySettings, Number, study_overrides
from driftwalk.core.units import parse_quantity
from driftwalk.notebook.simulating import model_of

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.runs import Progress

YIELD_KEYS = {**ASSEMBLY_KEYS, "seed": "sensitivity.seed"}
"""The runs of a yield have the seed of those of a sensitivity study."""


def maximise_yield(
    model: Study | xr.Dataset,
    flow: xr.Dataset | None = None,
    *,
    target: str,
    by: Number | None = None,
    axes: Mapping[str, Any] | None = None,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    selection_runs: int = 6000,
    fresh_runs: int = 2000,
    indifference: float = 0.02,
    folder: str | PathLike[str] | None = None,
    overwrite: bool = False,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    **settings: Unpack[AssemblySettings],
) -> xr.Dataset:
    """Find the setting in which most runs assemble into a target by a time.

    Parameters
    ----------
    model : Study or xarray.Dataset
        A study, a `fit`, a `calibration`, or a `model_comparison` whose best model is the block.
    flow : xarray.Dataset, optional
        The water's velocity, a `flow_field`; a fit brings its own.
    target : str
        Outcome class, such as "T".
    by : float or str, optional
        When it is to be reached [s], or ``"2min"``; default: at the end of the runs.
    axes : mapping, optional
        Values to compare by the names of `sensitivity_map`, SI; default: the lists of
        [sensitivity].
    ranges : mapping of str to (float, float), optional
        Lowest and highest value of continuous settings, SI, which are searched in between.
    selection_runs : int
        Runs that choose by halving, >= 1.
    fresh_runs : int
        Runs of each reported setting, >= 1.
    indifference : float
        Difference of yields that does not matter, in (0, 1).
    folder : path-like, optional
        Run directory to make or continue, the same as that of ``driftwalk yield``.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere. The result does not depend on it.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    **settings
        Keys of the study by their short names: ``blocks=4``, ``duration="5min"``.

    Returns
    -------
    Result
        Kind "yield", see `driftwalk.assembly.maximise_yield`; its text begins with the best
        setting.

    Raises
    ------
    InputError
        When the target is no class of these blocks, `by` lies outside the runs, nothing varies, or
        there are too few runs for so many settings.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> found = dw.maximise_yield(
    ...     dw.Study(), dw.tank30_flow(), target="2", by="10s", ranges={"force_std": (2e-4, 1e-3)},
    ...     selection_runs=1600, fresh_runs=100, blocks=2, duration="20s",
    ... )
    >>> 2e-4 <= float(found["force_std"][found.attrs["best"]]) <= 1e-3
    True
    """
    from driftwalk.assembly import maximise_yield as maximise
    from driftwalk.assembly.sensitivity.settings import make_axes
    from driftwalk.notebook.result import as_result, run_in_folder
    from driftwalk.runs import YieldWork
    from driftwalk.runs.resumable_run import silent

    found = model_of(model, flow, study_overrides(keys=YIELD_KEYS, **settings))
    say = progress or silent
    options: dict[str, Any] = {
        "target": target,
        "by": parse_quantity(by, "s") if isinstance(by, str) else by,
        "ranges": dict(ranges or {}),
        "runs": selection_runs,
        "fresh_runs": fresh_runs,
        "indifference": indifference,
    }
    if folder is not None:
        chosen = make_axes(found.study, axes) if axes else None
        study, flows = (found.study, {}) if chosen is None else (chosen.study, chosen.flows)
        work = YieldWork(study, found.flow, options, flows, {}, threads)
        return as_result(
            run_in_folder(
                folder, "maximise_yield", work, overwrite, say, executor, warnings=found.warnings
            )
        )
    return as_result(
        maximise(
            found.study, found.flow, axes=axes, threads=threads, executor=executor,
            progress=lambda done, total: say(done, total, "runs"), **options,
        )
    )  # fmt: skip
