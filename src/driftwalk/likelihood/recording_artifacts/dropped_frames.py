"""Dropped frames, found by expectation and maximisation over the lengths of intervals.

Where a block moves, its step across a missing frame is twice as long as its neighbours', in x, y
and orientation together. Every interval is compared with what its neighbours predict, once for each
number of missing frames. How often frames are missing is estimated along with it, by expectation
and maximisation over the whole recording. Intervals of half, one and a half and two and a half
times the length are a control: no dropped frame makes those.

A window has four samples on either side of the interval in question. Its path is a parabola, which
the window itself has to tell, plus an integrated Wiener process (the velocity under random
accelerations), plus white tracking noise. A longer interval stretches the path: that is the only
thing it does, in x, y and the orientation alike. The alternatives are what else may happen there: a
sample that is wrong, a bounce (another velocity from one moment on), a jump to another place.

The parabola's coefficients have a flat prior in units of the displacement over the window: where
the block does not move, no length of an interval is more likely than another.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats, Integers, remembered
from driftwalk.likelihood.filter.series import ORIENTED_SHARE
from driftwalk.schema import Track
from driftwalk.schema.tracking_noise import estimate_tracking_noise

WIDTH: Final = 8
"""Samples of a window, four on either side of the interval in question; chosen by hand."""
MIDDLE: Final = 3
"""Which of the window's intervals is the one in question."""
MOST_MISSING: Final = 3
"""Missing frames in one interval that are looked for; chosen by hand."""
WINDOWS_AT_ONCE: Final = 16_384
"""Windows that are whitened at a time: some 50 MB."""
CONTROL_LENGTHS: Final = (0.5, 1.5, 2.5)
"""Lengths that no dropped frame makes. Quick movements of an animal, or a clock that is not
regular, make them as often as double ones; chosen by hand."""
DROPS: Final = tuple(range(1, MOST_MISSING + 1))
"""Classes of a place: so many frames were dropped there."""
CONTROL, WRONG, BOUNCE, JUMP = range(MOST_MISSING + 1, MOST_MISSING + 5)
"""Further classes: a control length, a wrong place, a contact, a jump."""
CLEAN: Final = 0
"""Class of a place where nothing is wrong."""
CLASSES: Final = JUMP + 1
"""Number of classes, of which `JUMP` is the last."""


class Axis(NamedTuple):
    """One coordinate of a track, and what its noise and its accelerations are."""

    values: Floats
    """Shape (n,); NaN where missing."""
    noise: float
    """Standard deviation of the tracking noise."""
    intensity: float
    """Of the white acceleration [1/s^3 times the unit squared]."""
    step: float
    """Root mean square of the change from sample to sample."""


class Pattern(NamedTuple):
    """One thing that may have happened in a window."""

    kind: int
    at: int
    """Interval, or sample of a wrong one."""
    lengths: Floats
    """Of the window's intervals, in intervals of the clock."""
    shift: Floats | None
    """Shape of what is added to the path, whose size is unknown; None for nothing."""


def patterns_of(lengths: Floats, stamped: float) -> list[Pattern]:
    """Return what may have happened in a window."""
    plain = lengths.copy()
    plain[MIDDLE] = stamped
    found = [Pattern(CLEAN, MIDDLE, plain, None)]

    def longer(at: int, by: float) -> Floats:
        other = plain.copy()
        other[at] += by
        return other

    found += [Pattern(DROPS[0], at, longer(at, 1.0), None) for at in range(WIDTH - 1)]
    # The number of a class of dropped frames is that of the frames.
    others = [(kind, float(kind)) for kind in DROPS[1:]]
    others += [(CONTROL, length - 1.0) for length in CONTROL_LENGTHS]
    found += [Pattern(kind, MIDDLE, longer(MIDDLE, by), None) for kind, by in others]
    number = np.arange(WIDTH)
    time = np.concatenate([[0.0], np.cumsum(plain)])
    found += [Pattern(WRONG, at, plain, (number == at).astype(np.float64)) for at in range(WIDTH)]
    for at in range(WIDTH - 1):
        since = np.maximum(time - 0.5 * (time[at] + time[at + 1]), 0.0)
        found.append(Pattern(BOUNCE, at, plain, since))
        found.append(Pattern(JUMP, at, plain, (number > at).astype(np.float64)))
    return found


