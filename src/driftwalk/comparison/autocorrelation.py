"""Integrated autocorrelation time of a series."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


class AutocorrelationPolicy(NamedTuple):
    """How far an autocorrelation is summed, and when it counts."""

    window: float = 2.5
    """Largest lag, in autocorrelation times: five times 1/2 + sum of rho, the rule of Sokal."""
    fewest: int = 4
    """Values without which there is no correlation, and one more than the last lag that tells
    how much of a series is correlated; chosen by hand."""
    significant: float = 3.0
    """Standard errors of white noise from which on a correlation is significant: 0.3 % of white
    series."""


_AUTOCORRELATION: Final = AutocorrelationPolicy()


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
    if rho.size < _AUTOCORRELATION.fewest:
        return 1.0
    share = float(rho[1 : _AUTOCORRELATION.fewest].max())
    significant = share > _AUTOCORRELATION.significant / np.sqrt(rho.size)
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
    if values.size < _AUTOCORRELATION.fewest or power <= 0.0:
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
    beyond = np.arange(rho.size) >= _AUTOCORRELATION.window * tau
    return max(1.0, float(tau[int(np.argmax(beyond)) if beyond.any() else -1]))
