"""Flow fields of PIV programs from the command line: described, brought to metres, simulated in."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import contents, here, refusal

from driftwalk.flow import load_flow


@pytest.fixture
def shifts(tmp_path: Path) -> Path:
    """A synthetic field of OpenPIV, pixels from the top of the image on: a solid rotation."""
    x, y = np.meshgrid(16.0 * np.arange(1, 21), 16.0 * np.arange(1, 21))
    u, v = -0.02 * (y - 168.0), 0.02 * (x - 168.0)
    table = np.column_stack([part.ravel() for part in (x, y, u, v, 0 * x, 0 * x)])
    path = tmp_path / "field.txt"
    np.savetxt(path, table, header="x\ty\tu\tv\tflags\tmask", delimiter="\t")
    return path


SCALE = ("--scale", "1mm", "--frame-interval", "10ms")


@pytest.mark.slow
def test_a_field_in_pixels_is_described_and_made_one_in_metres(
    shifts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "name its units: give --scale and --frame-interval" in refusal(here("info", shifts))
    code, out, err = here("info", shifts, *SCALE, "--json")
    assert code == 0
    described: dict[str, Any] = json.loads(out)
    # A shift of 0.02 px per px of distance in 10 ms: 2 rad/s, at a corner 152 mm off both axes.
    assert described["speed_max_m_s"] == pytest.approx(2.0 * np.hypot(0.152, 0.152), rel=1e-9)
    assert "y counts downwards" in described["warnings"][0]
    made = tmp_path / "flow.nc"
    where = ("--tank", "circle:0.3@0.168,-0.168")
    code, out, err = here("flow", shifts, "--out", made, *SCALE, *where)
    assert code == 0
    assert "wrote" in err
    assert "y and v are negated (--y-axis)" in err
    field = load_flow(made)
    x, y = np.meshgrid(field.x, field.y)
    # Counter-clockwise in the image, whose y counts downwards, is clockwise seen with y up.
    np.testing.assert_allclose(field.u, 2.0 * y, atol=1e-9)
    np.testing.assert_allclose(field.v, -2.0 * x, atol=1e-9)
    np.testing.assert_array_equal(field.flag == 0, np.hypot(x, y) > 0.15)
    simulated = tmp_path / "simulated.nc"
    code, _, err = here(
        "simulate", "--flow", made, "--out", simulated, "--duration", "2", "--replicates", "1",
        "--drag-coefficient", "0.4", "--force-std", "0.1mN", "--force-interval", "16ms",
    )  # fmt: skip
    assert code == 0
    assert "the tank" not in err


def test_simulate_says_what_to_do_about_pixels(shifts: Path, tmp_path: Path) -> None:
    said = refusal(here("simulate", "--flow", shifts, "--out", tmp_path / "a.nc"))
    assert "driftwalk flow FILE -o flow.nc takes them" in said


@pytest.mark.slow
def test_netcdf_whose_variables_nobody_knows(tmp_path: Path) -> None:
    path = tmp_path / "field.nc"
    xr.Dataset(
        {name: (("b", "a"), np.ones((3, 4)), {"units": "m/s"}) for name in ("east", "north")},
        coords={n: (n, np.arange(float(k)), {"units": "m"}) for n, k in (("a", 4), ("b", 3))},
    ).to_netcdf(path, engine="h5netcdf")
    assert "--flow-variables u=NAME,v=NAME,x=NAME,y=NAME" in refusal(here("info", path))
    names = "u=east,v=north,x=a,y=b"
    code, out, _ = here("info", path, "--flow-variables", names, "--json")
    assert code == 0
    assert json.loads(out)["speed_mean_m_s"] == pytest.approx(np.sqrt(2.0))
    assert "takes QUANTITY=NAME" in refusal(here("info", path, "--flow-variables", "east"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--tank", "fit"), "--tank fit is for recordings"),
        (("--tank", "circle:wide"), "wide"),
    ],
)
def test_where_the_tank_is(
    shifts: Path, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    before = contents(tmp_path)
    said = refusal(here("flow", shifts, "--out", tmp_path / "flow.nc", *SCALE, *options))
    assert message in said
    assert contents(tmp_path) == before


def test_a_recording_has_no_time_between_images(tmp_path: Path) -> None:
    path = tmp_path / "track.csv"
    path.write_text("t,x,y\n0,1,2\n1,2,3\n2,3,3\n")
    for command in ("info",), ("flow", "--out", tmp_path / "a.nc"):
        said = refusal(here(command[0], path, *command[1:], "--frame-interval", "1s"))
        assert "--frame-interval is for a flow field" in said


def test_a_field_is_no_recording(shifts: Path, tmp_path: Path) -> None:
    said = refusal(here("read", shifts, "-o", tmp_path / "out.nc"))
    assert f"{shifts} holds a flow field, and no positions: it is for --flow" in said
    binary = tmp_path / "B00001.vc7"
    binary.write_bytes(b"\0\1")
    assert "export it from DaVis as txt" in refusal(here("info", binary))
    assert "export it from DaVis as txt" in refusal(
        here("simulate", "--flow", binary, "--out", tmp_path / "out.nc")
    )