_USUAL: Final = patterns_of(np.ones(WIDTH - 1), 1.0)
"""Patterns of a window without a gap; those of others differ in their times alone."""
KIND: Final = np.array([one.kind for one in _USUAL])
"""Of each pattern; the same for every window."""
AT_MIDDLE: Final = np.array([one.at == MIDDLE for one in _USUAL])
HERE: Final = np.bincount(KIND[AT_MIDDLE], minlength=CLASSES)
"""Number of patterns of each kind at the middle interval."""


def log_likelihoods(
    axes: Sequence[Axis],
    starts: npt.NDArray[np.intp],
    lengths: Floats,
    stamped: Floats,
    *,
    dt: float,
) -> Floats:
    """Return the log likelihood of every window under every pattern, relative to the first."""
    around = starts[:, None] + np.arange(WIDTH - 1)
    key = lengths[around]
    key[:, MIDDLE] = stamped[starts + MIDDLE]
    if (key == key[0]).all():
        # A regular clock, as most have: sorting hundreds of thousands of windows takes a second.
        unique, group = key[:1], np.zeros(len(key), dtype=np.intp)
    else:
        unique, group = np.unique(key, axis=0, return_inverse=True)
    chi = np.zeros((starts.size, KIND.size))
    constant = np.zeros((starts.size, KIND.size))
    dof = np.zeros(starts.size)
    for place, one in enumerate(unique):
        alike = np.flatnonzero(group.ravel() == place)
        patterns = patterns_of(one, one[MIDDLE])
        factors = [_factors(patterns, axis, dt) for axis in axes]
        for first in range(0, alike.size, WINDOWS_AT_ONCE):
            rows = alike[first : first + WINDOWS_AT_ONCE]
            members = starts[rows, None] + np.arange(WIDTH)
            for axis, (factor, half) in zip(axes, factors, strict=True):
                values = axis.values[members]
                known = np.isfinite(values).all(axis=1)
                values = np.where(known[:, None], values - values[:, :1], 0.0)
                squares = np.tensordot(values, factor, axes=(1, 1)) ** 2
                # One after the other: a sum along so short an axis takes four times as long.
                total = squares[:, :, 0].copy()
                for number in range(1, WIDTH - 3):
                    total += squares[:, :, number]
                chi[rows] += total
                constant[rows] += np.where(known[:, None], half, 0.0)
                dof[rows] += np.where(known, WIDTH - 3, 0)
    # Where the model of the path is too narrow, as in a flow with sharp bends, so are all of these.
    usual = max(float(np.median(chi[:, CLEAN])) / max(float(np.median(dof)) - 2.0 / 3.0, 1.0), 1.0)
    # Student's law with 6 degrees of freedom, chosen by hand, in place of the normal one:
    # accelerations are not the same everywhere. In place: of a fast camera each takes 50 MB.
    chi /= usual * 6.0
    np.log1p(chi, out=chi)
    chi *= 0.5 * (6.0 + dof[:, None])
    constant -= chi
    constant -= constant[:, :1].copy()
    return constant


