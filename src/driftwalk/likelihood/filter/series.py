"""Tracks as the filter takes them: angles smoothed, contacts with the wall left out.

The rule for contacts looks at the past only. To leave out an interval because of where the body is
at its end would select among the forces that brought it there, and bias what is estimated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Bools, Floats, remembered
from driftwalk.flow.arena import Outline, outline_of
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.law.candidate_laws import STRENGTHS

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.model.block import Block
    from driftwalk.schema import Track


class FilterPolicy(NamedTuple):
    """How the filter goes over a track."""

    largest_step_s: float = 0.05
    """Longest step of the filter's integrator [s]. Chosen by hand."""
    longest_gap_s: float = 1.0
    """Longest gap that is predicted over [s]; the filter restarts after a longer one. Chosen by
    hand."""
    least_stretch_s: float = 4.0
    """Mean length of the stretches between gaps below which C_d is not settled [s]. In 14
    recordings of studies/verdict (held-out set), cut into stretches of 4.2 s, C_d is 0.1 % off in
    the median, and all 90 % intervals hold it; cut into 2.1 s, 12 of 14 do."""
    least_free_s: float = 1.5
    """Mean time between contacts with the wall below which C_d is not settled [s]. Where it was
    shorter, C_d was 2 to 24 times too large in three of eleven recordings of studies/verdict
    (held-out set); at 1.9 s and more it was right. The speed after a contact is taken from two
    positions, whose noise seems to be drag. Measured before a velocity was expected there."""
    prior_reach: float = 0.5
    """Sides of the block around the place where a stretch begins within which the other stretches
    give the velocity that is expected there. Chosen by hand."""
    prior_span_s: float = 0.4
    """Time over which their velocities are taken [s]. Chosen by hand: of 0.3 mm of noise at 10 Hz,
    1 mm/s is left."""
    least_prior_stretches: int = 3
    """Fewer give no velocity. Chosen by hand."""
    prior_contacts: int = 8
    """Nearest other contacts that give the velocity behind a contact. Chosen by hand."""
    least_prior_contacts: int = 30
    """Contacts with a flight behind them below which they say too little of its velocity. Chosen by
    hand: with 9 flights of a real termite the fit found no solution; of ten held-out recordings of
    studies/verdict at the wall nine have 50 and more."""
    largest_prior_std: float = 0.1
    """Standard deviation of a velocity above which nothing is expected [m/s]: as much as a velocity
    may be where nothing is known of it (`unknown_speed` of the filter); chosen by hand."""
    settling_samples: int = 3
    """Samples left out after a missing frame when other explanations of an error are tried: in
    these a wrong place counts in the filter's velocity. Chosen by hand."""
    pooled_s: float = 0.1
    """Derivatives of samples within this time [s] hardly differ: their products are made of their
    mean. Measured at 100 Hz: docs/explanation/likelihood.md."""


FILTER: Final = FilterPolicy()


