"""Figures of how well the estimate is known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.patches import Polygon
from synthetic_calibration import synthetic_calibration

from driftwalk.core.errors import InputError
from driftwalk.plot import (
    bootstrap as plot_bootstrap,
    distance_profile as plot_distance_profile,
    validation as plot_validation,
)


@pytest.fixture(scope="module")
def calibration() -> xr.Dataset:
    return synthetic_calibration(points=17)


def _line(ax, label):
    (line,) = [line for line in ax.lines if line.get_label() == label]
    return line


@pytest.mark.parametrize(
    ("parameter", "row", "factor", "best", "interval"),
    [
        ("drag_coefficient", {"force_std": 5}, 1.0, 0.39, (0.34, 0.44)),
        ("force_std", {"drag_coefficient": 4}, 1e3, 0.61, (0.53, 0.70)),
    ],
)
def test_profile_runs_through_the_optimum(
    calibration, parameter, row, factor, best, interval
) -> None:
    ax = plot_distance_profile(calibration, parameter=parameter)
    expected = calibration.isel(row)
    mean = ax.containers[0][0]
    np.testing.assert_allclose(mean.get_xdata(), factor * calibration[parameter].values)
    np.testing.assert_allclose(mean.get_ydata(), expected["ks_distance"].values)
    dots = _line(ax, "replicates")
    np.testing.assert_allclose(
        np.sort(dots.get_ydata()), np.sort(expected["ks_distance_replicate"].values.ravel())
    )
    assert _line(ax, "optimum").get_xydata()[0] == pytest.approx([best, 0.041])
    assert _line(ax, "noise floor").get_ydata()[0] == pytest.approx(0.032)
    (band,) = ax.patches
    assert (band.get_x(), band.get_x() + band.get_width()) == pytest.approx(interval)


def test_replicates_stand_above_their_own_setting(calibration) -> None:
    dots = _line(plot_distance_profile(calibration), "replicates").get_xydata()
    for index, drag in enumerate(calibration["drag_coefficient"].values):
        np.testing.assert_allclose(
            np.sort(dots[np.isclose(dots[:, 0], drag), 1]),
            np.sort(calibration["ks_distance_replicate"][index, 5].values),
        )


def test_bootstrap_cloud_and_region(calibration) -> None:
    ax = plot_bootstrap(calibration)
    cloud = _line(ax, "bootstrap estimates").get_xydata()
    np.testing.assert_allclose(cloud[:, 0], calibration["bootstrap_drag_coefficient"])
    np.testing.assert_allclose(cloud[:, 1], 1e3 * calibration["bootstrap_force_std"])
    assert sum(isinstance(patch, Polygon) for patch in ax.patches) == 1
    assert "every 16 ms" in ax.get_ylabel()


def test_three_panels(calibration) -> None:
    row = plot_validation(calibration)
    assert len(row) == 3
    assert row[0].figure.get_size_inches()[0] == pytest.approx(180 / 25.4)
    assert plot_validation(calibration, row) == row


def test_missing_parts_are_named(calibration) -> None:
    with pytest.raises(InputError, match="lacks bootstrap_force_std"):
        plot_bootstrap(calibration.drop_vars("bootstrap_force_std"))
    with pytest.raises(InputError, match="lacks ks_distance_replicate"):
        plot_distance_profile(calibration.drop_vars("ks_distance_replicate"))
    with pytest.raises(InputError, match="choose one of drag_coefficient, force_std"):
        plot_distance_profile(calibration, parameter="mass")
