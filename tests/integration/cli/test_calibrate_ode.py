"""The block by the Open Dynamics Engine as a motion model: benchmarks/ode/ode_model.py."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import FLOW, RECORDING, here, leave_out_figures

import driftwalk as dw
from driftwalk.conditions import Conditions
from driftwalk.core.random_streams import world_keys
from driftwalk.motion import BlockModel, MotionModel, motion_model
from driftwalk.simulation import Start
from driftwalk.simulation.backend import Camera
from driftwalk.testing import MotionModelContract

PROGRAM = Path(__file__).resolve().parents[3] / "benchmarks" / "ode" / "ode_model.py"
START = Start(0.05, 0.02, 0.3, 0.02, 0.01, 0.2)
STUDY = """\
[tank]
wall_friction = 1.0

[forces]
force_interval_s = "16ms"

[simulation]
time_step_s = "{step}"

[calibration]
drag_coefficient_min = 0.3
drag_coefficient_max = 0.5
drag_coefficient_step = 0.05
force_std_min_N = "0.3mN"
force_std_max_N = "0.9mN"
force_std_step_N = "0.1mN"
replicates = 1
refined_drag_coefficient_step = 0.025
refined_force_std_step_N = "0.05mN"
refined_replicates = 2
bootstrap = 50
"""


@pytest.fixture(scope="module", autouse=True)
def engine() -> None:
    """Skip where the program cannot be built."""
    compiler = shutil.which("c++") or shutil.which("g++")
    if compiler is None:
        pytest.skip("no C++ compiler")
    probe = [compiler, "-x", "c++", "-fsyntax-only", "-"]
    header = "#include <ode/ode.h>\n"
    done = subprocess.run(probe, input=header, text=True, capture_output=True, check=False)
    if done.returncode != 0:
        pytest.skip("the headers of ODE are not installed (Debian: libode-dev)")


def written(folder: Path, *, step: str) -> Path:
    path = folder / f"study-{step}.toml"
    path.write_text(STUDY.format(step=step), encoding="utf-8")
    return path


def address(study: Path) -> str:
    return "command:" + " ".join(shlex.quote(str(one)) for one in (sys.executable, PROGRAM, study))


def moved(
    model: MotionModel, study: Path, force: float, worlds: int, seconds: float, seed: int = 1
) -> Any:
    """Return worlds with the C_d of the bundled recording, without a camera."""
    times = np.arange(round(10 * seconds)) / 10
    like = Conditions(times, START, Camera(), dw.load_study(study).tank, None, dw.tank30_flow(), 1)
    values = {"drag_coefficient": np.full(worlds, 0.387), "force_std": np.full(worlds, force)}
    return model.simulate(values, like, world_keys(seed, trial=0, replicate=np.arange(worlds)))


@pytest.mark.slow
def test_without_a_force_both_engines_take_the_same_path(tmp_path: Path) -> None:
    """The engine's steps are of first order: a quarter of the step, a quarter of the distance."""
    apart = {}
    for step in ("4ms", "1ms"):
        study = written(tmp_path, step=step)
        ours = moved(BlockModel(dw.load_study(study)), study, 0.0, 1, 10.0)
        theirs = moved(motion_model(address(study)), study, 0.0, 1, 10.0)
        apart[step] = np.hypot(ours.x - theirs.x, ours.y - theirs.y)[0, 1:]
    assert apart["1ms"].max() < 3e-4
    ratio = apart["4ms"][20:] / apart["1ms"][20:]
    assert ratio == pytest.approx(np.full(ratio.shape, 4.0), rel=0.1)


@pytest.mark.slow
@pytest.mark.false_alarm(8e-4)
def test_with_a_force_both_engines_take_the_same_steps(tmp_path: Path, fresh_seed: Any) -> None:
    """Means over 16 worlds of two minutes, of step lengths and distances from the middle.

    4 standard errors of the difference of two means: by Student's t with 30 degrees of freedom a
    false alarm in 2,600 for each of the two.
    """
    study = written(tmp_path, step="1ms")
    found = {}
    for name, model in (
        ("ours", BlockModel(dw.load_study(study))),
        ("theirs", motion_model(address(study))),
    ):
        seen = moved(model, study, 6e-4, 16, 120.0, fresh_seed(1))
        length = np.hypot(np.diff(seen.x), np.diff(seen.y)).mean(axis=1)
        found[name] = np.array([length, np.hypot(seen.x, seen.y).mean(axis=1)])
    difference = found["ours"].mean(axis=1) - found["theirs"].mean(axis=1)
    error = np.hypot(*(one.std(axis=1, ddof=1) / 4.0 for one in found.values()))
    assert (np.abs(difference) < 4.0 * error).all(), difference / error
    assert (error < 0.02 * found["ours"].mean(axis=1)).all()


@pytest.mark.slow
class TestContract(MotionModelContract):
    @pytest.fixture(autouse=True)
    def study(self, tmp_path_factory: pytest.TempPathFactory) -> None:
        if not hasattr(type(self), "kept"):
            folder = tmp_path_factory.mktemp("contract")
            type(self).kept = motion_model(address(written(folder, step="4ms")))

    def model(self) -> MotionModel:
        return type(self).kept

    def conditions(self) -> Conditions:
        like = super().conditions()
        return Conditions(**{**vars(like), "flow": dw.tank30_flow()})


@pytest.mark.slow
def test_without_a_flow_it_says_so(tmp_path: Path) -> None:
    study = written(tmp_path, step="4ms")
    words = ("calibrate", RECORDING, "--to", "20s", "--tank", "30cm", "--study", study)
    done = here(*words, "--model", address(study), "-o", tmp_path / "run")
    assert "the block needs the water's velocity: give --flow" in done.err.splitlines()[-1]
    assert done.code == 2


@pytest.mark.study
def test_both_engines_calibrate_a_recording_alike(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four minutes of the bundled recording in its true flow: the same statistic, two engines.

    Each estimate lies in the other's 90 % interval. In every run:
    `test_with_a_force_both_engines_take_the_same_steps`.
    """
    leave_out_figures(monkeypatch)
    study = written(tmp_path, step="4ms")
    given = ("--study", study, "--flow", FLOW, "--tank", "30cm", "--to", "4min")
    said = {}
    for name, words in (("ours", ()), ("theirs", ("--model", address(study)))):
        done = here("calibrate", RECORDING, *given, *words, "--json", "-o", tmp_path / name)
        assert done.code == 0, done.err
        said[name] = json.loads(done.out)
    assert said["theirs"]["model"] == "ode_model"
    assert "force_interval_s" not in said["theirs"]
    for key in ("drag_coefficient", "force_std_N"):
        for one, other in (("ours", "theirs"), ("theirs", "ours")):
            low, high = said[other][f"{key}_interval"]
            assert low <= said[one][key] <= high, (key, one, said[one][key], low, high)
