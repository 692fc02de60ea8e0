"""Replicates of the recordings: simulations of the fitted model, at the estimate and drawn.

They hold everything that the fit has opened. The law of the force and its memory stand in the
study of the estimate, samples that are missing in the time stamps. Here the flow gets the strength
that changes during the recording, the wall what was estimated of it, and the camera its errors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.problem import Problem, prepare_problem
from driftwalk.comparison import apply_steps, plan_steps
from driftwalk.conditions import recorded_camera
from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.processors import map_in_threads
from driftwalk.core.random_streams import CheckStream
from driftwalk.core.seeds import world_keys
from driftwalk.likelihood.filter.parameters import PULSES, STRENGTHS, Point
from driftwalk.likelihood.filter.series import Series, layer_strengths
from driftwalk.likelihood.flow_intervals import fitted_flow, fitted_intervals
from driftwalk.likelihood.preparation import Estimate
from driftwalk.likelihood.spline import Spline
from driftwalk.schema.answers.facts import fitted_value

if TYPE_CHECKING:
    import xarray as xr


Keys = npt.NDArray[np.uint64]

Path = tuple[Floats, Floats, Floats]


class FramePolicy(NamedTuple):
    """Frames of a flow whose strength changes; between them it is linear in time."""

    per_half_wave: int = 10
    """Frames in half a wave of the fastest cosine: its amplitude comes out 1 % too small."""
    per_period: int = 16
    """Frames in a period of a pulse: its amplitude comes out 1 % too small."""
    most: int = 2000
    """Most frames: with the 50 by 50 nodes of a flow they take some 100 MB. Chosen by hand."""


FRAMES: Final = FramePolicy()


class Replicates(NamedTuple):
    """Simulated recordings, those that broke down left out."""

    steps: list[Floats]
    """Step lengths [m] and turning angles [rad] of each, (pairs, 2)."""
    paths: list[list[Path]]
    """Each one's recordings: times [s], x and y [m]."""
    flow: Integers
    """Which drawn flow each was in."""
    broken: int
    """How many were left out."""


def problems_of(
    fit: xr.Dataset, estimate: Estimate, recordings: Sequence[xr.Dataset]
) -> list[Problem]:
    """Return the series ready for comparison, each in its fitted flow, with one step interval."""
    from driftwalk.conditions.study import fitted_wall
    from driftwalk.model import apply_overrides

    tracks, series = estimate.tracks, estimate.passes.series
    study = apply_overrides(estimate.study, fitted_wall(fit))
    intervals = fitted_intervals(fit)
    flows = [
        fitted_flow(fit, interval=intervals.of_flow(flow)[0])
        for flow in range(len(intervals.labels))
    ]
    if study.steps.step_interval_s == "auto":
        interval = max(plan_steps(track.time).step_interval for track in tracks)
        study = apply_overrides(study, {"steps.step_interval_s": interval})
    noise = fitted_value(fit, "tracking_noise")
    problems = []
    for track, one in zip(tracks, series, strict=True):
        quantum = float(recordings[one.recording].attrs.get("position_quantum_m", 0.0))
        # The rounding of the file is part of the noise that the fit finds, and is simulated apart.
        plain = float(np.sqrt(max(noise**2 - quantum**2 / 12.0, 0.0)))
        camera = {"observation.position_noise_m": plain, "observation.orientation_noise_rad": 0.0}
        seen = apply_overrides(study, camera)
        made = recorded_camera(track, seen, position_quantum=quantum)
        flow = _in_frames(flows[one.flow], one, estimate.point, estimate.passes.spline)
        problems.append(prepare_problem(track, seen, flow, camera=made))
    return problems


def _in_frames(
    flow: xr.Dataset, series: Series, point: Point, spline: Spline | None = None
) -> xr.Dataset:
    """Return a flow with the strength and the modes that a fit has found; a steady one as it is."""
    first, span = float(series.time[0]), float(series.time[-1] - series.time[0])
    if layer_strengths(series, point) is None:
        return flow
    steps = [series.span / (FRAMES.per_half_wave * len(STRENGTHS))]
    repeat, end = "hold", span
    pulses = [point.number("pulse_frequency")] if any(point.number(one) for one in PULSES) else []
    frequencies = [*pulses, *([point.number("mode_frequency")] if point.layers > 1 else [])]
    if frequencies:
        period = 1.0 / max(*frequencies, 1e-300)
        steps.append(period / FRAMES.per_period)
        if len(frequencies) == 1 and not any(point.number(name) for name in STRENGTHS):
            repeat, end = "loop", min(period, span)
    count = math.ceil(end / min(steps)) + 1
    if count > FRAMES.most:
        raise InputError(
            f"the strength of the flow changes too fast to be simulated: {count} frames would be "
            f"needed, and {FRAMES.most} are possible"
        )
    time = np.linspace(0.0, end, count)
    strengths = layer_strengths(replace(series, time=first + time), point)
    assert strengths is not None
    water = np.stack([flow["u"].values, flow["v"].values])
    total = strengths[0][:, None, None, None] * water
    if spline is not None and point.layers > 1:
        x, y = flow["x"].values, flow["y"].values
        for strength, layer in zip(strengths[1:], point.coefficients[1:], strict=True):
            total += strength[:, None, None, None] * spline.values(layer, x, y)
    frames = {name: (("time", "y", "x"), total[:, k]) for k, name in enumerate(("u", "v"))}
    return (
        flow[["u", "v", "flag"]].assign(frames).assign_coords(time=time).assign_attrs(repeat=repeat)
    )


