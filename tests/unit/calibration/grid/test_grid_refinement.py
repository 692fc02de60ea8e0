"""Windows on painted valleys, whose lowest point is known."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from driftwalk.calibration.grid.energy_score import smooth_energy_score
from driftwalk.calibration.grid.grid_map import Map, full_map
from driftwalk.calibration.grid.grid_refinement import (
    REFINEMENT,
    better_cell,
    first_window,
    locate_minimum,
    refine,
    round_step,
    window_axes,
)

LIMITS = ((0.0, 2.0), (0.0, 2e-3))
STEPS = (0.01, 2e-5)
FLOOR = 0.02
NOISE = 0.003


@dataclass
class Painted:
    """Maps of a valley: D is a floor far from which it rises in proportion.

    `scale` is the distance from the lowest point, along each axis, at which D is 1.4 floors.
    """

    lowest: tuple[float, float]
    scale: tuple[float, float]
    noise: float = NOISE
    tilt: float = 0.0
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(7))
    sizes: list[int] = field(default_factory=list)

    def exact(self, *places):
        x, y = ((at - low) / s for at, low, s in zip(places, self.lowest, self.scale, strict=True))
        return np.minimum(FLOOR * np.sqrt(1.0 + x**2 + y**2 - 2 * self.tilt * x * y), 1.0)

    def full(self, axes, replicates):
        exact = self.exact(*np.meshgrid(*axes, indexing="ij"))[..., None]
        distance = exact + self.noise * self.random.normal(size=(*exact.shape[:-1], replicates))
        apart = FLOOR + 0.3 * self.noise * self.random.normal(size=exact.shape[:-1])
        self.sizes.append(distance.size)
        return full_map(tuple(axes), distance, {"apart": apart})

    def more(self, found, chosen, replicates):
        every = self.full(found.axes, replicates)
        before = found.distance.shape[-1]
        distance = np.where(chosen[..., None], every.distance, np.nan)
        distance[..., :before] = found.distance
        return Map(
            found.axes, distance, found.arrays, np.where(chosen, replicates, found.replicates)
        )


def calibrated(maps):
    """Search as a calibration does, from the paper's coarse grid on."""
    coarse = maps.full((np.arange(41) * 0.05, np.arange(41) * 5e-5), 1)
    return refine(maps, locate_minimum(maps, first_window(coarse, FLOOR), LIMITS), LIMITS, STEPS, 8)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("lowest", [(0.7531, 0.283e-3), (0.775, 0.5e-3), (1.2022, 0.931e-3)])
@pytest.mark.parametrize("scale", [(0.002, 3e-5), (0.005, 8e-5), (0.03, 4e-6), (0.02, 1e-4)])
def test_a_valley_is_resolved_however_narrow_it_is(lowest, scale):
    """The lowest point is found to a third of the valley's scale, some 5 standard errors."""
    found = calibrated(Painted(lowest, scale))
    for index in (0, 1):
        off = found.energy_score.optimum.point[index] - lowest[index]
        assert abs(off) < scale[index] / 3
        assert found.bandwidth[index] < 1.6 * scale[index]
    # Smoothing over such a bandwidth raises the bottom of the valley by a tenth of the floor.
    assert found.energy_score.optimum.distance == pytest.approx(FLOOR, rel=0.15)
    assert better_cell(found.map, found.energy_score) is None


def test_a_valley_across_both_axes_is_resolved():
    maps = Painted((0.6123, 0.618e-3), (0.01, 6e-5), tilt=0.85)
    found = calibrated(maps)
    for value, lowest, scale in zip(
        found.energy_score.optimum.point, maps.lowest, maps.scale, strict=True
    ):
        assert abs(value - lowest) < scale / 2


@pytest.mark.slow
def test_a_wide_valley_costs_no_more_settings_than_a_narrow_one():
    maps = Painted((0.8, 1e-3), (0.4, 4e-4))
    found = calibrated(maps)
    assert max(axis.size for axis in found.map.axes) <= 1.4 * REFINEMENT.most_intervals[1] + 2
    assert found.energy_score.optimum.point == pytest.approx((0.8, 1e-3), rel=0.15)