@dataclass(frozen=True, eq=False)
class Series:
    """One track as the filter takes it, shapes (n,)."""

    time: Floats
    x: Floats
    y: Floats
    theta: Floats
    omega: Floats
    excluded: npt.NDArray[np.uint8]
    """Samples that end an interval which is left out."""
    flow: int = 0
    """Number of the flow that the water has meanwhile."""
    recording: int = 0
    """Number of the recording, which may be cut into several series."""
    near_wall: int = 0
    """Intervals that are left out because the block may touch the wall."""
    angle: Floats = field(default_factory=lambda: np.zeros(0))
    """The angle, with holes filled in; zeros where there is none."""
    span: float = 0.0
    """Time of the recording's last sample, counted from its first [s]."""
    first: float = 0.0
    """Time of the recording's first sample [s]."""
    velocity_prior: Floats | None = None
    """Mean and standard deviation of velocity and spin where a passage begins, behind a gap or a
    contact, for each of its samples, shape (n, 6) [m/s, rad/s], NaN where unknown; None where
    there are none."""

    @property
    def gaps(self) -> Bools:
        """Which intervals are gaps, over which nothing is predicted, shape (n - 1,)."""
        return np.diff(self.time) > FILTER.longest_gap_s

    @property
    def begins(self) -> Bools:
        """At which samples the velocity is not known: after a gap or a contact, shape (n,)."""
        return np.asarray(np.concatenate([[True], self.gaps]) | (self.excluded != 0))

    @property
    def pooled(self) -> int:
        """Samples within `FILTER.pooled_s`; 1 unless the camera is fast."""
        return max(self._within(FILTER.pooled_s), 1)

    def _within(self, interval: float) -> int:
        """Return the usual number of samples in an interval [s]; 0 in none."""
        if self.time.size < 2:
            return 0
        return round(interval / max(float(np.median(np.diff(self.time))), 1e-9))

    def part(self, first: int, end: int) -> Series:
        """Return the samples from a first one on, before an end."""
        kept = slice(first, end)
        return replace(self, **self._columns(kept), excluded=self.excluded[kept])

    def thinned(self, interval: float) -> Series:
        """Return samples about an interval [s] apart; the series where they are no nearer."""
        every = self._within(interval)
        return self if every < 2 else self.at(np.arange(0, self.time.size, every))

    def at(self, kept: npt.NDArray[np.intp]) -> Series:
        """Return the samples of these numbers, which increase."""
        # An interval is left out where one of those that it holds is.
        firsts = np.append(0, kept[:-1] + 1)
        excluded = np.maximum.reduceat(self.excluded, firsts)
        return replace(self, **self._columns(kept), excluded=excluded)

    def _columns(self, kept: slice | npt.NDArray[np.intp]) -> dict[str, Any]:
        """Return some samples of all columns but `excluded`."""
        names = ("time", "x", "y", "theta", "omega", "angle", "velocity_prior")
        whole = {name: getattr(self, name) for name in names}
        return {name: values if values is None else values[kept] for name, values in whole.items()}


def corrected(series: Series, point: Point) -> tuple[Floats, Floats, Floats]:
    """Return the centre of mass and the angle of its faces, for what the camera says."""
    across, along = point.number("marker_x"), point.number("marker_y")
    offset = point.number("angle_offset")
    x, y, theta = series.x, series.y, series.theta
    if across or along:
        cosine, sine = np.cos(series.angle), np.sin(series.angle)
        x = x - (across * cosine - along * sine)
        y = y - (across * sine + along * cosine)
    if offset:
        theta = theta - offset
    return x, y, theta


def strength_of(series: Series, point: Point) -> Floats | None:
    """Return the strength of the flow at the samples; nothing where it is 1 all the time."""
    terms = {name: point.number(name) for name in ("strength_0", *STRENGTHS)}
    waves = point.number("pulse_cosine"), point.number("pulse_sine")
    if not any(terms.values()) and not any(waves):
        return None
    strength = np.ones_like(series.time)
    for name, term in terms.items():
        strength += term * slow_change(series, name)
    phase = 2.0 * np.pi * point.number("pulse_frequency") * series.time
    return np.asarray(strength + waves[0] * np.cos(phase) + waves[1] * np.sin(phase))


def layer_strengths(series: Series, point: Point) -> Floats | None:
    """Return the strength of each layer of the flow at the samples, (layers, n); None for 1."""
    strength = strength_of(series, point)
    if point.layers == 1:
        return None if strength is None else strength[np.newaxis]
    layers = np.concatenate([np.ones((1, series.time.size)), mode_amplitudes(series.time, point)])
    return layers if strength is None else strength * layers


def mode_amplitudes(time: Floats, point: Point) -> Floats:
    """Return the amplitude of each mode, of unit rms, shape (modes, n)."""
    if point.amplitudes is not None:
        return point.amplitudes.at(time)
    turned = 2.0 * np.pi * point.number("mode_frequency") * time + point.number("mode_phase")
    return math.sqrt(2.0) * np.stack([np.cos(turned), np.sin(turned)])[: point.layers - 1]