def _factors(patterns: Sequence[Pattern], axis: Axis, dt: float) -> tuple[Floats, Floats]:
    """Return for each pattern the matrix whose product with a window is white, and a constant.

    Shapes (p, WIDTH, WIDTH - 3) and (p,): the matrix is blind for parabolas, and the
    constant is the logarithm of its normalisation.
    """
    time = dt * np.array([np.concatenate([[0.0], np.cumsum(one.lengths)]) for one in patterns])
    early = np.minimum(time[:, :, None], time[:, None, :])
    late = np.maximum(time[:, :, None], time[:, None, :])
    covariance = axis.intensity * early**2 * (late / 2.0 - early / 6.0)
    covariance += axis.noise**2 * np.eye(WIDTH)
    # A wrong sample and a jump may be many times the noise, a bounce turns the velocity round.
    size = {
        WRONG: 10.0 * axis.noise + 2.0 * axis.step,
        BOUNCE: 2.0 * axis.step,
        JUMP: 10.0 * axis.noise + 3.0 * axis.step,
    }
    for number, one in enumerate(patterns):
        if one.shift is not None:
            covariance[number] += size[one.kind] ** 2 * np.outer(one.shift, one.shift)
    span = time[:, -1:, None]
    basis = (time[:, :, None] / span) ** np.arange(3)
    root = np.linalg.cholesky(covariance)
    q, r = np.linalg.qr(np.linalg.solve(root, basis), mode="complete")
    blind = q[:, :, 3:]
    half = np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    half += np.log(np.abs(np.diagonal(r, axis1=1, axis2=2))).sum(axis=1)
    return np.linalg.solve(np.swapaxes(root, 1, 2), blind), -half


class DroppedFramesPolicy(NamedTuple):
    """When frames are missing although the stamps say a constant rate."""

    fewest_windows: int = 100
    """Windows without which no rate can be estimated. Chosen by hand."""
    regular: float = 0.1
    """Share of the interval by which the stamps of a constant rate may be off: they may be rounded.
    Chosen by hand."""
    evidence: float = 30.0
    """Log likelihood ratio from which on frames are missing. Measured: it is 0.0 on recordings of
    the model at 10 Hz and at most 27 on recordings of animals and robots, but for one whose control
    says that it means nothing; with one frame in twenty missing it is 128 and more after ten
    minutes."""
    most_control: float = 0.5
    """Share of the dropped frames' rate up to which the rate of the control lengths may go. Chosen
    by hand."""
    most_control_before: float = 2.0
    """The same before any frame is found, when two in one window pass for something else. Chosen by
    hand."""
    rounds: int = 6
    """Most rounds: frames that are found change what is expected of their neighbours; chosen by
    hand."""
    first_rate: float = 3e-3
    """Rate of everything at which the expectation-maximisation begins. Chosen by hand."""
    longest_span: int = 21
    """Intervals of the clock in a window: three times its seven. Nothing is predicted in a longer
    one. Chosen by hand."""
    fast_quantile: float = 0.99
    """Quantile of the steps beyond which they do not tell how fast a body is: jumps are among
    them. Chosen by hand."""


DROPPED: Final = DroppedFramesPolicy()


class DroppedFrames(NamedTuple):
    """Where frames are missing although the stamps do not say so."""

    after: Integers
    """Numbers of the track's samples before the missing frames, from 0; shape (d,)."""
    time: Floats
    """Their stamps [s], shape (d,)."""
    missing: Integers
    """Number of frames that are missing there, shape (d,)."""
    expected: Floats
    """Expected number of missing frames in every interval of the track, (n - 1,)."""
    rate: float
    """Estimated share of the intervals that lack frames."""
    evidence: float
    """Logarithm of the likelihood ratio of that rate over none; 0 where the rates are not those of
    dropped frames."""
    interval: float
    """Between frames [s]; NaN where the stamps have no constant rate."""

    @property
    def frames(self) -> int:
        """Number of missing frames."""
        return int(self.missing.sum())


