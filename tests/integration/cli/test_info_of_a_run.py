"""`driftwalk info` of a run directory: its answer, or one line on what is missing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import here, refusal
from every_kind import every_kind
from finished_run import StoredWork

from driftwalk.runs import run_work

REFERENCE = "outcome_distribution of realisations"
SENSITIVITY = {"sensitivity.nc": "sensitivity", "reference.nc": REFERENCE}


def stored(folder: Path, kind: str, forms: dict[str, str]) -> Path:
    run_work(StoredWork(kind, {n: every_kind(form) for n, form in forms.items()}), folder)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "forms", "said", "key"),
    [
        ("fit", {"fit.nc": "fit"}, "drag coefficient C_d", "drag_coefficient"),
        ("calibration", {"calibration.nc": "calibration"}, "σ_F", "force_std_N"),
        ("sensitivity", SENSITIVITY, "l1 distance", "settings"),
        ("recovery", {"recovery.nc": "recovery"}, "truth: C_d", "results"),
        ("model_recovery", {"model_recovery.nc": "model_recovery"}, "speed", "parameters"),
        ("model_calibration", {"model_calibration.nc": "model_calibration"}, "speed", "model"),
        ("model_comparison", {"comparison.nc": "model_comparison"}, "inertial", "models"),
    ],
)
def test_the_answer_of_each_kind(
    kind: str, forms: dict[str, str], said: str, key: str, tmp_path: Path
) -> None:
    run = stored(tmp_path / "run", kind, forms)
    done = here("info", run)
    assert done.code == 0, done.err
    assert said in done.out
    facts = json.loads(here("info", run, "--json").out)
    assert (facts["kind"], facts["finished"]) == (kind, True)
    assert key in facts


@pytest.mark.slow
def test_what_an_answer_needs_is_missed_in_one_line(tmp_path: Path) -> None:
    run = stored(tmp_path / "run", "sensitivity", {"sensitivity.nc": "sensitivity"})
    line = refusal(here("info", run))
    assert f"{run} lacks reference.nc: its answer cannot be printed" in line


@pytest.mark.slow
def test_files_of_other_kinds_and_options_of_recordings(tmp_path: Path) -> None:
    run = stored(tmp_path / "run", "fit", {"fit.nc": "fit", "reference.nc": REFERENCE})
    assert "C_d" in here("info", run).out
    line = refusal(here("info", run, "--fps", "3"))
    assert line.endswith(f"--fps: for a recording; {run} is a directory, read as a run\n")
    line = refusal(here("info", run, "--replicate", "0"))
    assert line.endswith(f"--replicate: for a recording; {run} is a directory, read as a run\n")
