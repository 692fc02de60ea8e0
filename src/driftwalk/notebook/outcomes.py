"""Parameters from outcomes alone, and the largest yield of one, in one line of a notebook."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from driftwalk.core.study_keys import ASSEMBLY_KEYS, AssemblySettings, Number, study_overrides
from driftwalk.core.units import parse_quantity
from driftwalk.notebook.simulating import model_of
from driftwalk.runs import OutcomePosteriorWork, Progress, YieldWork

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.outcome_posterior.records import Outcomes
    from driftwalk.model import Study


def infer_outcomes(
    outcomes: Outcomes | xr.Dataset | str | PathLike[str],
    model: Study | xr.Dataset,
    flow: xr.Dataset | None = None,
    *,
    vary: Mapping[str, tuple[float, float]] | None = None,
    after: float | None = None,
    truths: int | None = None,
    threads: int | None = None,
    folder: str | PathLike[str] | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
    **settings: Unpack[AssemblySettings],
) -> xr.Dataset:
    """Return the posterior of parameters from the outcomes of self-assembly alone.

    Parameters
    ----------
    outcomes : mapping of str to int, path-like, xarray.Dataset, or sequence of them
        Runs by final outcome class; a table of them, as ``driftwalk infer-outcomes`` reads it; or
        `assembly` or `classification` datasets.
    model : Study or xarray.Dataset
        A study, a `fit` or a `calibration`: all but the parameters that vary.
    flow : xarray.Dataset, optional
        The water's velocity, a `flow_field`; a fit brings its own.
    vary : mapping of str to (float, float), optional
        Lowest and highest value of two to four parameters, SI. Default: ``drag_coefficient`` 0.3 to
        0.6 and ``force_std`` 0.2 to 1.2 mN.
    after : float, optional
        When the final classes are read [s].
    truths : int, optional
        Data sets of the self-check, at least 20; default: 200.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    folder : path-like, optional
        Run directory to make or continue, the same as for ``driftwalk infer-outcomes``.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    **settings
        Over the study, as of `assemble`; ``runs`` are those of a node, 300 by default, and ``seed``
        is that of the simulations.

    Returns
    -------
    Result
        Kind "outcome_posterior", see `driftwalk.assembly.infer_outcomes`; its text begins with the
        verdict.

    Raises
    ------
    InputError
        When the outcomes are no classes of the study's blocks, a parameter is not known or its
        range is empty, or blocks do not fit the tank.
    FormatError
        When the table cannot be read.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> few = {"blocks": 2, "duration": "20s", "runs": 20, "truths": 20}
    >>> found = dw.infer_outcomes({"2": 12, "1+1": 8}, dw.Study(), dw.tank30_flow(), **few)
    >>> found["parameter"].values.tolist()
    ['drag_coefficient', 'force_std']
    """
    from driftwalk.assembly import infer_outcomes as infer, read_outcomes
    from driftwalk.notebook.result import as_result, counted, run_in_folder

    inputs = {}
    if isinstance(outcomes, (str, PathLike)):
        inputs = {"outcomes": Path(outcomes)}
        outcomes = read_outcomes(Path(outcomes))
    found = model_of(model, flow, study_overrides(keys=ASSEMBLY_KEYS, **settings))
    chosen: dict[str, Any] = {"vary": vary, "after": after, "truths": truths}
    chosen |= {name: settings.get(name) for name in ("runs", "seed")}
    options = {name: value for name, value in chosen.items() if value is not None}
    if folder is not None:
        work = OutcomePosteriorWork(outcomes, found.flow, found.study, options, inputs, threads)
        return as_result(run_in_folder(folder, "infer-outcomes", work, overwrite, progress))
    options |= {"threads": threads, "progress": counted(progress, "runs")}
    return as_result(infer(outcomes, found.flow, found.study, **options))


YIELD_KEYS = {**ASSEMBLY_KEYS, "seed": "sensitivity.seed"}
"""The runs of a yield have the same seed as a sensitivity study."""


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
        Run directory to make or continue, the same as for ``driftwalk yield``.
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
    from driftwalk.notebook.result import as_result, counted, run_in_folder

    found = model_of(model, flow, study_overrides(keys=YIELD_KEYS, **settings))
    options: dict[str, Any] = {
        "target": target,
        "by": parse_quantity(by, "s") if isinstance(by, str) else by,
        "ranges": dict(ranges or {}),
        "runs": selection_runs,
        "fresh_runs": fresh_runs,
        "indifference": indifference,
    }
    if folder is not None:
        # A folder keeps the axes as values in its study, so that the run can go on without the
        # caller.
        chosen = make_axes(found.study, axes) if axes else None
        study, flows = (found.study, {}) if chosen is None else (chosen.study, chosen.flows)
        work = YieldWork(study, found.flow, options, flows, {}, threads)
        done = run_in_folder(
            folder, "maximise_yield", work, overwrite, progress, executor, warnings=found.warnings
        )
        return as_result(done)
    options |= {"threads": threads, "executor": executor, "progress": counted(progress, "runs")}
    return as_result(maximise(found.study, found.flow, axes=axes, **options))
