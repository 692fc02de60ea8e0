"""Writing a trajectory and reading it back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from driftwalk.core.errors import InputError
from driftwalk.record import load, save_trajectory
from driftwalk.schema import body_track, build_trajectory


def example() -> xr.Dataset:
    x = np.array([[0.1, np.nan], [1 / 3, 2 / 3], [np.nan, np.nan], [np.pi, 1e-17]])
    theta = np.array([[0.5, np.nan], [-3.0, np.nan], [np.nan, np.nan], [3.0, np.nan]])
    return build_trajectory(
        [0.0, 0.1, 0.2, 0.30000000000000004], x, -x, theta, body=["a", "b"], attrs={"source": "s"}
    )


def test_netcdf_round_trip_is_exact(tmp_path: Path) -> None:
    dataset = example()
    dataset.attrs["arena"] = '{"shape": "circle", "diameter_m": 0.3, "center_m": [0, 0]}'
    path = save_trajectory(dataset, tmp_path / "a.nc")
    back = load(path)
    for name in ("x", "y", "theta", "time"):
        np.testing.assert_array_equal(back[name].values, dataset[name].values)
    assert back.attrs["arena"] == dataset.attrs["arena"]
    with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as plain:
        assert plain["x"].attrs["units"] == "m"
        assert plain.attrs["kind"] == "trajectory"


def test_csv_round_trip_is_exact(tmp_path: Path) -> None:
    dataset = example()
    path = save_trajectory(dataset, tmp_path / "a.csv")
    assert path.read_text().splitlines()[0] == "t_s,x_m,y_m,theta_rad,body"
    back = load(path)
    np.testing.assert_array_equal(back["time"].values, dataset["time"].values)
    for body in ("a", "b"):
        for found, expected in zip(body_track(back, body), body_track(dataset, body), strict=True):
            np.testing.assert_array_equal(found, expected)


def test_nothing_is_overwritten_silently(tmp_path: Path) -> None:
    path = save_trajectory(example(), tmp_path / "a.csv")
    before = path.read_bytes()
    with pytest.raises(InputError, match=r'exists already.*`existing="replace"`'):
        save_trajectory(example().isel(time=[0]), path)
    assert path.read_bytes() == before
    save_trajectory(example().isel(time=[0]), path, existing="replace")
    assert path.read_bytes() != before
    assert [file.name for file in tmp_path.iterdir()] == ["a.csv"]


def test_where_nothing_can_be_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.nc or \.csv"):
        save_trajectory(example(), tmp_path / "a.txt")
    with pytest.raises(InputError, match="does not exist"):
        save_trajectory(example(), tmp_path / "absent" / "a.csv")
    with pytest.raises(InputError, match="'error' or 'replace'"):
        save_trajectory(example(), tmp_path / "a.csv", existing="yes")
    with pytest.raises(InputError, match="not a trajectory"):
        save_trajectory(xr.Dataset(), tmp_path / "a.csv")