def replicates_at_estimate(
    fit: xr.Dataset, estimate: Estimate, problems: Sequence[Problem], *, count: int, seed: int
) -> Replicates:
    """Simulate the recordings with what the fit found."""
    drag, force = fitted_value(fit, "drag_coefficient"), fitted_value(fit, "force_std")
    parts = [
        _simulated(
            problem, _keys(seed, CheckStream.ESTIMATE, index, count), drag, force, estimate.point
        )
        for index, problem in enumerate(problems)
    ]
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
    points, factors = _posterior_samples(fit, estimate, spread, flows, seed)
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
            point = points[k].in_flow(series.flow)
            spline = estimate.passes.spline
            u, v = spline.values(point.mean_coefficients, x, y)
            mean = like.flow.assign(u=(("y", "x"), u), v=(("y", "x"), v))
            flow = _in_frames(mean, series, point, spline)
            noise = like.camera.position_noise * float(factors[k, 2])
            camera = replace(like.camera, position_noise=noise)
            own = replace(problem, like=replace(like, flow=flow, camera=camera, threads=1))
            begin = float(series.time[0])
            return _simulated(
                own, keys[flow_of == k], float(drag[k]), float(force[k]), point, begin
            )

        found = map_in_threads(simulated, range(flows), problem.like.threads)
        parts.append([found[k][j // flows] for j, k in enumerate(flow_of)])
    return _joined(parts, flow_of)


def _posterior_samples(
    fit: xr.Dataset, estimate: Estimate, spread: Floats, count: int, seed: int
) -> tuple[list[Point], Floats]:
    """Return drawn flows with their strength, and factors of C_d, force_std and tracking noise.

    C_d has the variance of the restricted likelihood; the flow follows it as far as the two are
    correlated.
    """
    generator = np.random.default_rng([seed, CheckStream.PARAMETERS])
    size = estimate.point.coefficients.size
    names = fit["log_parameter"].values.tolist()
    changing = [one for one in (*STRENGTHS, *PULSES) if one in names]
    drawn = [0, 1, 2, *(names.index(one) for one in changing)]
    found = fit["covariance"].values[np.ix_(drawn, drawn)]
    widest = float(np.sqrt(np.diag(found)[:3].max()))
    # Samples of a parameter that is known to a factor of ten only mean nothing.
    if not widest < math.log(10.0):
        raise InputError(
            "the fit leaves C_d, the force or the tracking noise uncertain by more "
            "than a factor of ten"
        )
    logs = generator.multivariate_normal(np.zeros(len(drawn)), found, size=count)
    free = generator.normal(size=(count, len(spread))) @ spread.T
    along = spread[:size] @ spread[size] / (spread[size] @ spread[size])
    moved = free[:, :size] + (logs[:, :1] - free[:, size : size + 1]) * along
    shape = (count, *estimate.point.coefficients.shape)
    coefficients = estimate.point.coefficients + moved.reshape(shape)
    points = []
    for k in range(count):
        point = replace(estimate.point, coefficients=coefficients[k])
        for name, off in zip(changing, logs[k, 3:], strict=True):
            point = point.with_extra(name, point.number(name) + float(off))
        points.append(point)
    return points, np.exp(logs[:, :3] * (1.0, 0.5, 1.0))


class _World(NamedTuple):
    steps: Floats
    path: Path
    sound: bool


def _keys(seed: int, kind: int, index: int, count: int) -> Keys:
    return world_keys(seed, trial=2 * index + kind, replicate=np.arange(count))


def _simulated(
    problem: Problem, keys: Keys, drag: float, force: float, point: Point, begin: float = 0.0
) -> list[_World]:
    like = problem.like
    values = {"drag_coefficient": np.full(keys.size, drag), "force_std": np.full(keys.size, force)}
    poses = problem.model.simulate(values, like, keys)
    worlds = []
    for k, key in enumerate(keys):
        pose = [one[k].astype(np.float64) for one in (poses.x, poses.y, poses.theta)]
        x, y = _as_seen(*pose, time=like.sample_time, point=point, key=int(key))
        found = apply_steps(problem.reference.plan, x, y)
        steps = np.column_stack([found.step_length, found.turning_angle])
        path = (begin + like.sample_time, x, y)
        worlds.append(_World(steps, path, bool(poses.status[k] == 0 and len(steps) > 0)))
    return worlds


def _as_seen(
    x: Floats, y: Floats, theta: Floats, *, time: Floats, point: Point, key: int
) -> tuple[Floats, Floats]:
    """Return where a camera with the fitted errors sees a block: marker, and time stamps."""
    across, along = point.number("marker_x"), point.number("marker_y")
    if across or along:
        marked = theta + point.number("angle_offset")
        cosine, sine = np.cos(marked), np.sin(marked)
        x = x + across * cosine - along * sine
        y = y + across * sine + along * cosine
    variance = point.number("time_variance")
    if variance > 0.0:
        late = math.sqrt(variance) * np.random.default_rng(key).normal(size=time.size)
        x, y = (axis + late * np.gradient(axis, time) for axis in (x, y))
    return x, y


def _joined(parts: Sequence[Sequence[_World]], flow_of: Integers) -> Replicates:
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
