"""Pictures of a model check show the numbers of the dataset, in the units of a reader."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.patches import Rectangle

from driftwalk.core.errors import InputError
from driftwalk.figures import check_figures, write_figures
from driftwalk.plot import (
    innovations as plot_innovations,
    predicted_steps as plot_predicted_steps,
    residual_time as plot_residual_time,
    residuals as plot_residual_map,
)

LAGS, CELLS, PARTS, BINS = 20, 5, 4, 6


@pytest.fixture
def check() -> xr.Dataset:
    """Return a made-up check of two recordings with one bad cell, x = 0.02 m, y = -0.04 m."""
    generator = np.random.default_rng(1)
    axis = 0.02 * np.arange(-2.0, 3.0)
    distance = generator.uniform(0.5, 2.0, (CELLS, CELLS))
    distance[0, 3], distance[4, 4] = 7.5, np.nan
    plane = ("y", "x")
    data = {
        "autocorrelation": (("component", "lag"), 0.01 * generator.normal(size=(2, LAGS))),
        "autocorrelation_expected": (("component", "lag"), np.full((2, LAGS), -0.002)),
        "autocorrelation_std": (("component", "lag"), np.full((2, LAGS), 0.01)),
        "residual": (("component", *plane), generator.normal(size=(2, CELLS, CELLS))),
        "residual_distance": (plane, distance, {"limit": 3.8}),
        "noise_ratio": (plane, generator.uniform(0.9, 1.1, (CELLS, CELLS))),
        "noise_ratio_std": (plane, np.full((CELLS, CELLS), 0.05)),
        "flow_change": ("part", [0.01, -0.02, 0.03, 0.0]),
        "flow_change_std": ("part", np.full(PARTS, 0.01)),
        "part_noise_ratio": ("part", [1.0, 1.1, 0.9, 1.0]),
        "part_noise_ratio_std": ("part", np.full(PARTS, 0.02)),
    }
    coords = {
        "component": np.array(["x", "y"], dtype=object),
        "lag": np.arange(1, LAGS + 1),
        "x": ("x", axis, {"units": "m"}),
        "y": ("y", axis, {"units": "m"}),
        "part_recording": ("part", [0, 0, 1, 1]),
        "part_start": ("part", [0.0, 60.0, 0.0, 60.0]),
        "part_end": ("part", [60.0, 120.0, 60.0, 120.0]),
    }
    for name, top, unit in (("step_length", 0.006, "m"), ("turning_angle", np.pi, "rad")):
        low = 0.0 if name == "step_length" else -top
        edge = np.linspace(low, top, BINS + 1)
        flat = np.full(BINS, 1.0 / (top - low))
        for part, factor in (("recording", 1.0), ("median", 1.0), ("low", 0.9), ("high", 1.1)):
            data[f"{name}_density_{part}"] = (f"{name}_bin", factor * flat)
        coords[f"{name}_edge"] = (f"{name}_edge", edge, {"units": unit})
    arena = {"shape": "circle", "diameter_m": 0.12, "center_m": [0.0, 0.0]}
    attrs = {"kind": "model_check", "cell_size_m": 0.02, "band": 0.9, "arena": json.dumps(arena)}
    return xr.Dataset(data, coords=coords, attrs=attrs)


def test_autocorrelation_with_its_band(check: xr.Dataset) -> None:
    ax = plot_innovations(check)
    drawn = [line for line in ax.lines if str(line.get_label()).startswith("error in")]
    for line, values in zip(drawn, check["autocorrelation"].values, strict=True):
        assert line.get_ydata() == pytest.approx(values)
    (steps,) = ax.patches
    band = steps.get_path().get_extents()
    assert (band.y0, band.y1) == pytest.approx((-0.002 - 0.0196, -0.002 + 0.0196))
    # Half a lag further, so that the points of all components lie above and below it.
    assert (band.x0, band.x1) == (0.5, 20.5)


def test_the_bad_cell_is_framed_in_centimetres(check: xr.Dataset) -> None:
    ax = plot_residual_map(check)
    frames = [patch for patch in ax.patches if isinstance(patch, Rectangle)]
    assert len(frames) == 1
    assert frames[0].get_xy() == pytest.approx((1.0, -5.0))
    assert frames[0].get_width() == pytest.approx(2.0)
    assert ax.collections[0].get_clim() == (0.0, 7.5)
    arrows = ax.collections[1]
    assert np.hypot(arrows.U, arrows.V).max() == pytest.approx(7.5)
    assert arrows.N == CELLS**2 - 1
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x (cm)", "y (cm)")
    assert ax.figure.axes[-1].get_ylabel() == "distance from zero (sd)"
    assert "above 3.8, by chance in one recording of twenty" in ax.figure.get_supxlabel()


def test_noise_is_white_where_all_is_well(check: xr.Dataset) -> None:
    mesh = plot_residual_map(check, show="noise").collections[0]
    off = (check["noise_ratio"].values - 1.0) / 0.05
    assert np.asarray(mesh.get_array()).ravel() == pytest.approx(off.ravel())
    assert mesh.norm(0.0) == 0.5


def test_recordings_stand_one_after_the_other(check: xr.Dataset) -> None:
    ax = plot_residual_time(check)
    points = ax.containers[0].lines[0]
    assert points.get_xdata() == pytest.approx([0.5, 1.5, 2.5, 3.5])
    assert points.get_ydata() == pytest.approx([1.0, -2.0, 3.0, 0.0])
    assert [line.get_xdata()[0] for line in ax.lines if line.get_linestyle() == ":"] == [2.0]
    noise = plot_residual_time(check, show="noise").containers[0].lines[0]
    assert noise.get_ydata() == pytest.approx([0.0, 10.0, -10.0, 0.0])


@pytest.mark.parametrize(
    ("show", "height"), [("step_length", 100.0 / 6.0), ("turning_angle", 100.0 / 360.0)]
)
def test_densities_in_the_units_of_a_reader(check: xr.Dataset, show: str, height: float) -> None:
    ax = plot_predicted_steps(check, show=show)
    values, edges, _ = ax.patches[-1].get_data()
    assert values == pytest.approx(np.full(BINS, height))
    assert edges[-1] == pytest.approx(6.0 if show == "step_length" else 180.0)


@pytest.mark.slow
def test_files_of_a_check_with_and_without_steps(check: xr.Dataset, tmp_path: Path) -> None:
    files = write_figures(check_figures(check), tmp_path, ("svg",))
    names = ["check_innovations.svg", "check_map.svg", "check_time.svg", "check_steps.svg"]
    assert [path.name for path in files] == names
    bare = check.drop_vars([name for name in check.variables if "step_length" in str(name)])
    bare.attrs["ks_left_out"] = "it hardly moves"
    files = write_figures(check_figures(bare), tmp_path / "bare", ("svg",))
    assert [path.name for path in files] == names[:3]
    with pytest.raises(InputError, match="it hardly moves"):
        plot_predicted_steps(bare)


def test_something_else_is_refused() -> None:
    with pytest.raises(InputError, match="expected a dataset 'model_check'"):
        plot_innovations(xr.Dataset())