@remembered
def find_dropped_frames(track: Track, clock: Floats) -> DroppedFrames:
    """Find frames that are missing although the stamps say a constant rate.

    None are found where the evidence is too small, where the control has more than half of
    their rate, or where more of the intervals lack two or three frames than one: then the steps are
    those of a body that moves in leaps. Frames that are missing while a body hardly moves are not
    seen, nor those among the first and the last four samples.

    Examples
    --------
    >>> frame = np.delete(np.arange(2000), np.arange(50, 2000, 50))
    >>> noise = np.random.default_rng(1).normal(0.0, 3e-4, (2, frame.size))
    >>> x, y = 0.1 * np.cos(0.05 * frame) + noise[0], 0.1 * np.sin(0.05 * frame) + noise[1]
    >>> clock = 0.1 * np.arange(frame.size)
    >>> found = find_dropped_frames(Track(clock, x, y, np.full(frame.size, np.nan)), clock)
    >>> found.frames, found.after[:4].tolist()
    (38, [49, 98, 147, 196])
    """
    interval = _regular_interval(clock)
    none = np.zeros(0, dtype=np.int64)
    still = np.zeros(max(track.time.size - 1, 0))
    nothing = DroppedFrames(none, np.zeros(0), none, still, 0.0, 0.0, interval)
    if math.isnan(interval) or track.time.size < DROPPED.fewest_windows + WIDTH:
        return nothing
    stamped = np.rint(np.diff(track.time) / interval)
    lengths = stamped
    for number in range(DROPPED.rounds):
        starts = _windows(lengths)
        if starts.size < DROPPED.fewest_windows:
            return nothing
        axes = _axes(track, interval * np.concatenate([[0.0], np.cumsum(lengths)]))
        likelihood = log_likelihoods(axes, starts, lengths, stamped, dt=interval)
        shares = _shares(likelihood)
        rates, value = _rates(shares)
        # The evidence comes from the first round: later ones have fitted the lengths to the track.
        if number == 0:
            if not _are_dropped_frames(rates, DROPPED.most_control_before):
                return nothing
            evidence = value - _rates(shares, without=DROPS)[1]
            if evidence < DROPPED.evidence:
                return nothing._replace(evidence=evidence)
        share = _posterior(likelihood, rates)
        found = share.sum(axis=1) > 0.5
        before = lengths
        lengths = stamped.copy()
        # Neighbours of a dropped frame see its true length in the next round.
        lengths[starts[found] + MIDDLE] += 1.0 + share[found].argmax(axis=1)
        if np.array_equal(lengths, before):
            break
    if not _are_dropped_frames(rates, DROPPED.most_control):
        return nothing._replace(evidence=evidence)
    after = np.flatnonzero(lengths > stamped)
    still[starts + MIDDLE] = share @ np.arange(1, MOST_MISSING + 1)
    return DroppedFrames(
        after,
        track.time[after],
        (lengths - stamped)[after].astype(np.int64),
        still,
        float(rates[list(DROPS)].sum()),
        evidence,
        interval,
    )


def with_gaps(track: Track, found: DroppedFrames) -> Track:
    """Return a track with the time of the missing frames put in: they become gaps.

    Where it is not sure whether a frame is missing, the expected time is put in: the position is
    then wrong by the least mean square.
    """
    if not found.frames:
        return track
    later = np.concatenate([[0.0], np.cumsum(found.expected)])
    return track._replace(time=track.time + found.interval * later)


def places_of(found: DroppedFrames) -> str:
    """Return in words after which stamps frames are missing: the first few."""
    named = ", ".join(f"{time:.6g} s" for time in found.time[:5])
    more = found.time.size - 5
    return f"after {named}" + (f" and {more} more" if more > 0 else "")


def _regular_interval(clock: Floats) -> float:
    """Return the interval of stamps at a constant rate; NaN where they are others."""
    if clock.size <= 1:
        return math.nan
    interval = float(clock[-1] - clock[0]) / (clock.size - 1)
    off = clock - (clock[0] + interval * np.arange(clock.size))
    return interval if np.abs(off).max() <= DROPPED.regular * interval else math.nan


def _windows(lengths: Floats) -> npt.NDArray[np.intp]:
    """Return the first samples of the windows that no long gap splits."""
    total = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.flatnonzero(total[WIDTH - 1 :] - total[: 1 - WIDTH] <= DROPPED.longest_span)


def _axes(track: Track, time: Floats) -> list[Axis]:
    """Return x and y, and the orientation where most samples have one."""
    known = estimate_tracking_noise(track._replace(time=time))
    moving = known.position_noise_m, known.acceleration_intensity_m2_s3
    axes = [_axis(time, values, *moving) for values in (track.x, track.y)]
    seen = np.isfinite(track.theta)
    if seen.mean() < ORIENTED_SHARE or np.ptp(track.theta[seen]) == 0.0:
        return axes
    theta = np.full(time.size, np.nan)
    theta[seen] = np.unwrap(track.theta[seen])
    turning = known.orientation_noise_rad, known.orientation_intensity_rad2_s3
    return [*axes, _axis(time, theta, *turning)]


