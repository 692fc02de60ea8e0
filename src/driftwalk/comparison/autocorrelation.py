"""How long a series remembers: the integrated autocorrelation time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

# Sokal's rule, five times 1/2 + sum of rho: beyond that lag there is more noise than correlation.
WINDOW = 2.5
# Fewer values than this have no correlation worth the name; also one more than the last of the lags
# that tell how much of a series is correlated.
FEWEST = 4
# A correlation is significant beyond this many standard errors of that of white noise.
SIGNIFICANT = 3.0


def autocorrelation_time(series: npt.ArrayLike) -> float:
    """Return the integrated autocorrelation time of a series, in samples.

    tau = 1 + 2 sum of rho(t) over the lags t up to the first one that exceeds 2.5 tau (Sokal).
    White noise gives 1, an AR(1) process of coefficient phi (1 + phi) / (1 - phi). Never below 1.

    Parameters
    ----------
    series : array_like, shape (n,)
        Values; a constant series gives 1.

    Examples
    --------
    >>> autocorrelation_time([1.0, 1.0, 1.0])
    1.0
    """
    return _integrated(_autocorrelation(np.asarray(series, dtype=np.float64)), 1.0)


def memory_time(series: npt.ArrayLike) -> float:
    """Return the autocorrelation time of the correlated part of a series, in samples.

    White noise on top of a slow motion makes every correlation smaller, and with it the integrated
    autocorrelation time, but the motion remembers as long as before. So the correlations are taken
    relative to the largest at lags 1 to 3; where that one is not significant, this is
    `autocorrelation_time`.

    Parameters
    ----------
    series : array_like, shape (n,)
        Values.

    Examples
    --------
    >>> memory_time([1.0, 1.0, 1.0])
    1.0
    """
    rho = _autocorrelation(np.asarray(series, dtype=np.float64))
    if rho.size < FEWEST:
        return 1.0
    share = float(rho[1:FEWEST].max())
    significant = share > SIGNIFICANT / np.sqrt(rho.size)
    return _integrated(rho, share if significant else 1.0)


def steps_memory_time(points: Floats) -> float:
    """Return the longest memory of what the KS statistic can see of a series of points.

    Taken over the ranks of either column, which a monotone map of an axis does not change, and over
    their distances from the middle rank, which show a slowly changing spread.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        The series in time order.
    """
    times = []
    for column in points.T:
        rank = np.argsort(np.argsort(column, kind="stable"), kind="stable").astype(np.float64)
        times += [memory_time(rank), memory_time(np.abs(rank - rank.mean()))]
    return max(times)


def _autocorrelation(values: Floats) -> Floats:
    """Return rho at every lag; empty where there is none."""
    centred = values - values.mean() if values.size else values
    power = float(centred @ centred)
    if values.size < FEWEST or power <= 0.0:
        return np.empty(0)
    length = 1 << (2 * values.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(centred, length)) ** 2
    rho: Floats = np.fft.irfft(spectrum, length)[: values.size] / power
    return rho


def _integrated(rho: Floats, share: float) -> float:
    """Return 1 + 2 sum of rho / share with Sokal's window."""
    if rho.size == 0:
        return 1.0
    tau = 1.0 + 2.0 * (np.cumsum(rho) - rho[0]) / share
    beyond = np.arange(rho.size) >= WINDOW * tau
    return max(1.0, float(tau[int(np.argmax(beyond)) if beyond.any() else -1]))
