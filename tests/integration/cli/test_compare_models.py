"""`driftwalk compare-models` on half a minute of the bundled recording."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import RECORDING, here, leave_out_figures, refusal
from few_simulations import compare_after_little
from redrawn import assert_drawn_alike

import driftwalk as dw
from driftwalk.calibration import DEFAULT_MODELS
from driftwalk.cli.terminal.output import print_result
from driftwalk.runs import read_found
from driftwalk.schema.stores.netcdf import open_netcdf

SHORT = (
    *(RECORDING, "--to", "30s", "--tank", "30cm", "--models", "inertial,active"),
    *("--bootstrap", "0"),
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    folder = tmp_path_factory.mktemp("models") / "run"
    with pytest.MonkeyPatch.context() as patch:
        compare_after_little(patch)
        done = here("compare-models", *SHORT, "-o", folder, "--json")
    assert done.code == 0, done.err
    return folder, json.loads(done.out)


@pytest.mark.slow
def test_json_holds_the_ranking(run: tuple[Path, dict]) -> None:
    _, said = run
    names = [one["model"] for one in said["models"]]
    assert set(names) == {"inertial", "active", "resampled steps", "hidden Markov walk"}
    scores = [one["score"] for one in said["models"]]
    assert scores == sorted(scores)
    inertial = said["models"][names.index("inertial")]
    assert inertial["estimate"]["memory_time"]["unit"] == "s"
    assert set(inertial["held_out_distance"]) == set(said["own_distance"])
    walk = said["models"][names.index("resampled steps")]
    assert walk["baseline"]
    assert walk["verdict"] == "does not explain"
    assert walk["estimate"] == {}


@pytest.mark.slow
def test_the_folder_holds_everything(run: tuple[Path, dict]) -> None:
    folder, said = run
    stored = open_netcdf(folder / "comparison.nc")
    assert stored["model"].values.tolist() == [one["model"] for one in said["models"]]
    for name in ("recording.nc", "manifest.json", "figures/models.png", "figures/models.svg"):
        assert (folder / name).stat().st_size > 0
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["inputs"]["recording"]["sha256"]


@pytest.mark.slow
def test_people_read_the_answer(run: tuple[Path, dict], capsys: pytest.CaptureFixture[str]) -> None:
    folder, said = run
    print_result(open_netcdf(folder / "comparison.nc"), folder, json=False)
    out = capsys.readouterr().out
    assert out.startswith(f"{said['findings'][0]}.\n")
    for one in said["models"]:
        assert one["model"] in out
    for text in said["findings"]:
        assert f"{text}." in out
    assert "the recording's own parts" in out
    assert str(folder / "figures") in out


@pytest.mark.slow
def test_models_are_ranked_as_they_finish(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compare_after_little(monkeypatch)
    done = here("compare-models", *SHORT, "-o", tmp_path / "run")
    assert done.code == 0, done.err
    first = done.out.splitlines()[:4]
    assert {line.partition(":")[0] for line in first} == {
        *("inertial", "active", "resampled steps", "hidden Markov walk")
    }
    for number, line in enumerate(first, start=1):
        assert "distance" in line
        assert f"of {number} so far" in line
        assert (f"; {4 - number} to go" in line) == (number < 4)
    answer = done.out.splitlines()[4]
    assert answer.startswith(("Cannot tell whether", "No model explains the recording"))


@pytest.mark.slow
def test_mistakes_are_one_line(tmp_path: Path) -> None:
    words = ("compare-models", RECORDING, "--to", "60s", "--tank", "30cm")
    out = tmp_path / "run"
    assert "run_tumbel" in refusal(here(*words, "--models", "run_tumbel", "-o", out))
    assert "twice" in refusal(here(*words, "--models", "active,active", "-o", out))
    assert "no motion model" in refusal(here(*words, "--models", " , ", "-o", out))
    assert not out.exists()


@pytest.mark.slow
def test_a_finished_run_is_kept(run: tuple[Path, dict]) -> None:
    folder, _ = run
    assert "--overwrite" in refusal(here("compare-models", *SHORT, "-o", folder))


def test_the_usual_models_begin_with_the_block() -> None:
    assert DEFAULT_MODELS[0] == "block"


@pytest.mark.slow
def test_its_figures_are_drawn_again_alike(run: tuple[Path, dict], tmp_path: Path) -> None:
    assert_drawn_alike(run[0], tmp_path / "out")


@pytest.mark.slow
def test_what_is_known_is_not_searched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compare_after_little(monkeypatch)
    leave_out_figures(monkeypatch)
    folder = tmp_path / "run"
    given = ("--parameter", "speed=0.02", "--clearance", "10mm")
    done = here("compare-models", *SHORT, *given, "-o", folder, "--json")
    assert done.code == 0, done.err
    estimates = {one["model"]: one["estimate"] for one in json.loads(done.out)["models"]}
    assert set(estimates["active"]) == {"rotational_diffusion", "turn_rate"}
    assert set(estimates["inertial"]) == {"speed_std", "memory_time", "turn_rate"}
    models = json.loads((folder / "manifest.json").read_text())["specification"]["models"]
    assert [one["clearance_m"] for one in models] == [0.01, 0.01]
    assert models[1]["fixed"] == {"speed": 0.02}
    # A simulation of the model takes what was known as well as what was found.
    known = read_found(folder).known("active")
    assert known == {"speed": 0.02, "clearance": 0.01}
    simulated = here(
        *("simulate", folder, "--model", "active", "--duration", "2s"),
        *("-o", tmp_path / "simulated.nc"),
    )
    assert simulated.code == 0, simulated.err


def test_a_parameter_that_no_model_has_is_named(tmp_path: Path) -> None:
    words = ("compare-models", *SHORT, "-o", tmp_path / "run", "--parameter")
    said = refusal(here(*words, "sped=0.02"))
    assert "--parameter sped: none of the named models has it" in said
    assert "did you mean 'speed'" in said
    assert "expected NAME=VALUE" in refusal(here(*words, "speed"))
    uncertain = ("--clearance", "15±0.2mm", "-o", tmp_path / "run")
    assert "without a standard deviation" in refusal(here("compare-models", *SHORT, *uncertain))


def test_a_clearance_larger_than_the_tank_is_refused(tmp_path: Path) -> None:
    words = ("compare-models", *SHORT, "--clearance", "2", "-o", tmp_path / "run")
    said = refusal(here(*words))
    assert "a clearance of 2000 mm: the body was recorded no further than" in said


@pytest.mark.slow
def test_the_notebook_takes_what_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    compare_after_little(monkeypatch)
    recording = dw.load(RECORDING, stop=30.0, tank="circle:30cm")
    found = dw.compare_models(
        recording, ["active"], parameters={"speed": 0.02}, clearance=0.01, bootstrap=0
    )
    assert "speed" not in found["parameter"].values
    with pytest.raises(dw.ConfigurationError, match="none of the named models has it"):
        dw.compare_models(recording, ["active"], parameters={"spee": 0.02}, bootstrap=0)


@pytest.fixture(scope="module")
def at_the_wall(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a point that goes along the wall of 30 cm, seen with a noise of 0.5 mm."""
    random = np.random.default_rng(1)
    time = np.arange(2000) / 20.0
    angle = np.cumsum(random.normal(0.02, 0.02, time.size))
    radius = 0.15 - 0.05 * np.clip(np.sin(time / 8.0) - 0.2, 0.0, 1.0)
    noise = random.normal(0.0, 5e-4, (2, time.size))
    x, y = radius * np.cos(angle) + noise[0], radius * np.sin(angle) + noise[1]
    assert 0.15 < np.mean(np.hypot(x, y) > 0.15) < 0.4
    path = tmp_path_factory.mktemp("wall") / "wall.csv"
    np.savetxt(path, np.stack([time, x, y], 1), delimiter=",", header="t_s,x_m,y_m", comments="")
    return path


