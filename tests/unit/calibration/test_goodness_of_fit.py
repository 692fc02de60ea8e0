"""Which settings the halves of a recording leave out."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.calibration.goodness_of_fit import GoodnessOfFit, could_be_best
from driftwalk.calibration.grid.grid_map import MapSimulator, full_map
from driftwalk.calibration.problem import prepare_problem
from driftwalk.schema import Track, body_track
from driftwalk.simulation.backend import Camera


@pytest.mark.parametrize(("distance", "stretch"), [(0.3, 3.0), (0.1, 1.0), (0.05, 1.0)])
def test_errors_are_widened_by_the_distance_in_floors(distance: float, stretch: float):
    """And made no smaller where chance brought the two nearer than the floor."""
    assert GoodnessOfFit(distance, 0.01, 0.1, 0.2).stretch == pytest.approx(stretch)


@pytest.mark.slow
def test_the_best_setting_of_a_half_is_among_those_that_could_be():
    """Every setting is simulated for the half, too: the nearest ones may not be left out."""
    track = body_track(dw.tank30_recording().isel(time=slice(0, 2400)))
    camera = Camera(3e-4, 0.0, 0.0)
    half = Track(*(values[:1200] for values in track))
    whole, first = (
        prepare_problem(one, dw.Study(), dw.tank30_flow(), camera=camera, threads=1)
        for one in (track, half)
    )
    axes = np.arange(1, 9) * 0.1, np.arange(0, 9) * 2e-4
    coarse = MapSimulator(whole, "coarse", apart=False).full(axes, 1)
    of_half = MapSimulator(first, "first_half", apart=False).full(axes, 1)
    possible = could_be_best(whole, coarse, first)
    assert possible[of_half.mean <= of_half.mean.min() + 0.02].all()
    assert 0.02 < possible.mean() < 0.7


def test_the_margin_is_that_of_the_triangle_inequality():
    """A half that is the whole leaves no margin but chance: two floors."""
    track = body_track(dw.tank30_recording().isel(time=slice(0, 600)))
    camera = Camera(3e-4, 0.0, 0.0)
    whole = prepare_problem(track, dw.Study(), dw.tank30_flow(), camera=camera, threads=1)
    axes = np.array([0.4]), np.array([0.0, 3e-4, 6e-4, 9e-4])
    from driftwalk.calibration.goodness_of_fit import noise_floor_at

    floor = noise_floor_at(whole, (0.4, 6e-4))
    distance = floor * np.array([[3.5, 2.9, 1.0, 3.1]])[..., None]
    coarse = full_map(axes, distance, {})
    assert could_be_best(whole, coarse, whole).tolist() == [[False, True, True, False]]
    moved = dataclasses.replace(
        whole.reference, steps=np.ascontiguousarray(whole.reference.steps * [1.1, 1.0])
    )
    other = dataclasses.replace(whole, reference=moved)
    assert could_be_best(whole, coarse, other).tolist() == [[True, True, True, True]]


def test_the_margin_is_twice_the_distance_and_two_floors(monkeypatch: pytest.MonkeyPatch):
    """Of a half 0.05 from the whole, with a floor of 0.02: 0.14 above the nearest setting."""
    from driftwalk.calibration import goodness_of_fit

    asked = []

    def floor_at(part: Any, point: tuple[float, ...]) -> float:
        asked.append(point)
        return 0.02

    monkeypatch.setattr(goodness_of_fit, "noise_floor_at", floor_at)
    statistic = SimpleNamespace(matrix=lambda *_, threads: np.array([[0.05]]))
    whole: Any = SimpleNamespace(
        statistic=statistic,
        reference=SimpleNamespace(table=None),
        like=SimpleNamespace(threads=1),
    )
    distance = 0.3 + np.array([[0.139, 0.0, 0.141]])[..., None]
    coarse = full_map((np.array([0.4]), np.array([0.0, 3e-4, 6e-4])), distance, {})
    assert could_be_best(whole, coarse, whole).tolist() == [[True, True, False]]
    assert asked == [(0.4, 3e-4)]
