"""The smooth surface against functions that it must reproduce."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from driftwalk.calibration.surface import FINENESS, make_smoother

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


def test_the_lattice_meets_the_grid_at_every_fourth_point():
    np.testing.assert_allclose(SMOOTHER.axes[0][::FINENESS], DRAG)
    np.testing.assert_allclose(SMOOTHER.axes[1][::FINENESS], FORCE)


@pytest.mark.parametrize("centre", [(0.4, 6e-4), (0.3125, 4.15e-4), (0.48, 7.7e-4)])
def test_the_optimum_of_a_bowl_is_its_bottom(centre):
    bowl = ((DRAG[:, None] - centre[0]) / 0.1) ** 2 + ((FORCE[None, :] - centre[1]) / 2e-4) ** 2
    found = SMOOTHER.optimum(bowl)
    assert found.point[0] == pytest.approx(centre[0], abs=0.51 * 0.01 / FINENESS)
    assert found.point[1] == pytest.approx(centre[1], abs=0.51 * 2e-5 / FINENESS)


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
        smooth.append(SMOOTHER.optimum(noisy).point[1] - 6e-4)
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
    lowest = np.unravel_index(np.argmin(lattice), lattice.shape)
    point = tuple(axis[at] for axis, at in zip(smoother.axes, lowest, strict=True))
    assert smoother.optimum(grid).point == pytest.approx(point)
