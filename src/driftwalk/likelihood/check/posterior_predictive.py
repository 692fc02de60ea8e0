"""Posterior predictive replicates of the recordings, and replicates at the estimate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.problem import Problem, prepare_problem
from driftwalk.comparison import apply_steps, plan_steps
from driftwalk.conditions import recorded_camera
from driftwalk.core.errors import InputError
from driftwalk.core.processors import map_in_threads
from driftwalk.core.random_streams import CheckStream
from driftwalk.core.seeds import world_keys
from driftwalk.likelihood.estimate import Estimate
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.flow_of_fit import fitted_flow
from driftwalk.likelihood.intervals import fitted_intervals
from driftwalk.likelihood.spline import Floats
from driftwalk.schema import Track
from driftwalk.schema.answers.facts import fitted_value

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

Keys = npt.NDArray[np.uint64]

Path = tuple[Floats, Floats, Floats]


class Replicates(NamedTuple):
    """Simulated recordings, those that broke down left out."""

    steps: list[Floats]
    """Step lengths [m] and turning angles [rad] of each, (pairs, 2)."""
    paths: list[list[Path]]
    """Each one's recordings: times [s], x and y [m]."""
    flow: npt.NDArray[np.int64]
    """Which drawn flow each was in."""
    broken: int
    """How many were left out."""


def problems_of(
    fit: xr.Dataset, estimate: Estimate, recordings: Sequence[xr.Dataset]
) -> list[Problem]:
    """Return the series ready for comparison, each in its fitted flow, with one step interval."""
    from driftwalk.model import apply_overrides

    study, tracks, series = estimate.study, estimate.tracks, estimate.passes.series
    intervals = fitted_intervals(fit)
    flows = [
        fitted_flow(fit, interval=intervals.of_flow(flow)[0])
        for flow in range(len(intervals.labels))
    ]
    if study.steps.step_interval_s == "auto":
        interval = max(plan_steps(track.time).step_interval for track in tracks)
        study = apply_overrides(study, {"steps.step_interval_s": interval})
    return [
        _problem(
            track,
            study,
            flows[one.flow],
            noise=fitted_value(fit, "tracking_noise"),
            recording=recordings[one.recording],
        )
        for track, one in zip(tracks, series, strict=True)
    ]


def _problem(
    track: Track, study: Study, flow: xr.Dataset, *, noise: float, recording: xr.Dataset
) -> Problem:
    from driftwalk.model import apply_overrides

    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    # The rounding of the file is part of the noise that the fit finds, and is simulated apart.
    plain = float(np.sqrt(max(noise**2 - quantum**2 / 12.0, 0.0)))
    seen = apply_overrides(
        study, {"observation.position_noise_m": plain, "observation.orientation_noise_rad": 0.0}
    )
    camera = recorded_camera(track, seen, position_quantum=quantum)
    return prepare_problem(track, seen, flow, camera=camera)


def replicates_at_estimate(
    fit: xr.Dataset, problems: Sequence[Problem], *, count: int, seed: int
) -> Replicates:
    """Simulate the recordings with what the fit found."""
    drag, force = fitted_value(fit, "drag_coefficient"), fitted_value(fit, "force_std")
    parts = []
    for index, problem in enumerate(problems):
        keys = _keys(seed, CheckStream.ESTIMATE, index, count)
        parts.append(_simulated(problem, keys, drag, force))
    return _joined(parts, np.zeros(count, dtype=np.int64))