def slow_change(series: Series, name: str) -> Floats:
    """Return the shape of a slow change over the recording, at the samples."""
    span = max(series.span, 1e-300)
    if name == "strength_trend":
        return np.asarray(1.0 - 2.0 * series.time / span)
    number = int(name.removeprefix("strength_"))
    return np.asarray(np.cos(number * np.pi * series.time / span))


ORIENTED_SHARE: Final = 0.5
"""Share of the samples with an orientation from which on the fit uses orientations by default, and
the search for dropped frames does. Chosen by hand: the majority."""
WINDOW: Final = 5
"""Fewest samples of a parabola, the nearest in time, so that gaps and uneven clocks are no case;
chosen by hand."""
WINDOW_S: Final = 0.16
"""Time that a parabola covers [s]: five samples at 25 Hz. With five samples of a faster camera the
turning rate is mostly noise of the angle: measured, with the angle as an input C_d came out 7 % too
small at 50 Hz and 21 % at 100 Hz, in simulated recordings with 0.5 degrees of noise."""


PART: Final = 10_000
"""Samples at once."""


class Angle(NamedTuple):
    """Smoothed orientation at every sample of a track, shapes (n,)."""

    theta: Floats
    """Orientation [rad], unwrapped."""
    omega: Floats
    """Turning rate [rad/s]."""
    known: Bools
    """Where orientations are near enough in time to tell."""


@remembered
def smooth_angle(time: Floats, theta: Floats) -> Angle:
    """Fit a parabola to the orientations nearest in time to each sample, five or those in 0.16 s.

    Examples
    --------
    >>> time = np.arange(20) * 0.1
    >>> smooth_angle(time, np.angle(np.exp(2j * time))).omega.round(6)[[0, 10]]
    array([2., 2.])
    """
    seen = np.isfinite(theta)
    if np.count_nonzero(seen) < WINDOW:
        return Angle(np.zeros(time.size), np.zeros(time.size), np.zeros(time.size, dtype=bool))
    at, turned = time[seen], np.unwrap(theta[seen])
    half = int(0.5 * WINDOW_S / float(np.median(np.diff(at))) + 1e-9)
    size = min(max(2 * half + 1, WINDOW), at.size)
    first, reach = _windows(at, size)
    # In parts, because a window of many samples takes their number of times the memory.
    ends = range(0, at.size, PART)
    found = [_parabolas(at, turned, first, slice(one, one + PART), size) for one in ends]
    value, rate = np.concatenate(found, axis=1)
    near = reach <= FILTER.longest_gap_s
    known = np.zeros(time.size, dtype=bool)
    if near.any():
        known = _distance(time, at[near]) <= FILTER.longest_gap_s
        at, value, rate = at[near], value[near], rate[near]
    return Angle(np.interp(time, at, value), np.interp(time, at, rate), known)


def _windows(time: Floats, size: int) -> tuple[npt.NDArray[np.intp], Floats]:
    """Return for each sample the window of `size` that reaches least far from it, and how far."""
    index = np.arange(time.size)
    first, least = np.zeros(time.size, dtype=np.intp), np.full(time.size, np.inf)
    # The centred window comes first, so that it is taken among equals.
    for offset in sorted(range(1 - size, 1), key=lambda one: abs(2 * one + size - 1)):
        start = index + offset
        whole = (start >= 0) & (start <= time.size - size)
        inside = np.where(whole, start, 0)
        reach = np.maximum(time - time[inside], time[inside + size - 1] - time)
        # 1e-9: rounding of the clock is no reason to leave the middle.
        better = whole & (np.round(reach, 9) < least)
        first[better], least[better] = start[better], np.round(reach, 9)[better]
    return first, least


