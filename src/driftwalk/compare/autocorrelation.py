"""How long a series remembers: the integrated autocorrelation time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

# Sokal's rule: sum up to the first lag that is this many autocorrelation times away.
WINDOW = 5.0


def autocorrelation_time(series: npt.ArrayLike) -> float:
    """Return the integrated autocorrelation time of a series, in samples.

    tau = 1 + 2 sum of rho(t) over the lags t up to the first one that exceeds 5 tau (Sokal). White
    noise gives 1, an AR(1) process of coefficient phi (1 + phi) / (1 - phi). Never below 1.

    Parameters
    ----------
    series : array_like, shape (n,)
        Values; a constant series gives 1.

    Examples
    --------
    >>> autocorrelation_time([1.0, 1.0, 1.0])
    1.0
    """
    values = np.asarray(series, dtype=np.float64)
    centred = values - values.mean() if values.size else values
    power = float(centred @ centred)
    if values.size < 4 or power <= 0.0:
        return 1.0
    length = 1 << (2 * values.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(centred, length)) ** 2
    rho = np.fft.irfft(spectrum, length)[: values.size] / power
    tau = 2.0 * np.cumsum(rho) - 1.0
    beyond = np.arange(values.size) >= WINDOW * tau
    return max(1.0, float(tau[int(np.argmax(beyond)) if beyond.any() else -1]))


def steps_autocorrelation_time(points: Floats) -> float:
    """Return the longest autocorrelation time of what the KS statistic can see of a series.

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
        times += [
            autocorrelation_time(rank),
            autocorrelation_time(np.abs(rank - rank.mean())),
        ]
    return max(times)
