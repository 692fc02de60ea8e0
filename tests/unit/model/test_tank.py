"""Outlines: circle, rectangle, convex polygon; the arena attribute; the grid of a calibration."""

from __future__ import annotations

import json
import math

import pytest

from driftwalk.core.errors import ConfigurationError
from driftwalk.model import Calibration, FieldOfView, Pose, Tank
from driftwalk.model.block import Block
from driftwalk.model.study import block_corners

HEXAGON = tuple((math.cos(k * math.pi / 3), math.sin(k * math.pi / 3)) for k in range(6))


def test_circle() -> None:
    tank = Tank(diameter_m=0.3)
    assert (tank.radius_m, tank.extent_m, tank.narrowest_m) == (0.15, (0.3, 0.3), 0.3)
    assert tank.contains(0.15, 0.0)
    assert not tank.contains(0.11, 0.11)
    assert tank.corners_m == ()


def test_rectangle() -> None:
    tank = Tank(shape="rectangle", width_m=0.4, height_m=0.2)
    assert tank.radius_m is None
    assert tank.narrowest_m == pytest.approx(0.2)
    assert tank.contains(0.2, 0.1)
    assert not tank.contains(0.0, 0.11)
    assert tank.corners_m == ((-0.2, -0.1), (0.2, -0.1), (0.2, 0.1), (-0.2, 0.1))


def test_polygon_is_stored_counter_clockwise() -> None:
    forward = Tank(shape="polygon", vertices_m=HEXAGON)
    backward = Tank(shape="polygon", vertices_m=HEXAGON[::-1])
    assert forward.vertices_m == HEXAGON
    assert backward.vertices_m == HEXAGON
    assert forward.narrowest_m == pytest.approx(math.sqrt(3.0))
    assert forward.contains(0.99, 0.0)
    assert not forward.contains(0.9, 0.5)


@pytest.mark.parametrize(
    ("vertices", "words"),
    [
        (((0, 0), (1, 0)), "at least 3 corners"),
        (((0, 0), (1, 0), (2, 0)), "on one line"),
        (((0, 0), (1, 0), (1, 1), (0, 0)), "repeats a corner"),
        (((0, 0), (1, 0), (0.2, 0.2), (0, 1)), "not convex"),
        (((0, 0), (math.inf, 0), (0, 1)), "not finite"),
        # A pentagram turns left at every corner and winds twice.
        (
            tuple((math.cos(4 * k * math.pi / 5), math.sin(4 * k * math.pi / 5)) for k in range(5)),
            "not",
        ),
        (((0, 0), (1, 1), (1, 0), (0, 1)), "line"),
    ],
)
def test_polygon_that_is_not_convex_is_refused(vertices: tuple[object, ...], words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        Tank(shape="polygon", vertices_m=vertices)  # type: ignore[arg-type]


def test_keys_of_another_shape_are_refused() -> None:
    with pytest.raises(ConfigurationError, match='width_m belongs to shape = "rectangle"'):
        Tank(width_m=0.3)
    with pytest.raises(ConfigurationError, match='shape = "polygon" needs vertices_m'):
        Tank(shape="polygon")


@pytest.mark.parametrize(
    "tank",
    [
        Tank(),
        Tank(diameter_m=0.123),
        Tank(shape="rectangle", width_m=0.4, height_m=0.2),
        Tank(shape="polygon", vertices_m=HEXAGON),
    ],
)
def test_arena_attribute_round_trip(tank: Tank) -> None:
    assert Tank.from_arena(tank.to_arena_json()) == tank
    assert Tank.from_arena(json.loads(tank.to_arena_json())) == tank


def test_arena_of_the_contract() -> None:
    assert json.loads(Tank().to_arena_json()) == {
        "shape": "circle",
        "diameter_m": 0.3,
        "center_m": [0.0, 0.0],
    }
    assert Tank.from_arena(Tank().to_arena(), wall_friction=1.0).wall_friction == 1.0


@pytest.mark.parametrize("arena", ["{", "[1]", '{"shape": "blob"}', '{"radius_m": 1}'])
def test_arena_that_is_none_is_refused(arena: str) -> None:
    with pytest.raises(ConfigurationError):
        Tank.from_arena(arena)


def test_field_of_view_may_lie_off_centre() -> None:
    view = FieldOfView(shape="rectangle", width_m=0.2, height_m=0.2, center_m=(0.1, 0.0))
    assert view.contains(0.19, 0.0)
    assert not view.contains(-0.01, 0.0)
    assert view.to_arena()["center_m"] == [0.1, 0.0]
    triangle = FieldOfView(
        shape="polygon", vertices_m=((0, 0), (1, 0), (0, 1)), center_m=(1.0, 2.0)
    )
    assert triangle.to_arena()["vertices_m"] == [[1.0, 2.0], [2.0, 2.0], [1.0, 3.0]]


def test_corners_of_a_turned_block() -> None:
    corners = block_corners(Pose(x_m=1.0, theta_rad=math.pi / 4), Block(side_m=math.sqrt(2.0)))
    expected = [(1.0, 1.0), (0.0, 0.0), (1.0, -1.0), (2.0, 0.0)]
    for corner, wanted in zip(corners, expected, strict=True):
        assert corner == pytest.approx(wanted, abs=1e-12)


@pytest.mark.slow
def test_the_grid_of_the_paper_has_41_by_41_settings() -> None:
    assert len(Calibration().drag_coefficients) == len(Calibration().force_stds_N) == 41
    assert Calibration().force_stds_N[11] == 0.00055
    assert Calibration().force_stds_N[-1] == 0.002