def _parabolas(
    time: Floats, values: Floats, first: npt.NDArray[np.intp], part: slice, size: int
) -> Floats:
    """Return value and slope at the samples of a part, of the parabola through their windows."""
    members = first[part, None] + np.arange(size)
    apart = time[members] - time[part, None]
    scale = np.abs(apart).max(axis=1)
    tau = apart / scale[:, None]
    terms = np.stack([np.ones_like(tau), tau, tau**2], axis=-1)
    rise = values[members] - values[part, None]
    normal = np.einsum("nwa,nwb->nab", terms, terms)
    moments = np.einsum("nwa,nw->na", terms, rise)
    found = np.linalg.solve(normal, moments[..., None])[..., 0]
    return np.stack([values[part] + found[:, 0], found[:, 1] / scale])


def _distance(time: Floats, others: Floats) -> Floats:
    """Return the time from each sample to the nearest of the others."""
    after = np.clip(np.searchsorted(others, time), 1, max(others.size - 1, 1))
    right = others[np.minimum(after, others.size - 1)]
    return np.minimum(np.abs(time - others[after - 1]), np.abs(right - time))


MARGIN = 0.002
"""A corner nearer to the wall than this [m] may touch it within a sampling interval. Chosen by
hand."""


def wall_intervals(
    time: Floats,
    x: Floats,
    y: Floats,
    theta: Floats | None,
    *,
    outline: Outline,
    block: Block,
    margin: float = MARGIN,
) -> Bools:
    """Return which intervals, by the sample at their end, may hold a contact with the wall, (n,).

    In the one from k - 1 to k a corner comes within the margin of the wall, 2 mm: at k - 1, or
    where the motion and the turning from k - 3 to k - 1 lead by k. Without orientations the circle
    around the block replaces its corners.
    """
    turned = None if theta is None else np.unwrap(theta)
    ahead_x, ahead_y = (_continued(time, axis) for axis in (x, y))
    ahead = None if turned is None else _continued(time, turned)
    now = None if turned is None else turned[:-1]
    reach = _reach(block)
    corners = None if block.shape == "square" else block.body().corners @ np.array([1.0, 1.0j])

    def touches(x: Floats, y: Floats, theta: Floats | None) -> Bools:
        """Return where the body's circle, or with an angle a corner, is in the margin."""
        close = np.asarray(outline.depth(x, y) < reach + margin)
        if theta is None:
            return close
        x, y, theta = x[close], y[close], theta[close]
        if corners is None:
            quarters = theta + math.pi * (0.25 + 0.5 * np.arange(4))[:, None]
            at = x + reach * np.cos(quarters), y + reach * np.sin(quarters)
        else:
            turned = corners[:, None] * np.exp(1j * theta)
            at = x + turned.real, y + turned.imag
        depths = [outline.depth(*corner) for corner in zip(*at, strict=True)]
        close[close] = np.min(depths, axis=0) < margin
        return close

    near = np.zeros(time.size, dtype=bool)
    near[1:] = touches(x[:-1], y[:-1], now) | touches(ahead_x, ahead_y, ahead)
    near[1:] &= np.isfinite(ahead_x)
    return near


def _continued(time: Floats, values: Floats) -> Floats:
    """Return where the change over the last two intervals leads in the next, shape (n - 1,)."""
    onward = np.zeros(time.size - 1)
    past = time[2:-1] - time[:-3]
    rate = (values[2:-1] - values[:-3]) / past
    onward[2:] = np.where(past <= FILTER.longest_gap_s, rate * (time[3:] - time[2:-1]), 0.0)
    return np.asarray(values[:-1] + np.where(np.diff(time) <= FILTER.longest_gap_s, onward, 0.0))


