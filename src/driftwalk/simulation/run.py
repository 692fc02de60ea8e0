"""Simulated trajectories, as many replicates as asked for."""

from __future__ import annotations

from operator import index
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.core.arrays import Keys
from driftwalk.core.errors import InputError
from driftwalk.core.processors import default_threads
from driftwalk.core.random_streams import world_keys
from driftwalk.schema.check import build_dataset
from driftwalk.schema.trajectory import POSE
from driftwalk.simulation.backend import Camera, check_sample_time, native_model
from driftwalk.simulation.initial import Start, random_start, world_table
from driftwalk.simulation.series import continued_flow, flow_starts, series_facts

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

Backend = Literal["cpu", "reference"]


def simulate(
    study: Study,
    flow: xr.Dataset,
    *,
    sample_time: npt.ArrayLike | None = None,
    start: Start | None = None,
    replicates: int | None = None,
    seed: int | None = None,
    flow_start: float | None = None,
    backend: Backend = "cpu",
    threads: int | None = None,
) -> xr.Dataset:
    """Simulate one block in a stirred tank.

    Drag on vertical strips of the four side faces (Eq. 2 of the paper, windward strips), a
    stochastic force N(0, sigma_F^2 I) on the centre of mass redrawn every force interval, and
    impacts on the wall; what [forces] of the study adds to that law. Second order in time.

    Parameters
    ----------
    study : Study
        Block, tank, water, forces, simulation and observation. "estimate" and "recording" in the
        observation mean no noise and no rounding here, since there is no recording.
    flow : xarray.Dataset
        The water's velocity, a `flow_field`. One that changes in time lasts as long as the
        simulation, or [flow] of the study says how it goes on.
    sample_time : array_like, shape (n,), optional
        Times of the samples [s], increasing, from 0 on; default: the study's rate and duration.
    start : Start, optional
        Pose and motion at time 0; default: what the study says.
    replicates, seed : int, optional
        Over the study's values.
    flow_start : float, optional
        Time on the clock of a flow that changes at which all replicates begin [s]; default: what
        [flow] of the study says, which is a random one for each.
    backend : {"cpu", "reference"}
        The batch kernels in single precision, or the same source in double precision.
    threads : int, optional
        Default: all processors. The result does not depend on it.

    Returns
    -------
    xarray.Dataset
        ``x``, ``y`` [m], ``theta`` [rad] with dimensions (replicate, time, body) and ``status``
        (replicate), bits with CF flag masks; in a flow that changes ``flow_start`` (replicate) [s].

    Raises
    ------
    InputError
        When times do not increase, `flow` is no flow field or over too soon, or the backend is
        unknown.

    Examples
    --------
    >>> import driftwalk as dw
    >>> still = dw.uniform_flow(0.0, 0.0)
    >>> run = dw.simulate(dw.Study(), still, sample_time=[0.0, 0.1, 0.2], seed=1)
    >>> run.sizes["time"]
    3
    """
    chosen, keys = replicate_keys(study, replicates, seed)
    count = keys.size
    if backend not in get_args(Backend):
        raise InputError(f"backend must be one of {', '.join(get_args(Backend))}, got {backend!r}")
    times = default_times(study) if sample_time is None else np.asarray(sample_time, np.float64)
    begin = start if start is not None else _study_start(study, keys)
    check_sample_time(times)
    water = continued_flow(flow, study, duration=float(times[-1]), begin=flow_start)
    starts = flow_starts(water, study, keys, duration=float(times[-1]))
    # Replicates that share a clock with a recording all begin with it.
    if starts is not None and flow_start is not None:
        starts = np.full(count, float(flow_start))
    model = native_model(study, water, times, plain_camera(study))
    forces = study.forces
    worlds = world_table(
        begin, keys, drag_coefficient=forces.drag_coefficient, force_std=forces.force_std_N
    )
    try:
        x, y, theta, status = _core.simulate(
            model,
            worlds,
            keys,
            threads=threads or default_threads(),
            precision="double" if backend == "reference" else "single",
            flow_start=starts,
        )
    except MemoryError as error:
        # Three numbers of 4 bytes; those of the reference are twice as large.
        size = count * times.size * 12 / 1e9
        raise MemoryError(
            f"{count} replicates of {times.size} samples take {size:.3g} GB; take fewer "
            "(`simulation.replicates`, `simulation.sample_rate_Hz`) or a shorter time "
            "(`simulation.duration_s`)"
        ) from error
    attrs = {
        "arena": study.tank.to_arena_json(),
        "drag_coefficient": forces.drag_coefficient,
        "force_std_N": forces.force_std_N,
        "force_interval_s": forces.force_interval_s,
        "force_noise_intensity_N2_s": forces.force_noise_intensity_N2_s,
        "time_step_s": study.time_step_s,
        "study": study.to_toml(),
        "seed": chosen,
        "backend": backend,
        **series_facts(water, starts, duration=float(times[-1])),
    }
    return simulation_dataset("block", times, (x, y, theta), status, starts, attrs)


def plain_camera(study: Study) -> Camera:
    """Return the camera of a study in which "estimate" and "recording" mean none."""
    seen = study.observation
    values = (seen.position_noise_m, seen.orientation_noise_rad, seen.position_quantum_m)
    return Camera(*(0.0 if isinstance(value, str) else value for value in values))


def replicate_keys(study: Study, replicates: int | None, seed: int | None) -> tuple[int, Keys]:
    """Return the seed and the keys of the replicates, those of the study where none are given."""
    count = index(study.simulation.replicates if replicates is None else replicates)
    if count < 1:
        raise InputError(f"replicates must be at least 1, got {count}")
    chosen = study.simulation.seed if seed is None else seed
    return chosen, world_keys(chosen, trial=0, replicate=np.arange(count))


def default_times(study: Study) -> npt.NDArray[np.float64]:
    """Return the times of the samples [s] that a study asks for: its rate and duration."""
    settings = study.simulation
    samples = int(np.floor(settings.duration_s * settings.sample_rate_Hz + 1e-9)) + 1
    return np.arange(samples) / settings.sample_rate_Hz


def _study_start(study: Study, keys: npt.NDArray[np.uint64]) -> Start:
    from driftwalk.model.simulation import Pose

    start = study.simulation.start
    if isinstance(start, Pose):
        return Start(start.x_m, start.y_m, start.theta_rad)
    return random_start(study, keys)


def simulation_dataset(
    body: str,
    times: Any,
    poses: tuple[Any, Any, Any],
    status: Any,
    starts: Any,
    attrs: dict[str, Any],
) -> xr.Dataset:
    """Return poses of shape (replicates, times) as a dataset of the kind "simulation"."""
    dims = ("replicate", "time", "body")
    data: dict[str, Any] = {
        name: (dims, np.asarray(values)[:, :, None])
        for name, values in zip(POSE, poses, strict=True)
    }
    data["status"] = ("replicate", status.astype(np.int32))
    if starts is not None:
        data["flow_start"] = ("replicate", starts)
    coords = {
        "time": ("time", times),
        "body": ("body", np.array([body], dtype=object)),
        "replicate": ("replicate", np.arange(status.size)),
    }
    return build_dataset("simulation", data, coords, attrs)
