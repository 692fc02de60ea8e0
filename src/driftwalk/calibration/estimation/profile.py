"""How the discrepancy rises along one parameter, with all others where they fit best.

A profile likelihood: where it is a parabola, its curvature gives the same interval as the draws;
where it is flat, or rises on one side only, the recording does not determine the parameter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwalk.calibration.estimation.emulator import LocalEmulator, Solution
from driftwalk.core.arrays import Floats


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
    places, rises = [], []
    for index in range(solution.setting.size):
        middle = solution.setting[index]
        first = max(middle - span * std[index], low[index])
        last = min(middle + span * std[index], high[index])
        place = np.linspace(first, last, points)
        places.append(place)
        rises.append(_rise(emulator, summaries, solution, index, place, reach))
    return Profiles(np.array(places), np.array(rises))


def _rise(
    emulator: LocalEmulator,
    summaries: Floats,
    solution: Solution,
    index: int,
    place: Floats,
    reach: float,
) -> Floats:
    """Return the discrepancy along one parameter less the least, going out from the solution."""
    discrepancy = np.empty(place.size)
    middle = int(np.abs(place - solution.setting[index]).argmin())
    for way in (range(middle, place.size), range(middle - 1, -1, -1)):
        start = solution.setting
        for number in way:
            found = emulator.solve(
                summaries, reach=reach, start=start, held=(index, float(place[number]))
            )
            discrepancy[number], start = found.discrepancy, found.setting
    return np.asarray(np.maximum(discrepancy - solution.discrepancy, 0.0))
