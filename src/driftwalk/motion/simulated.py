"""Trajectories of any motion model whose parameters are known."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.conditions.camera import study_as_seen
from driftwalk.conditions.recorded import Conditions, neighbours_of, recorded_conditions
from driftwalk.core.arrays import Keys
from driftwalk.core.errors import InputError
from driftwalk.core.processors import default_threads
from driftwalk.motion.block import BlockModel
from driftwalk.motion.external_program.program import ProgramModel
from driftwalk.motion.family.particle import ParticleModel, time_step_of
from driftwalk.motion.protocol import MotionModel, Worlds, no_numbers
from driftwalk.motion.values import known_values
from driftwalk.schema import body_track
from driftwalk.simulation.backend import STATUS, check_sample_time
from driftwalk.simulation.initial import Start, random_place, random_start
from driftwalk.simulation.run import (
    default_times,
    plain_camera,
    replicate_keys,
    simulation_dataset,
)
from driftwalk.simulation.series import continued_flow, flow_starts, series_facts, velocity_at

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


def simulate_motion(
    model: MotionModel,
    parameters: Mapping[str, float],
    study: Study,
    *,
    flow: xr.Dataset | None = None,
    like: xr.Dataset | None = None,
    body: str | None = None,
    sample_time: npt.ArrayLike | None = None,
    start: Start | None = None,
    replicates: int | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Simulate a motion model whose parameters are known.

    Parameters
    ----------
    model : MotionModel
        The model, as `motion_model` returns it.
    parameters : mapping of str to float
        A value for each of its parameters, in its unit.
    study : Study
        Tank, simulation and observation; with `like` in the recording's tank (`study_for`).
    flow : xarray.Dataset, optional
        The water's velocity, a `flow_field`; for a model that has a use for it.
    like : xarray.Dataset, optional
        A `trajectory` that gives start, time stamps, gaps and camera, as for a calibration.
    body : str, optional
        Its body, where there are several.
    sample_time : array_like, shape (n,), optional
        Times of the samples [s], increasing from 0 on; default: the study's rate and duration. Not
        with `like`.
    start : Start, optional
        Pose and motion at time 0; not with `like`. Default: what the study says, which is at
        random uniform over the tank, with a direction uniform too. A body starts at rest,
        relative to the water where there is a flow.
    replicates, seed : int, optional
        Over the study's values.
    threads : int, optional
        Default: all processors. The result does not depend on it.

    Returns
    -------
    xarray.Dataset
        A `simulation`: ``x``, ``y`` [m], ``theta`` [rad] with dimensions (replicate, time, body)
        and ``status``. Replicate r has the bits that `MotionModel.simulate` gives for the key of
        the seed, trial 0 and r.

    Raises
    ------
    ConfigurationError
        When a parameter has no value, or a value no parameter.
    InputError
        When a flow is missing or has no use, the model fails or gives no numbers, or an argument
        contradicts `like`.

    Examples
    --------
    >>> import driftwalk as dw
    >>> model = dw.motion_model("active", turn_rate=0.0)
    >>> values = {"speed": 0.02, "rotational_diffusion": 0.5}
    >>> run = dw.motion.simulate_motion(model, values, dw.Study(), sample_time=[0.0, 0.1, 0.2])
    >>> run.sizes["time"], run.attrs["model"]
    (3, 'active')
    """
    values = known_values(model, parameters)
    _check_flow(model, flow)
    chosen, keys = replicate_keys(study, replicates, seed)
    if like is None:
        if body is not None:
            raise InputError("`body` names a body of the recording `like`, and none is given")
        times = default_times(study) if sample_time is None else np.asarray(sample_time, np.float64)
        check_sample_time(times)
        if times[0] != 0.0:
            raise InputError(f"`sample_time` begins at {times[0]:g} s: it has to begin at 0 s")
        starts = None
        if flow is not None:
            flow = continued_flow(flow, study, duration=float(times[-1]))
            starts = flow_starts(flow, study, keys, duration=float(times[-1]))
        conditions = Conditions(
            sample_time=times,
            start=model_start(model, study, flow, keys, starts) if start is None else start,
            camera=plain_camera(study),
            tank=study.tank,
            view=study.observation.field_of_view,
            flow=flow,
            threads=threads or default_threads(),
            flow_start=starts,
        )
    else:
        if sample_time is not None or start is not None:
            raise InputError("with `like`, the recording gives times and start")
        track = body_track(like, body)
        # The study as the recording was seen: its tank, body and camera, so that both can be
        # compared.
        study = study_as_seen(study, like, track)
        conditions = recorded_conditions(
            track,
            study,
            camera=plain_camera(study),
            flow=flow,
            neighbours=neighbours_of(like, body, study.tank),
            threads=threads,
        )
    columns = {name: np.full(keys.size, value) for name, value in values.items()}
    worlds = model.simulate(columns, conditions, keys)
    if (worlds.status & STATUS["non_finite"]).all():
        raise InputError(no_numbers(model.name, values))
    return _dataset(model, values, study, conditions, worlds, chosen)


