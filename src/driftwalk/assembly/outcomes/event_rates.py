"""Rates of joining and parting per outcome class, with exact Poisson intervals."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.outcomes.distribution import check_confidence
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError


def rate_interval(
    count: npt.ArrayLike, time: npt.ArrayLike, *, confidence: float = 0.9
) -> tuple[Floats, Floats]:
    """Return the exact interval of a rate of independent events.

    The interval of a Poisson mean by Garwood (Biometrika 28, 437, 1936), over the time.

    Parameters
    ----------
    count : array_like of int
        Events that were seen, from 0.
    time : array_like
        Time in which they were seen [s], from 0; broadcast against `count`.
    confidence : float
        Probability with which the interval holds, at least, in (0, 1).

    Returns
    -------
    low, high : ndarray
        Limits [1/s]; 0 and infinity where there was no time.

    Raises
    ------
    InputError
        When a number is negative or the confidence out of range.

    Examples
    --------
    >>> low, high = rate_interval(0, 100.0)
    >>> float(low), round(float(high), 5)
    (0.0, 0.02996)
    """
    from scipy.special import gammaincinv

    check_confidence(confidence)
    k, span = np.broadcast_arrays(np.asarray(count, np.float64), np.asarray(time, np.float64))
    if not ((k >= 0) & (span >= 0)).all():
        raise InputError("a rate needs a count and a time that are not negative")
    tail = (1.0 - confidence) / 2
    known = span > 0
    low = np.where(k > 0, gammaincinv(np.maximum(k, 1.0), tail), 0.0)
    high = gammaincinv(k + 1.0, 1.0 - tail)
    unit = np.where(known, span, 1.0)
    return np.where(known, low / unit, 0.0), np.where(known, high / unit, np.inf)


def rate_variables(
    name: str, count: npt.ArrayLike, time: npt.ArrayLike, *, dim: str, confidence: float
) -> dict[str, Any]:
    """Return a count per class and its rate with interval, as variables of a dataset.

    Parameters
    ----------
    name : str
        Of the rate: ``joining`` gives ``joining_count``, ``joining_rate``, ...
    count, time, confidence
        As in `rate_interval`, one entry per class.
    dim : str
        The dimension of the classes.
    """
    low, high = rate_interval(count, time, confidence=confidence)
    number, span = np.asarray(count), np.asarray(time, dtype=np.float64)
    rate = np.divide(number, span, out=np.full(span.shape, np.nan), where=span > 0)
    return {
        f"{name}_count": (dim, number.astype(np.int64)),
        f"{name}_rate": (dim, rate),
        f"{name}_rate_low": (dim, low),
        f"{name}_rate_high": (dim, high),
    }
