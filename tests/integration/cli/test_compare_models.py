"""`driftwalk compare-models` on half a minute of the bundled recording."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import RECORDING, here, refusal
from few_simulations import compare_after_little
from redrawn import assert_drawn_alike

from driftwalk.calibration import DEFAULT_MODELS
from driftwalk.cli.terminal.models_answer import print_answer
from driftwalk.schema.netcdf import open_netcdf

SHORT = (
    *(RECORDING, "--to", "30s", "--tank-diameter", "30cm", "--models", "inertial,active"),
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
    assert not walk["explained"]
    assert walk["estimate"] == {}


def test_the_folder_holds_everything(run: tuple[Path, dict]) -> None:
    folder, said = run
    stored = open_netcdf(folder / "comparison.nc")
    assert stored["model"].values.tolist() == [one["model"] for one in said["models"]]
    for name in ("recording.nc", "manifest.json", "figures/models.png", "figures/models.svg"):
        assert (folder / name).stat().st_size > 0
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["inputs"]["recording"]["sha256"]


def test_people_read_the_answer(run: tuple[Path, dict], capsys: pytest.CaptureFixture[str]) -> None:
    folder, said = run
    print_answer(open_netcdf(folder / "comparison.nc"), folder)
    out = capsys.readouterr().out
    assert out.startswith(f"{said['findings'][0]}.\n")
    for one in said["models"]:
        assert one["model"] in out
    for text in said["findings"]:
        assert f"{text}." in out
    assert "the recording's own parts" in out
    assert str(folder / "figures") in out


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
    assert "explains the recording" in answer


def test_mistakes_are_one_line(tmp_path: Path) -> None:
    words = ("compare-models", RECORDING, "--to", "60s", "--tank-diameter", "30cm")
    out = tmp_path / "run"
    assert "run_tumbel" in refusal(here(*words, "--models", "run_tumbel", "-o", out))
    assert "twice" in refusal(here(*words, "--models", "active,active", "-o", out))
    assert "no motion model" in refusal(here(*words, "--models", " , ", "-o", out))
    assert not out.exists()


def test_a_finished_run_is_kept(run: tuple[Path, dict]) -> None:
    folder, _ = run
    assert "--overwrite" in refusal(here("compare-models", *SHORT, "-o", folder))


def test_the_usual_models_begin_with_the_block() -> None:
    assert DEFAULT_MODELS[0] == "block"


def test_its_figures_are_drawn_again_alike(run: tuple[Path, dict], tmp_path: Path) -> None:
    assert_drawn_alike(run[0], tmp_path / "out")
