"""NetCDF of other programs: attributes, usual names or the user say which variable is which."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from driftwalk.core.errors import InputError
from driftwalk.flow import flow_format, load_flow
from driftwalk.schema import FLAGS

X, Y = np.array([0.0, 10.0, 20.0, 30.0]), np.array([5.0, 10.0, 15.0])
U = 0.1 + 0.01 * np.arange(12.0).reshape(3, 4)
V = 0.2 - 0.01 * np.arange(12.0).reshape(3, 4)


def write(path: Path, dataset: xr.Dataset) -> Path:
    dataset.to_netcdf(path, engine="h5netcdf")
    return path


def ocean(
    names: tuple[str, str, str, str], attrs: list[dict[str, str]], lead: tuple[str, ...] = ()
) -> xr.Dataset:
    """Return a synthetic field with leading dimensions of size one."""
    u, v, x, y = names
    shape = (1,) * len(lead)
    return xr.Dataset(
        {
            u: ((*lead, y, x), U.reshape(*shape, 3, 4), attrs[0]),
            v: ((*lead, y, x), V.reshape(*shape, 3, 4), attrs[1]),
        },
        coords={x: (x, X, attrs[2]), y: (y, Y, attrs[3])},
    )


def check(field: Any, *, speed: float = 1.0, length: float = 1.0) -> None:
    np.testing.assert_allclose(field.x, length * X, rtol=1e-12)
    np.testing.assert_allclose(field.y, length * Y, rtol=1e-12)
    np.testing.assert_allclose(field.u, speed * U, rtol=1e-12)
    np.testing.assert_allclose(field.v, speed * V, rtol=1e-12)


SPEED = {"units": "m s-1"}
METRES = {"units": "m"}


def test_standard_names_and_axes(tmp_path: Path) -> None:
    dataset = ocean(
        ("a", "b", "c", "d"),
        [
            {**SPEED, "standard_name": "sea_water_x_velocity"},
            {**SPEED, "standard_name": "sea_water_y_velocity"},
            {**METRES, "standard_name": "projection_x_coordinate"},
            {"units": "meters", "axis": "Y"},
        ],
        ("time", "depth"),
    )
    path = write(tmp_path / "model.nc", dataset)
    assert flow_format(path) == "netcdf"
    check(load_flow(path))


def test_projected_names_of_an_ocean_model(tmp_path: Path) -> None:
    dataset = ocean(("uo", "vo", "x", "y"), [SPEED, SPEED, {"units": "km"}, {"units": "km"}])
    check(load_flow(write(tmp_path / "model.nc", dataset)), length=1e3)


def test_a_grid_of_parcels(tmp_path: Path) -> None:
    flat = ocean(("U", "V", "lon", "lat"), [SPEED, SPEED, METRES, METRES], ("time",))
    check(load_flow(write(tmp_path / "flat.nc", flat)))
    degrees = [{"units": "degrees_east"}, {"units": "degrees_north"}]
    round_ = write(tmp_path / "round.nc", ocean(("U", "V", "lon", "lat"), [SPEED, SPEED, *degrees]))
    assert flow_format(round_) == "netcdf"
    with pytest.raises(InputError, match="degrees of longitude and latitude: project the field"):
        load_flow(round_)


def test_a_curved_grid_is_refused(tmp_path: Path) -> None:
    longitude, latitude = np.meshgrid(X, Y)
    longitude += 0.1 * latitude
    dataset = xr.Dataset(
        {"vozocrtx": (("y", "x"), U, SPEED), "vomecrty": (("y", "x"), V, SPEED)},
        coords={"nav_lon": (("y", "x"), longitude), "nav_lat": (("y", "x"), latitude)},
    )
    with pytest.raises(InputError, match="is the grid curved, or in longitude and latitude"):
        load_flow(write(tmp_path / "nemo.nc", dataset))


def test_a_straight_grid_written_as_a_curved_one(tmp_path: Path) -> None:
    """As Parcels writes its fields: coordinates over both dimensions, here without units."""
    at_x, at_y = np.meshgrid(X, Y)
    dataset = xr.Dataset(
        {"vozocrtx": (("time_counter", "y", "x"), U[None]), "vomecrty": (("y", "x"), V)},
        coords={"nav_lon": (("y", "x"), at_x), "nav_lat": (("y", "x"), at_y)},
    )
    path = write(tmp_path / "parcels.nc", dataset)
    with pytest.raises(InputError, match=r"'u' has no units.*or state them with `length_unit`"):
        load_flow(path)
    check(load_flow(path, length_unit="cm"), length=1e-2, speed=1e-2)


def test_the_names_of_opendrift(tmp_path: Path) -> None:
    names = ("x_sea_water_velocity", "y_sea_water_velocity", "x", "y")
    dataset = ocean(names, [SPEED, SPEED, METRES, METRES], ("time",))
    for name in names[:2]:
        dataset[name].attrs["standard_name"] = name
    path = write(tmp_path / "drift.nc", dataset)
    assert flow_format(path) == "netcdf"
    check(load_flow(path))


@pytest.mark.slow
def test_variables_by_name_with_a_mask_and_turned_dimensions(tmp_path: Path) -> None:
    mask = np.zeros((4, 3))
    mask[2, 1] = 1
    dataset = xr.Dataset(
        {
            "speed_n": (("t", "x", "y"), U.T[None], {"units": "px/frame"}),
            "speed_z": (("t", "x", "y"), V.T[None], {"units": "pixel/dt"}),
            "land": (("x", "y"), mask),
            "other": ("y", Y),
        },
        coords={
            "grid_n": ("x", X, {"units": "pix"}),
            "grid_z": ("y", Y, {"units": "pix"}),
            "t": ("t", [0.0]),
        },
    )
    path = write(tmp_path / "field.nc", dataset)
    assert flow_format(path) is None
    names = {"u": "speed_n", "v": "speed_z", "x": "grid_n", "y": "grid_z", "mask": "land"}
    field = load_flow(path, variables=names, metres_per_pixel=1e-3, frame_interval=0.01)
    expected = np.full((3, 4), FLAGS["measured"])
    expected[1, 2] = FLAGS["filled"]
    np.testing.assert_array_equal(field.flag, expected)
    known = expected == FLAGS["measured"]
    np.testing.assert_allclose(field.u.values[known], 0.1 * U[known], rtol=1e-12)
    np.testing.assert_allclose(field.v.values[known], 0.1 * V[known], rtol=1e-12)
    np.testing.assert_allclose(field.x, 1e-3 * X)
    down = load_flow(
        path, variables=names, metres_per_pixel=1e-3, frame_interval=0.01, y_axis="down"
    )
    np.testing.assert_allclose(down.y, -1e-3 * Y[::-1])
    np.testing.assert_allclose(down.v.values[0], -0.1 * V[2], rtol=1e-12)
    moved = load_flow(
        path, variables=names, metres_per_pixel=1e-3, frame_interval=0.01, origin=(0.015, 0.01)
    )
    np.testing.assert_allclose(moved.x, 1e-3 * X - 0.015, atol=1e-15)


def frames(unit: str) -> xr.Dataset:
    one = ocean(("u", "v", "x", "y"), [SPEED, SPEED, METRES, METRES])
    two = xr.concat([one, 3.0 * one], dim="t")
    for name in ("u", "v"):
        two[name].attrs = SPEED
    two["u"][0, 1, 1] = np.nan
    return two.assign_coords(t=("t", [0.0, 2.0], {"units": unit}))


def test_counted_frames_are_averaged_and_timed_ones_kept(tmp_path: Path) -> None:
    field = load_flow(write(tmp_path / "counted.nc", frames("frame")))
    assert field.attrs["warning"] == "the flow is the mean of 2 frames: the file holds no times"
    expected = 2.0 * U
    expected[1, 1] = 3.0 * U[1, 1]
    np.testing.assert_allclose(field.u, expected, rtol=1e-12)
    timed = load_flow(write(tmp_path / "timed.nc", frames("minutes since 2020-01-01")))
    np.testing.assert_allclose(timed.time, [0.0, 120.0])
    np.testing.assert_allclose(timed.v[1], 3.0 * V, rtol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"variables": {"w": "u"}}, "`variables` are of u, v, x, y, time, mask; got 'w'"),
        ({"variables": {"u": "absent"}}, "no variable 'absent'; it has u, v, x, y: name them"),
        ({"variables": {"u": "v"}}, "names one variable twice"),
        ({"metres_per_pixel": 0.1}, "says what `metres_per_pixel` would"),
        ({"length_unit": "mm"}, "says what `length_unit` would"),
    ],
)
def test_what_is_refused(tmp_path: Path, options: dict[str, Any], message: str) -> None:
    path = write(tmp_path / "field.nc", ocean(("u", "v", "x", "y"), [SPEED, SPEED, METRES, METRES]))
    with pytest.raises(InputError, match=message) as caught:
        load_flow(path, **options)
    assert "\n" not in str(caught.value)


def test_a_fill_value_that_nobody_declared_is_no_velocity(tmp_path: Path) -> None:
    dataset = ocean(("u", "v", "x", "y"), [SPEED, SPEED, METRES, METRES])
    dataset["u"][0, 0] = 9.96921e36
    dataset["v"][1, 1] = np.nan
    with pytest.raises(InputError, match=r"the flow reaches 9.97e\+36 m/s, as no water does"):
        load_flow(write(tmp_path / "field.nc", dataset))


def test_layers_are_refused(tmp_path: Path) -> None:
    dataset = ocean(("u", "v", "x", "y"), [SPEED, SPEED, METRES, METRES], ("depth",))
    both = xr.concat([dataset, dataset], dim="depth")
    with pytest.raises(InputError, match="keep one layer or member in the file"):
        load_flow(write(tmp_path / "layers.nc", both))


def test_the_real_field(shared_data: Callable[[str], Path]) -> None:
    path = shared_data("formats-2") / "piv_named_otherwise.nc"
    with pytest.raises(InputError, match="it has velocity_n, velocity_s, chc"):
        load_flow(path)
    names = {"u": "velocity_n", "v": "velocity_s", "x": "grid_n", "y": "grid_z"}
    field = load_flow(path, variables=names, metres_per_pixel=1e-4, frame_interval=0.01)
    with xr.open_dataset(path, decode_times=False) as raw:
        np.testing.assert_allclose(field.x, 1e-4 * raw["grid_n"], rtol=1e-12)
        np.testing.assert_allclose(field.y, 1e-4 * raw["grid_z"], rtol=1e-12)
        np.testing.assert_array_equal(field.u, 0.01 * raw["velocity_n"][0].T)
