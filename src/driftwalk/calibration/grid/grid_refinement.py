"""The refined map: windows that close in on the valley until they resolve it.

A window is a grid of the same few nodes, whatever its extent. The settings that the recording does
not exclude, those less than 1.25 floors above the minimum, say where the next window lies:
smaller where they fill a small part of this one, wider or moved where they reach its end. So the
last one has steps that suit the valley along each axis, and a bandwidth narrow against it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.grid.energy_score import EnergyScore, at_settings, smooth_energy_score
from driftwalk.calibration.grid.grid_map import Map, MapSimulator
from driftwalk.calibration.problem import Axes
from driftwalk.core.arrays import Floats

Window = tuple[tuple[float, float], ...]
"""Both ends along each parameter, in its coordinate."""


class RefinementPolicy(NamedTuple):
    """How windows close in on the minimum of the energy score.

    Chosen by hand on slow, regular orbits, where the valley is narrow. The coverage of the 90 %
    regions that follow is counted by `studies/coverage`.
    """

    locating_intervals: tuple[int, int] = (24, 12)
    """Intervals along an axis of a locating window, with one and with two parameters; chosen by
    hand."""
    most_intervals: tuple[int, int] = (96, 18)
    """Most intervals along an axis of the refined map. Its time grows with their product; chosen by
    hand."""
    step_tolerance: float = 1.3
    """A step may exceed the wanted one by this factor before a window is mapped again; chosen by
    hand."""
    most_windows: int = 6
    """Most locating windows: a bound on the time; chosen by hand."""
    locating_replicates: int = 2
    """Fewest replicates from which the floor of a setting can be measured."""
    bandwidth_steps: float = 2.0
    """Least bandwidth of the surface, in steps. Wider ones shift the minimum to the flatter side;
    chosen by hand."""
    bandwidth_share: float = 0.125
    """Least bandwidth of the surface, as a share of the window; chosen by hand."""
    plausible_floors: float = 1.25
    """Height above the minimum, in floors, below which a setting is plausible; chosen by hand."""
    padding: float = 0.2
    """A window exceeds the plausible settings by this share of their extent on each side; chosen by
    hand."""
    smaller: float = 0.6
    """A window is replaced by one at most this share of its extent along an axis; chosen by
    hand."""
    false_alarm_rate: float = 1e-3
    """Share of maps in which chance alone makes a setting better than the optimum."""
    retained_floors: float = 0.8
    """Height above the minimum, in floors, below which settings get all replicates; chosen by
    hand."""


REFINEMENT: Final = RefinementPolicy()


class RefinedMap(NamedTuple):
    """A refined map with its surface."""

    map: Map
    energy_score: EnergyScore
    bandwidth: tuple[float, ...]
    window: Window
    plausible: Window
    """Extent of the plausible settings."""


def first_window(coarse: Map, margin: float) -> Window:
    """Return the extent of the coarse cells that could hold the optimum, and one around."""
    from scipy.ndimage import label

    cell = coarse.cell_of_minimum()
    labels, _ = label(coarse.mean <= coarse.mean[cell] + margin)
    inside = np.argwhere(labels == labels[cell])
    return tuple(
        (float(axis[max(low - 1, 0)]), float(axis[min(high + 1, axis.size - 1)]))
        for axis, low, high in zip(coarse.axes, inside.min(axis=0), inside.max(axis=0), strict=True)
    )


def locate_minimum(maps: MapSimulator, window: Window, limits: Window) -> RefinedMap:
    """Close in on the valley, from a window that holds part of it."""
    seen = set()
    for _ in range(REFINEMENT.most_windows):
        intervals = REFINEMENT.locating_intervals[len(window) - 1]
        axes = window_axes(window, limits, [intervals] * len(window))
        found = refined(maps.full(axes, REFINEMENT.locating_replicates), window, limits)
        seen.add(window)
        following = next_window(found, limits)
        if following in seen:
            break
        window = following
    return found


def refined(found: Map, window: Window, limits: Window) -> RefinedMap:
    """Return a map with its surface and the extent of its plausible settings."""
    steps, share = REFINEMENT.bandwidth_steps, REFINEMENT.bandwidth_share
    widths = tuple(max(steps * _step(axis), share * float(np.ptp(axis))) for axis in found.axes)
    energy_score = smooth_energy_score(found, widths)
    return RefinedMap(found, energy_score, widths, window, _plausible(energy_score, limits))


def _plausible(energy_score: EnergyScore, limits: Window) -> Window:
    """Return the extent of the plausible settings; infinite where they reach the end of a window.

    An end of the search is none of a window.
    """
    from scipy.ndimage import label

    labels, _ = label(energy_score.height <= REFINEMENT.plausible_floors)
    lowest = np.unravel_index(int(np.argmin(energy_score.height)), energy_score.height.shape)
    inside = np.argwhere(labels == labels[lowest])
    bounds = []
    for axis, low, high, ends in zip(
        energy_score.smoother.axes, inside.min(axis=0), inside.max(axis=0), limits, strict=True
    ):
        slack = 1e-6 * float(np.ptp(axis))
        cut_below = low == 0 and axis[0] - ends[0] > slack
        cut_above = high == axis.size - 1 and ends[1] - axis[-1] > slack
        first = -math.inf if cut_below else float(axis[low])
        bounds.append((first, math.inf if cut_above else float(axis[high])))
    return tuple(bounds)


def better_cell(found: Map, energy_score: EnergyScore) -> tuple[int, ...] | None:
    """Return the setting that is nearer than the optimum by more than chance; None without one.

    Half of the smooth floor is taken off the distance of each. Chance is the scatter of the
    replicates of the plausible settings; among all settings of a map without such a setting, one
    is found in one of 1000 maps.
    """
    # Not scipy.stats, whose import takes half a second.
    from scipy.special import ndtri

    height = at_settings(energy_score.height)
    plausible = (height <= REFINEMENT.plausible_floors) & (found.replicates > 1)
    if not plausible.any():
        return None
    error = found.standard_error[plausible] * np.sqrt(found.replicates[plausible])
    spread = float(np.sqrt(np.nanmean(error**2)))
    score = found.mean - 0.5 * at_settings(energy_score.floor)
    lowest = energy_score.optimum.distance - 0.5 * energy_score.floor_at_optimum
    better = (lowest - score) * np.sqrt(found.replicates)
    best = np.unravel_index(int(np.argmax(better)), better.shape)
    if better[best] <= -spread * ndtri(REFINEMENT.false_alarm_rate / better.size):
        return None
    return tuple(int(index) for index in best)


def next_window(found: RefinedMap, limits: Window) -> Window:
    """Return the window that follows one: itself where it resolves the valley."""
    cell = better_cell(found.map, found.energy_score)
    if cell is not None:
        return _half_around(found.map.point(cell), found.map.axes)
    grown = padded(found, limits, beyond=0.5)
    following = []
    for axis, ends, window, other in zip(
        found.map.axes, found.plausible, found.window, grown, strict=True
    ):
        # A valley that the window cuts off has an infinite end: the window moves there.
        fills = REFINEMENT.smaller * float(np.ptp(axis)) < other[1] - other[0]
        following.append(window if fills and np.isfinite(ends).all() else other)
    return tuple(following)


def _half_around(point: Sequence[float], axes: Axes) -> Window:
    """Return a window of half the extent around a point, within a grid."""
    bounds = []
    for value, axis in zip(point, axes, strict=True):
        quarter = 0.25 * float(np.ptp(axis))
        bounds.append((max(value - quarter, float(axis[0])), min(value + quarter, float(axis[-1]))))
    return tuple(bounds)


def window_axes(window: Window, limits: Window, intervals: Sequence[float]) -> Axes:
    """Return a grid over a window, of round numbers.

    Examples
    --------
    >>> window_axes(((0.31, 0.52),), ((0.0, 2.0),), [4])[0].tolist()
    [0.3, 0.35, 0.4, 0.45, 0.5, 0.55]
    """
    return tuple(
        _axis(low, high, ends, count)
        for (low, high), ends, count in zip(window, limits, intervals, strict=True)
    )


def _axis(low: float, high: float, limits: tuple[float, float], intervals: float) -> Floats:
    if limits[1] <= limits[0]:
        return np.array([limits[0]])
    step = round_step((high - low) / intervals)
    slack = 1e-6 * step
    first, last = math.floor(low / step + 1e-6), math.ceil(high / step - 1e-6)
    digits = max(12, 3 - math.floor(math.log10(step)))
    values = np.round(step * np.arange(first, last + 1), digits)
    inside = (values >= limits[0] - slack) & (values <= limits[1] + slack)
    return np.asarray(values[inside])


def round_step(step: float) -> float:
    """Return the largest round number up to a step.

    Examples
    --------
    >>> round_step(0.0173)
    0.015
    """
    power = 10.0 ** math.floor(math.log10(step) + 1e-9)
    nice = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
    return max(one for one in nice if one * power <= step * (1.0 + 1e-9)) * power


def refine(
    maps: MapSimulator, located: RefinedMap, limits: Window, steps: Sequence[float], wanted: int
) -> RefinedMap:
    """Give the located window the replicates that are wanted, where the optimum could be."""
    found = located
    finer = _intervals(located, steps)
    if finer is not None:
        window = padded(located, limits)
        axes = window_axes(window, limits, finer)
        found = refined(maps.full(axes, REFINEMENT.locating_replicates), window, limits)
    low = at_settings(found.energy_score.height) <= REFINEMENT.retained_floors
    return refined(maps.more(found.map, low, wanted), found.window, limits)


def _intervals(located: RefinedMap, steps: Sequence[float]) -> list[float] | None:
    """Return how many intervals each axis should have; None where it has them."""
    most = REFINEMENT.most_intervals[len(steps) - 1]
    wanted = []
    for axis, step in zip(located.map.axes, steps, strict=True):
        intervals = min(float(np.ptp(axis)) / step, most)
        wanted.append(max(intervals, axis.size - 1))
    enough = all(
        REFINEMENT.step_tolerance * (axis.size - 1) >= intervals
        for axis, intervals in zip(located.map.axes, wanted, strict=True)
    )
    return None if enough else wanted


def padded(found: RefinedMap, limits: Window, *, beyond: float = 0.0) -> Window:
    """Return the extent of the plausible settings with some around.

    Where they reach the end of the window, it goes on by at least this share of its extent.
    """
    bounds = []
    for axis, (low, high), ends in zip(found.map.axes, found.plausible, limits, strict=True):
        first, last = (axis[at] if math.isinf(end) else end for at, end in ((0, low), (-1, high)))
        pad = max(REFINEMENT.padding * (last - first), _step(axis))
        before, after = (
            max(pad, beyond * float(np.ptp(axis))) if math.isinf(end) else pad
            for end in (low, high)
        )
        bounds.append((float(max(first - before, ends[0])), float(min(last + after, ends[1]))))
    return tuple(bounds)


def _step(axis: Floats) -> float:
    return float(axis[1] - axis[0]) if axis.size > 1 else 0.0
