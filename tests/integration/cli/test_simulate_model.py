"""`driftwalk simulate --model`: a member of the family, a file and a program, on real options."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, RECORDING, Done, here, leave_out_figures, refusal
from scipy.integrate import solve_ivp
from scipy.interpolate import RegularGridInterpolator

import driftwalk as dw
from driftwalk.schema.check import check_dataset
from driftwalk.schema.stores.netcdf import open_netcdf

ACTIVE = {"speed": 0.05, "rotational_diffusion": 0.5, "turn_rate": 0.0}
PROGRAM = Path(__file__).parents[2] / "helpers" / "tumble_program.py"
GRID = """\
[calibration]
replicates = 1
refined_replicates = 2
bootstrap = 10
"""
FILE = """\
import numpy as np


def diffuse(scene, *, diffusivity=(1e-6, 1e-2, "m2/s")):
    spread = np.sqrt(2 * diffusivity * np.diff(scene.times, prepend=0.0))
    x, y = (np.cumsum(spread * scene.random.normal(spread.size), axis=1) for _ in "xy")
    return scene.start.x[:, None] + x, scene.start.y[:, None] + y


def nowhere(scene, *, speed=(0.01, 0.1, "m/s")):
    return (np.full((scene.worlds, scene.times.size), np.nan),) * 2


def fails(scene, *, speed=(0.01, 0.1, "m/s")):
    raise ValueError("no such speed")
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("model")
    (folder / "mine.py").write_text(FILE)
    (folder / "grid.toml").write_text(GRID)
    return folder


def parameters(values: dict[str, float]) -> list[str]:
    return [word for name, one in values.items() for word in ("--parameter", f"{name}={one!r}")]


def simulated(out: Path, *words: object) -> tuple[Done, xr.Dataset]:
    done = here("simulate", *words, "-o", out)
    assert done.code == 0, done.err
    return done, check_dataset(open_netcdf(out))


@pytest.mark.slow
def test_a_member_of_the_family_in_a_tank_of_its_own(tmp_path: Path) -> None:
    words = ("--model", "active", *parameters(ACTIVE), "--parameter", "clearance=0.01")
    times = ("--duration", "60s", "--sample-rate", "20", "--replicates", "3", "--seed", "4")
    done, run = simulated(tmp_path / "a.nc", *words, *times, "--tank", "20cm", "--json")
    said = json.loads(done.out)
    assert (said["replicates"], said["samples"], said["duration_s"]) == (3, 1201, 60.0)
    assert said["model"] == "active"
    assert said["parameters"]["rotational_diffusion_rad2_s"] == 0.5
    assert "drag_coefficient" not in said
    assert np.hypot(run["x"], run["y"]).max() <= 0.09 + 1e-6
    # A constant speed, but at the wall: 50 ms apart.
    away = np.hypot(run["x"], run["y"]).values[:, 1:, 0] < 0.08
    step = np.hypot(*(np.diff(run[name].values[:, :, 0], axis=1) for name in "xy"))
    assert np.median(step[away]) == pytest.approx(0.0025, rel=0.02)
    again = simulated(tmp_path / "b.nc", *words, *times, "--tank", "20cm")[1]
    np.testing.assert_array_equal(again["x"], run["x"])
    study = dw.apply_overrides(dw.Study(), {"tank.diameter_m": 0.2, "simulation.duration_s": 60.0})
    twin = dw.simulate(
        dw.motion_model("active", clearance=0.01),
        parameters=ACTIVE,
        study=dw.apply_overrides(study, {"simulation.sample_rate_Hz": 20.0}),
        replicates=3,
        seed=4,
    )
    np.testing.assert_array_equal(twin["x"], run["x"])


