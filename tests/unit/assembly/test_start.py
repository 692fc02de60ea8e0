"""Where blocks may start: room by area, given poses, overlap."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from driftwalk.assembly.runs.start import given_start, overlap_depth, require_room, tank_area
from driftwalk.core.errors import InputError
from driftwalk.model import Study, Tank

SIDE = 0.03
TWO = Study(assembly={"blocks": 2})
APART = [[0.0, 0.0, 0.3], [0.05, 0.0, 0.0]]


@pytest.mark.parametrize(
    ("tank", "area"),
    [
        (Tank(diameter_m=0.3), math.pi * 0.15**2),
        (Tank(shape="rectangle", width_m=0.4, height_m=0.2), 0.08),
        (Tank(shape="polygon", vertices_m=((0.0, 0.0), (0.3, 0.0), (0.0, 0.2))), 0.03),
    ],
)
def test_area_of_a_tank(tank: Tank, area: float) -> None:
    assert tank_area(tank) == pytest.approx(area, rel=1e-12)


def test_more_blocks_than_the_tank_has_area_for() -> None:
    """78 squares of 9 cm2 cover 702 cm2, the tank has 706.9; 79 cover 711."""
    require_room(Study(assembly={"blocks": 78}))
    with pytest.raises(
        InputError, match=r"79 blocks of 0.03 m do not fit .* \(`assembly.blocks`\)"
    ):
        require_room(Study(assembly={"blocks": 79}))


def test_one_set_of_poses_serves_all_runs() -> None:
    poses = given_start(TWO, APART, runs=3)
    assert poses.shape == (3, 2, 3)
    np.testing.assert_array_equal(poses[2], APART)
    np.testing.assert_array_equal(given_start(TWO, poses, runs=3), poses)


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ([0.0, 0.0, 0.3], r"expected poses of shape \(2, 3\) or \(4, 2, 3\).*got shape \(3,\)"),
        (np.zeros((3, 2, 3)), r"got shape \(3, 2, 3\)"),
        ([[0.0, 0.0, math.nan], [0.05, 0.0, 0.0]], "a pose is not finite"),
        (
            [[0.0, 0.0, 0.0], [0.140, 0.0, 0.0]],
            "block 1 of run 0 reaches 0.00572 m beyond the wall of the tank, a circle of diameter",
        ),
        ([[0.0, 0.0, 0.0], [0.029, 0.0, 0.0]], "blocks 0 and 1 of run 0 overlap by 0.001 m"),
    ],
)
def test_a_start_that_cannot_be(start: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        given_start(TWO, start, runs=4)  # type: ignore[arg-type]


def test_the_wall_of_a_polygon() -> None:
    study = Study(
        tank={"shape": "rectangle", "width_m": 0.2, "height_m": 0.1}, assembly={"blocks": 1}
    )
    given_start(study, [[0.085, -0.035, 0.0]], runs=1)
    with pytest.raises(InputError, match="beyond the wall"):
        given_start(study, [[0.085, -0.035, 0.1]], runs=1)


def corners(pose: np.ndarray) -> np.ndarray:
    turn = pose[2] + np.pi * (0.25 + 0.5 * np.arange(4))
    return pose[:2] + SIDE / math.sqrt(2.0) * np.column_stack([np.cos(turn), np.sin(turn)])


def holds_a_corner(pose: np.ndarray, points: np.ndarray) -> bool:
    c, s = math.cos(pose[2]), math.sin(pose[2])
    own = (points - pose[:2]) @ np.array([[c, -s], [s, c]])
    return bool((np.abs(own) < SIDE / 2).all(axis=1).any())


def side_of(a: np.ndarray, b: np.ndarray, point: np.ndarray) -> float:
    return float((b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]))


def edges_cross(first: np.ndarray, second: np.ndarray) -> bool:
    return any(
        side_of(a, b, c) * side_of(a, b, d) < 0 and side_of(c, d, a) * side_of(c, d, b) < 0
        for a, b in zip(first, np.roll(first, -1, axis=0), strict=True)
        for c, d in zip(second, np.roll(second, -1, axis=0), strict=True)
    )


@pytest.mark.slow
@settings(deadline=None, max_examples=300)
@given(
    x=st.floats(-0.05, 0.05),
    y=st.floats(-0.05, 0.05),
    turns=st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0)),
)
def test_overlap_is_where_the_squares_meet(x: float, y: float, turns: tuple[float, float]) -> None:
    """Against the definition: a corner of one, or its centre, in the other, or edges that cross."""
    first, second = np.array([0.01, -0.02, turns[0]]), np.array([0.01 + x, -0.02 + y, turns[1]])
    depth = float(overlap_depth(first[None], second[None], side=SIDE)[0])
    assume(abs(depth) > 1e-9)
    meet = (
        holds_a_corner(first, np.vstack([corners(second), second[:2]]))
        or holds_a_corner(second, np.vstack([corners(first), first[:2]]))
        or edges_cross(corners(first), corners(second))
    )
    # Edges on one line, or a corner on an edge, are seen by none of these.
    assume(meet or depth < 0 or np.abs(np.sin(2 * (turns[0] - turns[1]))) > 1e-6)
    assert (depth > 0) == meet


def test_depth_of_overlap_is_the_shortest_way_apart() -> None:
    pose = np.array([[0.0, 0.0, 0.7]])
    for distance in (0.01, 0.025, 0.03, 0.04):
        along = np.array([math.cos(0.7), math.sin(0.7)])
        other = np.array([[*(distance * along), 0.7 + math.pi / 2]])
        assert overlap_depth(pose, other, side=SIDE)[0] == pytest.approx(SIDE - distance)