def series_of(
    tracks: Sequence[Track],
    study: Study,
    used_angle: str,
    places: Sequence[tuple[int, int]] | None = None,
) -> list[Series]:
    """Return the tracks as the filter takes them.

    `places` are the flow and the recording of each, by default one flow and recording after
    recording. Times begin with the recording's first sample.
    """
    outline = outline_of(study.tank.to_arena())
    where = places or [(0, number) for number in range(len(tracks))]
    found: list[Series] = []
    first = 0.0
    ends = {place[1]: float(track.time[-1]) for place, track in zip(where, tracks, strict=True)}
    for (flow, recording), track in zip(where, tracks, strict=True):
        # All parts of a recording count time from its first sample: the cosines of the flow's
        # strength run over the whole of it.
        if not found or found[-1].recording != recording:
            first = float(track.time[0])
        time = track.time - first
        # Without orientations the filter gets zeros, and none of them is unknown.
        smooth = Angle(np.zeros(time.size), np.zeros(time.size), np.ones(time.size, dtype=bool))
        corners = None
        if used_angle != "none":
            smooth = smooth_angle(time, track.theta)
            # A corner is where the recorded angle puts it; the smooth one only fills its holes.
            corners = np.where(np.isfinite(track.theta), track.theta, smooth.theta)
        wall = wall_intervals(time, track.x, track.y, corners, outline=outline, block=study.block)
        one = Series(
            time,
            np.ascontiguousarray(track.x),
            np.ascontiguousarray(track.y),
            np.ascontiguousarray(track.theta) if used_angle == "state" else smooth.theta,
            smooth.omega,
            (wall | ~smooth.known).astype(np.uint8),
            flow,
            recording,
            near_wall=int(wall.sum()),
            angle=smooth.theta,
            span=ends[recording] - first,
            first=first,
        )
        prior = velocity_prior(one, FILTER.prior_reach * study.block.side_m)
        found.append(replace(one, velocity_prior=prior))
    return _without_contacts(found, study.block) if study.fit.interaction else found


def velocity_prior(series: Series, radius: float) -> Floats | None:
    """Return mean and standard deviation of the velocities with which the passages begin.

    Behind a gap the means are those of the other stretches within a radius [m] of the place, and
    behind a contact those with which the nearest other passages begin.
    """
    from scipy.spatial import cKDTree

    there = np.flatnonzero(np.isfinite(series.x))
    if there.size < 2:
        return None
    seen = series.at(there)
    if not seen.begins[1:].any():
        return None
    passage = np.cumsum(seen.begins) - 1
    half = max(seen._within(0.5 * FILTER.prior_span_s), 1)
    last = np.arange(2 * half, seen.time.size)
    last = last[passage[last] == passage[last - 2 * half]]
    if not last.size:
        return None
    first, middle = last - 2 * half, last - half
    place = np.column_stack([seen.x, seen.y])

    def mean_velocity(end: npt.NDArray[np.intp]) -> Floats:
        """Return the mean velocity from `first` to a sample, and the spin."""
        velocity = (place[end] - place[first]) / (seen.time[end] - seen.time[first])[:, None]
        return np.column_stack([velocity, seen.omega[middle]])

    motion = mean_velocity(last)
    begins = np.flatnonzero(seen.begins)
    touching = seen.excluded[begins] != 0
    begun, at = np.intersect1d(begins, first, assume_unique=True, return_indices=True)[1:]
    # What is expected over the span, in its middle and where it begins, and what is found.
    mean, start, own = np.full((3, begins.size, 3), np.nan)
    own[begun] = motion[at]
    if seen.gaps.any():
        stretch = np.cumsum(np.concatenate([[0], seen.gaps]))
        near = cKDTree(place[middle]).query_ball_point(place[begins[~touching]], radius)
        for row, some in zip(np.flatnonzero(~touching), near, strict=True):
            others = np.array(some, dtype=int)
            others = others[stretch[middle[others]] != stretch[begins[row]]]
            if np.unique(stretch[middle[others]]).size >= FILTER.least_prior_stretches:
                start[row] = mean[row] = motion[others].mean(axis=0)
    flights = np.flatnonzero(touching & np.isfinite(own).all(axis=1))
    if flights.size >= FILTER.least_prior_contacts:
        count = FILTER.prior_contacts + 1
        tree = cKDTree(place[begins[flights]])
        near = np.asarray(tree.query(place[begins[touching]], count)[1])
        others = flights[near] != np.flatnonzero(touching)[:, None]
        others[others.all(axis=1), -1] = False
        nearest = flights[near[others].reshape(-1, FILTER.prior_contacts)]
        # The drag slows the body down. What the filter needs is the velocity in the middle of the
        # first interval, in which nothing drags: on the line through those in the middles of both
        # spans.
        sooner = np.full_like(own, np.nan)
        early = mean_velocity(middle)
        sooner[begun] = (early + (early - motion) * (half - 1) / half)[at]
        mean[touching], start[touching] = (one[nearest].mean(axis=1) for one in (own, sooner))
    rows = np.full((begins.size, 6), np.nan)
    for kind, most in ((touching, FILTER.largest_prior_std), (~touching, math.inf)):
        rows[kind] = _expected(start[kind], mean[kind], own[kind], most)
    if not np.isfinite(rows).any():
        return None
    prior = np.full((series.time.size, 6), np.nan)
    prior[there] = rows[passage]
    return prior