@pytest.mark.slow
def test_like_a_recording_and_read_again_as_its_commands_do(tmp_path: Path) -> None:
    words = ("--model", "active", *parameters(ACTIVE), "--like", RECORDING, "--replicates", "2")
    _, run = simulated(tmp_path / "a.nc", *words)
    assert run.sizes["time"] == 18001
    first = np.hypot(run["x"].values[:, 0, 0] - 0.0164, run["y"].values[:, 0, 0])
    assert np.ptp(first) < 0.003  # one start, with the noise of the camera, 0.3 mm
    compared = here(
        *("compare", RECORDING, tmp_path / "a.nc", "--replicate", "1", "--permutations", "0"),
        "--json",
    )
    said = json.loads(compared.out)
    one = run.isel(replicate=1, drop=True)
    twin = dw.compare(dw.tank30_recording(), one, permutations=0)
    assert said["ks_distance"] == float(twin["ks_distance"])
    # As a recording: info and read take the same replicate.
    info = here("info", tmp_path / "a.nc", "--replicate", "1", "--json")
    (body,) = json.loads(info.out)["bodies"].values()
    assert (body["samples"], body["gaps"]) == (18001, 0)
    assert body["x_max_m"] == pytest.approx(float(one["x"].max()), abs=1e-9)
    assert json.loads(info.out)["arena"]["diameter_m"] == 0.3
    done = here("read", tmp_path / "a.nc", "-o", tmp_path / "one.csv", "--replicate", "1")
    assert done.code == 0, done.err
    table = np.genfromtxt(tmp_path / "one.csv", delimiter=",", names=True)
    np.testing.assert_allclose(table["x_m"], one["x"].values[:, 0], atol=1e-7)
    assert "no --replicate 2: the simulation has 2" in refusal(
        here("info", tmp_path / "a.nc", "--replicate", "2")
    )
    assert "omit --replicate" in refusal(here("info", RECORDING, "--replicate", "0"))
    report = here("report", tmp_path / "a.nc", "-o", tmp_path / "a.html")
    assert report.code == 0, report.err


def test_a_file_and_a_program(place: Path, tmp_path: Path) -> None:
    mine = f"{place / 'mine.py'}:diffuse"
    done, run = simulated(
        *(tmp_path / "a.nc", "--model", mine, "--parameter", "diffusivity=1e-5"),
        *("--duration", "200s", "--replicates", "4"),
    )
    assert "diffuse with diffusivity_m2_s 1e-05" in done.err
    assert "tank: circle of diameter 0.3 m (default)" in done.err
    # 16,000 squared steps of mean 2 D dt: known to 1.2 %, and this is four of that.
    steps = np.diff(run["x"].values[:, :, 0], axis=1), np.diff(run["y"].values[:, :, 0], axis=1)
    assert np.mean(np.square(steps)) == pytest.approx(2e-6, rel=0.048)
    speed = {"speed": 0.02, "tumble_rate": 1.0}
    command = f"command:{sys.executable} {PROGRAM}"
    _, run = simulated(
        tmp_path / "b.nc", "--model", command, *parameters(speed), "--duration", "10s"
    )
    step = np.hypot(*(np.diff(run[name].values[0, :, 0]) for name in "xy"))
    np.testing.assert_allclose(step, 0.002, rtol=1e-6)
    assert run.attrs["model"] == "tumble_program"


@pytest.mark.slow
def test_the_water_carries_it(tmp_path: Path) -> None:
    """A swimmer that hardly swims follows the water, by SciPy's integrator and interpolation."""
    slow = parameters({**ACTIVE, "speed": 1e-6})
    words = ("--model", "active+flow", *slow, "--flow", FLOW, "--duration", "3s")
    (tmp_path / "s.toml").write_text("[simulation]\nstart = { x_m = 0.05, y_m = 0.02 }\n")
    _, run = simulated(tmp_path / "a.nc", *words, "--study", tmp_path / "s.toml")
    water = dw.load_flow(FLOW)
    at = RegularGridInterpolator(
        (water["y"].values, water["x"].values), np.stack([water["u"], water["v"]], axis=-1)
    )
    path = solve_ivp(
        lambda _, place: at(place[::-1])[0], (0.0, 3.0), [0.05, 0.02], t_eval=run["time"], rtol=1e-8
    )
    assert np.hypot(*(path.y[:, -1] - path.y[:, 0])) > 0.05
    for name, expected in zip("xy", path.y, strict=True):
        np.testing.assert_allclose(run[name].values[0, :, 0], expected, atol=5e-4)


