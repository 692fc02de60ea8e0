"""Whether a flow field covers a tank."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.model import Tank
from driftwalk.schema import FLAGS, build_flow_field
from driftwalk.simulation.backend import require_cover, wall_depth

ROUND = Tank(diameter_m=0.3)


def still(half_x: float, half_y: float, cell: float = 0.01) -> xr.Dataset:
    """Return a field at rest on nodes from -half to half."""
    x, y = (np.linspace(-half, half, round(2 * half / cell) + 1) for half in (half_x, half_y))
    zeros = np.zeros((y.size, x.size))
    return build_flow_field(x, y, u=zeros, v=zeros, flag=zeros + FLAGS["measured"])


@pytest.mark.parametrize("half", [0.14, 0.145, 0.2])
def test_nodes_to_within_a_cell_of_the_wall_cover_the_tank(half: float) -> None:
    require_cover(still(half, half), ROUND)
    require_cover(still(half, 0.05), Tank(shape="rectangle", width_m=0.3, height_m=0.1))


@pytest.mark.parametrize(
    ("field", "tank"),
    [
        (still(0.13, 0.2), ROUND),
        (still(0.2, 0.13), ROUND),
        (still(0.15, 0.15), Tank(diameter_m=0.5)),
        (still(0.1, 0.1), Tank(shape="polygon", vertices_m=((0.0, 0.0), (0.2, 0.0), (0.0, 0.1)))),
    ],
)
def test_a_grid_that_ends_before_the_wall(field: xr.Dataset, tank: Tank) -> None:
    with pytest.raises(
        InputError, match=r"does not cover the tank, a .* it spans x from"
    ) as caught:
        require_cover(field, tank)
    assert tank.describe() in str(caught.value)
    assert "`tank.diameter_m`" in str(caught.value)


def test_the_bundled_flow_covers_its_own_tank_only() -> None:
    require_cover(dw.tank30_flow(), ROUND)
    with pytest.raises(InputError, match="flagged as outside"):
        require_cover(dw.tank30_flow(), Tank(shape="rectangle", width_m=0.3, height_m=0.3))
    with pytest.raises(
        InputError, match=r"circle of diameter 0.5 m that reaches x from -0.25 to 0.25 m"
    ):
        require_cover(dw.tank30_flow(), Tank(diameter_m=0.5))


def test_what_is_no_flow_field() -> None:
    with pytest.raises(InputError, match="not a flow field"):
        require_cover(dw.tank30_recording(), ROUND)


def test_depth_inside_a_wall() -> None:
    x, y = np.array([0.0, 0.05, 0.2]), np.array([0.0, 0.03, 0.0])
    np.testing.assert_allclose(wall_depth(ROUND, x, y), [0.15, 0.15 - np.hypot(0.05, 0.03), -0.05])
    box = Tank(shape="rectangle", width_m=0.2, height_m=0.1)
    np.testing.assert_allclose(wall_depth(box, x, y), [0.05, 0.02, -0.1], atol=1e-15)
