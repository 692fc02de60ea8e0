"""Replicates of the recordings: simulations of the fitted model, at the estimate and drawn.

They hold everything that the fit has opened. The law of the force and its memory stand in the
study of the estimate, samples that are missing in the time stamps. Here the flow gets the strength
that changes during the recording, the wall what was estimated of it, and the camera its errors.
They begin again on the recorded path from time to time (restarts.py).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.problem import Problem, prepare_problem
from driftwalk.comparison import StepPlan, apply_steps, plan_steps
from driftwalk.comparison.statistic import FEWEST_PAIRS
from driftwalk.conditions import recorded_camera
from driftwalk.core.arrays import Bools, Floats, Integers, Keys
from driftwalk.core.errors import InputError
from driftwalk.core.processors import map_in_threads
from driftwalk.core.random_streams import CheckStream, world_keys
from driftwalk.flow.arena import Outline, outline_of
from driftwalk.likelihood.check.restarts import (
    RESTART,
    Sections,
    States,
    first_samples,
    sections_of,
    within_sections,
)
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series, smooth_angle, wall_intervals
from driftwalk.likelihood.fitted_modes import flow_frames
from driftwalk.likelihood.flow_intervals import fitted_flow, fitted_intervals
from driftwalk.likelihood.law.candidate_laws import INTENSITIES, PULSES, STRENGTHS
from driftwalk.likelihood.preparation import Estimate
from driftwalk.likelihood.spline import Spline
from driftwalk.schema.answers.facts import fitted_value

if TYPE_CHECKING:
    import xarray as xr


Path = tuple[Floats, npt.NDArray[np.floating], npt.NDArray[np.floating]]
"""Times [s], x and y [m]."""


@dataclass(frozen=True, eq=False)
class Replicated:
    """A series ready for comparison, and where its replicates begin again."""

    problem: Problem
    first: Integers
    """Samples at which replicates begin again."""
    sections: list[Sections]
    plan: StepPlan
    """Of the steps within the sections."""
    outline: Outline
    angle: str
    """Use of the orientations, of which "none" is without them."""

    def steps(self, x: Floats, y: Floats, theta: Floats) -> Floats:
        """Return the step lengths [m] and turning angles [rad] away from the wall, (pairs, 2).

        Contacts are not fitted, and next to the wall the flow is not known.
        """
        turned, block = None if self.angle == "none" else theta, self.problem.study.block
        time = self.problem.like.sample_time
        left_out = wall_intervals(time, x, y, turned, outline=self.outline, block=block)
        left_out[:-1] |= left_out[1:]
        found = apply_steps(self.plan, *(np.where(left_out, np.nan, axis) for axis in (x, y)))
        return np.column_stack([found.step_length, found.turning_angle])


class Replicates(NamedTuple):
    """Simulated recordings, those that broke down left out."""

    steps: list[Floats]
    """Step lengths [m] and turning angles [rad] of each, (pairs, 2)."""
    paths: list[list[Path]]
    """Each one's recordings, where they are wanted: times [s], x and y [m]."""
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
        camera = {
            "observation.position_noise_m": plain,
            "observation.orientation_noise_rad": 0.0,
            "observation.gaps": "recording",
        }
        seen = apply_overrides(study, camera)
        made = recorded_camera(track, seen, position_quantum=quantum)
        flow = _in_frames(flows[one.flow], one, estimate.point, estimate.passes.spline)
        problems.append(prepare_problem(track, seen, flow, camera=made))
    return problems


def filtered_states(estimate: Estimate) -> list[States]:
    """Return the states of the filter after each sample, series by series.

    Where the angle is not a part of them, they have that of the recording. NaN where the filter
    knows no velocity.
    """
    found = []
    for one, track in zip(estimate.passes.series, estimate.tracks, strict=True):
        kernel = estimate.passes.kernel(one, estimate.point.in_flow(one.flow))
        run = kernel.run(one.time.size, errors=True)
        values, size = run["state"], run["state"].shape[1]
        mean, covariance = np.zeros((one.time.size, 6)), np.zeros((one.time.size, 6, 6))
        at = np.arange(6) if size == 6 else np.array([0, 1, 3, 4])
        mean[:, at] = values
        covariance[:, at[:, None], at] = run["errors"][:, 2, :size, :size]
        if estimate.passes.body.orientation == "given":
            mean[:, 2], mean[:, 5] = one.angle, one.omega
        elif size < 6:
            # The filter has no angle: replicates turn from the recorded one, if there is any.
            smooth = smooth_angle(track.time, track.theta)
            mean[:, 2] = np.where(smooth.known, smooth.theta, np.nan)
            mean[:, 5] = np.where(smooth.known, smooth.omega, 0.0)
        rates = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)[:, 3:])
        rates[:, 2] *= 0.5 * estimate.passes.body.side
        mean[~(rates.max(axis=1) < RESTART.most_velocity_std_m_s)] = np.nan
        found.append(States(mean, covariance))
    return found


