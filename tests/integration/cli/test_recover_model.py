"""`driftwalk study recover --model`: what it prints and writes, resume, and what it refuses."""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import NO_FIGURES, Done, apart, here, refusal
from few_simulations import simulate_little
from redrawn import assert_drawn_alike
from self_propelled import moving
from signals_at_units import after_units

import driftwalk as dw
from driftwalk.record import save_trajectory
from driftwalk.schema.stores.netcdf import open_netcdf

VALUES = {"speed": 0.03, "rotational_diffusion": 0.5, "turn_rate": 0.3}
TRUTH = [word for name, one in VALUES.items() for word in ("--parameter", f"{name}={one}")]
SHORT = ("--duration", "40s", "--position-noise", "0.3mm", "--bootstrap", "10")


def words(folder: Path, *more: object) -> list[object]:
    few = ("--recordings", "2", "--threads", "1")
    return ["study", "recover", "--model", "active", *TRUTH, *SHORT, *few, "-o", folder, *more]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("recover") / "run"
    with pytest.MonkeyPatch.context() as patch:
        simulate_little(patch, matched=True)
        done = here(*words(folder, "--json"))
    assert done.code == 0, done.err
    return folder, json.loads(done.out)


@pytest.mark.slow
def test_the_answer_is_the_summary_of_the_recordings(run: tuple[Path, dict[str, Any]]) -> None:
    folder, said = run
    found = open_netcdf(folder / "model_recovery.nc")
    assert (said["model"], said["recordings"], said["calibrated"]) == ("active", 2, 2)
    assert (said["duration_s"], said["sample_rate_Hz"], said["position_noise_m"]) == (40, 10, 3e-4)
    speed = np.abs(np.log(found["estimate"].sel(parameter="speed").values / VALUES["speed"]))
    assert said["parameters"]["speed_m_s"]["median_error"] == pytest.approx(speed.mean())
    # In 40 s the speed comes to about 1 %: ten times that is no chance.
    assert speed.max() < 0.1
    assert said["parameters"]["speed_m_s"]["determined"] == 2


