"""White noise of a tracker, estimated from the track itself."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Integers, remembered
from driftwalk.schema.trajectory import Track


class NoisePolicy(NamedTuple):
    """How the tracking noise is separated from the motion of a body."""

    order: int = 4
    """Order of the differences: in closed form, a path that is a cubic over five samples leaves
    nothing."""
    lags: int = 6
    """Largest lag of the products of differences; chosen by hand."""
    trim: float = 5.0
    """Robust standard deviations beyond which windows (glitches, wall hits) are left out;
    chosen by hand."""
    block: int = 500
    """Windows in a block; blocks are left out in turn for the standard error; chosen by hand."""
    most_blocks: int = 100
    """Blocks that are used at most; chosen by hand."""
    fewest_windows: int = 50
    """Windows, or shortest steps, without which there is no estimate; chosen by hand."""
    stillest: tuple[float, ...] = (0.01, 0.02, 0.05, 0.1, 0.2)
    """Shares of the steps, the shortest, that bound the noise; chosen by hand."""
    sure: float = 5.0
    """Standard errors by which the estimate must exceed the bound to be replaced by it; chosen
    by hand."""
    reach: float = 4.0
    """Standard deviations by which noise may show a body beyond a wall: by chance one sample of
    30,000 lies farther."""
    most_reach: float = 0.05
    """Largest such reach, as a share of the tank: with more, the tank or the scale is wrong;
    chosen by hand."""


_NOISE: Final = NoisePolicy()


class NoiseEstimate(NamedTuple):
    """White tracking noise of a recording, and the random motion of the path."""

    position_noise_m: float
    """Standard deviation of the position, per axis [m]; NaN with too few samples."""
    orientation_noise_rad: float
    """Standard deviation of the orientation [rad]; NaN without orientations."""
    position_noise_standard_error_m: float
    """Standard error of `position_noise_m` [m], from leaving out blocks in turn."""
    orientation_noise_standard_error_rad: float
    """Standard error of `orientation_noise_rad` [rad]."""
    acceleration_intensity_m2_s3: float
    """Intensity q of the path's white acceleration, per axis [m^2/s^3]; rough where q h^3 is well
    below the variance of the noise."""
    orientation_intensity_rad2_s3: float
    """The same of the orientation [rad^2/s^3]."""
    windows: int
    """Windows of five samples that were used."""


def estimate_tracking_noise(track: Track) -> NoiseEstimate:
    """Separate white camera noise from the body's own random motion.

    A position is modelled as a smooth path, plus an integrated Wiener process (the body's velocity
    under white accelerations of intensity q), plus white noise of variance r^2. In fourth
    differences d the smooth path vanishes, and their autocovariances at lags 0 to 6 are linear in
    the two unknowns::

        E[d_n d_(n+l)] = r^2 sum_i w_i w'_i + q sum_ij w_i w'_j |t_i - t'_j|^3 / 12

    On an even clock the first sum is the autocorrelation of (1, -4, 6, -4, 1), the second that of
    twice differenced ``h^3 (2/3, 1/6, 0, ...)``. The weights w are those of divided differences at
    the actual times, so an uneven clock needs no special case. The unknowns follow by least
    squares with none below zero; x and y share them. A velocity that jumps (a hit at the wall) has
    the covariance of the second term, so it does not pass for noise; outlying windows are left
    out, and so are windows across a gap.

    With n samples the estimate is good to about ``r * 1.3 / sqrt(n)`` for q h^3 up to 5 r^2. Noise
    that is not white (a slowly moving body in whole pixels) is underestimated.

    A body that jerks and rests is no integrated Wiener process: its jerks would pass for noise. So
    the steps of its rests bound the noise (`noise_bound`), and where the estimate is above that
    bound by more than chance, the bound takes its place.

    Parameters
    ----------
    track : Track
        One body.

    Returns
    -------
    NoiseEstimate
        Zero where the motion explains all there is.

    Examples
    --------
    >>> time = np.arange(1000) * 0.1
    >>> noise = np.random.default_rng(1).normal(0.0, 3e-4, (2, 1000))
    >>> track = Track(time, 0.01 * time + noise[0], noise[1], np.full(1000, np.nan))
    >>> round(estimate_tracking_noise(track).position_noise_m, 4)
    0.0003
    """
    position = _bounded(_estimate(track.time, (track.x, track.y)), track)
    turned = np.isfinite(track.theta)
    orientation = _estimate(track.time[turned], (np.unwrap(track.theta[turned]),))
    return NoiseEstimate(
        position_noise_m=position.noise,
        orientation_noise_rad=orientation.noise,
        position_noise_standard_error_m=position.standard_error,
        orientation_noise_standard_error_rad=orientation.standard_error,
        acceleration_intensity_m2_s3=position.intensity,
        orientation_intensity_rad2_s3=orientation.intensity,
        windows=position.windows,
    )


def noise_reach(track: Track, noise: float | None = None, *, size: float = np.inf) -> float:
    """Return how far beyond a wall the camera's noise shows a body that is within it [m].

    Parameters
    ----------
    track : Track
        One body.
    noise : float, optional
        Standard deviation of a position, per axis [m]; default: estimated.
    size : float
        Of the tank [m]: the reach is a twentieth of it at most, however noisy the track.

    Examples
    --------
    >>> time = np.arange(10.0)
    >>> noise_reach(Track(time, time, time, time), 3e-4)
    0.0012
    """
    known = estimate_tracking_noise(track).position_noise_m if noise is None else noise
    return min(_NOISE.reach * known, _NOISE.most_reach * size) if np.isfinite(known) else 0.0


class NoiseBound(NamedTuple):
    """The largest noise that leaves steps as short as the shortest ones of a recording."""

    position_noise_m: float
    """Standard deviation of the position, per axis [m]; infinite with too few steps."""
    standard_error_m: float
    """Its standard error [m]."""


def noise_bound(track: Track) -> NoiseBound:
    """Return the largest white noise that the shortest steps of a recording allow.

    Two positions with independent noise r per axis differ by at most u with the probability
    ``1 - exp(-u^2 / 4 r^2)`` if the body rests, and more rarely if it moves in any way that is
    independent of the noise (Anderson, Proc. Am. Math. Soc. 6 (1955) 170). So where a share s of
    the steps is no longer than u, ``r <= u / sqrt(-4 ln(1 - s))``. The smallest of these bounds
    for the shortest 1 to 20 % is returned.

    A position that is repeated to the last digit was not measured again: steps of length zero are
    left out. Rounding to a resolution d moves a step by sqrt(2) d at most, and u is longer by that;
    d is the smallest difference of two coordinates.

    Parameters
    ----------
    track : Track
        One body.

    Examples
    --------
    >>> time = np.arange(1000) * 0.1
    >>> noise = np.random.default_rng(1).normal(0.0, 3e-4, (2, 1000))
    >>> round(noise_bound(Track(time, noise[0], noise[1], 0 * time)).position_noise_m, 4)
    0.0003
    """
    step = np.diff(np.stack([track.x, track.y]), axis=1)
    usual = float(np.median(np.diff(track.time))) if track.time.size > 1 else 0.0
    step = step[:, np.diff(track.time) < 1.5 * usual]
    step = step[:, np.isfinite(step).all(axis=0)]
    apart = np.abs(step[step != 0.0])
    length = np.sort(np.hypot(*step[:, (step != 0.0).any(axis=0)]))
    found = NoiseBound(math.inf, math.inf)
    for share in _NOISE.stillest:
        count = int(share * length.size)
        if count < _NOISE.fewest_windows:
            continue
        longest = float(length[count - 1]) + math.sqrt(2.0) * float(apart.min())
        bound = longest / math.sqrt(-4.0 * math.log1p(-count / length.size))
        # u^2 is to first order proportional to the share of steps below it.
        if bound < found.position_noise_m:
            found = NoiseBound(bound, 0.5 * bound / math.sqrt(count))
    return found


class _Estimate(NamedTuple):
    noise: float
    standard_error: float
    intensity: float
    windows: int


def _bounded(estimate: _Estimate, track: Track) -> _Estimate:
    """Return the estimate, or the bound on the noise where it is clearly above that."""
    bound = noise_bound(track)
    if not estimate.noise > bound.position_noise_m + _NOISE.sure * bound.standard_error_m:
        return estimate
    return estimate._replace(noise=bound.position_noise_m, standard_error=bound.standard_error_m)


@remembered
def _estimate(time: Floats, series: tuple[Floats, ...]) -> _Estimate:
    """Fit noise and intensity to the lag products of all blocks."""
    starts = _window_starts(time)
    if starts.size < _NOISE.fewest_windows:
        return _Estimate(math.nan, math.nan, math.nan, 0)
    blocks = np.array_split(starts, max(8, starts.size // _NOISE.block))
    blocks = blocks[:: math.ceil(len(blocks) / _NOISE.most_blocks)]
    differences = []
    for block in blocks:
        weights = _weights(time, block)[1]
        members = [values[_members(block)] for values in series]
        differences.append(np.stack([(weights * one).sum(axis=1) for one in members]))
    spread = [_robust_std(row) for row in np.concatenate(differences, axis=1)]
    limits = _NOISE.trim * np.array(spread)[:, None]
    sums = np.stack(
        [
            _lag_sums(time, block, values, np.abs(values) <= limits)
            for block, values in zip(blocks, differences, strict=True)
        ]
    )
    noise, intensity = _solve(sums.sum(axis=0))
    left_out = np.array([_solve(sums.sum(axis=0) - part)[0] for part in sums])
    count = len(blocks)
    variance = (count - 1) / count * float(((left_out - left_out.mean()) ** 2).sum())
    noise = max(noise, 0.0)
    # d(r) = d(r^2) / 2r; at r = 0 the error of r^2 itself bounds r.
    error = math.sqrt(variance)
    standard_error = (
        min(error / (2.0 * math.sqrt(noise)), math.sqrt(error)) if noise else math.sqrt(error)
    )
    return _Estimate(math.sqrt(noise), standard_error, max(intensity, 0.0), sum(map(len, blocks)))


def _window_starts(time: Floats) -> Integers:
    """Return the first sample of each window of five that no gap splits."""
    if time.size <= _NOISE.order:
        return np.zeros(0, dtype=np.int64)
    usual = float(np.median(np.diff(time)))
    span = time[_NOISE.order :] - time[: -_NOISE.order]
    return np.flatnonzero(span <= 1.5 * _NOISE.order * usual)


def _members(starts: Integers) -> Integers:
    return starts[:, None] + np.arange(_NOISE.order + 1)


def _weights(time: Floats, starts: Integers) -> tuple[Floats, Floats]:
    """Return the times of each window and the weights of its divided difference.

    Scaled to the sum of squares of (1, -4, 6, -4, 1), which they are on an even clock.
    """
    times = time[_members(starts)]
    apart = times[:, :, None] - times[:, None, :]
    apart += np.eye(_NOISE.order + 1)  # a sample's distance to itself is no factor
    weights = 1.0 / apart.prod(axis=2)
    weights *= np.sqrt(math.comb(2 * _NOISE.order, _NOISE.order) / (weights**2).sum(axis=1))[
        :, None
    ]
    return times, weights


def _lag_sums(time: Floats, starts: Integers, values: Floats, good: Bools) -> Floats:
    """Return for each lag the sums of (noise term, process term, product of differences, count)."""
    times, weights = _weights(time, starts)
    sums = np.zeros((_NOISE.lags + 1, 4))
    for lag in range(_NOISE.lags + 1):
        if starts.size <= lag:
            break
        first, second = slice(0, starts.size - lag), slice(lag, starts.size)
        near = starts[second] - starts[first] == lag
        noise = np.zeros(near.size)
        for i in range(lag, _NOISE.order + 1):
            noise += weights[first][:, i] * weights[second][:, i - lag]
        distance = np.abs(times[first][:, :, None] - times[second][:, None, :])
        process = np.einsum("ni,nij,nj->n", weights[first], distance**3 / 12.0, weights[second])
        both = near & good[:, first] & good[:, second]
        product = values[:, first] * values[:, second]
        count = both.sum(axis=0)
        terms = (noise * count, process * count, product * both, count)
        sums[lag] = [term.sum() for term in terms]
    return sums


def _robust_std(values: Floats) -> float:
    """Return the standard deviation by the median absolute value; infinite when that is zero."""
    spread = 1.4826 * float(np.median(np.abs(values)))
    return spread if spread > 0.0 else math.inf


def _solve(sums: Floats) -> tuple[float, float]:
    """Return (r^2, q) of the least-squares fit over lags, q not below zero."""
    used = sums[:, 3] > 0
    if used.sum() < 2:
        return 0.0, 0.0
    noise, process, product = (sums[used, column] / sums[used, 3] for column in range(3))
    scale = math.sqrt(float((process**2).sum())) or 1.0
    design = np.column_stack([noise, process / scale])
    variance, intensity = np.linalg.lstsq(design, product, rcond=None)[0].tolist()
    if intensity < 0.0:
        return float(noise @ product / (noise @ noise)), 0.0
    if variance < 0.0:
        return variance, float(process @ product / (process @ process))
    return variance, intensity / scale
