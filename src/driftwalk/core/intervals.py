"""Intervals of proportions, and of the difference of two."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError


def check_confidence(confidence: float) -> None:
    """Raise `InputError` unless the confidence lies between 0 and 1."""
    if not 0 < confidence < 1:
        raise InputError(f"confidence must lie between 0 and 1, got {confidence}")


def proportion_interval(
    count: npt.ArrayLike, runs: npt.ArrayLike, *, confidence: float
) -> tuple[Floats, Floats]:
    """Return the Clopper-Pearson interval of a proportion.

    Parameters
    ----------
    count, runs : array_like of int
        Successes and trials, 0 <= count <= runs; broadcast against each other.
    confidence : float
        Probability with which the interval holds, at least, in (0, 1).

    Returns
    -------
    low, high : ndarray
        Limits; 0 and 1 where there were no trials.

    Raises
    ------
    InputError
        When a number or the confidence is out of range.

    Examples
    --------
    >>> low, high = proportion_interval(0, 10, confidence=0.9)
    >>> float(low), round(float(high), 4)
    (0.0, 0.2589)
    """
    from scipy.special import betaincinv

    check_confidence(confidence)
    k, n = np.broadcast_arrays(np.asarray(count, np.float64), np.asarray(runs, np.float64))
    if not ((k >= 0) & (k <= n)).all():
        raise InputError("a proportion needs 0 <= count <= runs")
    tail = (1.0 - confidence) / 2
    # The parameters are clipped where the limit is known and the beta law is not defined.
    low = np.where(k > 0, betaincinv(np.maximum(k, 1.0), n - k + 1.0, tail), 0.0)
    high = np.where(k < n, betaincinv(k + 1.0, np.maximum(n - k, 1.0), 1.0 - tail), 1.0)
    return low, high


def difference_interval(
    count: npt.ArrayLike, runs: npt.ArrayLike, *, confidence: float
) -> tuple[Floats, Floats]:
    """Return Newcombe's interval of the difference of two independent proportions.

    Parameters
    ----------
    count, runs : array_like of int, shape (2, ...)
        Successes and trials of the first proportion and of the one that is subtracted.
    confidence : float
        Probability with which the interval holds, nearly, in (0, 1).

    Returns
    -------
    low, high : ndarray
        Limits, from Wilson's limits of both: Newcombe, Statistics in Medicine 17, 873 (1998),
        method 10.

    Examples
    --------
    His first example, 56 of 70 less 48 of 80:

    >>> low, high = difference_interval([56, 48], [70, 80], confidence=0.95)
    >>> round(float(low), 4), round(float(high), 4)
    (0.0524, 0.3339)
    """
    from scipy.special import ndtri

    check_confidence(confidence)
    k, n = np.asarray(count, np.float64), np.asarray(runs, np.float64)
    z, p = ndtri(0.5 + 0.5 * confidence), k / n
    middle = (k + 0.5 * z**2) / (n + z**2)
    half = z * np.sqrt(k * (1.0 - p) + 0.25 * z**2) / (n + z**2)
    below, above = (p - middle + half) ** 2, (middle + half - p) ** 2
    low = p[0] - p[1] - np.sqrt(below[0] + above[1])
    high = p[0] - p[1] + np.sqrt(above[0] + below[1])
    return low, high
