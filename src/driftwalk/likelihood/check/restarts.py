"""Restarts of simulated recordings: from time to time they begin again where the recording is.

A simulated block that runs freely for ten minutes leaves the part of the tank that the recording
has seen. The flow that the fit continues there may hold it for good, and its steps then say nothing
about the model. From the recorded pose a block cannot stray far, and replicates differ less from
each other, so a misfit of the model is found sooner. They begin at the filter's state, drawn with
its covariance: under the right model they go on as the recording does. Started from a parabola
through 1.4 s, bodies that float on small orbits went 14 % too fast.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from driftwalk.comparison import StepPlan
from driftwalk.conditions import recorded_start
from driftwalk.core.arrays import Floats, Integers
from driftwalk.likelihood.filter.series import FILTER
from driftwalk.likelihood.preparation import Estimate
from driftwalk.schema import Track
from driftwalk.simulation.initial import Start


class RestartPolicy(NamedTuple):
    """How often replicates begin again."""

    steps_s: float = 10.0
    """Time between two restarts where steps are compared, a few times as long as a block remembers
    its velocity. The smallest KS distance that is found nine times in ten falls from a median of
    0.4 without restarts to 0.11 (14 fits of the development set of studies/verdict)."""
    change_s: float = 100.0
    """The same where velocities at different times are compared, which have to be the replicate's
    own: a fit of a flow that is reversed half way has so little drag that in ten seconds a block
    hardly forgets the recorded velocity; chosen by hand."""
    most_velocity_std_m_s: float = 0.05
    """Standard deviation of a velocity component, that of a face by the turning too, from which on
    the filter's velocity is not used. The filter assumes 0.1 m/s at its first sample and after a
    gap or a contact; two samples later a few mm/s are left; chosen by hand."""
    on_grid: float = 0.05
    """Share of the usual interval by which time stamps may be off a regular grid, on which all
    sections are simulated together; by convention as for steps (`STEP_PLAN`)."""
    most_irregular: int = 20
    """Sections of a recording without such a grid, each of which is simulated alone. Chosen by
    hand."""


RESTART: Final = RestartPolicy()


class States(NamedTuple):
    """Pose and motion of a body at some samples, as the filter of the fit knows them."""

    mean: Floats
    """x, y [m], theta [rad], and their rates, (samples, 6); NaN where the filter has none."""
    covariance: Floats
    """(samples, 6, 6)."""

    def at(self, samples: Integers) -> States:
        """Return the states at some of the samples."""
        return States(self.mean[samples], self.covariance[samples])


@dataclass(frozen=True, eq=False)
class Sections:
    """Sections of a recording that are simulated together, on one grid of times."""

    time: Floats
    """Times from the begin of a section [s], the first is 0."""
    begin: Floats
    """When each section begins, after the recording's first sample [s]."""
    start: Start
    """Mean pose and motion at the first sample of each."""
    sample: Integers
    """Samples of the recording that lie in the sections."""
    section: Integers
    """Section of each sample."""
    place: Integers
    """Place of each sample on the grid."""
    root: Floats
    """Square roots of the covariances of the starts, (sections, 6, 6)."""

    def starts(self, count: int, key: int) -> Start:
        """Return starts of `count` replicates, drawn from what is known of the recorded motion."""
        # The camera's errors come from the key alone.
        normal = np.random.default_rng([key, 1]).normal(size=(count, *self.root.shape[:2]))
        found = np.column_stack(self.start) + np.einsum("sab,csb->csa", self.root, normal)
        return Start(*found.reshape(-1, 6).T)


def further_apart(estimate: Estimate) -> Estimate:
    """Return the estimate with the frames of a fast camera some 0.1 s apart.

    Between its frames a block moves by less than the camera is noisy: steps would compare noise.
    """
    tracks, series = list(estimate.tracks), list(estimate.passes.series)
    for k, (track, one) in enumerate(zip(tracks, series, strict=True)):
        if one.pooled > 1:
            kept = frames_of(track.time, one.pooled)
            tracks[k], series[k] = Track(*(axis[kept] for axis in track)), one.at(kept)
    return replace(estimate, tracks=tracks, passes=replace(estimate.passes, series=series))


