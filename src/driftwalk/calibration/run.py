"""The whole calibration: which parameters fit a recording, and how well they are known.

Before anything is computed or written, what cannot be calibrated is refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from typing import TYPE_CHECKING, Final

from driftwalk.calibration.estimation.run import calibrate_many
from driftwalk.calibration.goodness_of_fit import Halves, validate_on_halves
from driftwalk.calibration.grid.grid_map import SweepProgress
from driftwalk.calibration.grid.stages import GridCalibration
from driftwalk.calibration.held_out.recorded import body_motion
from driftwalk.calibration.problem import (
    Execution,
    FlowSource,
    Stores,
    Tell,
    in_memory,
    recorded_problem,
)
from driftwalk.calibration.result import build_calibration
from driftwalk.calibration.stationarity import stationarity_of
from driftwalk.calibration.warnings import OWN_FLOW, fit_disagreements, wall_warning
from driftwalk.comparison import Statistic, StepDistance
from driftwalk.conditions import jump_warnings, study_in_arena, unstated_warning
from driftwalk.core.calibration_stages import share_of_windows
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.grid import MOST_SETTINGS
from driftwalk.core.processors import run_in_background
from driftwalk.core.progress import ignore_progress
from driftwalk.motion import BlockModel, MotionModel, ParticleModel
from driftwalk.motion.protocol import ScoresItself
from driftwalk.schema.answers.facts import taken_keys, taken_names
from driftwalk.simulation.series import is_series, series_warnings

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


MOST_PARAMETERS: Final = 2
"""Of a grid; with more a model is searched."""


def check_recording(
    recording: xr.Dataset,
    study: Study,
    *,
    flow: xr.Dataset | None,
    body: str | None = None,
    model: MotionModel | None = None,
) -> None:
    """Refuse a recording or a model that `calibrate` would refuse; takes almost no time.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    study : Study
        Model and step interval.
    flow : xarray.Dataset or None
        A `flow_field`; None for a model that needs none.
    body : str, optional
        The body, where there are several.
    model : MotionModel, optional
        Default: the block of the study.

    Raises
    ------
    InputError
        When the recording is too short, does not move, or several bodies are there and none named.
    ConfigurationError
        When the model has no parameter, or a name that a calibration uses itself.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.calibration.check_recording(dw.tank30_recording(), dw.Study(), flow=dw.tank30_flow())
    """
    chosen = BlockModel(study) if model is None else model
    if len(chosen.parameters) > MOST_PARAMETERS:
        like = body_motion(recording, study, flow=flow, body=body).like
    else:
        require_searchable(chosen)
        _, problem = recorded_problem(recording, study, lambda _: flow, model=chosen, body=body)
        like = problem.like
    if isinstance(chosen, ParticleModel):
        chosen.require_others(like)
    if isinstance(chosen, BlockModel):
        chosen.native(like)


def require_searchable(model: MotionModel) -> None:
    """Refuse a model that no grid over one or two parameters can be laid over."""
    names = [parameter.name for parameter in model.parameters]
    if not 1 <= len(names) <= MOST_PARAMETERS:
        raise ConfigurationError(
            f"the model {model.name} has {len(names)} parameters to search"
            f"{': ' + ', '.join(names) if names else ''}; a grid takes one or two"
        )
    taken, taken_flat = taken_names(), taken_keys()
    for parameter in model.parameters:
        prefixed = parameter.name.startswith(("refined_", "bootstrap_", "region_"))
        if parameter.name in taken or parameter.key in taken_flat or prefixed:
            raise ConfigurationError(
                f"the model {model.name} has a parameter '{parameter.name}', a name that a "
                "calibration uses itself: choose another"
            )
    settings = math.prod(len(parameter.coordinates) for parameter in model.parameters)
    if settings > MOST_SETTINGS:
        raise ConfigurationError(
            f"the grid over {', '.join(names)} has {settings} settings, more than {MOST_SETTINGS}: "
            "enlarge a step"
        )


def calibrate(
    recording: xr.Dataset,
    model: MotionModel | Study | None = None,
    *,
    study: Study | None = None,
    statistic: Statistic | None = None,
    flow: xr.Dataset | None = None,
    body: str | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    stores: Stores | None = None,
    tell: Tell | None = None,
    meanwhile: Callable[[xr.Dataset], object] | None = None,
) -> xr.Dataset:
    """Find the parameters of a motion model that explain a recording.

    An exhaustive grid over the model's parameters, one or two: every setting is simulated as long
    as the recording, at its time stamps, with its gaps, start and camera noise, and its step
    lengths and turning angles are compared with the recording's by the two-dimensional
    Kolmogorov-Smirnov distance. A second, finer pass around the minimum follows; the optimum is
    that of a smooth surface through it. A parametric bootstrap gives the intervals and the joint
    region, and the distance at the optimum is judged against the noise floor. With the block in
    stirred water, the default, this is the paper's calibration of (C_d, sigma_F).

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    model : MotionModel or Study, optional
        What is calibrated: a `motion_model`, or the block of a study.
    study : Study, optional
        Tank, observation, step interval and search; default: that of `model`, else the paper's,
        for a `motion_model` in the arena of the recording. The ranges are the model's.
    statistic : Statistic, optional
        The distance that is made small; default: `StepDistance`.
    flow : xarray.Dataset, optional
        The water's velocity. For the block it is extracted from the recording when left out.
    body : str, optional
        The body, where the recording has several.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes the work units of maps, bootstrap and summaries elsewhere, with one thread each;
        see `driftwalk.sweep.run_sweep`. The rest runs here. The result does not depend on it.
    stores : callable, optional
        Where each stage keeps finished work (`driftwalk.core.files.rundir`); memory when left out.
    tell : callable, optional
        Called with the stage and its progress: ``tell("map", 64, 1681)``.
    meanwhile : callable, optional
        Called once with the calibration, as soon as all of it is known that figures show. The
        block's is still without its two halves, which other threads compare in the meantime, if
        there may be several.

    Returns
    -------
    xarray.Dataset
        A `calibration`. ``estimate`` and ``interval`` are the answer, by parameter:
        ``drag_coefficient`` and ``force_std`` [N] of the block. ``optimum_ks_distance`` is to be
        compared with ``noise_floor``; ``verdict`` and ``warning`` say what comes of that. Of the
        block also ``force_interval`` [s] and ``force_noise_intensity`` [N2 s], which is what the
        recording can tell.

    Raises
    ------
    InputError
        When the recording is too short, does not move, or several bodies are there and none named;
        when the model has more than two parameters.

    Notes
    -----
    A small distance does not certify the parameters: an error of the flow field is absorbed by
    them (docs/explanation/calibration.md).

    Examples
    --------
    >>> import driftwalk as dw
    >>> found = dw.calibrate(dw.tank30_recording(), flow=dw.tank30_flow())  # doctest: +SKIP
    >>> found["estimate"].sel(parameter="drag_coefficient").item()  # doctest: +SKIP
    0.39
    """
    chosen, searched = _study_and_model(model, study, recording)
    how = Execution(executor, stores or in_memory, tell or ignore_progress)
    if len(searched.parameters) > MOST_PARAMETERS:
        if statistic is not None:
            raise ConfigurationError(
                f"a user's statistic works for one or two parameters; {searched.name} has "
                f"{len(searched.parameters)}"
            )
        motion = body_motion(recording, chosen, flow=flow, body=body, threads=threads)
        many = calibrate_many(motion, searched, how)
        if meanwhile is not None:
            meanwhile(many)
        return many
    require_searchable(searched)
    flow_of = _flow_source(chosen, searched, flow)
    track, problem = recorded_problem(
        recording, chosen, flow_of, model=searched, statistic=statistic, body=body, threads=threads
    )
    stages = GridCalibration(problem, how).run()
    # A model is not rejected for what it cannot know: inputs taken for right, an unsteady motion.
    stationarity = stationarity_of(problem)
    in_tank = isinstance(searched, BlockModel | ParticleModel)
    is_block = isinstance(searched, BlockModel)
    unstated = unstated_warning(chosen, about="block" if is_block else "tank") if in_tank else None
    stages.warnings += jump_warnings(recording, body, track=track)
    stages.warnings += [] if unstated is None else [unstated]
    if is_block and flow is not None and stages.region is not None:
        drag, force = stages.region.intervals
        every = chosen.forces.force_interval_s
        found_in_flow = {
            "drag_coefficient": drag,
            "force_noise_intensity": (every * force[0] ** 2, every * force[1] ** 2),
        }
        name = str(recording.attrs.get("source", ""))
        stages.unable += fit_disagreements(flow, name, found_in_flow)
    stages.unable += [
        text
        for text in (
            OWN_FLOW if is_block and flow is None else None,
            wall_warning(track, chosen) if is_block else None,
            # In a flow that changes the model is not steady either.
            None if stationarity is None or is_series(problem.like.flow) else stationarity.warning,
        )
        if text is not None
    ]
    stages.warnings += series_warnings(problem.like.flow, duration=problem.duration)

    def finish(halves: Halves | None) -> xr.Dataset:
        return build_calibration(stages, halves, stationarity, recording)

    compare_halves = partial(validate_on_halves, track, problem, stages.coarse, flow_of, executor)
    if problem.study.calibration.refine == "none":
        halves = None
    else:
        how.tell("validation", 0, 1)
        # The figures show nothing of the halves, so they are drawn while the core compares them.
        native = isinstance(searched, ScoresItself) and isinstance(problem.statistic, StepDistance)
        if meanwhile is not None and native and executor is None and problem.like.threads > 1:
            halves = run_in_background(compare_halves, partial(meanwhile, finish(None)))
            meanwhile = None
        else:
            halves = compare_halves(
                SweepProgress(partial(how.tell, "validation"), share_of_windows)
            )
        how.tell("validation", 1, 1)
    found = finish(halves)
    if meanwhile is not None:
        meanwhile(found)
    return found


def _study_and_model(
    model: MotionModel | Study | None, study: Study | None, recording: xr.Dataset
) -> tuple[Study, MotionModel]:
    """Return the conditions and the search, and what is searched."""
    from driftwalk.model import Study

    if isinstance(model, Study):
        if study is not None:
            raise InputError("two studies are given: give one, or a motion model and a study")
        return model, BlockModel(model)
    if model is None:
        chosen = study if study is not None else Study()
        return chosen, BlockModel(chosen)
    if not isinstance(model, MotionModel):
        raise InputError(
            f"expected a motion model or a study, got {type(model).__name__}: a function becomes "
            "one by motion_model(function, speed=(0, 0.1, 'm/s'))"
        )
    if study is not None:
        return study, model
    if isinstance(model, BlockModel):
        return model.study, model
    # Nothing but the recording says in which tank a model without a study moves.
    return study_in_arena(Study(), recording), model


def _flow_source(study: Study, model: MotionModel, flow: xr.Dataset | None) -> FlowSource:
    """Return what gives the flow for a track: the given field, or one extracted from the track."""
    if flow is not None or not model.needs_flow:
        return lambda track: flow  # noqa: ARG005
    from driftwalk.conditions.recorded import flow_from_track

    return lambda track: flow_from_track(track, study)
