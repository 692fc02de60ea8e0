"""Smoothing derivatives: a local quadratic fit around every sample of a track.

Second differences of noisy points are almost pure noise (with 0.3 mm at 10 Hz they scatter by
7 cm/s²), so velocities and accelerations are always taken from a least-squares parabola.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Bools, Floats, Indices
from driftwalk.core.errors import InputError

MIN_SAMPLES = 5
"""Samples that a window needs: a parabola through three has no residual to average; chosen by
hand."""
_EDGE = 1e-3
"""A sample on the edge of the window, up to this part of the interval, is in it; chosen by hand."""
_EVEN = 1e-6
"""Intervals that differ from the median by less than this part of it count as equal; chosen by
hand."""
_SINGULAR = 1e-10
"""Below this part of its size the quadratic term is not determined by the sampling times; chosen by
hand."""
_CHUNK = 1 << 15
"""Windows fitted at a time: a handful of such arrays stay in the cache; chosen by hand."""


def local_quadratic(
    time: npt.ArrayLike,
    values: npt.ArrayLike,
    *,
    window: float,
    gap_factor: float = 1.5,
    at: slice = slice(None),
) -> tuple[Floats, Floats, Floats]:
    """Fit a parabola by least squares around every sample, and return it at the sample.

    The fit at sample ``i`` uses the samples within ``window / 2`` of its time, at the times at
    which they were taken: the clock may be uneven. An interval longer than `gap_factor` times the
    median one is a gap, and no window reaches across a gap: next to a gap, and at both ends, the
    window is one-sided. On an evenly sampled stretch this is the Savitzky-Golay filter of degree 2.

    Parameters
    ----------
    time : array_like, shape (n,)
        Time stamps [s], strictly increasing.
    values : array_like, shape (n,) or (n, k)
        Samples in any unit. A sample with a value that is not finite counts as missing.
    window : float
        Full width of the window [s].
    gap_factor : float, optional
        Multiple of the median interval above which an interval is a gap, at least 1.
    at : slice, optional
        Samples at which the parabola is wanted; at the others the result is NaN.

    Returns
    -------
    value, velocity, acceleration : ndarray, shape of `values`
        The parabola's value, first and second time derivative at every sample, in the unit of
        `values`, per s and per s². NaN where the sample is missing, where the window holds fewer
        than `MIN_SAMPLES` samples, and where they bunch up so that no parabola is determined.

    Raises
    ------
    InputError
        When shapes disagree, times do not increase, or an option is out of range.

    Notes
    -----
    O(n) memory and O(n w) time for w samples in a window. With white noise of standard deviation s
    at interval h, the acceleration scatters by about ``27 s h^0.5 / window^2.5``.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(8) * 0.1
    >>> value, velocity, acceleration = local_quadratic(t, 3.0 * t**2, window=0.5)
    >>> float(acceleration[4].round(9))
    6.0
    """
    times, columns = _checked(time, values, window, gap_factor)
    present = np.isfinite(columns).all(axis=1)
    fit = np.full((3, *columns.shape), np.nan)
    if np.count_nonzero(present) >= MIN_SAMPLES:
        wanted = np.zeros(times.size, dtype=bool)
        wanted[at] = True
        fit[:, present] = _fit_present(
            times[present], columns[present], window, gap_factor, wanted[present]
        )
    value, velocity, acceleration = fit.reshape(3, *np.shape(values))
    return value, velocity, acceleration


def _checked(
    time: npt.ArrayLike, values: npt.ArrayLike, window: float, gap_factor: float
) -> tuple[Floats, Floats]:
    times, samples = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if times.ndim != 1 or samples.ndim not in (1, 2) or samples.shape[0] != times.size:
        raise InputError(
            f"time {times.shape} and values {samples.shape} do not have the same number of samples"
        )
    if not (math.isfinite(window) and window > 0.0):
        raise InputError(f"the smoothing window must be a positive number of seconds, got {window}")
    if not gap_factor >= 1.0:
        raise InputError(f"gap_factor must be at least 1, got {gap_factor}")
    if not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        raise InputError("time stamps must be finite and strictly increasing")
    return times, samples if samples.ndim == 2 else samples[:, None]


def _fit_present(
    time: Floats, values: Floats, window: float, gap_factor: float, wanted: Bools
) -> Floats:
    """Return value, velocity, acceleration, shape (3, n, k), of samples that are all present."""
    intervals = np.diff(time)
    interval = float(np.median(intervals))
    first, last = _windows(time, intervals, 0.5 * window + _EDGE * interval, gap_factor * interval)
    half = int((0.5 * window + _EDGE * interval) / interval)
    fit = np.full((3, *values.shape), np.nan)
    enough = wanted & (last - first + 1 >= MIN_SAMPLES)
    even = enough & _even_windows(intervals, interval, first, last, half)
    if even.any():
        fit[:, even] = _convolve(values, half, interval)[:, even]
    uneven = np.flatnonzero(enough & ~even)
    for start in range(0, uneven.size, _CHUNK):
        at = uneven[start : start + _CHUNK]
        fit[:, at] = _fit_windows(time, values, at, first[at], last[at])
    return fit


def _windows(time: Floats, intervals: Floats, reach: float, gap: float) -> tuple[Indices, Indices]:
    """Return the first and last sample of every window, clipped at gaps."""
    after_gap = np.concatenate([[True], intervals > gap])
    run = np.cumsum(after_gap) - 1
    run_first = np.flatnonzero(after_gap)
    run_last = np.append(run_first[1:], time.size) - 1
    first = np.searchsorted(time, time - reach, side="left")
    last = np.searchsorted(time, time + reach, side="right") - 1
    return np.maximum(first, run_first[run]), np.minimum(last, run_last[run])


def _even_windows(
    intervals: Floats, interval: float, first: Indices, last: Indices, half: int
) -> Bools:
    """Return which windows are complete, centred and evenly sampled."""
    index = np.arange(first.size)
    odd_before = np.concatenate([[0], np.cumsum(abs(intervals - interval) > _EVEN * interval)])
    whole = (first == index - half) & (last == index + half)
    return np.asarray(whole & (odd_before[last] == odd_before[first]))


def _convolve(values: Floats, half: int, interval: float) -> Floats:
    """Return the fit, shape (3, n, k), as if every window were complete and even."""
    j = np.arange(-half, half + 1, dtype=np.float64)
    s0, s2, s4 = 2.0 * half + 1.0, float(np.sum(j**2)), float(np.sum(j**4))
    determinant = s0 * s4 - s2**2
    weights = (
        (s4 - s2 * j**2) / determinant,
        j / (s2 * interval),
        2.0 * (s0 * j**2 - s2) / (determinant * interval**2),
    )
    # Centred first, so that a position far from the origin costs no digits.
    center = values.mean(axis=0)
    fit = np.stack(
        [
            np.column_stack([np.convolve(c, w[::-1], mode="full") for c in (values - center).T])
            for w in weights
        ]
    )[:, half : half + len(values)]
    fit[0] += center
    return fit


def _fit_windows(
    time: Floats, values: Floats, at: Indices, first: Indices, last: Indices
) -> Floats:
    """Return the fit, shape (3, len(at), k), on the windows ``first`` to ``last`` around ``at``.

    The parabola is built on polynomials that are orthogonal over the window's own times, with
    times and values relative to the centre sample, so uneven and one-sided windows keep digits.
    """
    offsets = range(int((first - at).min()), int((last - at).max()) + 1)
    scale = np.maximum(time[last] - time[at], time[at] - time[first])

    def members(offset: int) -> tuple[Floats, Floats, Indices]:
        index = at + offset
        inside = (index >= first) & (index <= last)
        index = np.where(inside, index, at)
        return inside.astype(np.float64), (time[index] - time[at]) / scale, index

    mean = sum(w * tau for w, tau, _ in map(members, offsets)) / (last - first + 1)
    moments = np.zeros((5, at.size))
    products = np.zeros((3, at.size, values.shape[1]))
    for w, tau, index in map(members, offsets):
        centred = tau - mean
        rise = values[index] - values[at]
        power = w
        for k in range(5):
            moments[k] += power
            if k < 3:
                products[k] += power[:, None] * rise
            power = power * centred
    return _parabola(moments, products, mean, scale, values[at])


def _parabola(
    moments: Floats, products: Floats, mean: Floats, scale: Floats, origin: Floats
) -> Floats:
    """Return the least-squares parabola at the centre sample from the sums over the window."""
    s0, _, s2, s3, s4 = moments
    # p0 = 1, p1 = c, p2 = c² - (s3/s2) c - s2/s0, orthogonal over the window; c = tau - mean.
    lean, spread = s3 / s2, s2 / s0
    norm = s4 - s3 * lean - s2 * spread
    norm = np.where(norm > _SINGULAR * s4, norm, np.nan)
    b0 = products[0] / s0[:, None]
    b1 = products[1] / s2[:, None]
    p2 = products[2] - lean[:, None] * products[1] - spread[:, None] * products[0]
    b2 = p2 / norm[:, None]
    at, lean, spread, scale = (part[:, None] for part in (-mean, lean, spread, scale))
    value = origin + b0 + b1 * at + b2 * (at**2 - lean * at - spread)
    velocity = (b1 + b2 * (2.0 * at - lean)) / scale
    return np.stack([value, velocity, 2.0 * b2 / scale**2])