def restarted(
    problems: Sequence[Problem], estimate: Estimate, states: Sequence[States], *, every: float
) -> list[Replicated]:
    """Return the series, whose replicates begin again after the time `every` [s]."""
    found = []
    for problem, track, known in zip(problems, estimate.tracks, states, strict=True):
        study, first = problem.study, first_samples(track, every)
        found.append(
            Replicated(
                problem,
                first,
                sections_of(track, first, known, window=study.flow.smoothing_window_s),
                within_sections(problem.reference.plan, first),
                outline_of(study.tank.to_arena()),
                estimate.passes.body.orientation,
            )
        )
    return found


def recorded_steps(series: Sequence[Replicated], estimate: Estimate) -> Floats:
    """Return the recorded steps as those of replicates are formed, (pairs, 2)."""
    angles = [one.angle for one in estimate.passes.series]
    steps = [
        one.steps(track.x, track.y, np.where(np.isfinite(track.theta), track.theta, angle))
        for one, track, angle in zip(series, estimate.tracks, angles, strict=True)
    ]
    found = np.concatenate(steps)
    if len(found) < FEWEST_PAIRS:
        raise InputError(
            f"the recording has {len(found)} pairs of steps away from the wall, and {FEWEST_PAIRS} "
            "at least are needed"
        )
    return found


def _in_frames(flow: xr.Dataset, series: Series, point: Point, spline: Spline) -> xr.Dataset:
    """Return a flow with the strength and the modes that a fit has found; a steady one as it is."""
    found = flow_frames(series, point)
    if found is None:
        return flow
    water = np.stack([flow["u"].values, flow["v"].values])
    total = found.strength[0][:, None, None, None] * water
    if point.layers > 1:
        x, y = flow["x"].values, flow["y"].values
        for strength, layer in zip(found.strength[1:], point.coefficients[1:], strict=True):
            total += strength[:, None, None, None] * spline.values(layer, x, y)
    frames = {name: (("time", "y", "x"), total[:, k]) for k, name in enumerate(("u", "v"))}
    moving = flow[["u", "v", "flag"]].assign(frames).assign_coords(time=found.time)
    return moving.assign_attrs(repeat=found.repeat)


def replicates_at_estimate(
    fit: xr.Dataset, estimate: Estimate, series: Sequence[Replicated], *, count: int, seed: int
) -> Replicates:
    """Simulate the recordings with what the fit found."""
    drag, force = fitted_value(fit, "drag_coefficient"), fitted_value(fit, "force_std")
    point, parts = estimate.point, []
    for index, (one, filtered) in enumerate(zip(series, estimate.passes.series, strict=True)):
        keys = _keys(seed, CheckStream.ESTIMATE, index, one, count)
        own_force = force * _force_factor(point, filtered)
        parts.append(_simulated(one, keys, drag, own_force, point))
    return _joined(parts)