@pytest.mark.slow
def test_values_of_a_calibration(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Calibrate what was simulated, and simulate it again with what was found."""
    leave_out_figures(monkeypatch)
    truth = (*parameters(ACTIVE), "--parameter", "clearance=0.015", "--position-noise", "0.3mm")
    _, made = simulated(tmp_path / "a.nc", "--model", "active", *truth, "--duration", "100s")
    moved = made.isel(replicate=0, drop=True).assign_attrs(kind="trajectory")
    dw.save_trajectory(moved, tmp_path / "moved.nc")
    known = ("--parameter", "turn_rate=0", "--parameter", "clearance=0.015")
    searched = ("--parameter", "speed=0.03,0.08", "--parameter", "rotational_diffusion=0.5")
    run = tmp_path / "run"
    done = here(
        *("calibrate", tmp_path / "moved.nc", "--study", place / "grid.toml", "-o", run),
        *("--model", "active", *known, *searched, "--json"),
    )
    assert done.code == 0, done.err
    speed = json.loads(done.out)["speed_m_s"]
    assert speed == pytest.approx(ACTIVE["speed"], rel=0.05)
    words = ("--model", "active", "--like", tmp_path / "moved.nc", "--json")
    # The directory knows what the calibration was given; its dataset alone does not.
    again = json.loads(simulated(tmp_path / "b.nc", run, *words)[0].out)
    stated = {"rotational_diffusion_rad2_s": 0.5, "turn_rate_rad_s": 0.0, "clearance_m": 0.015}
    assert again["parameters"] == {"speed_m_s": pytest.approx(speed), **stated}
    over = (run, *words, "--parameter", "speed=0.2")
    other = json.loads(simulated(tmp_path / "c.nc", *over)[0].out)
    assert other["parameters"]["speed_m_s"] == 0.2
    alone = tmp_path / "alone.nc"
    alone.write_bytes((run / "calibration.nc").read_bytes())
    words = ("simulate", "--model", "active", "-o", tmp_path / "d.nc")
    assert "no value for rotational_diffusion" in refusal(here(*words, alone))
    words = ("simulate", "--model", "run_tumble", "-o", tmp_path / "d.nc", run)
    assert "about active, and not about the model run_tumble" in refusal(here(*words))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--model", "active"), "no value for speed (1e-06 to 10 m/s), rotational_diffusion (0.00"),
        (("--model", "active"), "give one for each (--parameter)"),
        (("--model", "activ"), "activ"),
        (("--model", "mine.py:nothing"), "mine.py has no 'nothing'"),
        (("--parameter", "speed=0.1"), "belongs to a --model"),
        (("--model", "active", "--parameter", "speed"), "expected NAME=VALUE"),
        (("--model", "active", "--parameter", "speed=1,2"), "speed=1,2 is a range"),
        (("--model", "active", "--parameter", "speed=1", "--parameter", "speed=2"), "twice"),
        (("--model", "active", *parameters({**ACTIVE, "sped": 1.0})), "did you mean 'speed'"),
        (("--model", "active", *parameters({**ACTIVE, "speed": -1.0})), "speed is -1"),
        (("--model", "active", *parameters({**ACTIVE, "clearance": 0.2})), "0.2 m from the wall"),
        (("--model", "active", *parameters({**ACTIVE, "clearance": -1.0})), "clearance is -1"),
        (("--model", "active+flow", *parameters(ACTIVE)), "give the flow of the water (--flow)"),
        (("--model", "active", *parameters(ACTIVE), "--flow", FLOW), "does not feel the water"),
        (("--model", "active", *parameters(ACTIVE), "--side", "3cm"), "--side: about the block"),
        (("--model", "active", *parameters(ACTIVE), "--backend", "reference"), "for the block"),
        (("--model", "active", "nowhere"), "nowhere does not exist"),
        (("--model", "active", "."), "is not a run directory"),
        (("--model", "active", "mine.py"), "is not a run directory"),
        (("--model", "mine.py:fails", "--parameter", "speed=0.1"), "ValueError: no such speed"),
        (("--model", "mine.py:nowhere", "--parameter", "speed=0.1"), "such as at speed=0.1"),
        (("--model", f"command:{sys.executable} {PROGRAM} die", "--parameter", "speed=0.02",
          "--parameter", "tumble_rate=1"), "last words"),
        (("--model", "command:./nothing", "--parameter", "speed=0.02"), "nothing"),
        ((), "the flow of the water is missing: give a flow field (--flow)"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(
    place: Path,
    tmp_path: Path,
    options: tuple[str, ...],
    said: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(place)
    out = tmp_path / "out.nc"
    assert said in refusal(here("simulate", *options, "--duration", "5s", "-o", out))
    assert not out.exists()


@pytest.mark.slow
def test_a_source_that_has_changed_since_is_said(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(FILE, encoding="utf-8")
    model = dw.motion_model("mine.py:diffuse")
    estimate = xr.DataArray([2e-5], {"parameter": ["diffusivity"]}, "parameter")
    found = xr.Dataset({"estimate": estimate}, attrs={"kind": "calibration", **model.facts({})})
    found.to_netcdf("found.nc", engine="h5netcdf")
    words = ("--model", "mine.py:diffuse", "found.nc", "--duration", "5s")
    assert "has changed since" not in simulated(tmp_path / "a.nc", *words)[0].err
    Path("mine.py").write_text(f"# another one\n{FILE}", encoding="utf-8")
    done, run = simulated(tmp_path / "b.nc", *words)
    assert "warning: the source of mine.py:diffuse has changed since" in done.err
    assert json.loads(run.attrs["model_parameters"]) == {"diffusivity_m2_s": 2e-5}
