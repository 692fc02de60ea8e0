"""Simulated self-assembly: many blocks in the stirred tank, as many runs as asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.runs.dataset import LAW_NAMES, build_assembly, build_path
from driftwalk.assembly.runs.draws import (
    RUNS_PER_FLOW,
    draw_flow,
    draw_parameters,
    draw_posterior,
    draw_quantiles,
    drawn_from,
    has_standard_error,
)
from driftwalk.assembly.runs.plan import Backend, Plan, make_plan, simulate_rows, start_poses
from driftwalk.assembly.runs.start import with_event_rows
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.core.progress import Progress
from driftwalk.model import Study, apply_overrides
from driftwalk.sweep import Store, WorkUnit, grid, run_sweep, settings_per_unit, threads_of_unit

if TYPE_CHECKING:
    import xarray as xr


FlowDraws = Literal["standard_error", "none"]

RUNS_TOGETHER: Final = 4 * RUNS_PER_FLOW
"""Runs of a work unit at least: fewer leave lanes empty, and each then takes longer."""


def assemble(
    study: Study,
    flow: xr.Dataset,
    *,
    blocks: int | None = None,
    runs: int | None = None,
    duration: float | None = None,
    start: npt.ArrayLike | None = None,
    drag_coefficient: npt.ArrayLike | None = None,
    force_std: npt.ArrayLike | None = None,
    seed: int | None = None,
    trial: int = 0,
    store: Store | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    backend: Backend = "cpu",
) -> xr.Dataset:
    """Simulate the self-assembly of blocks in a stirred tank.

    Each block moves as in `simulate`; blocks that touch latch face to face and are one rigid body
    from then on. How they latch stands in the study's section [assembly].

    Parameters
    ----------
    study : Study
        Block, tank, water, forces and assembly.
    flow : xarray.Dataset
        The water's velocity, a `flow_field` that covers the tank.
    blocks, runs : int, optional
        Over the study's values.
    duration : float, optional
        Length of a run [s], over the study's value.
    start : array_like, shape (blocks, 3) or (runs, blocks, 3), optional
        Poses at the start [m, m, rad], at rest; default: random ones that do not overlap.
    drag_coefficient, force_std : float or array_like, shape (runs,), optional
        C_d and sigma_F [N], for all runs or of each, over the study's values.
    seed : int, optional
        Over the study's value.
    trial : int
        Index of the parameter set within a larger piece of work: with the seed and the run's index
        it is the address of a run's random numbers, so that two trials are independent.
    store : Store, optional
        Where finished work units are kept (`driftwalk.core.files.rundir`); memory when left out.
    progress : callable, optional
        Called with the number of finished runs and the total.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes the work units elsewhere, see `driftwalk.sweep.run_sweep`; each then has one
        thread if `threads` is left out. The result does not depend on it.
    backend : {"cpu", "reference"}
        The batch kernels in single precision, or the same source in double precision.

    Returns
    -------
    xarray.Dataset
        Kind "assembly", see `driftwalk.assembly.runs.dataset`: events, times, poses at the end, and
        ``outcome``, the class of every run.

    Raises
    ------
    InputError
        When there are more blocks than fit the tank, the flow does not cover it, or an option is
        out of range.

    Examples
    --------
    >>> import driftwalk as dw
    >>> still = dw.uniform_flow(0.0, 0.0)
    >>> found = dw.assemble(dw.Study(), still, blocks=2, runs=3, duration=1.0)
    >>> found["outcome"].dims, found["class"].values.tolist()
    (('run',), ['2', '1+1'])
    """
    plan = make_plan(
        study,
        flow,
        settings={"blocks": blocks, "runs": runs, "duration_s": duration, "seed": seed},
        drag_coefficient=drag_coefficient,
        force_std=force_std,
        trial=trial,
        threads=threads_of_unit(threads, executor),
        backend=backend,
    )
    return _run(plan, start, "no", store=store, progress=progress, executor=executor)


def assemble_drawn(
    study: Study,
    flow: xr.Dataset,
    calibration: xr.Dataset,
    *,
    quantiles: Mapping[str, npt.ArrayLike] | None = None,
    blocks: int | None = None,
    runs: int | None = None,
    duration: float | None = None,
    start: npt.ArrayLike | None = None,
    seed: int | None = None,
    trial: int = 1,
    flow_draws: FlowDraws = "standard_error",
    store: Store | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> xr.Dataset:
    """Simulate self-assembly with parameters drawn from the uncertainty of a calibration or a fit.

    Every run has its own drag coefficient and stochastic force, drawn from the calibration's joint
    region or from the fit's posterior (`draw_parameters`); with a fit whose force law has further
    uncertain numbers, every 25 runs share a draw of all of them, as they do of `quantiles`. Where
    the flow field states standard errors, every 25 runs have their own flow field too: its measured
    nodes are moved at random by them, each on its own, those of a fit's own flow smoothly over its
    knots.

    Parameters
    ----------
    study, flow, blocks, runs, duration, start, seed, store, progress, threads, executor
        As in `assemble`.
    calibration : xarray.Dataset
        A `calibration` with its joint region, or a `fit`.
    quantiles : mapping, optional
        Further numbers that are drawn, by their keys in the study: values for equal shares of what
        is known of each. `interaction_quantiles` makes them of a fit of glued blocks.
    trial : int
        As in `assemble`; 1, so that these runs are independent of those of `assemble`.
    flow_draws : {"standard_error", "none"}
        Whether flow fields are drawn where standard errors are known.

    Returns
    -------
    xarray.Dataset
        As of `assemble`; ``drag_coefficient``, ``force_std`` of each run, drawn numbers of the
        force law, and where flows were drawn ``flow_draw``, the index of its flow.

    Raises
    ------
    InputError
        As `assemble`, and when the calibration has no region or the fit no covariance.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> calibration = dw.calibrate(recording, flow=dw.tank30_flow())  # doctest: +SKIP
    >>> found = dw.assemble_drawn(dw.Study(), dw.tank30_flow(), calibration)  # doctest: +SKIP
    """
    if flow_draws not in get_args(FlowDraws):
        raise InputError(
            f"flow_draws must be one of {', '.join(get_args(FlowDraws))}, got {flow_draws!r}"
        )
    plan = make_plan(
        study,
        flow,
        settings={"blocks": blocks, "runs": runs, "duration_s": duration, "seed": seed},
        trial=trial,
        threads=threads_of_unit(threads, executor),
    )
    settings = plan.study.assembly
    # The draws of run k depend on these alone, not on how the runs are shared out to workers.
    address = {"runs": settings.runs, "seed": settings.seed, "trial": trial}
    drawn = draw_parameters(calibration, **address)
    is_fit = drawn_from(calibration) == "covariance"
    numbers = draw_posterior(calibration, **address) if is_fit else {}
    law = {f"forces.{key}": values for key, values in numbers.items()}
    law = {key: values for key, values in law.items() if key in LAW_NAMES}
    law |= draw_quantiles(quantiles or {}, **address)
    moves = flow_draws == "standard_error" and has_standard_error(flow)
    plan = replace(
        plan,
        drag_coefficient=drawn.drag_coefficient,
        force_std=drawn.force_std,
        flow_correlated_over=_knot_distance(calibration, flow) if is_fit and moves else None,
        law=law,
        flow_draw=np.arange(settings.runs) // RUNS_PER_FLOW if moves else None,
    )
    what = ["drag_coefficient", "force_std", *(LAW_NAMES[key] for key in law)]
    what += ["flow"] if moves else []
    return _run(plan, start, " ".join(what), store=store, progress=progress, executor=executor)


def assembly_path(
    study: Study,
    flow: xr.Dataset,
    *,
    runs: Sequence[int] = (0,),
    sample_interval: float = 0.1,
    blocks: int | None = None,
    duration: float | None = None,
    start: npt.ArrayLike | None = None,
    drag_coefficient: npt.ArrayLike | None = None,
    force_std: npt.ArrayLike | None = None,
    seed: int | None = None,
    trial: int = 0,
    threads: int | None = None,
    backend: Backend = "cpu",
) -> xr.Dataset:
    """Simulate chosen runs of `assemble` again, and keep their motion.

    Parameters
    ----------
    study, flow, blocks, duration, seed, trial, threads, backend
        As in `assemble`: with the same values the runs are the same.
    runs : sequence of int
        Indices of the runs.
    sample_interval : float
        Time between samples [s]; the next whole number of time steps, at least one, is taken.
    start : array_like, shape (blocks, 3) or (len(runs), blocks, 3), optional
        As in `assemble`, of the chosen runs.
    drag_coefficient, force_std : float or array_like, shape (len(runs),), optional
        As in `assemble`, of the chosen runs.

    Returns
    -------
    xarray.Dataset
        Kind "assembly_path": ``x``, ``y`` [m], ``theta`` [rad] and ``assembly`` (lowest block of
        the block's assembly) on (run, time, block), from 0 to the duration.

    Raises
    ------
    InputError
        As `assemble`, and when no run is named or an index is negative.

    Examples
    --------
    >>> import driftwalk as dw
    >>> still = dw.uniform_flow(0.0, 0.0)
    >>> path = dw.assembly_path(dw.Study(), still, blocks=2, duration=1.0, sample_interval=0.5)
    >>> path["time"].values.tolist()
    [0.0, 0.5, 1.0]
    """
    index = np.atleast_1d(np.asarray(runs))
    if index.size == 0 or index.ndim != 1 or index.dtype.kind not in "iu" or index.min() < 0:
        raise InputError(f"runs: expected the indices of runs, whole numbers from 0, got {runs}")
    plan = make_plan(
        study,
        flow,
        settings={"blocks": blocks, "duration_s": duration, "seed": seed},
        index=index.astype(np.int64),
        drag_coefficient=drag_coefficient,
        force_std=force_std,
        trial=trial,
        threads=threads,
        backend=backend,
    )
    if not sample_interval > 0:
        raise InputError(f"sample_interval must be above 0 s, got {sample_interval}")
    every = min(max(round(sample_interval / plan.study.time_step_s), 1), plan.steps)
    found = simulate_rows(plan, start_poses(plan, start), sample_every=every)
    return build_path(plan, found, every=every)


def check_assembly(
    study: Study, flow: xr.Dataset, *, trial: int = 0, threads: int | None = None
) -> None:
    """Raise the errors that `assemble` would raise, before any run is simulated.

    Parameters
    ----------
    study, flow, trial, threads
        As in `assemble`.

    Raises
    ------
    InputError
        When there are more blocks than fit the tank, or the flow does not cover it.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.assembly.check_assembly(dw.Study(), dw.uniform_flow(0.0, 0.0))
    """
    start_poses(make_plan(study, flow, settings={}, trial=trial, threads=threads), None)


def _knot_distance(fit: xr.Dataset, flow: xr.Dataset) -> float | None:
    """Return the distance of the knots [m] where a flow is the fit's own."""
    stretched = float(flow.attrs.get("stretched_by", 1.0))
    own = all(np.array_equal(stretched * fit[axis].values, flow[axis].values) for axis in "xy")
    return stretched * float(fit["spline_spacing"]) if own else None


def _run(plan: Plan, start: npt.ArrayLike | None, drawn: str, **how: Any) -> xr.Dataset:
    """Simulate the runs unit by unit, `how` as for `run_sweep`, and put them into one dataset."""
    units = grid(run=plan.index).units(runs_per_unit(plan))
    poses = start_poses(plan, start)
    function = partial(_simulate_unit, plan, poses)
    arrays = run_sweep(function, units, **how)
    if plan.study.assembly.bonds_break:
        arrays = _all_events(plan, poses, arrays)
    return build_assembly(plan, arrays, attrs={"drawn": drawn})


def _simulate_unit(plan: Plan, poses: Floats, unit: WorkUnit) -> Arrays:
    """Return the runs of a unit, simulated by a worker; `poses` are those at the start."""
    parts = [
        simulate_rows(drawn, poses, rows) for rows, drawn in _by_draw(plan, unit.start, unit.stop)
    ]
    parts = [with_event_rows(part, plan.event_rows) for part in parts]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _all_events(plan: Plan, poses: Floats, arrays: Arrays) -> Arrays:
    """Return the runs with all of their events: those with more than a unit keeps run again."""
    count = arrays["event_count"]
    most = int(count.max(initial=0))
    again = np.flatnonzero(count > arrays["event_step"].shape[1]).tolist()
    arrays = with_event_rows(arrays, max(most, plan.study.assembly.blocks - 1, 1))
    for run in again:
        [(rows, drawn)] = _by_draw(plan, run, run + 1)
        found = with_event_rows(simulate_rows(drawn, poses, rows), most)
        for name, values in found.items():
            arrays[name][run] = values[0]
    return arrays


def runs_per_unit(plan: Plan) -> int:
    """Return the runs of a work unit: a whole number of drawn flows, enough for the lanes."""
    block_steps = plan.steps * plan.study.assembly.blocks
    return settings_per_unit(plan.index.size, block_steps, multiple=RUNS_TOGETHER)


def _by_draw(plan: Plan, first: int, last: int) -> Sequence[tuple[slice, Plan]]:
    """Return the rows of a unit that share a flow and a force law, and their plan."""
    if plan.flow_draw is None and not plan.law:
        return [(slice(first, last), plan)]
    following = first - first % RUNS_PER_FLOW + RUNS_PER_FLOW
    edges = [first, *range(following, last, RUNS_PER_FLOW), last]
    return [(slice(low, high), _drawn(plan, low)) for low, high in pairwise(edges)]


def _drawn(plan: Plan, row: int) -> Plan:
    """Return the plan with the drawn flow and the drawn force law of a row."""
    law = {key: float(values[row]) for key, values in plan.law.items()}
    study, flow = apply_overrides(plan.study, law) if law else plan.study, plan.flow
    if plan.flow_draw is not None:
        flow = draw_flow(
            plan.flow,
            seed=plan.study.assembly.seed,
            trial=plan.trial,
            draw=int(plan.flow_draw[row]),
            correlated_over=plan.flow_correlated_over,
        )
    return replace(plan, study=study, flow=flow)
