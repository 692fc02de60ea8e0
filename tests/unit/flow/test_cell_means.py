"""Filling: a dense oracle, exact fields, and the wall."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from driftwalk.core.errors import InputError
from driftwalk.flow import cell_means
from driftwalk.flow.arena import outline_of
from driftwalk.flow.cell_means import fill_velocity
from driftwalk.flow.grid import Grid, make_grid

Array = npt.NDArray[np.float64]
CIRCLE = {"shape": "circle", "diameter_m": 0.3}
RECTANGLE = {"shape": "rectangle", "width_m": 0.3, "height_m": 0.2}
HEXAGON = {
    "shape": "polygon",
    "vertices_m": [[0.15 * np.cos(a), 0.15 * np.sin(a)] for a in np.arange(6) * np.pi / 3],
}


def minimise_energy(grid: Grid, velocity: Array, known: Array, radius: float) -> Array:
    """Oracle for a circle: the dense quadratic form of the docstring, minimised with lstsq."""
    x, y = grid.nodes()
    inside = (np.hypot(x, y) <= radius) | known
    rows, right = [], []

    def row(parts: list[tuple[int, int, int, float]]) -> None:
        line, constant = np.zeros(2 * grid.size), 0.0
        for j, i, component, weight in parts:
            if known[j, i]:
                constant -= weight * velocity[j, i, component]
            else:
                line[2 * (j * grid.x.size + i) + component] += weight
        rows.append(line)
        right.append(constant)

    for j in range(grid.y.size):
        for i in range(grid.x.size):
            if not inside[j, i]:
                continue
            for dj, di in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                nj, ni = j + dj, i + di
                on_grid = 0 <= nj < grid.y.size and 0 <= ni < grid.x.size
                if on_grid and inside[nj, ni]:
                    if dj + di > 0:  # each link once
                        for c in range(2):
                            row([(nj, ni, c, 1.0), (j, i, c, -1.0)])
                elif not known[j, i]:
                    h = grid.cell_size
                    along = np.linspace(0.0, 1.0, 2_000_001)
                    r = np.hypot(x[j, i] + along * di * h, y[j, i] + along * dj * h)
                    part = float(along[np.argmax(r > radius)])
                    at = np.array([x[j, i] + part * di * h, y[j, i] + part * dj * h])
                    n = -at / np.hypot(*at) / np.sqrt(part)
                    row([(j, i, 0, float(n[0])), (j, i, 1, float(n[1]))])
    solution = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
    free = inside & ~known
    return np.where(free[..., None], solution.reshape(*grid.shape, 2), velocity)


@pytest.mark.slow
def test_filled_cells_minimise_the_stated_energy() -> None:
    grid = make_grid(outline_of(CIRCLE), cells=7)
    x, y = grid.nodes()
    rng = np.random.default_rng(0)
    velocity = rng.normal(size=(*grid.shape, 2))
    known = (np.hypot(x, y) < 0.12) & (rng.random(grid.shape) < 0.5)
    filled = fill_velocity(grid, velocity, known=known, outline=outline_of(CIRCLE))
    oracle = minimise_energy(grid, velocity, known, 0.15)
    inside = np.hypot(x, y) <= 0.15
    np.testing.assert_allclose(filled[inside], oracle[inside], atol=1e-5)


def test_known_nodes_stay_and_everything_is_finite() -> None:
    grid = make_grid(outline_of(CIRCLE), cells=20)
    known = np.zeros(grid.shape, dtype=bool)
    known[5, 7] = known[0, 0] = True  # (0, 0) lies far beyond the wall
    velocity = np.full((*grid.shape, 2), np.nan)
    velocity[5, 7], velocity[0, 0] = (0.1, -0.2), (0.3, 0.0)
    filled = fill_velocity(grid, velocity, known=known, outline=outline_of(CIRCLE))
    np.testing.assert_array_equal(filled[known], velocity[known])
    assert np.isfinite(filled).all()


@pytest.mark.parametrize("arena", [CIRCLE, RECTANGLE, HEXAGON])
@pytest.mark.parametrize("field", ["uniform", "rotation"])
def test_holes_in_a_linear_field_are_filled_exactly(arena: dict[str, Any], field: str) -> None:
    """Away from the wall, to 1e-8 of the largest speed: a linear field solves the equation."""
    outline = outline_of(arena)
    grid = make_grid(outline, cells=30)
    x, y = grid.nodes()
    exact = np.stack([0.1 + 0 * x, 0 * x] if field == "uniform" else [-y, x], axis=-1)
    deep = (outline.depth(x.ravel(), y.ravel()) > 2.0 * grid.cell_size).reshape(grid.shape)
    holes = deep & (np.random.default_rng(1).random(grid.shape) < 0.6)
    filled = fill_velocity(grid, exact, known=~holes, outline=outline)
    assert np.count_nonzero(holes) > 100
    assert abs(filled - exact)[holes].max() < 1e-8 * np.hypot(*exact[deep].T).max()


def test_rotation_measured_where_a_block_can_be_is_continued_to_the_wall() -> None:
    """The ring that the centre of a 3-cm block cannot reach, to 15 % of the speed at the wall.

    The fill keeps the tangential speed up to the wall; the rotation grows by 11 % across it.
    """
    grid = make_grid(outline_of(CIRCLE))
    x, y = grid.nodes()
    exact = np.stack([-y, x], axis=-1)
    r = np.hypot(x, y)
    filled = fill_velocity(grid, exact, known=r < 0.135, outline=outline_of(CIRCLE))
    ring = (r >= 0.135) & (r <= 0.15)
    assert np.hypot(*(filled - exact)[ring].T).max() < 0.15 * 0.15


@pytest.mark.parametrize("arena", [CIRCLE, RECTANGLE, HEXAGON])
def test_filled_rim_has_no_flow_through_the_wall(arena: dict[str, Any]) -> None:
    """A uniform stream is bent along the wall: at the outermost nodes its normal part is gone."""
    outline = outline_of(arena)
    grid = make_grid(outline, cells=60)
    x, y = grid.nodes()
    depth = outline.depth(x.ravel(), y.ravel()).reshape(grid.shape)
    stream = np.stack([np.ones_like(x), np.zeros_like(x)], axis=-1)
    filled = fill_velocity(grid, stream, known=depth > 0.03, outline=outline)
    normal = outline.normal(x.ravel(), y.ravel()).reshape(*grid.shape, 2)
    through = abs(np.sum(filled * normal, axis=-1))
    assert through[depth < 0.0].max(initial=0.0) < 1e-12
    # The normal part falls linearly from 1 to 0 over 3 cm; half a cell from the wall is 2.5 mm.
    rim = (depth >= 0.0) & (depth < 0.501 * grid.cell_size)
    assert np.count_nonzero(rim) > 20
    assert through[rim].max() < 0.15


def test_without_an_outline_every_node_is_inside() -> None:
    grid = Grid(np.arange(6.0), np.arange(4.0), 1.0)
    known = np.zeros((4, 6), dtype=bool)
    known[:, [0, 5]] = True
    ramp = np.stack([grid.nodes()[0], -grid.nodes()[0]], axis=-1)
    np.testing.assert_allclose(fill_velocity(grid, ramp, known=known), ramp, atol=1e-9)


def test_refuses_to_fill_from_nothing() -> None:
    grid = Grid(np.arange(3.0), np.arange(3.0), 1.0)
    with pytest.raises(InputError, match="no known node to fill from"):
        fill_velocity(grid, np.zeros((3, 3, 2)), known=np.zeros((3, 3), dtype=bool))


def test_says_so_when_the_solver_gives_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cell_means, "_MAX_ITERATIONS", 1)
    grid = make_grid(outline_of(CIRCLE), cells=20)
    known = np.zeros(grid.shape, dtype=bool)
    known[10, 10] = True
    with pytest.raises(InputError, match="`cells`"):
        fill_velocity(grid, np.ones((20, 20, 2)), known=known, outline=outline_of(CIRCLE))