@pytest.mark.slow
def test_the_steps_of_the_study_are_kept_where_there_is_room():
    found = calibrated(Painted((0.8, 1e-3), (0.05, 8e-5)))
    for axis, step in zip(found.map.axes, STEPS, strict=True):
        assert np.diff(axis).max() < 1.6 * step


@pytest.mark.slow
def test_an_optimum_outside_the_first_window_is_followed():
    maps = Painted((0.9, 1.2e-3), (0.02, 1e-4))
    found = locate_minimum(maps, ((0.75, 0.85), (0.8e-3, 1.0e-3)), LIMITS)
    assert found.energy_score.optimum.point == pytest.approx((0.9, 1.2e-3), rel=0.03)


@pytest.mark.slow
def test_a_window_ends_with_the_search():
    found = calibrated(Painted((0.0, 2e-3), (0.05, 1e-4)))
    assert found.energy_score.optimum.point == pytest.approx((0.0, 2e-3), abs=0.02)
    for axis, limits in zip(found.map.axes, LIMITS, strict=True):
        assert limits[0] <= axis[0] < axis[-1] <= limits[1] * (1 + 1e-12)


def test_replicates_go_where_the_optimum_could_be():
    found = calibrated(Painted((0.75, 0.5e-3), (0.01, 5e-5)))
    counts = found.map.replicates
    assert set(np.unique(counts)) == {2, 8}
    mean = Painted((0.75, 0.5e-3), (0.01, 5e-5)).exact(*np.meshgrid(*found.map.axes, indexing="ij"))
    assert counts[mean < 1.3 * FLOOR].min() == 8
    assert counts[mean > 2.5 * FLOOR].max() == 2


def test_a_setting_that_beats_the_optimum_by_more_than_chance_is_found():
    """A slot of one setting, 10 standard errors deep, on a map that smooths it away."""
    axes = window_axes(((0.7, 0.8), (2e-4, 4e-4)), LIMITS, (12, 12))
    found = Painted((0.75, 3e-4), (0.05, 1e-4)).full(axes, 8)
    widths = [2 * (axis[1] - axis[0]) for axis in axes]
    assert better_cell(found, smooth_energy_score(found, widths)) is None
    found.distance[3, 4] -= 10 * NOISE / np.sqrt(8)
    assert better_cell(found, smooth_energy_score(found, widths)) == (3, 4)


@pytest.mark.slow
def test_chance_alone_beats_the_optimum_in_next_to_no_map():
    """At a rate of 1 in 1000, 2 of 60 maps or more are seen with a chance of 0.2 %."""
    maps = Painted((0.75, 3e-4), (0.05, 1e-4))
    axes = window_axes(((0.6, 0.9), (1e-4, 5e-4)), LIMITS, (6, 6))
    widths = [2 * (axis[1] - axis[0]) for axis in axes]
    beaten = 0
    for _ in range(60):
        found = maps.full(axes, 2)
        beaten += better_cell(found, smooth_energy_score(found, widths)) is not None
    assert beaten <= 1


def test_the_first_window_holds_what_could_be_the_optimum_and_a_cell_around():
    coarse = Painted((0.4, 6e-4), (0.02, 1e-4), noise=0.0).full(
        (np.arange(41) * 0.05, np.arange(41) * 5e-5), 1
    )
    (low, high), force = first_window(coarse, FLOOR)
    assert (low, high) == pytest.approx((0.35, 0.45))
    # D is two floors at 1.7e-4: 3 cells and one more on each side.
    assert force == pytest.approx((6e-4 - 2e-4, 6e-4 + 2e-4))


def test_one_value_of_a_parameter_is_a_grid_of_one():
    (axis,) = window_axes(((0.5, 0.5),), ((0.5, 0.5),), (12,))
    assert axis.tolist() == [0.5]


@pytest.mark.parametrize("power", [1e-5, 1.0])
@pytest.mark.parametrize("nice", [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0])
def test_a_step_is_rounded_down_to_a_round_number(nice: float, power: float) -> None:
    for step in (nice, nice * 1.0001, nice * 1.19):
        assert round_step(step * power) <= step * power * (1 + 1e-9)
    assert round_step(nice * power) == pytest.approx(nice * power, rel=1e-12)
    assert round_step(nice * 1.0001 * power) == pytest.approx(nice * power, rel=1e-12)