def posterior_replicates(
    fit: xr.Dataset,
    estimate: Estimate,
    problems: Sequence[Problem],
    spread: Floats,
    *,
    count: int,
    seed: int,
) -> Replicates:
    """Simulate the recordings with flow and parameters drawn from what the fit leaves open."""
    # Eight flow fields: a world on its own takes as long as eight together.
    flows = min(8, count)
    flow_of = np.arange(count) % flows
    coefficients, factors = _posterior_samples(fit, estimate, spread, flows, seed)
    drag = fitted_value(fit, "drag_coefficient") * factors[:, 0]
    force = fitted_value(fit, "force_std") * factors[:, 1]
    parts: list[list[_World]] = []
    for index, problem in enumerate(problems):
        keys = _keys(seed, CheckStream.DRAWN, index, count)
        series = estimate.passes.series[index]

        def simulated(
            k: int, problem: Problem = problem, keys: Keys = keys, series: Series = series
        ) -> list[_World]:
            like = problem.like
            assert like.flow is not None
            x, y = like.flow["x"].values, like.flow["y"].values
            point = replace(estimate.point, coefficients=coefficients[k]).in_flow(series.flow)
            u, v = estimate.passes.spline.values(point.coefficients, x, y)
            flow = like.flow.assign(u=(("y", "x"), u), v=(("y", "x"), v))
            noise = like.camera.position_noise * float(factors[k, 2])
            camera = replace(like.camera, position_noise=noise)
            own = replace(problem, like=replace(like, flow=flow, camera=camera, threads=1))
            begin = float(series.time[0])
            return _simulated(own, keys[flow_of == k], float(drag[k]), float(force[k]), begin)

        found = map_in_threads(simulated, range(flows), problem.like.threads)
        parts.append([found[k][j // flows] for j, k in enumerate(flow_of)])
    return _joined(parts, flow_of)


def _posterior_samples(
    fit: xr.Dataset, estimate: Estimate, spread: Floats, count: int, seed: int
) -> tuple[Floats, Floats]:
    """Return drawn coefficients of the flow, and factors of C_d, force_std and tracking noise.

    C_d has the variance of the restricted likelihood; the flow follows it as far as the two are
    correlated.
    """
    generator = np.random.default_rng([seed, CheckStream.PARAMETERS])
    size = estimate.point.coefficients.size
    found = fit["covariance"].values[:3, :3]
    widest = float(np.sqrt(np.diag(found).max()))
    # Samples of a parameter that is known to a factor of ten only mean nothing.
    if not widest < math.log(10.0):
        raise InputError(
            "the fit leaves C_d, the force or the tracking noise uncertain by more "
            "than a factor of ten"
        )
    logs = generator.multivariate_normal(np.zeros(3), found, size=count)
    free = generator.normal(size=(count, len(spread))) @ spread.T
    along = spread[:size] @ spread[size] / (spread[size] @ spread[size])
    moved = free[:, :size] + (logs[:, :1] - free[:, size : size + 1]) * along
    shape = (count, *estimate.point.coefficients.shape)
    coefficients = estimate.point.coefficients + moved.reshape(shape)
    return coefficients, np.exp(logs * (1.0, 0.5, 1.0))


class _World(NamedTuple):
    steps: Floats
    path: Path
    sound: bool


def _keys(seed: int, kind: int, index: int, count: int) -> Keys:
    return world_keys(seed, trial=2 * index + kind, replicate=np.arange(count))


def _simulated(
    problem: Problem, keys: Keys, drag: float, force: float, begin: float = 0.0
) -> list[_World]:
    like = problem.like
    values = {"drag_coefficient": np.full(keys.size, drag), "force_std": np.full(keys.size, force)}
    x, y, _, status = problem.model.simulate(values, like, keys)
    worlds = []
    for k in range(keys.size):
        found = apply_steps(problem.reference.plan, x[k], y[k])
        steps = np.column_stack([found.step_length, found.turning_angle])
        path = (begin + like.sample_time, x[k].astype(np.float64), y[k].astype(np.float64))
        worlds.append(_World(steps, path, bool(status[k] == 0 and len(steps) > 0)))
    return worlds


def _joined(parts: Sequence[Sequence[_World]], flow_of: npt.NDArray[np.int64]) -> Replicates:
    """Put the recordings of each replicate together."""
    whole = list(zip(*parts, strict=True))
    sound = np.array([all(world.sound for world in one) for one in whole])
    retained = [whole[k] for k in np.flatnonzero(sound)]
    return Replicates(
        [np.concatenate([world.steps for world in one]) for one in retained],
        [[world.path for world in one] for one in retained],
        flow_of[sound],
        int(np.count_nonzero(~sound)),
    )
