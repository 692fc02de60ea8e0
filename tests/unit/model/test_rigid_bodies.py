"""Shapes of a body: moments, corners and symmetry by hand; wrong ones are refused in one line."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.core.errors import ConfigurationError
from driftwalk.model import Block, parse_study
from driftwalk.model.rigid_bodies import BODIES, Measures, RigidBody, rigid_body

A = 0.03


def made(shape: str, width: float | None = None, share: float = 0.0) -> RigidBody:
    return rigid_body(shape, Measures(A, width, 8, share))


@pytest.mark.parametrize(
    ("shape", "width", "area", "moment", "symmetry", "reach"),
    [
        ("square", None, A**2, A**2 / 6, 4, A / math.sqrt(2)),
        ("disc", None, math.pi * A**2 / 4, A**2 / 8, 0, A / 2),
        ("rectangle", 0.01, A * 0.01, (A**2 + 1e-4) / 12, 2, math.hypot(A, 0.01) / 2),
        ("xx", None, 2 * A**2, 5 * A**2 / 12, 2, A * math.sqrt(1.25)),
        ("x/x", None, 2 * A**2, 5 * A**2 / 12, 2, A * math.sqrt(1.25)),
        ("xxx", None, 3 * A**2, 10 * A**2 / 12, 2, A * math.sqrt(2.5)),
        # Cells at (2, -1), (-1, -1) and (-1, 2) thirds of a side: mean square 4/9 + 1/6 of it.
        ("x./xx", None, 3 * A**2, (4 / 9 + 1 / 6) * A**2, 1, A * math.hypot(5 / 6, 7 / 6)),
        ("xx/xx", None, 4 * A**2, 4 * A**2 / 6, 4, A * math.sqrt(2)),
    ],
)
def test_area_moment_symmetry_and_reach(
    shape: str, width: float | None, area: float, moment: float, symmetry: int, reach: float
) -> None:
    body = made(shape, width)
    assert body.area_m2 == pytest.approx(area, rel=1e-12)
    assert body.moment_m2 == pytest.approx(moment, rel=1e-12)
    assert body.symmetry == symmetry
    assert body.reach_m == pytest.approx(reach, rel=1e-12)
    block = Block(shape=shape, side_m=A, width_m=width, mass_kg=0.02)
    assert block.inertia_kg_m2 == pytest.approx(0.02 * moment, rel=1e-12)
    assert block.area_m2 == pytest.approx(area, rel=1e-12)


@pytest.mark.parametrize(("shape", "width"), [("disc", None), ("rectangle", 0.01), ("x./xx", None)])
def test_points_have_the_moments_of_the_area(shape: str, width: float | None) -> None:
    """To the fourth degree, by a fine grid over the body; they are about the centre of mass."""
    body = made(shape, width)
    axis = (np.arange(1500) + 0.5) / 1500 * 0.1 - 0.05
    x, y = np.meshgrid(axis, axis)
    if shape == "disc":
        inside = np.hypot(x, y) < A / 2
    elif shape == "rectangle":
        inside = (abs(x) < A / 2) & (abs(y) < 0.005)
    else:
        inside = np.zeros(x.shape, dtype=bool)
        for cell in body.cells:
            inside |= (abs(x - cell[0]) < A / 2) & (abs(y - cell[1]) < A / 2)
    across, along = x[inside], y[inside]
    near, far, share = body.moment_points.T
    assert share.sum() == pytest.approx(1.0, rel=1e-12)
    assert [share @ near, share @ far] == pytest.approx([0, 0], abs=1e-15)
    for degree in (2, 3, 4):
        for power in range(degree + 1):
            want = (across**power * along ** (degree - power)).mean()
            found = share @ (near**power * far ** (degree - power))
            assert found == pytest.approx(want, rel=5e-3, abs=5e-3 * (0.5 * A) ** degree)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_panels_close_the_outline_and_count_hidden_faces_by_their_share(share: float) -> None:
    """Of the L of three blocks eight faces are free and four are hidden."""
    panels = made("x./xx", share=share).panels
    assert panels[:, 4].sum() == pytest.approx((8 + 4 * share) * A)
    # Widths along each normal sum to nothing, as do those of any closed line.
    assert panels[:, 2:4].T @ panels[:, 4] == pytest.approx([0, 0], abs=1e-15)
    assert np.hypot(panels[:, 2], panels[:, 3]) == pytest.approx(1.0)


def test_only_corners_of_the_hull_touch_a_wall() -> None:
    cells = made("x./xx").cells
    corners = {tuple(np.round(corner / A, 6)) for corner in made("x./xx").corners - cells.min(0)}
    half = 0.5
    assert corners == {
        (-half, -half), (1 + half, -half), (1 + half, half), (half, 1 + half), (-half, 1 + half)
    }  # fmt: skip
    assert made("disc").corners.size == 0


@pytest.mark.parametrize(
    ("shape", "lever"),
    # rms distance of the cells from the centre of mass: their torques are independent.
    [("xx", A / 2), ("xxx", A * math.sqrt(2 / 3)), ("x./xx", A * 2 / 3), ("disc", 0.0)],
)
def test_independent_forces_on_the_cells_have_a_lever(shape: str, lever: float) -> None:
    assert made(shape).force_lever_m() == pytest.approx(lever, rel=1e-12)


@pytest.mark.parametrize("length", [0.01, 0.03, 0.5])
def test_shared_forces_on_a_dimer(length: float) -> None:
    """With the correlation rho at a distance a the force is sqrt(2 (1 + rho)) of one cell's.

    The torque, sigma a sqrt((1 - rho) / 2), over that force is a / 2 sqrt((1 - rho) / (1 + rho)).
    """
    rho = math.exp(-(A**2) / (2 * length**2))
    body = made("xx")
    assert body.force_share(length) == pytest.approx(math.sqrt(2 * (1 + rho)), rel=1e-12)
    lever = A / 2 * math.sqrt((1 - rho) / (1 + rho))
    assert body.force_lever_m(length) == pytest.approx(lever, rel=1e-9)


def test_the_size_may_stand_in_the_shape() -> None:
    assert (Block(shape="disc:4cm").side_m, Block(shape="disc:4cm").shape) == (0.04, "disc")
    for text in ("rectangle:4x2cm", "rectangle:40mmx2cm", "rectangle:0.04x0.02"):
        block = Block(shape=text)
        assert (block.shape, block.side_m, block.width_m) == ("rectangle", 0.04, 0.02)
    again = dw.apply_overrides(dw.Study(block={"shape": "rectangle:4x2cm"}), {"block.shape": "xx"})
    assert (again.block.shape, again.block.width_m) == ("xx", None)
    assert parse_study(again.to_toml()) == again
    assert set(BODIES) == {"square", "disc", "rectangle"}


@pytest.mark.parametrize(
    ("block", "tank", "words"),
    [
        ({"shape": "disc", "width_m": 0.02}, {}, "width_m belongs to a rectangle"),
        ({"shape": "square", "width_m": 0.02}, {}, "width_m belongs to a rectangle"),
        ({"shape": "rectangle"}, {}, "a rectangle has two sides"),
        ({"shape": "rectangle:4cm"}, {}, "a rectangle has two sides"),
        ({"shape": "rectangle:4x"}, {}, "width_m"),
        ({"shape": "x.x"}, {}, "hang together face to face"),
        ({"shape": "x./.x"}, {}, "hang together face to face"),
        ({"shape": "x" * 65}, {}, "64 cells at most, got 65"),
        ({"shape": "x" * 20_000}, {}, "64 cells at most"),
        ({"shape": "disc:4x2cm"}, {}, "side_m: expected a number in m"),
        ({"shape": "disc:4cm", "side_m": 0.03}, {}, "keep one"),
        ({"shape": "rectangle:4x2cm", "width_m": 0.02}, {}, "keep one"),
        ({"shape": "disc:4kg"}, {}, "'kg' measures something else"),
        ({"shape": "disc:-4cm"}, {}, "must be more than 0"),
        ({"shape": "hexagon"}, {}, "no body shape 'hexagon'"),
        ({"shape": ""}, {}, "no body shape"),
        ({"shape": "disc:31cm"}, {}, "does not fit into the tank"),
        ({"shape": "xx:14cm"}, {}, "does not fit into the tank"),
        (
            {"shape": "disc:21cm"},
            {"shape": "rectangle", "width_m": 0.4, "height_m": 0.2},
            "does not fit into the tank",
        ),
    ],
)
def test_a_wrong_shape_is_refused_in_one_line(
    block: dict[str, Any], tank: dict[str, Any], words: str
) -> None:
    with pytest.raises(ConfigurationError, match=words) as refused:
        dw.Study(block=block, tank=tank)
    assert "\n" not in str(refused.value)