def test_all_doors_allow_the_noise_of_a_body_at_the_wall(at_the_wall: Path) -> None:
    recording = dw.load(at_the_wall, tank="circle:30cm")
    assert not [text for text in dw.record.describe(recording)["warnings"] if "outside" in text]
    assert dw.conditions.study_for([recording]).tank.diameter_m == 0.3
    # The noise that the study states counts, where it states one.
    with pytest.raises(dw.InputError, match="outside the tank"):
        dw.conditions.study_for([recording], None, {"observation.position_noise_m": 1e-5})


def test_all_doors_refuse_a_tank_that_is_too_small(at_the_wall: Path) -> None:
    recording = dw.load(at_the_wall, tank="circle:28cm")
    (warning,) = (one for one in dw.record.describe(recording)["warnings"] if "outside" in one)
    assert "its size, or the scale, is wrong" in warning
    with pytest.raises(dw.InputError, match="lie outside the tank"):
        dw.conditions.study_for([recording])


@pytest.mark.slow
def test_a_body_at_the_wall_is_compared(
    at_the_wall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compare_after_little(monkeypatch)
    leave_out_figures(monkeypatch)
    words = ("--tank", "30cm", "--models", "active", "--bootstrap", "0")
    done = here("compare-models", at_the_wall, *words, "-o", tmp_path / "run", "--json")
    assert done.code == 0, done.err
