"""Splines of the fitted flow: against scipy's B-splines, and integrals by quadrature."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import BSpline

from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.spline import Spline, lay_spline, penalties

SPLINE = Spline(origin_x=-0.05, origin_y=0.02, spacing=0.02, columns=8, rows=6)


def peer(coefficients: np.ndarray, x: np.ndarray, y: np.ndarray, dx: int, dy: int) -> np.ndarray:
    """Return the surface or a derivative from scipy's B-splines on the same knots."""
    d = SPLINE.spacing
    knots_x = SPLINE.origin_x + d * np.arange(-3, SPLINE.columns + 1)
    knots_y = SPLINE.origin_y + d * np.arange(-3, SPLINE.rows + 1)
    along_x, along_y = (
        np.stack(
            [BSpline(knots, row, 3)(at, nu=order) for row in np.eye(count)],
            axis=1,
        )
        for knots, count, at, order in (
            (knots_x, SPLINE.columns, x, dx),
            (knots_y, SPLINE.rows, y, dy),
        )
    )
    return along_y @ coefficients @ along_x.T


def coefficients() -> np.ndarray:
    return np.random.default_rng(3).normal(size=(2, SPLINE.rows, SPLINE.columns))


def test_values_are_those_of_another_library() -> None:
    x = np.linspace(-0.05, 0.0499, 17)
    y = np.linspace(0.02, 0.0799, 13)
    values = SPLINE.values(coefficients(), x, y)
    assert values == pytest.approx(
        np.stack([peer(part, x, y, 0, 0) for part in coefficients()]), abs=1e-12
    )


def test_penalties_are_the_integrals_they_claim_to_be() -> None:
    """Against a Gauss rule of high order in each cell, on scipy's derivatives."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    d = SPLINE.spacing

    def axis(origin: float, cells: int) -> tuple[np.ndarray, np.ndarray]:
        at = origin + d * (np.arange(cells)[:, None] + 0.5 * (nodes + 1.0))
        return at.ravel(), np.tile(0.5 * d * weights, cells)

    x, weight_x = axis(SPLINE.origin_x, SPLINE.columns - 3)
    y, weight_y = axis(SPLINE.origin_y, SPLINE.rows - 3)
    c = coefficients()[0]
    area = weight_y[:, None] * weight_x
    parts = [(peer(c, x, y, *order) ** 2 * area).sum() for order in ((2, 0), (1, 1), (0, 2))]
    roughness, size = penalties(SPLINE)
    assert c.ravel() @ roughness @ c.ravel() == pytest.approx(
        parts[0] + 2.0 * parts[1] + parts[2], rel=1e-10
    )
    assert c.ravel() @ size @ c.ravel() == pytest.approx(
        (peer(c, x, y, 0, 0) ** 2 * area).sum(), rel=1e-10
    )


@pytest.mark.slow
@pytest.mark.false_alarm(2e-5)
def test_standard_errors_are_the_spread_of_drawn_coefficients(
    fresh_seed: Callable[[int], int],
) -> None:
    """4000 draws: each of 24 spreads is off by 5 sd (5.6 %) once in 7e4 runs."""
    generator = np.random.default_rng(fresh_seed(8))
    root = generator.normal(size=(2 * SPLINE.size, 30)) / 30.0
    x, y = np.array([-0.04, -0.01, 0.02, 0.045]), np.array([0.025, 0.05, 0.075])
    errors = SPLINE.standard_errors(root @ root.T, x, y)
    draws = (generator.normal(size=(4000, 30)) @ root.T).reshape(-1, 2, SPLINE.rows, SPLINE.columns)
    spread = np.std([SPLINE.values(draw, x, y) for draw in draws], axis=0)
    assert errors == pytest.approx(spread, rel=0.056)


@pytest.mark.parametrize(
    "arena",
    [
        {"shape": "circle", "diameter_m": 0.3},
        {"shape": "rectangle", "width_m": 0.41, "height_m": 0.2, "center_m": [0.0, 0.0]},
    ],
)
def test_knots_cover_the_tank_from_its_middle(arena: dict[str, object]) -> None:
    outline = outline_of(arena)
    spline = lay_spline(outline, side=0.03, spacing=0.02)
    x_min, y_min, x_max, y_max = outline.bounds
    for origin, cells, low, high in (
        (spline.origin_x, spline.columns - 3, x_min, x_max),
        (spline.origin_y, spline.rows - 3, y_min, y_max),
    ):
        assert origin < low
        assert origin + cells * 0.02 > high
        assert (origin + 0.01 * cells) == pytest.approx((low + high) / 2.0, abs=1e-12)