def _check_flow(model: MotionModel, flow: xr.Dataset | None) -> None:
    if flow is None and model.needs_flow:
        raise InputError(
            f"the water carries a body of the model {model.name}: give the flow of the water "
            "(`flow`)"
        )
    if flow is None or model.needs_flow:
        return
    if isinstance(model, ParticleModel):
        raise InputError(
            f"the model {model.name} does not feel the water: leave the flow out (`flow`), or add "
            f"the part that lets the water carry it, {model.name}+flow"
        )
    if isinstance(model, ProgramModel):
        raise InputError("a program gets no flow of the water: leave it out (`flow`)")


def model_start(
    model: MotionModel,
    study: Study,
    flow: xr.Dataset | None,
    keys: Keys,
    flow_start: npt.ArrayLike | None = None,
) -> Start:
    """Return the start that a study says: a pose or a random one, at rest relative to the water.

    Parameters
    ----------
    model : MotionModel
        The model; a body of the family keeps its clearance from the wall.
    study : Study
        Tank and [simulation] start.
    flow : xarray.Dataset or None
        The water's velocity.
    keys : ndarray of uint64, shape (worlds,)
        The address of every world's random numbers.
    flow_start : array_like, shape (worlds,), optional
        When each world begins in a flow that changes [s]; default: 0.

    Returns
    -------
    Start
        Arrays with one entry per world.

    Raises
    ------
    InputError
        When a flow is missing or has no use, or no place is as far from the wall as the clearance.

    Examples
    --------
    >>> import driftwalk as dw
    >>> keys = np.array([1, 2], dtype=np.uint64)
    >>> model_start(dw.motion_model("active"), dw.Study(), None, keys).x.size
    2
    """
    from driftwalk.model.simulation import Pose

    _check_flow(model, flow)
    pose = study.simulation.start
    if isinstance(pose, Pose):
        begin = Start(*(np.full(keys.size, one) for one in (pose.x_m, pose.y_m, pose.theta_rad)))
    elif isinstance(model, BlockModel):
        return random_start(study, keys)
    else:
        clearance = model.clearance if isinstance(model, ParticleModel) else 0.0
        begin = random_place(study.tank, keys, clearance=clearance)
    if flow is None or isinstance(model, BlockModel):
        return begin
    vx, vy = velocity_at(flow, begin.x, begin.y, 0.0 if flow_start is None else flow_start)
    return begin._replace(vx=vx, vy=vy)


def _dataset(
    model: MotionModel,
    values: Mapping[str, float],
    study: Study,
    conditions: Conditions,
    worlds: Worlds,
    seed: int,
) -> xr.Dataset:
    times, starts = conditions.sample_time, conditions.flow_start
    stated = {one.key: values[one.name] for one in model.parameters}
    attrs: dict[str, Any] = {"model": model.name, **model.facts(values)}
    if isinstance(model, ParticleModel):
        # Numbers that the caller fixed are no parameters of the model, and a repeated run needs
        # them.
        stated |= model.known
        attrs["time_step_s"] = time_step_of(times)
    attrs = {
        "arena": study.tank.to_arena_json(),
        **attrs,
        "model_parameters": json.dumps(stated),
        "seed": seed,
        "study": study.to_toml(),
        **series_facts(conditions.flow, starts, duration=float(times[-1])),
    }
    return simulation_dataset("body", times, worlds[:3], worlds.status, starts, attrs)
