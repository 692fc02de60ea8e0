"""Panels of densities at low, best and high values of a parameter."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import QuadMesh
from synthetic_calibration import answered, synthetic_calibration

from driftwalk.core.errors import InputError
from driftwalk.plot import density_panels as plot_density_panels
from driftwalk.plot.parts.style import new_figure
from driftwalk.plot.step_densities import choose_settings, shared_setting_text


@pytest.fixture(scope="module")
def calibration() -> xr.Dataset:
    return synthetic_calibration(points=17)


def _mesh(ax) -> QuadMesh:
    return next(artist for artist in ax.collections if isinstance(artist, QuadMesh))


def test_settings_are_the_nearest_of_the_grid(calibration) -> None:
    # Optimum 0.39 and 0.61 mN on grids of 0.1 and 0.125 mN.
    settings = choose_settings(calibration, parameter="drag_coefficient")
    assert [float(s["drag_coefficient"]) for s in settings] == pytest.approx([0.1, 0.4, 0.7])
    assert [float(s["force_std"]) for s in settings] == pytest.approx([0.625e-3] * 3)
    settings = choose_settings(calibration, parameter="force_std", low=0.0, high=1e-3)
    assert [float(s["force_std"]) for s in settings] == pytest.approx([0.0, 0.625e-3, 1e-3])
    assert [float(s["drag_coefficient"]) for s in settings] == pytest.approx([0.4] * 3)


def test_an_optimum_at_an_end_of_the_map_is_shown_once(calibration) -> None:
    settings = choose_settings(calibration, parameter="drag_coefficient", low=0.4, high=0.8)
    assert [float(s["drag_coefficient"]) for s in settings] == pytest.approx([0.4, 0.6, 0.8])


@pytest.mark.slow
def test_panels_hold_the_stored_densities_on_one_scale(calibration) -> None:
    row = plot_density_panels(calibration)
    stored = [
        calibration["recording_step_density"],
        *(calibration["step_density"][i, 5] for i in (1, 4, 7)),
    ]
    area = np.diff(1e3 * calibration["step_length_edge"].values)[0] * np.degrees(
        np.diff(calibration["turning_angle_edge"].values)[0]
    )
    for ax, density in zip(row, stored, strict=True):
        drawn = np.ma.filled(_mesh(ax).get_array(), 0.0).reshape(32, 32)
        np.testing.assert_allclose(drawn, 100.0 * density.values.T / area, atol=1e-12)
    assert len({_mesh(ax).get_clim() for ax in row}) == 1
    assert len({(*ax.get_xlim(), *ax.get_ylim()) for ax in row}) == 1


def test_titles_state_the_values_shown(calibration) -> None:
    titles = [ax.get_title(loc="left") for ax in plot_density_panels(calibration)]
    assert titles == ["(a) recording", "(b) $C_d$ = 0.1", "(c) $C_d$ = 0.4", "(d) $C_d$ = 0.7"]
    titles = [
        ax.get_title(loc="left") for ax in plot_density_panels(calibration, parameter="force_std")
    ]
    assert titles[1] == r"(b) $\sigma_F$ = 0.125 mN"


def test_the_force_is_never_stated_without_its_interval(calibration) -> None:
    for parameter in ("drag_coefficient", "force_std"):
        text = shared_setting_text(calibration, parameter=parameter)
        assert r"\sigma_F" in text
        assert "every 16 ms" in text


def test_limits_show_all_but_the_tails_of_every_panel(calibration) -> None:
    ax = plot_density_panels(calibration, parameter="force_std")[0]
    length = 1e3 * calibration["recording_step_length"].values
    angle = np.degrees(calibration["recording_turning_angle"].values)
    inside = (length > ax.get_xlim()[0]) & (length < ax.get_xlim()[1])
    inside &= (angle > ax.get_ylim()[0]) & (angle < ax.get_ylim()[1])
    assert inside.mean() > 0.998


def test_a_setting_without_motion_is_a_hatched_panel(calibration) -> None:
    still = answered(calibration, {"force_std_N": 0.0})
    row = plot_density_panels(still, low=0.0)
    assert [len([p for p in ax.patches if p.get_hatch()]) for ax in row] == [0, 1, 0, 0]
    assert [text.get_text() for text in row[1].texts] == ["no motion (D = 1)"]


def test_two_rows_of_two_keep_labels_at_the_outside(calibration) -> None:
    grid = new_figure(width_mm=90.0, height_mm=90.0).subplots(2, 2, sharex=True, sharey=True)
    row = plot_density_panels(calibration, grid)
    assert [bool(ax.get_xlabel()) for ax in row] == [False, False, True, True]
    assert [bool(ax.get_ylabel()) for ax in row] == [True, False, True, False]


def test_wrong_arguments_are_refused(calibration) -> None:
    with pytest.raises(InputError, match="choose one of drag_coefficient, force_std"):
        plot_density_panels(calibration, parameter="mass")
    with pytest.raises(InputError, match="got 3 axes, expected 4"):
        plot_density_panels(calibration, new_figure(width_mm=90, height_mm=50).subplots(1, 3))
    with pytest.raises(InputError, match="lacks step_density"):
        plot_density_panels(calibration.drop_vars("step_density"))
