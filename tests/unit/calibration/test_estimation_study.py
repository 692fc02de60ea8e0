"""The study of estimators: its recordings, its prior, and each library on a few simulations."""

import json
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

STUDY = Path(__file__).resolve().parents[3] / "studies" / "estimation"
MISSING = "the study's README says how to install sbi and pyABC, which driftwalk does not need"


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    monkeypatch.syspath_prepend(str(STUDY))
    monkeypatch.chdir(tmp_path)  # where sbi writes its logs
    return import_module("compare_estimators")


def test_the_results_are_of_the_recordings_that_the_study_makes(study: ModuleType) -> None:
    for line in map(json.loads, (STUDY / "results.jsonl").read_text("utf-8").splitlines()):
        if "method" in line:
            truth = study.truth_of(line["problem"], line["recording"])
            assert line["truth"] == pytest.approx(truth, rel=1e-4)


@pytest.mark.slow
def test_both_libraries_answer(study: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("pyabc", "sbi"):
        pytest.importorskip(module, reason=MISSING)
    monkeypatch.setattr(study, "POPULATION", 20)
    simulator = study.Simulator("run_tumble", 0)
    assert study.by_pyabc(simulator, 60, 1, learned=True).simulations >= 60
    network = study.by_npe(study.Trainings("run_tumble", 20)("npe_10"), simulator)
    assert list(network.estimate) == simulator.names
