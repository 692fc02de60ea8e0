"""Identifiability: which parameters a recording determines, and their profile likelihoods.

A profile shows how the discrepancy rises along one parameter, with all others where they fit best.
Where it is a parabola, its curvature gives the same interval as the draws; where it is flat, or
rises on one side only, the recording does not determine the parameter.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.estimation.synthetic_likelihood import LocalEmulator, Solution
from driftwalk.core.arrays import Bools, Floats
from driftwalk.schema import Parameter


class DeterminedPolicy(NamedTuple):
    """When a recording determines a parameter (`studies/motion_models/recover.py`)."""

    most_half_width: float = 0.15
    """Half-width over the value: half of the answers are then within 6 % of the truth. Measured
    (studies/motion_models): with a quarter, the median error of some parameters exceeded a
    tenth."""
    confidence: float = 0.9
    """The confidence of the interval that is judged; by convention that of a calibration."""
    small_part: float = 0.05
    """On a linear scale, values near 0 count as large as this part of the range; chosen by hand."""
    range_end: float = 0.01
    """An answer within this part of a range of its end is called open. Chosen by hand."""


DETERMINED: Final = DeterminedPolicy()


class Determination(NamedTuple):
    """How well a recording determines parameters."""

    interval: Floats
    """In the units of the parameters, shape (parameters, 2)."""
    half_width: Floats
    """Half the 90 % interval over the value: of a logarithmic scale, in its logarithm."""
    determined: Bools


def determination(
    sample: Floats, ranges: Sequence[Parameter], *, confidence: float
) -> Determination:
    """Return the intervals of parameters, and which of them are determined.

    Examples
    --------
    >>> speed = Parameter("speed", "m/s", 0.01, 1.0, scale="log")
    >>> found = determination(np.linspace(0.49, 0.51, 101)[:, None], [speed], confidence=0.9)
    >>> found.interval.round(3).tolist(), found.determined.tolist()
    ([[0.096, 0.104]], [True])
    """
    intervals, widths = [], []
    for column, one in zip(sample.T, ranges, strict=True):
        tail = 0.5 * (1.0 - confidence)
        intervals.append(one.value_at(np.quantile(column, [tail, 1.0 - tail])))
        widths.append(_half_width(column, one))
    half_width = np.array(widths)
    return Determination(np.array(intervals), half_width, half_width <= DETERMINED.most_half_width)


def _half_width(column: Floats, parameter: Parameter) -> float:
    """Return half the 90 % interval over the value; infinite where it reaches the range's end."""
    tail = 0.5 * (1.0 - DETERMINED.confidence)
    low, middle, high = np.quantile(column, [tail, 0.5, 1.0 - tail])
    if low < DETERMINED.range_end or high > 1.0 - DETERMINED.range_end:
        return float("inf")
    start, value, end = (float(parameter.value_at(share)) for share in (low, middle, high))
    return relative_half_width(start, value, end, parameter)


def relative_half_width(
    start: float, value: float, end: float, parameter: Parameter, *, factor: float = 1.0
) -> float:
    """Return half an interval over the value, or over a small part of the range if that is more.

    The interval is made longer by a factor, as for another confidence.
    """
    if parameter.scale == "log":
        return 0.5 * factor * float(np.log(end / start))
    size = max(abs(value), DETERMINED.small_part * (parameter.high - parameter.low))
    return 0.5 * factor * (end - start) / size


class Profiles(NamedTuple):
    """The least discrepancy along each parameter."""

    place: Floats
    """Values of the parameter in the unit cube, shape (parameters, 21)."""
    rise: Floats
    """The discrepancy less its least value, same shape."""


def discrepancy_profiles(
    emulator: LocalEmulator, summaries: Floats, solution: Solution, std: Floats, *, reach: float
) -> Profiles:
    """Return the profile of the discrepancy of each parameter."""
    points, span = 21, 3.0
    low = np.maximum(emulator.centre - reach * emulator.width, 0.0)
    high = np.minimum(emulator.centre + reach * emulator.width, 1.0)

    def rise(index: int, place: Floats) -> Floats:
        """Return the discrepancy along one parameter less the least, out from the solution."""
        discrepancy = np.empty(place.size)
        middle = int(np.abs(place - solution.setting[index]).argmin())
        for way in (range(middle, place.size), range(middle - 1, -1, -1)):
            start = solution.setting
            for number in way:
                held = (index, float(place[number]))
                found = emulator.solve(summaries, reach=reach, start=start, held=held)
                discrepancy[number], start = found.discrepancy, found.setting
        return np.asarray(np.maximum(discrepancy - solution.discrepancy, 0.0))

    places = []
    for index, middle in enumerate(solution.setting):
        first = max(middle - span * std[index], low[index])
        last = min(middle + span * std[index], high[index])
        places.append(np.linspace(first, last, points))
    rises = [rise(index, place) for index, place in enumerate(places)]
    return Profiles(np.array(places), np.array(rises))
