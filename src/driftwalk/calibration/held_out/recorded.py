"""A recording as motion models are compared on it: its blocks of time, aspects and scales."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.evolution import Scales, scales_of, wall_distance
from driftwalk.calibration.held_out.checks import motion_checks
from driftwalk.calibration.refuse import require_samples
from driftwalk.comparison import KsReference
from driftwalk.comparison.aspects import (
    BLOCKS,
    FEWEST_POINTS,
    Aspect,
    AspectPlan,
    AspectReference,
    aspect_reference,
    block_of,
    form_aspects,
    interleaved,
    own_distance,
    plan_aspects,
)
from driftwalk.conditions import (
    Conditions,
    Neighbours,
    neighbours_of,
    possible_noises,
    recorded_camera,
    recorded_conditions,
    require_travel,
)
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.schema import Track, body_track

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


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
    clearance : float
        Distance from the wall at contact [m].
    depth : float
        Largest recorded distance from the wall [m].
    usual_step : float
        Median step [m].
    noises : tuple of float
        Noises of positions that the camera may have, each as likely [m]; one where it is stated.
    recorded_checks : ndarray, shape (checks,)
        Facts of the recording that are not fitted, see `motion_checks`.
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
    clearance: float
    depth: float
    usual_step: float
    noises: tuple[float, ...]
    recorded_checks: Floats

    @cached_property
    def without_each_block(self) -> tuple[AspectReference, ...]:
        """The odd blocks without each of them, over the same floors."""
        found = []
        for block in range(1, BLOCKS, 2):
            left = [
                one.within(block_of(one.time, self.duration) != block).points
                for one in self.held_aspects
            ]
            # After long gaps one block may have all the points.
            natives = tuple(
                KsReference(points if len(points) else one.points)
                for points, one in zip(left, self.held_aspects, strict=True)
            )
            found.append(AspectReference(self.held.names, self.held.floor, natives))
        return tuple(found)

    def checks(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Floats:
        """Return the facts of a simulated world, see `motion_checks`."""
        return motion_checks(
            self.plan,
            x,
            y,
            wall=wall_distance(self.like),
            depth=self.depth,
            usual_step=self.usual_step,
        )

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
    """Prepare a body of a recording for motion models; see `recorded_motion`."""
    track = body_track(recording, body)
    require_samples(track)
    require_travel(track, study, of_block=False)
    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    return recorded_motion(
        track,
        study,
        position_quantum=quantum,
        flow=flow,
        neighbours=neighbours_of(recording, body, study.tank),
        threads=threads,
    )


def recorded_motion(
    track: Track,
    study: Study,
    *,
    position_quantum: float = 0.0,
    flow: xr.Dataset | None = None,
    neighbours: Neighbours | None = None,
    threads: int | None = None,
) -> RecordedMotion:
    """Prepare a recorded track for the comparison of motion models."""
    if neighbours is not None:
        neighbours = neighbours.since(float(track.time[0]))
    track = track._replace(time=track.time - track.time[0])
    camera = recorded_camera(track, study, position_quantum=position_quantum)
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
    shown = [min(len(one.points), len(other.points)) for one, other in zip(even, odd, strict=True)]
    even, odd = (
        [one for one, points in zip(part, shown, strict=True) if points >= FEWEST_POINTS]
        for part in (even, odd)
    )
    if not even or even[0].name != "steps":
        raise InputError(
            f"one half of the recording's blocks of time has fewer than {FEWEST_POINTS} steps with "
            "a direction: it is too short, or too much at rest, for the step interval "
            "(`step_interval`)"
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
        # Not the least: a few of the nearest samples may be tracking errors.
        clearance=max(float(np.quantile(from_wall, 0.01)), 0.0),
        depth=depth,
        usual_step=usual_step,
        noises=noises,
        recorded_checks=motion_checks(
            plan, track.x, track.y, wall=wall, depth=depth, usual_step=usual_step
        ),
    )