def _expected(start: Floats, mean: Floats, own: Floats, most: float) -> Floats:
    """Return means and standard deviations, NaN where few are known or they scatter too much."""
    known = np.isfinite(mean + own).all(axis=1)
    found = np.full((len(start), 6), np.nan)
    if np.count_nonzero(known) >= FILTER.least_prior_stretches:
        std = np.sqrt(((own - mean)[known] ** 2).mean(axis=0))
        if std[:2].max() <= most:
            found[:] = np.column_stack([start, np.broadcast_to(std, start.shape)])
    return found


def _without_contacts(series: list[Series], block: Block) -> list[Series]:
    """Leave out intervals in which two bodies may touch: where the circles around them meet."""
    found = []
    for one in series:
        near = np.zeros(one.time.size, dtype=bool)
        for other in series:
            if other.recording == one.recording or not other.time.size:
                continue
            clock = other.time + other.first - one.first
            away = [
                own - np.interp(one.time, clock, its, left=np.nan, right=np.nan)
                for own, its in ((one.x, other.x), (one.y, other.y))
            ]
            ahead = (_continued(one.time, axis) for axis in away)
            apart = np.minimum(np.hypot(*away)[:-1], np.hypot(*ahead))
            near[1:] |= apart < 2.0 * _reach(block) + MARGIN
        found.append(replace(one, excluded=one.excluded | near.astype(np.uint8)))
    return found


def _reach(block: Block) -> float:
    """Return the radius of the circle around a body [m]."""
    return block.side_m / math.sqrt(2.0) if block.shape == "square" else block.body().reach_m


def usable_intervals(series: Sequence[Series]) -> int:
    """Return the number of intervals that are not left out, no gaps, and not next after one."""
    count = 0
    for one in series:
        begins = one.begins[1:]
        count += int(np.count_nonzero(~begins)) - int(np.count_nonzero(begins[:-1] & ~begins[1:]))
    return count


def stretches_unsettled(series: Sequence[Series]) -> str:
    """Return why gaps or contacts leave C_d unsettled; nothing where stretches are long."""
    gaps = sum(int(np.count_nonzero(one.gaps)) for one in series)
    seen = sum(float(np.diff(one.time)[~one.gaps].sum()) for one in series)
    mean = seen / (gaps + len(series))
    if gaps and mean < FILTER.least_stretch_s:
        return (
            f"the track has gaps, {gaps} in all, and {mean:.2g} s between them: how the block "
            "moved before each is lost, which leaves C_d and the force too large; record the "
            f"whole path of the block, or stretches of {FILTER.least_stretch_s:.0f} s and more"
        )
    free = sum(float(np.diff(one.time)[~one.begins[1:]].sum()) for one in series)
    contacts = sum(int(np.count_nonzero(one.begins[:-1] & ~one.begins[1:])) for one in series)
    if contacts and free / contacts < FILTER.least_free_s:
        return (
            f"the block moves freely for {free / contacts:.2g} s at a time, between contacts: its "
            "speed is hardly known then, which makes C_d too large; record where it touches "
            f"nothing for {FILTER.least_free_s:g} s and more"
        )
    return ""
