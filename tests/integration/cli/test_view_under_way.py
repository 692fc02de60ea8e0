"""The live page of every kind of run, opened at the moments at which a run could be killed.

What a kill leaves is what lies in the folder at that moment, so the page is opened there and then.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from chain_runs import chain_runs
from command_line import FLOW, GRID, RECORDING, here, leave_out_figures
from every_kind import every_kind
from few_simulations import compare_after_little, simulate_little

from driftwalk.core.files.rundir import RunDirectory
from driftwalk.core.files.shards import ShardStore
from driftwalk.page import report_page
from driftwalk.schema.runs import RUN_KINDS
from driftwalk.viewer.watch.run_page import RunSource

TANK = ("--tank", "30cm")
SHORT = (RECORDING, "--to", "30s", *TANK)
ACTIVE = (
    *("--model", "active", "--parameter", "speed=0.03", "--parameter", "turn_rate=0.3"),
    *("--parameter", "rotational_diffusion=0.5", "--known", "turn_rate"),
    *("--known", "rotational_diffusion", "--study", "known.toml"),
)
VARIED = ("--vary", "drag-coefficient=0.2,0.6", "--vary", "force-std=0.2mN,1mN")
QUICK = ("--after", "4s", "--runs", "20", "--truths", "20")
LITTLE = ("--blocks", "3", "--duration", "20s")
PLANNED = (
    *("--blocks", "2", "--target", "2", "--by", "20s", "--vary", "flow-scale=0,1"),
    *("--rounds", "1", "--worlds", "20"),
)

RUNS: dict[str, tuple[tuple[object, ...], str]] = {
    "calibration": (("calibrate", *SHORT, "--study", "grid.toml"), "A calibration under way"),
    "model_calibration": (
        ("calibrate", *SHORT, "--model", "inertial", "--bootstrap", "0"),
        "A calibration under way",
    ),
    "model_comparison": (
        ("compare-models", *SHORT, "--models", "inertial,active", "--bootstrap", "0"),
        "A comparison of motion models under way",
    ),
    "fit": (("fit", *SHORT, "--spline-spacing", "4cm", "--no-check"), "A fit under way"),
    "recovery": (("study", "recover", "--study", "truth.toml"), "A recovery study under way"),
    "model_recovery": (
        ("study", "recover", *ACTIVE),
        "A recovery study under way",
    ),
    "assembly": (
        ("assemble", "--flow", FLOW, *TANK, *LITTLE, "--runs", "20"),
        "Self-assembly under way",
    ),
    "kinetics": (("kinetics", "runs.nc"), "Kinetics under way"),
    "outcome_posterior": (
        ("infer-outcomes", "counts.csv", "--flow", FLOW, *TANK, "--blocks", "2", *QUICK),
        "Parameters from outcomes under way",
    ),
    "control_policy": (
        ("control", "plan", "--flow", FLOW, *TANK, *PLANNED),
        "A plan of control under way",
    ),
    "control_test": (
        ("control", "test", "policy.nc", "--worlds", "20"),
        "A test of control under way",
    ),
    "sensitivity": (
        ("sensitivity", "--flow", FLOW, *TANK, *LITTLE, *VARIED, "--runs", "5"),
        "A sensitivity analysis under way",
    ),
    "yield": (
        ("yield", "--flow", FLOW, *TANK, *LITTLE, *VARIED, "--target", "L3", "--runs", "200"),
        "Search for the largest yield under way",
    ),
}
"""By the kind of run: the command, as small as it allows, and the title of its live page."""

KNOWN = """\
[calibration]
replicates = 1
refined_replicates = 1
bootstrap = 5
[observation]
position_noise_m = 3e-4
orientation_noise_rad = 0.01
[fit]
spline_spacing_m = 0.06
[recover]
recordings = 2
durations_s = [40.0]
sample_interval_s = 0.2
"""
TRUTH = f"""\
{KNOWN.replace("40.0", "20.0")}flow = {json.dumps(str(FLOW))}
drag_coefficient_precision = 0.5
[forces]
drag_coefficient = 0.4
force_std_N = 6e-4
"""


def test_every_kind_of_run_is_watched() -> None:
    assert set(RUNS) == set(RUN_KINDS)


class Stopped(Exception):
    """Stands for a kill."""


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that the commands take."""
    folder = tmp_path_factory.mktemp("given")
    for name, text in (("grid", GRID), ("known", KNOWN), ("truth", TRUTH)):
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    chain_runs(60, 1).to_netcdf(folder / "runs.nc")
    (folder / "counts.csv").write_text("class,count\n2,12\n1+1,8\n", encoding="utf-8")
    every_kind("control_policy").to_netcdf(folder / "policy.nc")
    return folder


@pytest.fixture
def place(given: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with these files, in which the runs are made."""
    shutil.copytree(given, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def opened_pages(folder: Path) -> list[dict[str, Any]]:
    """Return the live page and the report of a run under way."""
    source = RunSource(folder)
    live = dict(source.greeting()[0]["page"])
    assert source.look() == []
    assert "cannot be read" not in live["state"]["words"]
    pages = [live, report_page(folder)]
    for page in pages:
        json.dumps(page, allow_nan=False)
        assert not page["state"]["finished"]
    return pages


WIDE = ("calibrate", *SHORT, "--model", "run_rest+wall", "--bootstrap", "10")
BEGUN = {**RUNS, "model_calibration of eleven parameters": (WIDE, "A calibration under way")}


@pytest.mark.parametrize("kind", BEGUN)
def test_the_page_of_a_run_that_has_just_begun(
    kind: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words, title = BEGUN[kind]

    def enter(run: RunDirectory) -> RunDirectory:
        raise Stopped(entered(run).path)

    entered: Callable[..., RunDirectory] = RunDirectory.__enter__
    monkeypatch.setattr(RunDirectory, "__enter__", enter)
    with pytest.raises(Stopped):
        here(*words, "-o", place / "run")
    live, report = opened_pages(place / "run")
    assert live["title"] == title
    assert report["title"] == RUN_KINDS[kind.split()[0]].title


@pytest.mark.slow
@pytest.mark.parametrize("kind", RUNS)
def test_the_page_of_a_run_that_is_further(
    kind: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After its first work unit, after some more, and when all is there but the manifest."""
    words, title = RUNS[kind]
    leave_out_figures(monkeypatch)
    if kind == "model_comparison":
        compare_after_little(monkeypatch)
    else:
        simulate_little(monkeypatch, matched=True)
    seen: dict[str, list[dict[str, Any]]] = {}
    stored: list[object] = []

    def store(*given: Any) -> None:
        kept(*given)
        stored.append(given)
        if len(stored) in (1, 2, 20):
            seen[f"unit {len(stored)}"] = opened_pages(place / "run")

    def finish(*given: Any) -> None:
        seen["manifest"] = opened_pages(place / "run")
        finished(*given)

    kept, finished = ShardStore.write, RunDirectory.finish
    monkeypatch.setattr(ShardStore, "write", store)
    monkeypatch.setattr(RunDirectory, "finish", finish)
    done = here(*words, "-o", place / "run")
    assert done.code == 0, done.err
    # A fit is one piece of work and keeps no units.
    assert set(seen) >= ({"manifest"} if kind == "fit" else {"unit 1", "manifest"})
    titles = {(live["title"], report["title"]) for live, report in seen.values()}
    assert titles == {(title, RUN_KINDS[kind].title)}
