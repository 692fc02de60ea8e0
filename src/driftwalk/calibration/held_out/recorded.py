"""A recording as motion models are compared on it: blocks of time, aspects, scales and checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.evolution import wall_distance
from driftwalk.calibration.held_out.wall_clearance import Clearance, estimate_clearance
from driftwalk.calibration.problem import require_samples
from driftwalk.comparison import KsReference
from driftwalk.comparison.aspects import (
    ASPECT_POLICY,
    Aspect,
    AspectPlan,
    AspectReference,
    WallDistance,
    aspect_reference,
    block_of,
    form_aspects,
    interleaved,
    own_distance,
    plan_aspects,
    points_distance,
    resampled,
)
from driftwalk.conditions import (
    Conditions,
    neighbours_of,
    possible_noises,
    recorded_camera,
    recorded_conditions,
    require_travel,
    sound_track,
)
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.schema import Parameter, Track

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


LAGS: Final = (1, 3, 10, 30, 100)
"""Of the mean squared displacement, in step intervals; chosen by hand."""
CHECKS: Final = (*(f"displacement_{lag}" for lag in LAGS), "speed_time", "wall_share", "rest_share")
UNITS: Final = (*("m2" for _ in LAGS), "s", "1", "1")


def short_steps(
    plan: AspectPlan, x: npt.ArrayLike, y: npt.ArrayLike
) -> tuple[Floats, Floats, Bools]:
    """Return positions [m] after each short step, and which of the steps between them are there."""
    px, py = resampled(plan.short, x), resampled(plan.short, y)
    there = np.zeros(px.size - 1, dtype=bool)
    there[plan.step] = True
    return px, py, there & np.isfinite(np.diff(px)) & np.isfinite(np.diff(py))


def motion_checks(
    plan: AspectPlan,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    wall: WallDistance,
    depth: float,
    usual_step: float,
) -> Floats:
    """Return facts of a motion, shape (checks,); NaN where it is too short for one."""
    px, py, there = short_steps(plan, x, y)
    broken = np.concatenate([[0], np.cumsum(~there)])
    length = np.hypot(np.diff(px), np.diff(py))
    found = [_squared_displacement(px, py, broken, lag) for lag in LAGS]
    found.append(_memory(length, there) * plan.short.step_interval)
    steps = length[there]
    if not steps.size:
        return np.full(len(CHECKS), np.nan)
    near = wall(px, py)[:-1][there] < 0.2 * depth
    found += [float(near.mean()), float((steps < 0.2 * usual_step).mean())]
    return np.array(found)


def _squared_displacement(x: Floats, y: Floats, broken: Integers, lag: int) -> float:
    """Return the mean over all stretches without a gap."""
    whole = broken[lag:] == broken[:-lag]
    if not whole.any():
        return float("nan")
    squares = (x[lag:] - x[:-lag]) ** 2 + (y[lag:] - y[:-lag]) ** 2
    return float(squares[whole].mean())


def _memory(length: Floats, there: Bools) -> float:
    """Return after how many intervals the autocorrelation of the step lengths falls below 1/e."""
    if np.count_nonzero(there) < LAGS[-1]:
        return float("nan")
    apart = np.where(there, length, 0.0)
    apart = np.where(there, apart - apart[there].mean(), 0.0)
    variance = float((apart**2).sum()) / np.count_nonzero(there)
    # A speed that is the same all along differs by rounding alone.
    if variance <= (1e-9 * float(length[there].mean())) ** 2:
        return float("nan")
    before, longest = 1.0, 500
    for lag in range(1, min(longest, length.size // 4)):
        pairs = int(np.count_nonzero(there[lag:] & there[:-lag]))
        if not pairs:
            break
        now = float((apart[lag:] * apart[:-lag]).sum()) / pairs / variance
        if now < np.exp(-1.0):
            return float(lag - 1 + (before - np.exp(-1.0)) / (before - now))
        before = now
    return float(min(longest, length.size // 4))


@dataclass(frozen=True)
class Scales:
    """The scales of a recorded motion.

    Attributes
    ----------
    speed : float
        Mean speed over a step interval [m/s].
    fastest : float
        Its 99.9 % quantile [m/s].
    interval : float
        Step interval [s].
    duration : float
        From the first to the last sample [s].
    size : float
        Half the longer side of what the recording covers [m].
    """

    speed: float
    fastest: float
    interval: float
    duration: float
    size: float


def scales_of(track: Track, *, step_interval: float, steps: Floats) -> Scales:
    """Return the scales of a track with these step lengths [m].

    Raises
    ------
    InputError
        When the track does not move.

    Examples
    --------
    >>> time = np.arange(100) / 10.0
    >>> track = Track(time, 0.02 * time, 0 * time, 0 * time)
    >>> round(scales_of(track, step_interval=0.1, steps=np.full(99, 0.002)).speed, 6)
    0.02
    """
    speed = float(np.mean(steps)) / step_interval
    if not speed > 0.0:
        raise InputError("the recording does not move: no step has a length")
    size = 0.5 * max(float(np.ptp(track.x)), float(np.ptp(track.y)))
    return Scales(
        speed=speed,
        fastest=float(np.quantile(steps, 0.999)) / step_interval,
        interval=step_interval,
        duration=float(track.time[-1] - track.time[0]),
        size=size,
    )


def recorded_ranges(parameters: Sequence[Parameter], scales: Scales) -> tuple[Parameter, ...]:
    """Return the parameters with ranges that a recording of these scales can tell apart.

    Speeds lie about the recorded one, times between half a step interval and a tenth of the
    recording, rates below a turn per step, lengths below the size of what was covered. A body that
    does not turn at the wall turns by less than a radian in a tenth of the recording. A range is
    the part of the parameter's own that lies there; where they do not meet, its own stays.

    Examples
    --------
    >>> speed = Parameter("speed", "m/s", 1e-6, 10.0, scale="log")
    >>> scales = Scales(speed=0.1, fastest=0.5, interval=0.1, duration=600.0, size=0.2)
    >>> found = recorded_ranges([speed], scales)[0]
    >>> round(found.low, 6), found.high
    (0.005, 1.0)
    """
    return tuple(_ranged(one, scales) for one in parameters)


def _ranged(parameter: Parameter, scales: Scales) -> Parameter:
    per_step = 1.0 / scales.interval
    usual = {
        "m/s": (0.05 * scales.speed, max(2.0 * scales.fastest, 2.0 * scales.speed)),
        "s": (0.5 * scales.interval, 0.1 * scales.duration),
        "rad2/s": (1e-3 * per_step, 3.0 * per_step),
        "rad/s": (min(10.0 / scales.duration, 0.02 * per_step), 5.0 * per_step),
        "m": (0.01 * scales.size, scales.size),
        "m2/s": (1e-4 * scales.speed**2 * scales.interval, scales.speed**2 * scales.interval),
        "Hz": (0.02 * per_step, 2.0 * per_step),
    }
    if parameter.unit not in usual:
        return parameter
    low, high = usual[parameter.unit]
    if parameter.low < 0.0:
        low = -high if parameter.unit != "rad/s" else -0.3 * per_step
        high = -low
    low, high = max(low, parameter.low), min(high, parameter.high)
    return replace(parameter, low=low, high=high, step=0.0) if low < high else parameter


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """A recording, cut into 20 blocks of time, ready for any motion model.

    Attributes
    ----------
    track : Track
        The present samples, time from 0 on.
    like : Conditions
        Its conditions, for simulations.
    own_plan : AspectPlan
        How the track shows its aspects.
    plan : AspectPlan
        How a simulated world shows its aspects.
    aspects : tuple of Aspect
        Of the whole recording.
    fitted, held : AspectReference
        Of the even blocks, on which models are searched, and of the odd ones, on which they are
        judged.
    held_aspects : list of Aspect
        Points of the odd blocks.
    own : ndarray, shape (aspects,)
        Distance between parts of the recording that are made of interleaved blocks: no model can
        be expected below it.
    scales : Scales
        Of the motion.
    clearance : Clearance
        Distance from the wall at contact, as the recording shows it.
    depth : float
        Largest recorded distance from the wall [m].
    usual_step : float
        Median step [m].
    noises : tuple of float
        Noises of positions that the camera may have, each as likely [m]; one where it is stated.
    study : Study
        Tank, camera, step interval, seed and search.
    attrs : mapping
        Attributes of each dataset of scores on this recording.
    warnings : list of str
        Outliers that were left out, and jumps of the body.
    """

    track: Track
    like: Conditions
    own_plan: AspectPlan
    plan: AspectPlan
    aspects: tuple[Aspect, ...]
    fitted: AspectReference
    held: AspectReference
    held_aspects: list[Aspect]
    own: Floats
    scales: Scales
    clearance: Clearance
    depth: float
    usual_step: float
    noises: tuple[float, ...]
    study: Study
    attrs: Mapping[str, Any]
    warnings: list[str]

    @cached_property
    def without_each_block(self) -> tuple[AspectReference, ...]:
        """The odd blocks without each of them, over the same floors."""
        found = []
        for block in range(1, ASPECT_POLICY.blocks, 2):
            natives = []
            for one in self.held_aspects:
                left = one.within(block_of(one.time, self.duration) != block).points
                # After long gaps one block may have all the points.
                natives.append(KsReference(left if len(left) else one.points))
            found.append(AspectReference(self.held.names, self.held.floor, tuple(natives)))
        return tuple(found)

    @cached_property
    def clearance_distance(self) -> float:
        """Largest KS distance of the place near the wall that an error of the clearance makes.

        That of the odd blocks from themselves, moved by two standard errors.
        """
        wall = next((one.points for one in self.held_aspects if one.name == "wall"), None)
        if wall is None:
            return 0.0
        reference = KsReference(wall)
        moved = (wall + np.array([sign * 2.0 * self.clearance.std, 0.0]) for sign in (-1, 1))
        return max(points_distance(reference, np.ascontiguousarray(one)) for one in moved)

    @cached_property
    def recorded_checks(self) -> Floats:
        """Facts of the recording that are not fitted, see `motion_checks`."""
        return self._checks(self.own_plan, self.track.x, self.track.y)

    def checks(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Floats:
        """Return the facts of a simulated world, see `motion_checks`."""
        return self._checks(self.plan, x, y)

    def _checks(self, plan: AspectPlan, x: npt.ArrayLike, y: npt.ArrayLike) -> Floats:
        wall = wall_distance(self.like)
        return motion_checks(plan, x, y, wall=wall, depth=self.depth, usual_step=self.usual_step)

    @cached_property
    def usual_distance(self) -> float:
        """Median distance from the nearest of the other bodies [m]; NaN where there are none."""
        others = self.like.neighbours
        if others is None:
            return float("nan")
        x, y = np.moveaxis(others.at(self.track.time), 2, 0)
        apart = np.hypot(x - self.track.x[:, None], y - self.track.y[:, None])
        nearest = np.where(np.isfinite(apart), apart, np.inf).min(axis=1)
        return float(np.median(nearest))

    @property
    def steps(self) -> Aspect:
        """Step lengths [m] and turning angles [rad] of the whole recording."""
        return next(one for one in self.aspects if one.name == "steps")

    @property
    def seed(self) -> int:
        """Seed of all searches."""
        return self.study.calibration.seed

    @property
    def replicates(self) -> int:
        """Simulated recordings that judge a discrepancy; below 2 the summaries are left out."""
        search = self.study.calibration
        return search.bootstrap if search.refine == "auto" else 0

    @property
    def duration(self) -> float:
        """From the first to the last sample [s]."""
        return float(self.track.time[-1])


def body_motion(
    recording: xr.Dataset,
    study: Study,
    *,
    flow: xr.Dataset | None,
    body: str | None,
    threads: int | None = None,
) -> RecordedMotion:
    """Prepare a body of a recording for the comparison of motion models."""
    track, warnings = sound_track(recording, body)
    require_samples(track)
    require_travel(track, study, of_block=False)
    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    neighbours = neighbours_of(recording, body, study.tank)
    if neighbours is not None:
        neighbours = neighbours.since(float(track.time[0]))
    track = track._replace(time=track.time - track.time[0])
    camera = recorded_camera(track, study, position_quantum=quantum)
    noises = possible_noises(track, study, camera)
    if not min(noises) <= camera.position_noise <= max(noises):
        # An estimate of zero: bodies that rest would rest to the last digit.
        camera = replace(camera, position_noise=float(np.median(noises)))
    like = recorded_conditions(
        track, study, camera=camera, flow=flow, neighbours=neighbours, threads=threads
    )
    interval = study.steps.step_interval_s
    plan = plan_aspects(track.time, step_interval=None if interval == "auto" else interval)
    wall = wall_distance(like)
    aspects = form_aspects(plan, track.x, track.y, wall=wall)
    by_name = {one.name: one.points for one in aspects}
    if not len(by_name["steps"]):
        raise InputError("the recording does not move: no step has a length")
    steps, from_wall = by_name["steps"][:, 0], by_name["wall"][:, 0]
    depth, usual_step = float(from_wall.max()), float(np.median(steps))
    duration = float(track.time[-1])
    even, odd = interleaved(aspects, duration=duration)
    # What one part hardly shows cannot be judged on it.
    shown = [
        min(len(one.points), len(other.points)) >= ASPECT_POLICY.fewest_points
        for one, other in zip(even, odd, strict=True)
    ]
    even, odd = (list(compress(part, shown)) for part in (even, odd))
    if not even or even[0].name != "steps":
        raise InputError(
            "one half of the recording's blocks of time has fewer than "
            f"{ASPECT_POLICY.fewest_points} steps with a direction: it is too short, or too much "
            "at rest, for the step interval (`step_interval`)"
        )
    fitted, held = (aspect_reference(part, duration=duration) for part in (even, odd))
    return RecordedMotion(
        track=track,
        like=like,
        own_plan=plan,
        plan=plan_aspects(like.sample_time, step_interval=plan.short.step_interval),
        aspects=aspects,
        fitted=fitted,
        held=held,
        held_aspects=odd,
        own=np.array(
            [own_distance(one, duration=duration) for one in aspects if one.name in held.names]
        ),
        scales=scales_of(track, step_interval=plan.short.step_interval, steps=steps),
        clearance=estimate_clearance(wall(track.x, track.y), camera.position_noise),
        depth=depth,
        usual_step=usual_step,
        noises=noises,
        study=study,
        attrs={
            "step_interval_s": float(plan.short.step_interval),
            "duration_s": duration,
            "seed": study.calibration.seed,
            "arena": study.tank.to_arena_json(),
            "source": str(recording.attrs.get("source", "")),
            "simulated_recording": str(recording.attrs.get("simulated", "no")),
        },
        warnings=warnings,
    )
