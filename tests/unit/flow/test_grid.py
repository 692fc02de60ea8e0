"""Tank outlines and the grid over them, against direct geometry."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.flow.arena import outline_of
from driftwalk.flow.grid import make_grid

CIRCLE = {"shape": "circle", "diameter_m": 0.3, "center_m": [0.0, 0.0]}
RECTANGLE = {"shape": "rectangle", "width_m": 0.4, "height_m": 0.2, "center_m": [0.1, 0.0]}
TRIANGLE = {"shape": "polygon", "vertices_m": [[0.0, 0.2], [-0.1, -0.1], [0.2, -0.1]]}
ARENAS = [CIRCLE, RECTANGLE, TRIANGLE]


def test_depth_of_a_circle_and_a_rectangle() -> None:
    x, y = np.array([0.0, 0.1, 0.2]), np.array([0.0, 0.0, 0.0])
    np.testing.assert_allclose(outline_of(CIRCLE).depth(x, y), [0.15, 0.05, -0.05])
    np.testing.assert_allclose(outline_of(RECTANGLE).depth(x, y), [0.1, 0.1, 0.1])
    np.testing.assert_allclose(
        outline_of(RECTANGLE).depth(np.array([0.35]), np.array([0.09])), [-0.05]
    )


def test_polygon_is_the_same_in_either_order() -> None:
    back = {"shape": "polygon", "vertices_m": TRIANGLE["vertices_m"][::-1]}  # type: ignore[index]
    x, y = np.random.default_rng(0).uniform(-0.2, 0.2, (2, 100))
    np.testing.assert_array_equal(outline_of(TRIANGLE).depth(x, y), outline_of(back).depth(x, y))


@pytest.mark.parametrize("arena", ARENAS)
def test_normal_is_the_gradient_of_the_depth(arena: dict[str, Any]) -> None:
    outline = outline_of(arena)
    x, y = np.random.default_rng(1).uniform(-0.14, 0.14, (2, 200))
    step = 1e-7
    gradient = np.column_stack(
        [
            (outline.depth(x + step, y) - outline.depth(x - step, y)) / (2 * step),
            (outline.depth(x, y + step) - outline.depth(x, y - step)) / (2 * step),
        ]
    )
    # On a line that is equally near to two walls the depth has no gradient.
    smooth = abs(np.hypot(*gradient.T) - 1.0) < 1e-5
    assert smooth.mean() > 0.95
    np.testing.assert_allclose(outline.normal(x, y)[smooth], gradient[smooth], atol=1e-5)


@pytest.mark.parametrize("arena", ARENAS)
def test_leave_finds_the_wall_on_the_way(arena: dict[str, Any]) -> None:
    outline = outline_of(arena)
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-0.14, 0.2, (2, 400))
    inside = outline.depth(x, y) > 0.0
    x, y = x[inside], y[inside]
    heading = rng.uniform(0.0, 2.0 * np.pi, x.size)
    dx, dy = np.cos(heading), np.sin(heading)
    part, normal = outline.leave(x, y, dx, dy)
    at = x + part * dx, y + part * dy
    np.testing.assert_allclose(outline.depth(*at), 0.0, atol=1e-12)
    assert (normal[:, 0] * dx + normal[:, 1] * dy < 0.0).all()
    just_inside = outline.depth(at[0] - 1e-6 * dx, at[1] - 1e-6 * dy)
    assert (just_inside > 0.0).all()


def test_normal_at_the_centre_of_a_circle_is_a_unit_vector() -> None:
    np.testing.assert_array_equal(outline_of(CIRCLE).normal(np.zeros(1), np.zeros(1)), [[1.0, 0.0]])


@pytest.mark.parametrize(
    ("arena", "message"),
    [
        ("{", "not JSON"),
        ("[1]", "object of keys"),
        ({"shape": "ellipse"}, "'ellipse', expected one of circle, rectangle, polygon"),
        ({"shape": "circle"}, "needs diameter_m"),
        ({"shape": "circle", "diameter_m": "3"}, "needs diameter_m"),
        ({"shape": "circle", "diameter_m": -1.0}, "must be positive"),
        ({"shape": "circle", "diameter_m": float("inf")}, "must be positive"),
        ({"shape": "circle", "diameter_m": 1.0, "center_m": 3}, "center_m must be"),
        ({"shape": "circle", "diameter_m": 1.0, "center_m": [math.nan, 0]}, "not finite"),
        ({"shape": "rectangle", "width_m": 1.0}, "height_m"),
        ({"shape": "polygon"}, "vertices_m must be"),
        ({"shape": "polygon", "vertices_m": [[0, 0], [1, 0]]}, "at least 3"),
        ({"shape": "polygon", "vertices_m": [[0, 0], [1, 0], [2, 0]]}, "no area"),
        ({"shape": "polygon", "vertices_m": [[0, 0], [2, 0], [2, 2], [1, 0.5]]}, "not convex"),
    ],
)
def test_refuses_what_is_no_arena(arena: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        outline_of(arena)


def test_grid_of_the_papers_tank() -> None:
    grid = make_grid(outline_of(json.dumps(CIRCLE)))
    assert grid.x.tolist() == [round(-0.147 + 0.006 * i, 3) for i in range(50)]
    np.testing.assert_allclose(grid.y, grid.x)
    assert grid.shape == (50, 50)
    assert grid.size == 2500


def test_cells_count_along_the_longer_side_and_the_rest_is_centred() -> None:
    grid = make_grid(outline_of(RECTANGLE), cells=7)
    assert grid.shape == (4, 7)
    np.testing.assert_allclose(np.diff(grid.x), 0.4 / 7)
    assert grid.y.mean() == pytest.approx(0.0, abs=1e-15)
    assert grid.x.mean() == pytest.approx(0.1)
    assert 4 * grid.cell_size >= 0.2


def test_cell_size_in_place_of_cells() -> None:
    assert make_grid(outline_of(CIRCLE), cell_size=0.03).shape == (10, 10)
    assert make_grid(outline_of(CIRCLE), cell_size=0.04).shape == (8, 8)


@pytest.mark.parametrize(
    "options", [{"cells": 1}, {"cells": 2001}, {"cell_size": 0.2}, {"cell_size": math.nan}]
)
def test_refuses_a_useless_grid(options: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="must be from"):
        make_grid(outline_of(CIRCLE), **options)


def test_cell_of_a_point_is_the_nearest_node() -> None:
    grid = make_grid(outline_of(RECTANGLE), cells=7)
    x = np.random.default_rng(3).uniform(-0.2, 0.4, 500)
    y = np.random.default_rng(4).uniform(-0.2, 0.2, 500)
    half = 0.5 * grid.cell_size
    for px, py, cell in zip(x, y, grid.cell_of(x, y), strict=True):
        away = np.maximum(abs(grid.nodes()[0] - px), abs(grid.nodes()[1] - py)).ravel()
        assert cell == (away.argmin() if away.min() <= half else -1)


def test_every_edge_of_the_bounding_box_has_a_cell() -> None:
    grid = make_grid(outline_of(CIRCLE))
    edges = np.array([-0.15, 0.15])
    np.testing.assert_array_equal(grid.cell_of(edges, edges), [0, 2499])
    np.testing.assert_array_equal(grid.cell_of(np.array([0.1501]), np.array([0.0])), [-1])
