"""Figures of the flow field and of the arena's outline."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import QuadMesh
from matplotlib.patches import Circle, PathPatch, Polygon, Rectangle
from matplotlib.quiver import Quiver
from synthetic_calibration import ARENA, bundled_flow

from driftwalk.core.errors import InputError
from driftwalk.plot import flow as plot_flow
from driftwalk.plot.parts.arena import arena_of, arena_patch
from driftwalk.plot.parts.style import new_figure
from driftwalk.schema import FLAGS, build_flow_field


@pytest.fixture(scope="module")
def flow() -> xr.Dataset:
    return bundled_flow()


def _mesh(ax) -> QuadMesh:
    return next(artist for artist in ax.collections if isinstance(artist, QuadMesh))


def test_speed_is_in_cm_per_s_and_outside_is_blank(flow) -> None:
    ax = plot_flow(flow)
    drawn = np.ma.filled(_mesh(ax).get_array(), np.nan).reshape(flow["u"].shape)
    expected = 100.0 * np.hypot(flow["u"].values, flow["v"].values)
    outside = flow["flag"].values == FLAGS["outside"]
    np.testing.assert_allclose(drawn[~outside], expected[~outside])
    assert outside.any()
    # Cells that the wall cuts have their centre outside: drawn as their neighbour, cut at the wall.
    cut = outside & ~np.isnan(drawn)
    size = float(flow["x"][1] - flow["x"][0])
    centre = np.hypot(*np.meshgrid(flow["x"].values, flow["y"].values))
    assert (centre[cut] < 0.15 + 2.0 * size).all()
    assert np.isnan(drawn[outside & (centre > 0.15 + 2.0 * size)]).all()
    assert _mesh(ax).get_clip_path() is not None


def test_the_scale_is_that_of_the_measured_nodes(flow) -> None:
    """A filled node may be far faster than all that was measured."""
    guessed = flow.copy(deep=True)
    row, column = np.argwhere(guessed["flag"].values == FLAGS["measured"])[0]
    guessed["flag"][row, column] = FLAGS["filled"]
    guessed["u"][row, column] = 10.0
    kept = np.array(guessed["flag"].values == FLAGS["measured"])
    measured = 100.0 * np.hypot(guessed["u"].values, guessed["v"].values)[kept]
    assert _mesh(plot_flow(guessed)).get_clim()[1] == pytest.approx(measured.max())


def test_tank_outline_labels_and_equal_aspect(flow) -> None:
    ax = plot_flow(flow)
    outline = next(patch for patch in ax.patches if isinstance(patch, Circle))
    assert outline.radius == pytest.approx(15.0)
    assert ax.get_aspect() == 1.0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x (cm)", "y (cm)")
    assert ax.figure.axes[1].get_ylabel() == "speed (cm/s)"


def test_filled_cells_are_hatched_and_measured_ones_are_not(flow) -> None:
    ax = plot_flow(flow)
    (hatched,) = [patch for patch in ax.patches if isinstance(patch, PathPatch)]
    assert hatched.get_hatch()
    cells = hatched.get_path().vertices.reshape(-1, 5, 2)
    filled = flow["flag"].values == FLAGS["filled"]
    # And cells that the wall cuts, next to filled ones.
    outside = flow["flag"].values == FLAGS["outside"]
    x, y = (np.round(1e3 * flow[axis].values).astype(int) for axis in "xy")
    found = {tuple(place) for place in np.round(10.0 * cells[:, :4].mean(axis=1)).astype(int)}
    assert {(x[column], y[row]) for row, column in np.argwhere(filled)} <= found
    assert found <= {(x[column], y[row]) for row, column in np.argwhere(filled | outside)}


def test_every_node_measured_means_no_hatch(flow) -> None:
    measured = flow.copy()
    measured["flag"] = xr.full_like(flow["flag"], FLAGS["measured"])
    assert not [p for p in plot_flow(measured).patches if isinstance(p, PathPatch)]


def test_arrows_are_thinned_and_point_along_the_flow(flow) -> None:
    ax = plot_flow(flow)
    arrows = [artist for artist in ax.collections if isinstance(artist, Quiver)]
    assert {artist.get_label() for artist in arrows} == {"measured velocity", "filled velocity"}
    assert 50 < sum(artist.N for artist in arrows) < 400
    nodes = {
        (round(100 * x, 6), round(100 * y, 6)): (100 * u, 100 * v)
        for (x, y, u, v) in zip(
            *(grid.ravel() for grid in np.meshgrid(flow["x"], flow["y"])),
            flow["u"].values.ravel(),
            flow["v"].values.ravel(),
            strict=True,
        )
    }
    for artist in arrows:
        for (x, y), u, v in zip(artist.XY, artist.U, artist.V, strict=True):
            assert (u, v) == pytest.approx(nodes[round(x, 6), round(y, 6)])


def test_block_velocity_is_blank_where_the_block_never_was(flow) -> None:
    drawn = np.ma.filled(_mesh(plot_flow(flow, field="block")).get_array(), np.nan)
    seen = np.isfinite(flow["u_block"].values) & (flow["flag"].values != FLAGS["outside"])
    inside = flow["flag"].values != FLAGS["outside"]
    assert (np.isfinite(drawn.reshape(seen.shape)) == seen)[inside].all()


def test_speed_limit_sets_the_colour_scale(flow) -> None:
    assert _mesh(plot_flow(flow, speed_limit=0.2)).get_clim() == (0.0, 20.0)


def test_a_field_in_time_is_drawn_as_its_mean() -> None:
    u = np.stack([np.full((3, 4), 0.01), np.full((3, 4), 0.03)])
    field = build_flow_field(
        np.arange(4) / 10, np.arange(3) / 10, u=u, v=0 * u, flag=np.ones_like(u), time=[0.0, 1.0]
    )
    np.testing.assert_allclose(_mesh(plot_flow(field)).get_array(), 2.0)


def test_given_axes_are_used_and_returned(flow) -> None:
    figure = new_figure(width_mm=90.0, height_mm=80.0)
    ax = figure.add_subplot()
    assert plot_flow(flow, ax, colorbar="none") is ax
    assert figure.axes == [ax]


def test_no_water_motion_draws_no_arrow_and_no_warning() -> None:
    still = np.zeros((4, 4))
    nodes = np.arange(4) / 10
    ax = plot_flow(build_flow_field(nodes, nodes, u=still, v=still, flag=still + 1))
    assert not [artist for artist in ax.collections if isinstance(artist, Quiver)]
    ax.figure.draw_without_rendering()


def test_block_field_without_block_velocity_is_refused(flow) -> None:
    with pytest.raises(InputError, match="u_block and v_block"):
        plot_flow(flow.drop_vars(["u_block", "v_block"]), field="block")
    with pytest.raises(InputError, match="choose one of water, block"):
        plot_flow(flow, field="air")


def test_a_wrong_unit_is_refused(flow) -> None:
    wrong = flow.copy()
    wrong["u"] = flow["u"].assign_attrs(units="knots")
    with pytest.raises(InputError, match="'u' is in 'knots'"):
        plot_flow(wrong)


@pytest.mark.parametrize(
    ("arena", "kind", "extent_cm"),
    [
        ({"shape": "circle", "diameter_m": 0.2, "center_m": [0.01, 0]}, Circle, (-9, -10, 11, 10)),
        (
            {"shape": "rectangle", "width_m": 0.4, "height_m": 0.2, "center_m": [0, 0]},
            Rectangle,
            (-20, -10, 20, 10),
        ),
        ({"shape": "polygon", "vertices_m": [[0, 0], [0.1, 0], [0, 0.2]]}, Polygon, (0, 0, 10, 20)),
    ],
)
def test_arena_shapes(arena, kind, extent_cm) -> None:
    patch = arena_patch(arena)
    assert isinstance(patch, kind)
    extent = patch.get_path().get_extents(patch.get_patch_transform())
    assert (extent.x0, extent.y0, extent.x1, extent.y1) == pytest.approx(extent_cm)


def test_arena_from_attribute_argument_or_nowhere() -> None:
    with_arena = xr.Dataset(attrs={"arena": ARENA})
    assert arena_of(with_arena) == json.loads(ARENA)
    assert arena_of(with_arena, {"shape": "polygon"}) == {"shape": "polygon"}
    assert arena_of(xr.Dataset()) == {}


@pytest.mark.parametrize(
    ("arena", "message"),
    [
        ({"shape": "blob"}, "expected circle, rectangle or polygon"),
        ({"shape": "circle"}, "lacks 'diameter_m'"),
        ({"diameter_m": 0.3}, "lacks 'shape'"),
    ],
)
def test_a_wrong_arena_is_refused(arena, message) -> None:
    with pytest.raises(InputError, match=message):
        arena_patch(arena)


def test_an_arena_that_is_not_json_is_refused() -> None:
    with pytest.raises(InputError, match="not JSON"):
        arena_of(xr.Dataset(), "circle")
