"""Flow fields on disk: NetCDF that plain xarray opens, CSV in SI, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from driftwalk.core.errors import FormatError, InputError
from driftwalk.flow import (
    bilinear,
    extract_flow,
    jets_flow,
    load_flow,
    save_flow,
    shear_flow,
    uniform_flow,
    vortex_flow,
)
from driftwalk.schema import FLAGS, build_flow_field, build_trajectory


@pytest.fixture
def extracted() -> xr.Dataset:
    angle = 0.05 * np.arange(3000) + 0.0
    radius = 0.08 + 0.04 * np.sin(0.013 * np.arange(3000))
    track = build_trajectory(0.1 * np.arange(3000), radius * np.cos(angle), radius * np.sin(angle))
    arena = {"shape": "circle", "diameter_m": 0.3}
    return extract_flow(track, arena=arena, mass=0.0116, side=0.03)


def test_netcdf_returns_everything(extracted: xr.Dataset, tmp_path: Path) -> None:
    path = save_flow(extracted, tmp_path / "flow.nc")
    again = load_flow(path)
    xr.testing.assert_identical(again.drop_attrs(), extracted.drop_attrs())
    assert {**again.attrs, "Conventions": None} == {**extracted.attrs, "Conventions": None}


def test_plain_xarray_reads_units_and_flags(extracted: xr.Dataset, tmp_path: Path) -> None:
    save_flow(extracted, tmp_path / "flow.nc")
    with xr.open_dataset(tmp_path / "flow.nc") as plain:
        for name in ("u", "v", "u_block", "u_standard_error"):
            assert plain[name].attrs["units"] == "m s-1"
            assert plain[name].dims == ("y", "x")
        assert plain["x"].attrs["units"] == plain["y"].attrs["units"] == "m"
        assert plain["flag"].attrs["flag_meanings"] == "outside measured filled"
        np.testing.assert_array_equal(plain["flag"].attrs["flag_values"], [0, 1, 2])
        assert plain.attrs["Conventions"].startswith("CF-")
        assert plain.attrs["mass_kg"] == 0.0116


def test_nothing_is_overwritten_silently(tmp_path: Path) -> None:
    path = tmp_path / "flow.nc"
    save_flow(uniform_flow(0.1, 0.0), path)
    before = path.read_bytes()
    with pytest.raises(InputError, match='`existing="replace"`'):
        save_flow(uniform_flow(0.2, 0.0), path)
    assert path.read_bytes() == before
    save_flow(uniform_flow(0.2, 0.0), path, existing="replace")
    assert float(load_flow(path).u[0, 0]) == 0.2
    assert [file.name for file in tmp_path.iterdir()] == ["flow.nc"]


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("flow.txt", {}, "ends in .nc or .csv"),
        ("absent/flow.nc", {}, "does not exist"),
        ("flow.nc", {"existing": "maybe"}, "existing"),
    ],
)
def test_refuses_to_write(name: str, options: dict[str, str], message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        save_flow(uniform_flow(0.1, 0.0), tmp_path / name, **options)


def test_csv_returns_the_same_numbers_whatever_the_order(tmp_path: Path) -> None:
    field = jets_flow(cells=9)
    path = save_flow(field, tmp_path / "flow.csv")
    header, *lines = path.read_text().splitlines()
    assert header == "x,y,u,v"
    shuffled = [lines[i] for i in np.random.default_rng(0).permutation(len(lines))]
    path.write_text("\n".join([header, *shuffled]) + "\n\n")
    again = load_flow(path)
    np.testing.assert_array_equal(again.u, field.u)
    np.testing.assert_array_equal(again.v, field.v)
    np.testing.assert_allclose(again.x, field.x, atol=1e-15)
    assert (again.flag == FLAGS["measured"]).all()


def test_csv_with_another_column_order_separator_and_more_columns(tmp_path: Path) -> None:
    path = tmp_path / "flow.csv"
    path.write_text(
        "# by hand\nv_m_s;quality;Y_M;x_m;u_m_s\n0.1;ok;0;0;1\n0.2;ok;0;2;1\n0.3;ok;1;0;1\n"
        "\n0.4;bad;1;2;1\n",
        encoding="utf-8-sig",
    )
    field = load_flow(path)
    np.testing.assert_array_equal(field.v, [[0.1, 0.2], [0.3, 0.4]])
    np.testing.assert_array_equal(field.x, [0.0, 2.0])


def test_csv_knows_its_tank_when_told(tmp_path: Path) -> None:
    path = save_flow(uniform_flow(0.1, 0.0), tmp_path / "flow.csv")
    field = load_flow(path, arena={"shape": "circle", "diameter_m": 0.3})
    np.testing.assert_array_equal(field.flag, uniform_flow(0.1, 0.0).flag)
    assert "diameter_m" in field.attrs["arena"]


GRID = "x,y,u,v\n0,0,1,0\n1,0,1,0\n0,1,1,0\n1,1,1,0\n"


@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        ("", "empty", None),
        ("x,y,u\n0,0,1\n", "one column 'v'", 1),
        ("x,x,y,u,v\n0,0,0,1,0\n", "one column 'x'", 1),
        ("x,y,u,v\n", "no row", 1),
        (GRID + "0,2,1\n", "expected 4 fields, got 3", 6),
        (GRID + "0,2,one,0\n", "expected a finite number, got 'one'", 6),
        (GRID + "0,2,inf,0\n", "expected a finite number, got 'inf'", 6),
        (GRID + "nan,2,1,0\n", "a node has no position", 6),
        (GRID + "1,0,2,0\n", "stands in line 3 already", 6),
        (GRID + "0,2,1,0\n", "lacks 1 of them, the first at x = 1, y = 2", None),
        (GRID + "0,2.5,1,0\n1,2.5,1,0\n", "not evenly spaced", None),
        (GRID + "0,2,1,0\n1.1,2,1,0\n", "x = 1.1 stands in 1 of 6 rows", 7),
        ("x,y,u,v\n0,0,1,0\n0,1,1,0\n", "all rows have the same x", None),
    ],
)
def test_csv_is_refused_with_its_line(
    text: str, message: str, line: int | None, tmp_path: Path
) -> None:
    path = tmp_path / "flow.csv"
    path.write_text(text)
    with pytest.raises(FormatError, match=message) as caught:
        load_flow(path)
    assert str(path) in str(caught.value)
    if line is not None:
        assert caught.value.line == line


def test_a_wrong_field_is_found_by_its_column(tmp_path: Path) -> None:
    path = tmp_path / "flow.csv"
    path.write_text("a,x,y,u,v\n,0,0,?,0\n")
    with pytest.raises(FormatError) as caught:
        load_flow(path)
    assert (caught.value.line, caught.value.column) == (2, 4)


def test_no_file_and_no_text(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no such file"):
        load_flow(tmp_path / "absent.nc")
    (tmp_path / "binary").write_bytes(b"\xff\x00\x80\x01")
    with pytest.raises(FormatError, match="is not text"):
        load_flow(tmp_path / "binary")


def foreign_dataset(**changes: Any) -> xr.Dataset:
    """A field as another program may write it, synthetic: cm, falling y, x first."""
    x, y = np.array([0.0, 2.0, 4.0, 6.0]), np.array([3.0, 2.0, 1.0])
    u = 10.0 * x[:, None] + y[None, :]
    units = {"x": "cm", "y": "cm", "u": "cm s-1", "v": "mm/s", **changes}
    return xr.Dataset(
        {
            "u": (("x", "y"), u, {"units": units["u"]}),
            "v": (("x", "y"), -u, {"units": units["v"]}),
            "pressure": ("x", x),
        },
        coords={
            "x": ("x", x, {"units": units["x"]}),
            "y": ("y", y, {"units": units["y"]}),
        },
    )


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
def test_foreign_netcdf_is_converted_turned_and_sorted(engine: Any, tmp_path: Path) -> None:
    path = tmp_path / "field.nc"
    foreign_dataset().to_netcdf(path, engine=engine)
    field = load_flow(path)
    np.testing.assert_allclose(field.x, [0.0, 0.02, 0.04, 0.06])
    np.testing.assert_allclose(field.y, [0.01, 0.02, 0.03])
    expected = 10.0 * np.array([0.0, 2.0, 4.0, 6.0])[None, :] + np.array([1.0, 2.0, 3.0])[:, None]
    np.testing.assert_allclose(field.u, 0.01 * expected)
    np.testing.assert_allclose(field.v, -0.001 * expected)
    assert field.u.dims == ("y", "x")
    assert field.attrs["source"] == "field.nc"


def test_missing_velocities_of_a_foreign_field_are_filled_and_flagged(tmp_path: Path) -> None:
    foreign = foreign_dataset(v="cm s**-1")
    foreign["u"][1, 1] = np.nan
    foreign.to_netcdf(tmp_path / "field.nc", engine="h5netcdf")
    field = load_flow(tmp_path / "field.nc")
    np.testing.assert_array_equal(
        field.flag == FLAGS["filled"], np.eye(3, 4, dtype=bool) & [[0, 1, 0, 0]]
    )
    np.testing.assert_allclose(field.u.values[1, 1], 0.01 * 22.0)


def test_frames_are_kept(tmp_path: Path) -> None:
    frames = xr.concat([foreign_dataset(), 2.0 * foreign_dataset()], dim="time")
    for name in ("u", "v"):
        frames[name].attrs["units"] = "m.s-1"
    frames = frames.assign_coords(time=("time", [0.0, 40.0], {"units": "ms"}))
    frames.to_netcdf(tmp_path / "field.nc", engine="h5netcdf")
    field = load_flow(tmp_path / "field.nc")
    assert field.u.dims == ("time", "y", "x")
    np.testing.assert_allclose(field.time, [0.0, 0.04])
    np.testing.assert_allclose(field.u[1], 2.0 * field.u[0])
    np.testing.assert_allclose(bilinear(field, 0.02, 0.01, time=0.02)[0], 1.5 * 21.0)
    with pytest.raises(InputError, match=r"kept as \.nc"):
        save_flow(field, tmp_path / "field.csv")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"u": "kg"}, "units of 'u' are 'kg'"),
        ({"x": "pixels"}, "units of 'x' are 'pixels'"),
        ({"v": ""}, "'v' has no units"),
    ],
)
def test_foreign_units_are_refused_by_name(
    change: dict[str, str], message: str, tmp_path: Path
) -> None:
    foreign_dataset(**change).to_netcdf(tmp_path / "field.nc", engine="h5netcdf")
    with pytest.raises(FormatError, match=message):
        load_flow(tmp_path / "field.nc")


@pytest.mark.slow
def test_netcdf_that_is_no_flow_field_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "field.nc"
    foreign_dataset().drop_vars("v").to_netcdf(path, engine="h5netcdf")
    with pytest.raises(FormatError, match="no variable 'v'"):
        load_flow(path)
    foreign_dataset().expand_dims(level=2).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(FormatError, match="dimensions"):
        load_flow(path)
    foreign_dataset().isel(x=[0, 1, 3]).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(FormatError, match="not evenly spaced"):
        load_flow(path)
    foreign_dataset().isel(x=[0]).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(FormatError, match="'x' needs at least 2"):
        load_flow(path)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(FormatError, match="cannot be read as NetCDF"):
        load_flow(path)


def test_own_file_keeps_its_flags_and_is_checked(tmp_path: Path) -> None:
    path = save_flow(vortex_flow(1.0), tmp_path / "flow.nc")
    with pytest.raises(InputError, match="its own flags"):
        load_flow(path, arena={"shape": "circle", "diameter_m": 0.2})
    broken = shear_flow(1.0)
    broken["u"][3, 3] = np.nan
    broken.to_netcdf(tmp_path / "broken.nc", engine="h5netcdf")
    with pytest.raises(FormatError, match=r"broken.nc.*not finite"):
        load_flow(tmp_path / "broken.nc")


def test_a_small_field_with_uneven_sides(tmp_path: Path) -> None:
    field = build_flow_field(
        [0.0, 1.0], [0.0, 5.0, 10.0], u=np.ones((3, 2)), v=np.zeros((3, 2)), flag=np.ones((3, 2))
    )
    for name in ("a.nc", "a.csv"):
        again = load_flow(save_flow(field, tmp_path / name))
        np.testing.assert_array_equal(again.u, field.u)