def _axis(time: Floats, values: Floats, noise: float, intensity: float) -> Axis:
    seen = np.isfinite(values)
    interval = float(np.median(np.diff(time[seen])))
    steps = np.abs(np.diff(values[seen]))
    slow = np.minimum(steps, np.quantile(steps, DROPPED.fast_quantile))
    usual = math.sqrt(float((slow**2).mean()))
    # Neither is exactly zero: a covariance has to be one.
    std = max(np.nan_to_num(noise), 1e-2 * usual, 1e-12)
    return Axis(values, std, max(intensity, 1e-6 * std**2 / interval**3), usual)


class _Shares(NamedTuple):
    """Likelihoods of the classes, relative to the most likely pattern of each window."""

    top: Floats
    """Logarithm of the likelihood of that pattern, (w,)."""
    anywhere: Floats
    """Sums over the places in the window, (w, CLASSES)."""
    here: Floats
    """Those at the middle interval alone, (w, CLASSES)."""


def _shares(likelihood: Floats) -> _Shares:
    """Return the likelihood of each class in each window."""
    top = likelihood.max(axis=1)
    scaled = likelihood - top[:, None]
    np.exp(scaled, out=scaled)
    kinds = [kind == KIND for kind in range(CLASSES)]
    anywhere = np.stack([scaled[:, one].sum(axis=1) for one in kinds], axis=1)
    here = np.stack([scaled[:, one & AT_MIDDLE].sum(axis=1) for one in kinds], axis=1)
    return _Shares(top, anywhere, here)


def _rates(shares: _Shares, *, without: tuple[int, ...] = ()) -> tuple[Floats, float]:
    """Return how often everything happens in an interval, shape (CLASSES,), and how likely that is.

    A window is one of seven that see the same interval: their likelihood is that to the power of
    seven.
    """
    top, anywhere, here = shares
    part = np.empty_like(here)
    rates = np.full(CLASSES, DROPPED.first_rate)
    for _ in range(60):
        rates[list(without)] = 0.0
        weight = _weights(rates)
        total = anywhere @ weight
        before = rates
        # Into memory that is there: new one for each step takes as long as the step.
        np.divide(here, total[:, None], out=part)
        rates = np.maximum(weight * part.mean(axis=0) / HERE, 1e-6)
        if np.abs(rates - before)[CLEAN + 1 :].max() < 1e-6:
            break
    return before, float((top + np.log(total)).sum()) / (WIDTH - 1)


def _weights(rates: Floats) -> Floats:
    """Return the probability of a window in which one thing happens at one place, or nothing."""
    some = min(float(rates[CLEAN + 1 :].sum()), 0.9)
    weight = rates * (1.0 - some) ** (WIDTH - 2)
    weight[CLEAN] = (1.0 - some) ** (WIDTH - 1)
    return weight


def _are_dropped_frames(rates: Floats, most: float) -> bool:
    """Whether the intervals are whole ones rather than any, and mostly lack one frame."""
    single, more = rates[DROPS[0]], rates[list(DROPS[1:])].sum()
    return bool(len(CONTROL_LENGTHS) * rates[CONTROL] <= most * (single + more) and more <= single)


def _posterior(likelihood: Floats, rates: Floats) -> Floats:
    """Return the probability that a window's middle interval lacks 1, 2, 3 frames, (w, 3)."""
    whole = likelihood + np.log(_weights(rates)[KIND])
    share = np.exp(whole - whole.max(axis=1, keepdims=True))
    share /= share.sum(axis=1, keepdims=True)
    kinds = [(kind == KIND) & AT_MIDDLE for kind in DROPS]
    return np.stack([share[:, one].sum(axis=1) for one in kinds], axis=1)
