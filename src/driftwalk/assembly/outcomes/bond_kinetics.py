"""Rates at which blocks join and part, per outcome class and per bond.

The rates of recorded classes have Poisson intervals that know of clusters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.join_history import JoinHistory
from driftwalk.assembly.outcomes.distribution import with_limits
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.intervals import check_confidence
from driftwalk.schema.shapes import cells_of_shape, joins_of_cells

RATE_CONFIDENCE: Final = 0.9
"""Probability with which an interval of a rate holds, as elsewhere; by convention."""
PARTS: Final = 5
"""Parts of a class's time that tell how events cluster; measured: of 4, 5, 8 and 12 the number
whose 90 % intervals held most evenly in simulated recordings of 300 to 1800 s."""


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
    low = np.where(k > 0, gammaincinv(np.where(k > 0, k, 1.0), tail), 0.0)
    high = gammaincinv(k + 1.0, 1.0 - tail)
    unit = np.where(known, span, 1.0)
    return np.where(known, low / unit, 0.0), np.where(known, high / unit, np.inf)


def clustering(
    moments: npt.ArrayLike, time: float, *, parts: int = PARTS, confidence: float = 0.9
) -> float:
    """Return the factor by which an interval must count fewer events because they cluster.

    It is the variance of the counts in equal parts of the time over their mean, times the square
    of Student's quantile over the normal one, as few parts do not tell it well; at least 1.

    Parameters
    ----------
    moments : array_like
        When each event came, in [0, time] [s].
    time : float
        Time in which they were seen [s].
    parts : int
        Number of parts, from 2.
    confidence : float
        As in `rate_interval`.

    Examples
    --------
    >>> clustering([1.0, 3.0, 5.0, 7.0, 9.0], 10.0)
    1.0
    >>> round(clustering([1.0, 1.1, 1.2, 1.3, 9.0], 10.0), 2)
    5.04
    """
    from scipy.special import ndtri, stdtrit

    when = np.asarray(moments, dtype=np.float64)
    if when.size == 0 or not time > 0:
        return 1.0
    counts = np.histogram(when, bins=parts, range=(0.0, time))[0]
    ratio = float(counts.var(ddof=1) / counts.mean())
    end = (1.0 + confidence) / 2
    return max(1.0, float(ratio * (stdtrit(parts - 1, end) / ndtri(end)) ** 2))


def bridges_of(name: str) -> int:
    """Return the bonds of an outcome class of squares; 0 where loops hold blocks more than once.

    Examples
    --------
    >>> [bridges_of(name) for name in ("1+1", "L3+2", "O+1", "12 assemblies")]
    [0, 3, 0, 0]
    """
    bonds = 0
    for cells in map(cells_of_shape, name.split("+")):
        beside = joins_of_cells(cells)
        if not cells or beside > len(cells) - 1:
            return 0
        bonds += beside
    return bonds


def rate_variables(
    name: str,
    count: npt.ArrayLike,
    time: npt.ArrayLike,
    *,
    confidence: float,
    clusters: npt.ArrayLike = 1.0,
) -> dict[str, Any]:
    """Return a count per class and its rate with interval, as variables of a dataset.

    Parameters
    ----------
    name : str
        Of the rate: ``joining`` gives ``joining_count``, ``joining_rate``, ...
    count, time, confidence
        As in `rate_interval`, one entry per class.
    clusters : array_like
        By how much events cluster: the interval is for this factor fewer events in less time.
    """
    number, span = np.asarray(count), np.asarray(time, dtype=np.float64)
    fewer = 1.0 / np.asarray(clusters, dtype=np.float64)
    low, high = rate_interval(number * fewer, span * fewer, confidence=confidence)
    rate = np.divide(number, span, out=np.full(span.shape, np.nan), where=span > 0)
    return {
        f"{name}_count": ("class", number.astype(np.int64)),
        **with_limits(f"{name}_rate", "class", rate, low, high),
    }


def recorded_rates(
    history: JoinHistory, outcome: npt.NDArray[np.int32], lasts: Floats, classes: Sequence[str]
) -> dict[str, Any]:
    """Return how often blocks joined and parted in each class, over the time in it.

    Events while the class is not known are left out, as that time is.

    Parameters
    ----------
    history : JoinHistory
        Joins and partings of the recording.
    outcome : ndarray of int32, shape (samples,)
        Index into `classes`, -1 where the class is not known.
    lasts : ndarray, shape (samples,)
        How long each sample counts [s].
    classes : sequence of str
        The outcome classes of the recording.
    """
    # What came apart at a sample did so before what joined there.
    events = [(event, "parting") for event in history.split]
    events += [(event, "joining") for event in history.joined]
    events.sort(key=lambda one: one[0].sample)
    spent = np.where(outcome[:, None] == np.arange(len(classes)), lasts[:, None], 0.0)
    clock = np.vstack([np.zeros(len(classes)), np.cumsum(spent, axis=0)])
    before = classes.index(history.outcome[0])
    when: dict[str, list[list[float]]] = {
        kind: [[] for _ in classes] for kind in ("joining", "parting")
    }
    for event, kind in events:
        if outcome[max(event.sample - 1, 0)] >= 0:
            when[kind][before].append(clock[event.sample, before])
        before = classes.index(event.outcome)
    data: dict[str, Any] = {}
    for kind, moments in when.items():
        # Bonds break independently of each other; blocks that parted lately are near each other.
        clusters = [
            clustering(one, time, confidence=RATE_CONFIDENCE) if kind == "joining" else 1.0
            for one, time in zip(moments, clock[-1], strict=True)
        ]
        counts = [len(one) for one in moments]
        data |= rate_variables(
            kind, counts, clock[-1], confidence=RATE_CONFIDENCE, clusters=clusters
        )
    return data


def bond_rate(
    rates: dict[str, Any], outcome: npt.NDArray[np.int32], lasts: Floats, classes: Sequence[str]
) -> dict[str, float]:
    """Return the partings per bond and second in classes without loops, where there are any.

    Parameters
    ----------
    rates : dict
        As `recorded_rates` gives them.
    outcome, lasts, classes
        As in `recorded_rates`.
    """
    bonds = np.array([bridges_of(name) for name in classes])
    time = float((lasts * np.where(outcome >= 0, bonds[outcome], 0)).sum())
    if time == 0.0:
        return {}
    count = int(rates["parting_count"][1][bonds > 0].sum())
    low, high = rate_interval(count, time, confidence=RATE_CONFIDENCE)
    return {
        "bond_rate_per_s": count / time,
        "bond_rate_low_per_s": float(low),
        "bond_rate_high_per_s": float(high),
    }