def posterior_replicates(
    fit: xr.Dataset,
    estimate: Estimate,
    series: Sequence[Replicated],
    spread: Floats,
    *,
    count: int,
    seed: int,
    with_path: bool = False,
) -> Replicates:
    """Simulate the recordings with flow and parameters drawn from what the fit leaves open.

    The replicates have their steps, or their paths.
    """
    points, factors = _posterior_samples(fit, estimate, spread, count, seed)
    drag = fitted_value(fit, "drag_coefficient") * factors[:, 0]
    force = fitted_value(fit, "force_std") * factors[:, 1]
    spline = estimate.passes.spline

    def of_series(index: int) -> list[_Replicate]:
        one, filtered = series[index], estimate.passes.series[index]
        keys = _keys(seed, CheckStream.DRAWN, index, one, count)
        like, begin = one.problem.like, float(filtered.time[0]) if with_path else None

        def simulated(k: int) -> _Replicate:
            assert like.flow is not None
            point = points[k].in_flow(filtered.flow)
            u, v = spline.values(
                point.mean_coefficients, like.flow["x"].values, like.flow["y"].values
            )
            mean = like.flow.assign(u=(("y", "x"), u), v=(("y", "x"), v))
            noise = like.camera.position_noise * float(factors[k, 2])
            camera = replace(like.camera, position_noise=noise)
            flow = _in_frames(mean, filtered, point, spline)
            own = replace(like, flow=flow, camera=camera, threads=1)
            drawn = replace(one, problem=replace(one.problem, like=own))
            own_force = float(force[k]) * _force_factor(points[k], filtered)
            (world,) = _simulated(drawn, keys[k : k + 1], float(drag[k]), own_force, point, begin)
            return world

        return map_in_threads(simulated, range(count), like.threads)

    return _joined([of_series(index) for index in range(len(series))])


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
    changing = [one for one in (*STRENGTHS, *PULSES, *INTENSITIES) if one in names]
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


def _force_factor(point: Point, series: Series) -> float:
    """Return σ_F in the flow of a series over that in the first flow."""
    return math.exp(0.5 * point.intensity_contrasts.get(series.flow, 0.0))


class _Replicate(NamedTuple):
    steps: Floats
    path: Path | None
    sound: bool


def _keys(seed: int, kind: int, index: int, one: Replicated, count: int) -> Keys:
    """Return the keys of a series' sections, (replicates, sections)."""
    number = np.arange(count * one.first.size)
    return world_keys(seed, trial=2 * index + kind, replicate=number).reshape(count, -1)


def _simulated(
    one: Replicated,
    keys: Keys,
    drag: float,
    force: float,
    point: Point,
    begin: float | None = None,
) -> list[_Replicate]:
    """Return replicates of a series with their steps, or with paths that begin at a time [s]."""
    time = one.problem.like.sample_time
    poses, sound = _poses(one, keys, drag, force)
    # Without the last sample of a section no velocity is taken across a restart.
    shown = np.delete(np.arange(time.size), np.append(one.first[1:] - 1, time.size - 1))
    replicates = []
    for k, key in enumerate(keys[:, 0]):
        x, y, theta = poses[:, k].astype(np.float64)
        x, y = _as_seen(x, y, theta, time=time, point=point, key=int(key))
        if begin is None:
            steps = one.steps(x, y, theta)
            replicates.append(_Replicate(steps, None, bool(sound[k] and len(steps) > 0)))
        else:
            path = begin + time[shown], x[shown].astype(np.float32), y[shown].astype(np.float32)
            replicates.append(_Replicate(np.zeros((0, 2)), path, bool(sound[k])))
    return replicates


def _poses(
    one: Replicated, keys: Keys, drag: float, force: float
) -> tuple[npt.NDArray[np.float32], Bools]:
    """Return x, y [m] and theta [rad], (3, replicates, samples), and which replicates are sound."""
    like, count, done = one.problem.like, len(keys), 0
    assert like.flow is not None
    poses = np.empty((3, count, like.sample_time.size), dtype=np.float32)
    sound = np.ones(count, dtype=bool)
    for some in one.sections:
        each = some.begin.size
        own = replace(
            like,
            sample_time=some.time,
            start=some.starts(count, int(keys[0, done])),
            flow_start=np.tile(some.begin, count) if "time" in like.flow.dims else None,
        )
        values = {
            "drag_coefficient": np.full(count * each, drag),
            "force_std": np.full(count * each, force),
        }
        found = one.problem.model.simulate(values, own, keys[:, done : done + each].ravel())
        for axis, pose in zip(poses, (found.x, found.y, found.theta), strict=True):
            axis[:, some.sample] = pose.reshape(count, each, -1)[:, some.section, some.place]
        sound &= (found.status == 0).reshape(count, each).all(axis=1)
        done += each
    return poses, sound


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


def _joined(parts: Sequence[Sequence[_Replicate]]) -> Replicates:
    """Put the recordings of each replicate together."""
    whole = list(zip(*parts, strict=True))
    retained = [one for one in whole if all(world.sound for world in one)]
    return Replicates(
        [
            one[0].steps if len(one) == 1 else np.concatenate([world.steps for world in one])
            for one in retained
        ],
        [[world.path for world in one if world.path is not None] for one in retained],
        len(whole) - len(retained),
    )
