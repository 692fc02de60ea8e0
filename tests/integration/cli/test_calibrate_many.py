"""`driftwalk calibrate --model` with more than two parameters, on a recording of known truth."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import here, refusal
from redrawn import assert_drawn_alike
from self_propelled import moving

import driftwalk as dw
from driftwalk.cli.terminal.output import print_result
from driftwalk.record import save_trajectory
from driftwalk.schema.stores.netcdf import open_netcdf

TRUTH = {"speed": 0.03, "rotational_diffusion": 0.5, "turn_rate": 0.3}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """Return the folder of a calibration of a minute of an active body (synthetic)."""
    folder = tmp_path_factory.mktemp("many")
    moved = moving(dw.motion_model("active", clearance=0.015), TRUTH, 60.0, seed=2, noise=3e-4)
    save_trajectory(moved, folder / "recording.nc")
    done = here(*words(folder), "--json")
    assert done.code == 0, done.err
    return folder, json.loads(done.out)


def words(folder: Path) -> tuple[object, ...]:
    model = ("--model", "active", "--parameter", "clearance=0.015")
    noise = ("--position-noise", "0.3mm", "--bootstrap", "40", "--posterior")
    return ("calibrate", folder / "recording.nc", *model, *noise, "-o", folder / "run")


@pytest.mark.slow
def test_the_truth_is_found(run: tuple[Path, dict]) -> None:
    """Three intervals of 90 %, widened by half: all hold the truth of 97 of 100 recordings."""
    _, said = run
    assert said["estimate_from"] == "summaries"
    for name, value in TRUTH.items():
        (one,) = (found for key, found in said["parameters"].items() if key.startswith(name))
        low, high = one["interval"]
        room = 0.25 * (high - low)
        assert low - room <= value <= high + room, name
    assert said["parameters"]["speed_m_s"]["determined"]
    # The speed is known from 600 steps, within a percent or two.
    assert said["parameters"]["speed_m_s"]["value"] == pytest.approx(TRUTH["speed"], rel=0.03)


@pytest.mark.slow
def test_the_right_model_is_believed_without_a_search(run: tuple[Path, dict]) -> None:
    found = open_netcdf(run[0] / "run" / "model_calibration.nc")
    assert "searched_estimate" not in found
    assert float(found["discrepancy"]) <= float(found["discrepancy_q95"])
    assert float(found["interval_stretch"]) == 1.0
    assert found["verdict"] == "explains"


@pytest.mark.slow
def test_the_folder_holds_everything(run: tuple[Path, dict]) -> None:
    folder, said = run
    stored = open_netcdf(folder / "run" / "model_calibration.nc")
    values = [one["value"] for one in said["parameters"].values()]
    assert stored["estimate"].values.tolist() == values
    for name in ("recording.nc", "manifest.json", "figures/pairs.png", "figures/quality.svg"):
        assert (folder / "run" / name).stat().st_size > 0
    report = here("report", folder / "run", "-o", folder / "report.html")
    assert report.code == 0, report.err
    assert "--overwrite" in refusal(here(*words(folder)))


@pytest.mark.slow
def test_the_posterior_is_a_table(run: tuple[Path, dict]) -> None:
    folder, said = run
    head, *rows = (folder / "run" / "posterior.csv").read_text().splitlines()
    assert head.split(",") == list(said["parameters"])
    draws = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    assert draws.shape == (512, 3)
    low, high = np.quantile(draws[:, 0], [0.05, 0.95])
    assert [low, high] == pytest.approx(said["parameters"]["speed_m_s"]["interval"], rel=1e-6)


@pytest.mark.slow
def test_a_posterior_of_a_map_is_refused(run: tuple[Path, dict], tmp_path: Path) -> None:
    folder, _ = run
    words = ("calibrate", folder / "recording.nc", "--posterior", "-o", tmp_path / "run")
    assert "more than two parameters" in refusal(here(*words))
    assert "--bootstrap" in refusal(here(*words, "--model", "active", "--bootstrap", "0"))
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_people_read_which_parameters_are_determined(
    run: tuple[Path, dict], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, said = run
    found = open_netcdf(folder / "run" / "model_calibration.nc")
    print_result(found, folder / "run", json=False)
    rows = capsys.readouterr().out.splitlines()
    for row, one in zip(rows, said["parameters"].values(), strict=False):
        assert ("not determined" in row) != one["determined"]
    print_result(found.assign(determined=("parameter", [False] * 3)), folder / "run", json=False)
    rows = capsys.readouterr().out.splitlines()
    assert [row.split()[-1] for row in rows[:3]] == ["m/s)", "rad2/s)", "rad/s)"]


@pytest.mark.slow
def test_its_values_can_be_simulated(run: tuple[Path, dict]) -> None:
    folder, said = run
    out = folder / "again.nc"
    done = here(
        "simulate", folder / "run", "--model", "active",
        "--like", folder / "recording.nc", "-o", out,
    )  # fmt: skip
    assert done.code == 0, done.err
    stored = json.loads(open_netcdf(out).attrs["model_parameters"])
    assert stored["speed_m_s"] == said["parameters"]["speed_m_s"]["value"]


@pytest.mark.slow
def test_its_figures_are_drawn_again_alike(run: tuple[Path, dict], tmp_path: Path) -> None:
    assert_drawn_alike(run[0] / "run", tmp_path / "out")
