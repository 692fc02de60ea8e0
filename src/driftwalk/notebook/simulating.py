"""Simulate motion or self-assembly as a study, a fit or a calibration says; compare motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple, Unpack

from driftwalk.conditions import simulate_like, study_for
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import ASSEMBLY_KEYS, AssemblySettings, study_overrides
from driftwalk.model import Study, apply_overrides
from driftwalk.motion import (
    BlockModel,
    MotionModel,
    ParticleModel,
    estimated_values,
    simulate_motion,
)
from driftwalk.runs import AssemblyWork, KineticsWork, Progress, flow_of_result, read_found
from driftwalk.schema.check import kind_name
from driftwalk.schema.runs import kind_of
from driftwalk.simulation import Start, simulate as simulate_study

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr

    from driftwalk.comparison.ks import Ties
    from driftwalk.simulation.run import Backend


def simulate(
    model: Study | MotionModel | xr.Dataset,
    flow: xr.Dataset | None = None,
    *,
    parameters: Mapping[str, float] | xr.Dataset | None = None,
    study: Study | None = None,
    like: xr.Dataset | None = None,
    body: str | None = None,
    sample_time: npt.ArrayLike | None = None,
    start: Start | None = None,
    replicates: int | None = None,
    seed: int | None = None,
    backend: Backend = "cpu",
    threads: int | None = None,
) -> xr.Dataset:
    """Simulate one block in a stirred tank, or a body of any motion model.

    Parameters
    ----------
    model : Study, MotionModel or xarray.Dataset
        A study, a `fit` or a `calibration` of the block; or a `motion_model`.
    flow : xarray.Dataset, optional
        The water's velocity, a `flow_field`; a fit brings its own. A motion model gets one only
        if it has a use for it.
    parameters : mapping of str to float or xarray.Dataset, optional
        Of a motion model: the value of each parameter by name, in its unit; or the calibration
        that has found them, anything with ``estimate`` along ``parameter``.
    study : Study, optional
        Of a motion model: tank, camera, times, seed and replicates; default: the paper's.
    like : xarray.Dataset, optional
        A `trajectory`: simulate what its camera would have recorded, in its tank, with its start,
        time stamps, gaps and noise.
    body : str, optional
        The body of that recording, where there are several.
    sample_time : array_like, shape (n,), optional
        Times of the samples [s]; not with `like`.
    start : Start, optional
        Pose and motion at time 0; not with `like`. Default: as the study says, anywhere in the
        tank at rest.
    replicates, seed : int, optional
        Over the study's values.
    backend : {"cpu", "reference"}
        See `driftwalk.simulation.simulate`; "reference" for the block without `like`.
    threads : int, optional
        Default: all processors. The result does not depend on it.

    Returns
    -------
    xarray.Dataset
        ``x``, ``y`` [m], ``theta`` [rad] with dimensions (replicate, time, body) and ``status``.

    Raises
    ------
    InputError
        When there is no flow for the block, a parameter of a motion model has no value, or an
        argument contradicts `like`: it and the study state two tanks or two blocks, say.

    Examples
    --------
    >>> import driftwalk as dw
    >>> run = dw.simulate(dw.Study(), dw.uniform_flow(0.0, 0.0), sample_time=[0.0, 0.1], seed=1)
    >>> run.sizes["time"]
    2
    >>> fish = dw.motion_model("burst_coast", kick_speed_cv=0.4, kick_time_cv=1.0, turn_std=0.5)
    >>> known = {"kick_speed": 0.1, "kick_time": 0.5, "glide_time": 0.3}
    >>> run = dw.simulate(fish, parameters=known, sample_time=[0.0, 0.1], replicates=4)
    >>> run.sizes["replicate"]
    4
    """
    common: dict[str, Any] = {"replicates": replicates, "seed": seed, "threads": threads}
    free: dict[str, Any] = {"sample_time": sample_time, "start": start}
    if isinstance(model, MotionModel):
        if backend != "cpu":
            raise InputError("a motion model is simulated by its own code: leave out `backend`")
        free |= {"flow": flow, "like": like, "body": body}
        return _of_motion_model(model, parameters, study, **free, **common)
    if parameters is not None or study is not None:
        raise InputError("`parameters` and `study` are for a motion model: `motion_model(...)`")
    _refuse_numbers_alone(model)
    chosen, field, *_ = model_of(model, flow, {})
    if like is None:
        if body is not None:
            raise InputError("`body` names a body of the recording `like`, and none is given")
        return simulate_study(chosen, field, backend=backend, **free, **common)
    if sample_time is not None or start is not None or backend != "cpu":
        raise InputError("with `like`, the recording gives times and start, in single precision")
    return simulate_like(study_for([like], chosen, body=body), field, like, body=body, **common)


def _of_motion_model(
    model: MotionModel,
    parameters: Mapping[str, float] | xr.Dataset | None,
    study: Study | None,
    *,
    flow: xr.Dataset | None,
    like: xr.Dataset | None,
    body: str | None,
    **options: Any,
) -> xr.Dataset:
    import xarray as xr

    if isinstance(parameters, xr.Dataset):
        parameters = estimated_values(parameters, model)
    chosen = study or Study()
    if like is not None:
        # A model of the user's may know no wall; a body of the family keeps to the tank.
        keeps = isinstance(model, ParticleModel | BlockModel)
        chosen = study_for([like], chosen, body=body, needs_tank=keeps)
    field = None if flow is None else flow_field_of(flow)
    return simulate_motion(
        model, parameters or {}, chosen, flow=field, like=like, body=body, **options
    )


def _refuse_numbers_alone(source: Study | xr.Dataset) -> None:
    """Refuse a calibration of another model than the block: it holds numbers, and no model."""
    name = getattr(source, "attrs", {}).get("model")
    if name is not None:
        raise InputError(
            f"the calibration is about the model {name}, of which it holds the numbers alone: give "
            "the model, and the calibration as `parameters`"
        )


def compare(
    trajectory_a: xr.Dataset,
    trajectory_b: xr.Dataset,
    *,
    body_a: str | None = None,
    body_b: str | None = None,
    step_interval: float | None = None,
    ties: Ties = "strict",
    block_length: int | None = None,
    permutations: int = 999,
    seed: int = 1,
) -> xr.Dataset:
    """Compare the step lengths and turning angles of two motions.

    Parameters
    ----------
    trajectory_a : xarray.Dataset
        A `trajectory`.
    trajectory_b : xarray.Dataset
        Another one; or a simulation, of which every replicate is compared with the first motion.
    body_a, body_b : str, optional
        Names of the bodies, where there are several.
    step_interval : float, optional
        Time between the positions of a step [s], the same for both; default: the longer of the two
        median sampling intervals.
    ties : {"strict", "limits"}
        As in `ks_distance`.
    block_length, permutations, seed
        Of two single motions: as in `driftwalk.comparison.block_permutation_test`.

    Returns
    -------
    xarray.Dataset
        Of two single motions a `comparison`, see `driftwalk.comparison.compare`; with several
        replicates a `replicate_comparison`, see `driftwalk.comparison.compare_replicates`. Both
        have ``ks_distance``, ``noise_floor`` and ``p_value``.

    Raises
    ------
    InputError
        When a body is not there or no steps can be formed.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording().isel(time=slice(0, 600))
    >>> run = dw.simulate(dw.Study(), dw.tank30_flow(), like=recording, replicates=3)
    >>> 0.25 <= float(dw.compare(recording, run)["p_value"]) <= 1.0
    True
    """
    from driftwalk.comparison import compare as compare_two, compare_replicates

    if trajectory_a.sizes.get("replicate", 1) > 1:
        raise InputError("the simulation comes second: compare(recording, simulation)")
    first = trajectory_a.isel(replicate=0) if "replicate" in trajectory_a.dims else trajectory_a
    if trajectory_b.sizes.get("replicate", 1) > 1:
        if body_b is not None or block_length is not None:
            raise InputError("`body_b` and `block_length` are for two single motions")
        return compare_replicates(
            first, trajectory_b, body=body_a, step_interval=step_interval, ties=ties
        )
    second = trajectory_b.isel(replicate=0) if "replicate" in trajectory_b.dims else trajectory_b
    return compare_two(
        first,
        second,
        body_a=body_a,
        body_b=body_b,
        step_interval=step_interval,
        ties=ties,
        block_length=block_length,
        permutations=permutations,
        seed=seed,
    )


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
        Run directory to make or continue, the same as for ``driftwalk assemble``.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere, for example from `driftwalk.cluster.connect`. The result does
        not depend on it.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    **settings
        Keys of the study by their short names: ``blocks=4``, ``runs=1000``, ``duration="10min"``.

    Returns
    -------
    xarray.Dataset
        An `assembly`, see `driftwalk.assembly.assemble`, whose text begins with how often each
        class formed; `outcome_distribution` makes proportions of it.

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
    from driftwalk.notebook.result import as_result, counted, run_in_folder

    found = model_of(model, flow, study_overrides(keys=ASSEMBLY_KEYS, **settings))
    if folder is not None:
        work = AssemblyWork(found.study, found.flow, found.uncertainty, {}, threads)
        done = run_in_folder(
            folder, "assemble", work, overwrite, progress, executor, warnings=found.warnings
        )
        return as_result(done.assembly)
    made = assemble_study(
        found.study,
        found.flow,
        threads=threads,
        executor=executor,
        progress=counted(progress, "runs"),
    )
    return as_result(made)


class FoundModel(NamedTuple):
    """A model whose parameters are known."""

    study: Study
    flow: xr.Dataset
    """A `flow_field`."""
    uncertainty: xr.Dataset | None
    """The `fit` or `calibration` where parameters can be drawn from it."""
    warnings: tuple[str, ...] = ()
    """Sentences on what was found, for the user who simulates with it."""


def model_of(
    source: Study | xr.Dataset,
    flow: xr.Dataset | None,
    overrides: Mapping[str, Any],
) -> FoundModel:
    """Return the model of a study, or of what a run found.

    Parameters
    ----------
    source : Study or xarray.Dataset
        A study, a `fit`, a `calibration`, or a `model_comparison` whose best model is the block.
    flow : xarray.Dataset or None
        A `flow_field` or a `fit`. A fit has its own; a calibration in a run directory has the one
        that is stored there.
    overrides : mapping
        Over the study, from ``"section.key"`` to the value.

    Raises
    ------
    InputError
        When there is no flow, or the dataset is of another kind.
    """
    if isinstance(source, Study):
        if flow is None:
            raise InputError(
                "a study says nothing of the water: give `flow`, a flow field or a fit"
            )
        return FoundModel(apply_overrides(source, overrides), flow_field_of(flow), None)
    if not hasattr(source, "attrs"):
        raise InputError(
            f"a study, a fit or a calibration is needed, got {source!r}; `motion_model` makes a "
            "motion model of a name, and xarray.open_dataset opens what a run directory holds, "
            "such as fit.nc"
        )
    kind = kind_of(source)
    if kind is None or not kind.gives_model:
        raise InputError(
            "a study, a fit or a calibration is needed, got a dataset of kind "
            f"{kind_name(source)!r}"
        )
    found = read_found(source)
    study = found.block_study(overrides)
    field = found.flow(study) if flow is None else flow_field_of(flow)
    undrawn = () if found.not_drawn is None else (found.not_drawn,)
    return FoundModel(study, field, found.uncertainty, (*found.warnings, *undrawn))


def flow_field_of(flow: xr.Dataset) -> xr.Dataset:
    """Return a flow field: the given one, or that of a given fit."""
    held = flow_of_result(flow)
    return flow if held is None else held


def kinetics(
    runs: xr.Dataset | Sequence[xr.Dataset],
    other: xr.Dataset | Sequence[xr.Dataset] | None = None,
    *,
    target: str | None = None,
    blocks: int | None = None,
    seed: int = 1,
    folder: str | PathLike[str] | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Return how fast blocks assemble and by which steps: rates between the outcome classes.

    Parameters
    ----------
    runs : xarray.Dataset or sequence of xarray.Dataset
        An `assembly`, a `classification` of a recording, or several of one number of blocks.
    other : xarray.Dataset or sequence of xarray.Dataset, optional
        The same of other runs, such as real ones: are the rates equal?
    target : str, optional
        Outcome class to be reached, such as "T".
    blocks : int, optional
        Another number of blocks, for which the rate of the first joining is extrapolated where the
        tank is well mixed; at least 2.
    seed : int
        Seed of the bootstrap, at least 0.
    folder : path-like, optional
        Run directory to make or continue, the same as for ``driftwalk kinetics``.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.

    Returns
    -------
    Result
        Kind "kinetics", see `driftwalk.assembly.kinetics`; its text begins with the verdict.

    Raises
    ------
    InputError
        When a dataset holds no outcome classes, numbers of blocks differ, the target is no class
        of these blocks, or there are too few runs to tell.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> runs = dw.assemble(dw.Study(), dw.tank30_flow(), blocks=2, runs=400, duration="60s")
    >>> dw.kinetics(runs, target="2").attrs["verdict"] != ""
    True
    """
    from driftwalk.assembly import kinetics as estimate
    from driftwalk.assembly.chains.histories import datasets_of
    from driftwalk.notebook.result import as_result, counted, run_in_folder

    if folder is not None:
        given = [datasets_of(one) for one in (runs, other) if one is not None]
        work = KineticsWork(given, target, blocks, seed)
        return as_result(run_in_folder(folder, "kinetics", work, overwrite, progress))
    tell = counted(progress, "models")
    return as_result(estimate(runs, other, target=target, blocks=blocks, seed=seed, progress=tell))
