"""Figures of the map of 1 − D: the whole box and near the optimum."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st
from matplotlib.collections import QuadMesh
from matplotlib.contour import ContourSet
from matplotlib.patches import Polygon, Rectangle
from synthetic_calibration import answered, synthetic_calibration

from driftwalk.core.errors import InputError
from driftwalk.plot import map as plot_ks_map, refined_map as plot_refined_map
from driftwalk.plot.distances import cell_edges


@pytest.fixture(scope="module")
def calibration() -> xr.Dataset:
    return synthetic_calibration(points=9)


def _mesh(ax) -> QuadMesh:
    return next(artist for artist in ax.collections if isinstance(artist, QuadMesh))


def _hatched(ax) -> list[Rectangle]:
    return [patch for patch in ax.patches if isinstance(patch, Rectangle) and patch.get_hatch()]


def test_mesh_is_one_minus_the_distance_with_force_upwards(calibration) -> None:
    drawn = np.ma.filled(_mesh(plot_ks_map(calibration)).get_array(), np.nan)
    expected = 1.0 - calibration["ks_distance"].values.T
    np.testing.assert_allclose(drawn.reshape(expected.shape), expected)


def test_order_of_the_dimensions_does_not_matter(calibration) -> None:
    turned = calibration.transpose("force_std", "drag_coefficient", ...)
    one, other = (_mesh(plot_ks_map(data)).get_array() for data in (calibration, turned))
    np.testing.assert_array_equal(one, other)


def test_every_cell_with_a_cause_is_hatched_and_no_other(calibration) -> None:
    ax = plot_ks_map(calibration)
    status = calibration["status"].values
    hatched = _hatched(ax)
    assert len(hatched) == (status != 0).sum()
    by_cause = {
        name: sum(patch.get_gid() == name for patch in hatched)
        for name in ("no motion (D = 1)", "not finite", "too few steps")
    }
    assert list(by_cause.values()) == [(status == bit).sum() for bit in (1, 2, 4)]
    assert len({patch.get_hatch() for patch in hatched}) == 3


def test_hatched_cells_lie_where_nothing_moves(calibration) -> None:
    ax = plot_ks_map(calibration)
    still = calibration["status"].values == 1
    centers = {
        (
            round(patch.get_x() + patch.get_width() / 2, 6),
            round(patch.get_y() + patch.get_height() / 2, 6),
        )
        for patch in _hatched(ax)
        if patch.get_gid() == "no motion (D = 1)"
    }
    drag, force = calibration["drag_coefficient"].values, 1e3 * calibration["force_std"].values
    assert centers == {
        (round(drag[i], 6), round(force[j], 6)) for i, j in zip(*np.nonzero(still), strict=True)
    }


def test_a_cell_without_distance_or_cause_is_hatched_too(calibration) -> None:
    holed = calibration.copy(deep=True)
    holed["ks_distance"][4, 4] = np.nan
    assert [p.get_gid() for p in _hatched(plot_ks_map(holed))].count("not computed") == 1
    holed["refined_ks_distance"][2, 3] = np.nan
    assert [p.get_gid() for p in _hatched(plot_refined_map(holed))] == ["not computed"]


def test_each_cause_is_named_once_in_the_legend(calibration) -> None:
    _, labels = plot_ks_map(calibration).get_legend_handles_labels()
    assert sorted(labels) == sorted(
        ["no motion (D = 1)", "not finite", "too few steps", "90 % region", "optimum and interval"]
    )


def test_axis_of_the_force_always_states_its_interval(calibration) -> None:
    for plot in (plot_ks_map, plot_refined_map):
        label = plot(calibration).get_ylabel()
        assert "mN" in label
        assert "every 16 ms" in label
    with pytest.raises(InputError, match="force_interval_s"):
        plot_ks_map(calibration.drop_vars("force_interval"))


def test_optimum_and_interval_bars(calibration) -> None:
    ax = plot_ks_map(calibration)
    (bars,) = ax.containers
    assert bars[0].get_xydata()[0] == pytest.approx([0.39, 0.61])
    across, upright = (segment.get_segments()[0] for segment in bars[2])
    assert across[:, 0] == pytest.approx([0.34, 0.44])
    assert upright[:, 1] == pytest.approx([0.53, 0.70])


def test_intervals_may_be_absent_or_unknown(calibration) -> None:
    unknown = answered(calibration, {"drag_coefficient_interval": [np.nan, np.nan]})
    for one, across, upright in (
        (calibration, True, True),
        (unknown, False, True),
        (calibration.drop_vars("interval"), False, False),
    ):
        (bars,) = plot_ks_map(one).containers
        assert (bars.has_xerr, bars.has_yerr) == (across, upright)


def test_region_is_outlined_in_mn(calibration) -> None:
    (region,) = [p for p in plot_ks_map(calibration).patches if isinstance(p, Polygon)]
    np.testing.assert_allclose(
        region.get_xy()[:-1],
        np.column_stack(
            [calibration["region_drag_coefficient"], 1e3 * calibration["region_force_std"]]
        ),
    )


def test_a_map_without_region_is_drawn(calibration) -> None:
    plain = calibration.drop_vars(["region_drag_coefficient", "region_force_std"])
    assert not [p for p in plot_ks_map(plain).patches if isinstance(p, Polygon)]


def test_noise_floor_is_a_line_in_the_colour_bar(calibration) -> None:
    for plot in (plot_ks_map, plot_refined_map):
        bar = plot(calibration).figure.axes[1]
        assert "noise floor" in bar.get_ylabel()
        assert [line.get_ydata()[0] for line in bar.lines] == pytest.approx([1.0 - 0.032])
        low, high = bar.get_ylim()
        assert low < 1.0 - 0.032 < high


def test_whole_box_uses_the_whole_range_of_scores(calibration) -> None:
    assert _mesh(plot_ks_map(calibration)).get_clim() == (0.0, 1.0)


def test_refined_map_shows_the_fitted_surface(calibration) -> None:
    ax = plot_refined_map(calibration)
    drawn = _mesh(ax).get_array()
    expected = 1.0 - calibration["refined_ks_distance"].values.T
    np.testing.assert_allclose(drawn.reshape(expected.shape), expected)
    (contours,) = [artist for artist in ax.collections if isinstance(artist, ContourSet)]
    # Drawn through the surface, on a finer grid.
    surface = 1.0 - calibration["refined_surface"].values
    assert contours.zmax == pytest.approx(surface.max(), abs=0.05 * np.ptp(surface))
    assert max(len(path.vertices) for path in contours.get_paths()) > 10 * max(surface.shape)


def test_missing_parts_are_named(calibration) -> None:
    with pytest.raises(InputError, match="lacks refined_surface"):
        plot_refined_map(calibration.drop_vars("refined_surface"))
    with pytest.raises(InputError, match="lacks ks_distance, status"):
        plot_ks_map(calibration.drop_vars(["ks_distance", "status"]))


def test_a_single_grid_value_still_has_a_cell(calibration) -> None:
    ax = plot_ks_map(calibration.isel(force_std=[3]))
    ax.figure.draw_without_rendering()
    assert _mesh(ax).get_coordinates().shape[0] == 2


@settings(deadline=None, max_examples=40)
@given(st.lists(st.floats(0.01, 10.0), min_size=1, max_size=12))
def test_every_grid_point_lies_inside_its_cell(gaps) -> None:
    center = np.cumsum(gaps)
    edges = cell_edges(center)
    assert edges.size == center.size + 1
    assert (edges[:-1] < center).all()
    assert (center < edges[1:]).all()