def frames_of(time: Floats, every: int) -> Integers:
    """Return the samples of one frame in `every`; where that frame is missing there is none."""
    frame = _frames(time)
    kept = np.flatnonzero(frame % every == 0)
    return kept[np.diff(frame[kept], prepend=-1) > 0]


def first_samples(track: Track, every: float) -> Integers:
    """Return the samples at which replicates begin again: every `every` seconds, and after gaps."""
    time = track.time
    if not _intervals(time)[1]:
        every = max(every, float(time[-1] - time[0]) / RESTART.most_irregular)
    found: list[int] = []
    gaps = np.flatnonzero(np.diff(time) > FILTER.longest_gap_s) + 1
    for run in np.split(np.arange(time.size), gaps):
        lasts = float(time[run[-1]] - time[run[0]])
        count = max(1, round(lasts / every))
        # A quarter of the usual interval earlier, so that rounding moves no border.
        borders = time[run[0]] + lasts / count * np.arange(count) - 0.25 * _interval(time)
        found += (run[0] + np.searchsorted(time[run], borders)).tolist()
    return np.array(found)


def sections_of(track: Track, first: Integers, states: States, *, window: float) -> list[Sections]:
    """Return the sections of a track, which begin where the filter's states are.

    Where the filter knows no velocity a parabola through the samples of two windows [s] is used.
    """
    time = track.time - track.time[0]
    ends = np.append(first[1:], time.size)
    section = np.repeat(np.arange(first.size), ends - first)
    starts, root = _starts(track, first, ends, states.at(first), window=window)
    if not _intervals(time)[1]:
        return [
            Sections(
                time[begin:end] - time[begin],
                time[[begin]],
                Start(*(np.asarray(axis)[[k]] for axis in starts)),
                np.arange(begin, end),
                np.zeros(end - begin, dtype=np.int64),
                np.arange(end - begin),
                root[[k]],
            )
            for k, (begin, end) in enumerate(zip(first, ends, strict=True))
        ]
    passed = _frames(time)
    place = passed - passed[first][section]
    grid = _interval(time) * np.arange(place.max() + 1)
    return [Sections(grid, time[first], starts, np.arange(time.size), section, place, root)]


def _interval(time: Floats) -> float:
    """Return the usual interval [s]: a mean, for the median of rounded stamps drifts."""
    intervals = np.diff(time)
    return float(intervals[intervals < 1.5 * np.median(intervals)].mean())


def _frames(time: Floats) -> Integers:
    """Return how many usual intervals have passed at each sample."""
    return np.concatenate([[0], np.cumsum(np.rint(_intervals(time)[0]).astype(np.int64))])


def _intervals(time: Floats) -> tuple[Floats, bool]:
    """Return all intervals over the usual one, and whether they are whole within each section."""
    found = np.diff(time) / _interval(time)
    short = np.diff(time) <= FILTER.longest_gap_s
    off = np.abs(found - np.rint(found))[short]
    return found, bool((off < RESTART.on_grid).all())


def _starts(
    track: Track, first: Integers, ends: Integers, states: States, *, window: float
) -> tuple[Start, Floats]:
    """Return pose and motion at the first sample of each section, and roots of covariances."""
    sure = np.isfinite(states.mean[:, 3])
    mean = states.mean.copy()
    for k in np.flatnonzero(~sure):
        part = Track(*(axis[first[k] : ends[k]] for axis in track))
        mean[k] = np.array(recorded_start(part, window=window))
    values, vectors = np.linalg.eigh(np.where(sure[:, None, None], states.covariance, 0.0))
    root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    return Start(*mean.T), root


def within_sections(plan: StepPlan, first: Integers) -> StepPlan:
    """Return the plan of the steps that do not go across a restart."""
    last = plan.triple + 2
    ends = (plan.left[plan.triple], plan.left[last] + (plan.weight[last] > 0))
    before, after = (np.searchsorted(first, end, side="right") for end in ends)
    retained = before == after
    return replace(plan, triple=plan.triple[retained], time=plan.time[retained])
