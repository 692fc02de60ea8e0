"""The smooth surface against functions that it must reproduce."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from driftwalk.calibration.grid.energy_score import (
    FINENESS,
    lattice_of,
    lowest_point,
    make_smoother,
    nearest_point,
)

DRAG = np.linspace(0.3, 0.5, 21)
FORCE = np.linspace(4e-4, 8e-4, 21)
SMOOTHER = make_smoother((DRAG, FORCE), bandwidth=(0.02, 4e-5))
coefficients = st.floats(-1.0, 1.0)


def quadratic(drag, force, c):
    x, y = (drag - 0.4) / 0.1, (force - 6e-4) / 2e-4
    return c[0] + c[1] * x + c[2] * y + c[3] * x**2 + c[4] * x * y + c[5] * y**2


@settings(deadline=None, max_examples=25)
@given(st.tuples(*[coefficients] * 6))
def test_a_quadratic_is_reproduced_everywhere_even_at_the_edges(c):
    grid = quadratic(DRAG[:, None], FORCE[None, :], c)
    lattice = quadratic(SMOOTHER.axes[0][:, None], SMOOTHER.axes[1][None, :], c)
    np.testing.assert_allclose(SMOOTHER.surface(grid.ravel()), lattice, atol=1e-6)


def lowest(smoother, grid):
    return lowest_point(smoother.axes, smoother.surface(np.ravel(grid)))


def test_the_lattice_meets_the_grid_at_every_fourth_point():
    np.testing.assert_allclose(SMOOTHER.axes[0][::FINENESS], DRAG)
    np.testing.assert_allclose(SMOOTHER.axes[1][::FINENESS], FORCE)


@pytest.mark.parametrize("centre", [(0.4, 6e-4), (0.3125, 4.15e-4), (0.48, 7.7e-4)])
def test_the_optimum_of_a_bowl_is_its_bottom(centre):
    bowl = ((DRAG[:, None] - centre[0]) / 0.1) ** 2 + ((FORCE[None, :] - centre[1]) / 2e-4) ** 2
    found = lowest(SMOOTHER, bowl)
    assert found[0] == pytest.approx(centre[0], abs=0.51 * 0.01 / FINENESS)
    assert found[1] == pytest.approx(centre[1], abs=0.51 * 2e-5 / FINENESS)


def test_noise_moves_the_optimum_less_than_it_moves_the_luckiest_cell():
    random = np.random.default_rng(20)
    bowl = (
        0.03
        + 0.4 * ((DRAG[:, None] - 0.4) / 0.1) ** 2
        + 0.1 * ((FORCE[None, :] - 6e-4) / 2e-4) ** 2
    )
    smooth, lucky = [], []
    for _ in range(60):
        noisy = bowl + random.normal(0.0, 0.01, bowl.shape)
        smooth.append(lowest(SMOOTHER, noisy)[1] - 6e-4)
        lucky.append(FORCE[np.unravel_index(np.argmin(noisy), noisy.shape)[1]] - 6e-4)
    assert np.std(smooth) < 0.8 * np.std(lucky)


def test_a_stack_of_surfaces_is_the_surfaces_one_by_one():
    random = np.random.default_rng(1)
    many = random.uniform(size=(3, DRAG.size * FORCE.size))
    together = SMOOTHER.surface(many)
    np.testing.assert_allclose(together[1], SMOOTHER.surface(many[1]))


def test_a_bandwidth_below_the_grid_step_is_widened_to_it():
    narrow = make_smoother((DRAG, FORCE), bandwidth=(1e-6, 1e-9))
    flat = np.full(DRAG.size * FORCE.size, 0.25)
    np.testing.assert_allclose(narrow.surface(flat), 0.25, atol=1e-6)


def test_the_weight_of_a_cell_is_how_often_it_counts():
    """A cell of weight 2 is two cells: by least squares at one point, done by hand."""
    random = np.random.default_rng(4)
    axis = np.linspace(-1.0, 1.0, 6)
    values, weights = random.uniform(size=6), np.array([1.0, 2.0, 1.0, 0.0, 3.0, 1.0])
    smoother = make_smoother((axis,), bandwidth=(1.0,), weights=weights)
    at = 9
    near = np.clip(1.0 - (axis - smoother.axes[0][at]) ** 2 / 4.0, 0.0, None) ** 3
    cells = np.repeat(np.arange(6), weights.astype(int))
    terms = np.vander(axis[cells] - smoother.axes[0][at], 3, increasing=True)
    root = np.sqrt(near[cells])
    solution = np.linalg.lstsq(terms * root[:, None], values[cells] * root, rcond=None)[0]
    assert smoother.surface(values)[at] == pytest.approx(solution[0], abs=1e-6)


def test_far_from_any_cell_the_surface_is_0():
    axis = np.linspace(0.0, 1.0, 21)
    smoother = make_smoother((axis,), bandwidth=(0.1,), weights=(axis < 0.4).astype(float))
    sums = smoother.matrix.sum(axis=1)
    assert sums[smoother.axes[0] < 0.4] == pytest.approx(1.0, abs=1e-6)
    assert (sums[smoother.axes[0] > 0.61] == 0.0).all()


def test_the_nearest_point_of_a_lattice():
    lattice = lattice_of((np.array([0.0, 1.0]), np.array([2.0])))
    assert [axis.tolist() for axis in lattice] == [[0.0, 0.25, 0.5, 0.75, 1.0], [2.0]]
    assert nearest_point(lattice, (0.6, 9.0)) == (2, 0)


@pytest.mark.slow
@pytest.mark.parametrize("parameters", [1, 3])
def test_a_quadratic_in_any_number_of_parameters_is_reproduced(parameters):
    axes = [np.linspace(-1.0, 1.0, 5 + index) for index in range(parameters)]
    smoother = make_smoother(axes, bandwidth=[0.9] * parameters)
    random = np.random.default_rng(parameters)
    curvature, slope = random.normal(size=(parameters, parameters)), random.normal(size=parameters)

    def quadratic_form(grids):
        at = np.stack(grids, axis=-1)
        return 0.3 + at @ slope + np.einsum("...a,ab,...b", at, curvature, at)

    grid = quadratic_form(np.meshgrid(*axes, indexing="ij"))
    lattice = quadratic_form(np.meshgrid(*smoother.axes, indexing="ij"))
    np.testing.assert_allclose(smoother.surface(grid.ravel()), lattice, atol=1e-6)
    assert lowest(smoother, grid) == pytest.approx(lowest_point(smoother.axes, lattice))