@pytest.mark.slow
def test_the_folder_holds_everything(run: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = run
    for name in ("errors.png", "errors.svg"):
        assert (folder / "figures" / name).stat().st_size > 1000
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["seeds"] == {"recovery": 1}
    assert not (folder / ".shards").exists()
    report = here("report", folder, "-o", folder.parent / "report.html")
    assert report.code == 0, report.err
    assert "--overwrite" in refusal(here(*words(folder)))


GRID = """\
[calibration]
replicates = 1
refined_replicates = 1
bootstrap = 5
[observation]
position_noise_m = 3e-4
[recover]
recordings = 3
durations_s = [40.0]
sample_interval_s = 0.2
"""
KNOWN = ("--known", "turn_rate", "--known", "rotational_diffusion")


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("grid") / "grid.toml"
    path.write_text(GRID, encoding="utf-8")
    return path


def on_a_grid(grid: Path, folder: Path, *more: object) -> list[object]:
    """Return a command that leaves one parameter open, which a map is made of."""
    model = ("study", "recover", "--model", "active", *TRUTH, *KNOWN, "--study", grid)
    return [*model, "--threads", "1", "-o", folder, *more]


@pytest.fixture(scope="module")
def one_open(grid: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("one_open") / "run"
    done = here(*on_a_grid(grid, folder, "--json"))
    assert done.code == 0, done.err
    return folder, json.loads(done.out)


def test_known_parameters_leave_a_map(one_open: tuple[Path, dict[str, Any]]) -> None:
    said = one_open[1]
    assert list(said["parameters"]) == ["speed_m_s"]
    assert said["fixed"] == {"turn_rate": 0.3, "rotational_diffusion": 0.5}
    assert said["sample_rate_Hz"] == 5.0
    assert said["parameters"]["speed_m_s"]["median_error"] < 0.1
    assert said["parameters"]["speed_m_s"]["intervals"] == 3


@pytest.mark.slow
def test_python_gives_the_same(one_open: tuple[Path, dict[str, Any]], grid: Path) -> None:
    model = dw.motion_model("active", turn_rate=0.3, rotational_diffusion=0.5)
    found = dw.recover_model(model, {"speed": 0.03}, dw.load_study(grid), threads=2)
    xr.testing.assert_equal(found, open_netcdf(one_open[0] / "model_recovery.nc"))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_killed_after_two_recordings_it_goes_on(
    one_open: tuple[Path, dict[str, Any]], grid: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    told = []
    for count in (2, 1):
        command = on_a_grid(grid, folder)
        killed = apart(*command, before=NO_FIGURES + after_units(signal.SIGKILL, count))
        assert killed.code == -signal.SIGKILL
        kept = folder.glob(".shards/*/[0-9]*.npz")
        told.append({path.name: path.stat().st_mtime_ns for path in kept})
    before, after = told
    # The second start made one recording, and left the first two as they were.
    assert (len(before), len(after)) == (2, 3)
    assert {name: after[name] for name in before} == before
    done = here(*on_a_grid(grid, folder))
    assert done.code == 0, done.err
    # Another process may use another number of threads for its linear algebra.
    stored = open_netcdf(one_open[0] / "model_recovery.nc")
    xr.testing.assert_allclose(open_netcdf(folder / "model_recovery.nc"), stored, rtol=1e-6)


@pytest.mark.slow
def test_recordings_are_like_one(grid: Path, tmp_path: Path) -> None:
    """Its times and gaps; the truth is that of a made-up calibration, with one value over it."""
    found = xr.Dataset(
        {"estimate": ("parameter", [0.03, 0.5, 0.3])},
        {"parameter": list(VALUES)},
        {"kind": "model_calibration", "model": "active"},
    )
    found.to_netcdf(tmp_path / "found.nc", engine="h5netcdf")
    seen = moving(dw.motion_model("active", clearance=0.015), VALUES, 40.0, seed=3, noise=5e-4)
    seen["x"][100:120] = np.nan
    save_trajectory(seen, tmp_path / "seen.nc")
    search = tmp_path / "search.toml"
    search.write_text(GRID.partition("[observation]")[0], encoding="utf-8")
    done = here(
        *("study", "recover", tmp_path / "found.nc", "--model", "active"),
        *("--parameter", "speed=0.02", *KNOWN, "--like", tmp_path / "seen.nc"),
        *(
            "--study",
            search,
            "--known",
            "position_noise",
            "--recordings",
            "2",
            "-o",
            tmp_path / "run",
            "--json",
        ),
    )
    assert done.code == 0, done.err
    said = json.loads(done.out)
    assert said["duration_s"] == pytest.approx(39.9)
    assert said["missing_share"] == pytest.approx(0.05)
    assert said["parameters"]["speed_m_s"]["truth"] == 0.02
    assert said["position_noise_m"] == pytest.approx(5e-4, rel=0.2)
    assert said["noise"] == "known"
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text(encoding="utf-8"))
    assert set(manifest["inputs"]) == {"truth", "parameters", "like"}


MODEL = ("--model", "active", *TRUTH)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "the truth is missing"),
        (("--model", "activ", *TRUTH), "no motion model 'activ'"),
        (("--model", "active", "--parameter", "speed=0.03"), "no value for rotational_diffusion"),
        ((*MODEL, "--parameter", "spee=1"), "did you mean 'speed'"),
        ((*MODEL, "--known", "spee"), "--known spee"),
        (("--parameter", "speed=1"), "--parameter belongs to a --model"),
        (("--known", "speed"), "--known belongs to a --model"),
        (("--bootstrap", "10"), "--bootstrap: belongs to a --model"),
        ((*MODEL, "--precision", "0.1"), "--precision: about the block"),
        ((*MODEL, "--recordings", "1"), "--recordings"),
        ((*MODEL, "--duration", "1min,2min"), "--duration holds 2 lengths"),
        ((*MODEL, "--duration", "2s"), "too short"),
        ((*MODEL, "--sample-rate", "0"), "--sample-rate 0: give a rate above 0"),
        ((*MODEL, "--body", "a"), "--body belongs to --like"),
        ((*MODEL, "--like", "nowhere.csv"), "nowhere.csv: there is no such file"),
        ((*MODEL, "--flow", "random"), 'the flow "random" is for the block'),
        ((*MODEL, "--flow", "nowhere.nc"), "nowhere.nc: there is no such file"),
        (("nowhere", "--model", "active"), "nowhere does not exist"),
        ((*MODEL[:-1], "turn_rate=99"), "turn_rate is 99 rad/s, and is searched from -10 to 10"),
    ],
)
def test_mistakes_are_one_line(options: tuple[str, ...], message: str, tmp_path: Path) -> None:
    done: Done = here("study", "recover", *options, "-o", tmp_path / "run")
    assert message in refusal(done)
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_its_figures_are_drawn_again_alike(
    run: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    assert_drawn_alike(run[0], tmp_path / "out")
