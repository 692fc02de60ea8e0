"""Parameters drawn from a calibration's joint region. The calibrations here are synthetic."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from matplotlib.path import Path
from quadratic_calibration import CENTER, LEVEL, LOW, WIDTH, quadratic, region_calibration
from scipy.stats import kstest

from driftwalk.assembly.runs.draws import _inside, draw_parameters, has_region
from driftwalk.core.errors import InputError


def scaled(drag_coefficient: np.ndarray, force_std: np.ndarray) -> np.ndarray:
    """Return the draws in units of the ellipse's half axes."""
    return (np.column_stack([drag_coefficient, force_std]) - CENTER) / WIDTH


@pytest.mark.slow
@pytest.mark.false_alarm(2e-5)
@pytest.mark.parametrize("confidence", [0.5, 0.9])
def test_draws_have_the_weight_that_is_stated(
    confidence: float, fresh_seed: Callable[[int], int]
) -> None:
    """With weight (1 - c)^(r^2) on the unit disc, r^2 has the law (1 - (1 - c)^t) / c.

    False alarm 1e-5 per test. The law of an unweighted draw, t, is 0.09 (c = 0.5) and 0.27
    (c = 0.9) away; the limit at 4000 draws is 0.039.
    """
    drawn = draw_parameters(quadratic(confidence=confidence), runs=4000, seed=fresh_seed(7))
    point = scaled(*drawn)
    square = (point**2).sum(axis=1)
    law = kstest(square, lambda t: (1.0 - (1.0 - confidence) ** np.clip(t, 0, 1)) / confidence)
    assert law.pvalue > 1e-5
    turn = np.arctan2(point[:, 1], point[:, 0])
    assert kstest(turn, lambda t: (t + np.pi) / (2.0 * np.pi)).pvalue > 1e-5


@pytest.mark.slow
def test_draws_lie_in_the_region_and_fill_it() -> None:
    point = scaled(*draw_parameters(quadratic(), runs=3000, seed=1))
    assert (np.hypot(*point.T) <= 1.0 + 1e-9).all()
    assert (point.min(axis=0) < -0.9).all()
    assert (point.max(axis=0) > 0.9).all()


def test_draws_follow_a_bent_valley() -> None:
    """A region with a bend: no draw lies on the inside of it, where both marginals are dense."""
    drag, force = np.linspace(0.0, 1.0, 81), np.linspace(0.0, 1e-3, 81)
    radius = np.hypot(drag[:, None], force[None, :] / 1e-3)
    surface = LOW + (LEVEL - LOW) * ((radius - 0.8) / 0.1) ** 2
    turn = np.linspace(0.0, 0.5 * np.pi, 60)
    arc = np.column_stack([np.cos(turn), 1e-3 * np.sin(turn)])
    border = np.vstack([0.9 * arc, 0.7 * arc[::-1], 0.9 * arc[:1]])
    drawn = draw_parameters(region_calibration(drag, force, surface, border), runs=2000, seed=3)
    distance = np.hypot(drawn.drag_coefficient, drawn.force_std / 1e-3)
    assert distance.min() > 0.699
    assert distance.max() < 0.901
    assert np.hypot(drawn.drag_coefficient.mean(), drawn.force_std.mean() / 1e-3) < 0.75


def test_a_runs_parameters_depend_on_its_address_alone() -> None:
    known = quadratic()
    many = draw_parameters(known, runs=1500, seed=5, trial=1)
    few = draw_parameters(known, runs=10, seed=5, trial=1)
    for a, b in zip(many, few, strict=True):
        np.testing.assert_array_equal(a[:10], b)
    for other in ({"seed": 6, "trial": 1}, {"seed": 5, "trial": 2}):
        assert not np.isin(draw_parameters(known, runs=10, **other).force_std, few.force_std).any()
    assert np.unique(many.drag_coefficient).size == 1500


def test_a_region_at_the_end_of_the_grid_gives_no_negative_parameter() -> None:
    drag, force = np.linspace(0.0, 0.1, 11), np.linspace(0.0, 1e-3, 11)
    surface = LOW + (LEVEL - LOW) * (drag[:, None] / 0.05 + force[None, :] / 1e-3)
    border = np.array([[-1e-9, -1e-9], [0.05, -1e-9], [-1e-9, 1e-3], [-1e-9, -1e-9]])
    drawn = draw_parameters(region_calibration(drag, force, surface, border), runs=500)
    assert drawn.drag_coefficient.min() >= 0.0
    assert drawn.force_std.min() >= 0.0
    assert (drawn.drag_coefficient / 0.05 + drawn.force_std / 1e-3 <= 1.0 + 1e-6).all()


def test_a_grid_with_one_value_on_an_axis() -> None:
    force = np.linspace(0.0, 1e-3, 21)
    surface = LOW + (LEVEL - LOW) * ((force - 0.5e-3) / 0.2e-3)[None, :] ** 2
    thin = 1e-9 * np.array([-1.0, 1.0, 1.0, -1.0, -1.0])
    border = np.column_stack([0.4 + thin, np.array([0.3, 0.3, 0.7, 0.7, 0.3]) * 1e-3])
    drawn = draw_parameters(region_calibration(np.array([0.4]), force, surface, border), runs=200)
    np.testing.assert_allclose(drawn.drag_coefficient, 0.4, atol=2e-9)
    assert ((drawn.force_std >= 0.3e-3) & (drawn.force_std <= 0.7e-3)).all()


@pytest.mark.parametrize("name", ["region_drag_coefficient", "refined_surface"])
def test_a_calibration_without_a_region_is_refused(name: str) -> None:
    known = quadratic()
    assert has_region(known)
    lacking = known.drop_vars(name)
    assert not has_region(lacking)
    with pytest.raises(InputError, match=r"no joint region .*`calibration.bootstrap=200`"):
        draw_parameters(lacking, runs=3)


@settings(deadline=None, max_examples=60)
@given(
    radii=st.lists(st.floats(0.2, 2.0), min_size=3, max_size=12),
    seed=st.integers(0, 2**32 - 1),
)
def test_inside_a_star_shaped_border(radii: list[float], seed: int) -> None:
    """Against matplotlib's test for points in a polygon."""
    turn = np.linspace(0.0, 2.0 * np.pi, len(radii), endpoint=False)
    border = np.column_stack([radii * np.cos(turn), radii * np.sin(turn)])
    closed = np.vstack([border, border[:1]])
    points = np.random.default_rng(seed).uniform(-2.1, 2.1, (200, 2))
    np.testing.assert_array_equal(_inside(closed, points), Path(closed).contains_points(points))
