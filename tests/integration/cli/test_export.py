"""`driftwalk export` as a user runs it: runs in, folders out that other programs take."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import DATA, FLOW, Done, contents, here, refusal
from exported import a_compiler, floating_block_module, run_verify
from finished_run import write_finished_run

import driftwalk as dw
from driftwalk.export import TARGETS
from driftwalk.schema import build_flow_field
from driftwalk.schema.stores.netcdf import netcdf_bytes

SIMULATORS = ("mujoco", "webots", "gazebo")


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_finished_run(tmp_path_factory.mktemp("calibration") / "run")


@pytest.fixture
def study(tmp_path: Path) -> Path:
    file = tmp_path / "study.toml"
    file.write_text("[forces]\ndrag_coefficient = 0.387\n[simulation]\nseed = 11\n")
    return file


@pytest.fixture
def one_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let exports have one path of each set: Python's callback takes a second for each."""
    monkeypatch.setattr("driftwalk.export.simulators.reference.KEPT", 1)


@pytest.mark.slow
@pytest.mark.usefixtures("one_path")
def test_a_calibration_runs_in_mujoco(calibrated: Path, tmp_path: Path) -> None:
    """The promise: within 0.1 mm over 10 s, without the stochastic force and with it."""
    pytest.importorskip("mujoco", reason="mujoco-core is not installed: make .venv/.test-tools")
    out = tmp_path / "tank"
    done = here("export", calibrated, "--to", "mujoco", "-o", out, "--verify", "--json")
    assert done.code == 0, done.err
    said = json.loads(done.out)
    proof = said["verification"]
    assert proof["passed"]
    for name in ("still", "noisy"):
        assert proof[f"{name}_paths"] == 1
        assert proof[f"{name}_duration_s"] == 10.0
        assert 0 < proof[f"{name}_largest_distance_m"] < 1e-4
        assert proof[f"{name}_longest_path_m"] > 0.05
    assert {out / name for name in said["files"]} == {
        file for file in out.rglob("*") if file.is_file() and "__pycache__" not in file.parts
    }
    found = xr.open_dataset(calibrated / "calibration.nc")
    numbers = json.loads((out / "block.json").read_text())
    estimate = found["estimate"].sel(parameter="drag_coefficient")
    assert numbers["drag_coefficient"] == float(estimate)
    assert dw.load_study(out / "study.toml").forces.force_std_N == numbers["force_std_N"]


@pytest.mark.slow
def test_the_proof_can_fail(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A drag that is wrong by a fifth is another run after a second."""
    pytest.importorskip("mujoco", reason="mujoco-core is not installed: make .venv/.test-tools")
    monkeypatch.setattr("driftwalk.export.simulators.reference.LENGTHS_S", (1.0,))
    out = tmp_path / "tank"
    assert here("export", study, "--flow", FLOW, "--to", "mujoco", "-o", out).code == 0
    numbers = json.loads((out / "block.json").read_text())
    numbers["drag_coefficient"] *= 1.2
    (out / "block.json").write_text(json.dumps(numbers))
    done = run_verify(out, "--paths", "1")
    assert done.returncode == 1, done.stderr
    assert "NOT the same" in done.stdout


@pytest.mark.slow
def test_a_keyframe_is_the_replicate_of_driftwalk_simulate(study: Path, tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="mujoco-core is not installed")
    out = tmp_path / "tank"
    assert here("export", study, "--flow", FLOW, "--to", "mujoco", "-o", out).code == 0
    words = ("--study", out / "study.toml", "--flow", out / "flow.nc", "--replicates", 4)
    done = here("simulate", *words, "--duration", 2, "-o", tmp_path / "sim.nc")
    assert done.code == 0, done.err
    run = xr.open_dataset(tmp_path / "sim.nc").isel(replicate=3, body=0)
    model = mujoco.MjModel.from_xml_path(str(out / "tank.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 3)
    floating_block_module(out).install(model, data, out, replicate=3)
    try:
        while data.time < 2 - 1e-9:
            mujoco.mj_step(model, data)
    finally:
        mujoco.set_mjcb_passive(None)
    x, y = (float(run[name].sel(time=2.0)) for name in ("x", "y"))
    assert float(np.hypot(x - run["x"][0], y - run["y"][0])) > 0.01
    assert np.hypot(data.qpos[0] - x, data.qpos[1] - y) < 1e-5


@pytest.mark.slow
def test_an_export_to_mujoco_proves_itself(study: Path, tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="mujoco-core is not installed: make .venv/.test-tools")
    out = tmp_path / "tank"
    assert here("export", study, "--flow", FLOW, "--to", "mujoco", "-o", out).code == 0
    done = run_verify(out, "--paths", "2")
    assert done.returncode == 0, done.stdout
    assert re.fullmatch(
        r"without the stochastic force: 2 paths of 10 s, .+\nwith the .+: 2 paths of 10 s, .+\n"
        r"the same run\n", done.stdout
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("target", ["webots", "gazebo"])
def test_the_force_of_a_plugin_is_driftwalk_s(study: Path, target: str, tmp_path: Path) -> None:
    """Number by number, by the compiled code; and the proof fails where the drag is another."""
    a_compiler()
    out = tmp_path / "tank"
    if target == "gazebo":  # a tank whose middle is elsewhere
        corners = "[[-0.07, -0.09], [0.15, -0.1], [0.14, 0.12], [-0.06, 0.13]]"
        shape = f'[tank]\nshape = "polygon"\nvertices_m = {corners}\n'
        study.write_text(study.read_text(encoding="utf-8") + shape, encoding="utf-8")
    words = ("export", study, "--flow", FLOW, "--to", target, "-o", out, "--verify", "--json")
    done = here(*words)
    assert done.code == 0, done.err
    proof = json.loads(done.out)["verification"]
    assert proof["forces"] == 200
    assert proof["largest_relative_error"] < 1e-12
    assert proof["paths"] >= 2
    assert proof["largest_distance_m"] < 1e-12
    data = next(out.rglob("model_data.c"))
    data.write_text(data.read_text().replace("coefficient = 0.387", "coefficient = 0.388"))
    outcome = TARGETS[target].verify(out)
    assert not outcome.passed


@pytest.mark.slow
def test_a_fit_goes_out_with_its_law_and_its_flow(
    fitted: tuple[Path, Done], tmp_path: Path
) -> None:
    folder, _ = fitted
    out = tmp_path / "tank"
    assert here("export", folder, "--to", "webots", "-o", out, "--seed", 9).code == 0
    found = xr.open_dataset(folder / "fit.nc")
    numbers = json.loads((out / "block.json").read_text())
    assert numbers["drag_coefficient"] == float(found["estimate"].sel(parameter="drag_coefficient"))
    assert numbers["force_interval_s"] == float(found["force_interval"])
    assert (numbers["displaced_mass_kg"] > 0) == (found.attrs["force_law"] == "floating body")
    assert numbers["seed"] == dw.load_study(out / "study.toml").simulation.seed == 9
    written, own = (xr.open_dataset(place / "flow.nc") for place in (out, folder))
    assert np.array_equal(written["u"], own["u"])


@pytest.mark.slow
def test_the_world_of_gazebo_is_xml_with_the_block_where_it_starts(
    study: Path, tmp_path: Path
) -> None:
    out = tmp_path / "tank"
    assert here("export", study, "--flow", FLOW, "--to", "gazebo", "-o", out).code == 0
    world = ElementTree.parse(out / "tank.sdf").getroot()
    x, y, _, _, _, theta = map(float, world.findtext(".//model/pose").split())
    run = dw.simulate(
        dw.load_study(study), dw.load_flow(FLOW), sample_time=[0.0], backend="reference"
    )
    for found, name in ((x, "x"), (y, "y"), (theta, "theta")):
        assert found == pytest.approx(run[name].item(), abs=1e-12)
    assert len(world.findall(".//collision")) == 65


@pytest.mark.slow
@pytest.mark.parametrize("target", ["mujoco", "gazebo"])
def test_a_tank_too_narrow_for_a_proof_is_said(target: str, study: Path, tmp_path: Path) -> None:
    """The block goes out all the same; its diagonal is 4.2 cm."""
    if target == "mujoco":
        pytest.importorskip("mujoco", reason="mujoco-core is not installed")
    else:
        a_compiler()
    study.write_text(
        "tank.diameter_m = 0.043\nsimulation.start = { x_m = 0.0 }\n", encoding="utf-8"
    )
    words = ("export", study, "--flow", FLOW, "--to", target, "-o", tmp_path / "tank", "--verify")
    done = here(*words)
    assert done.code == 1
    assert "NOT VERIFIED" in done.out
    assert "no path stays clear of the wall" in done.out


@pytest.mark.parametrize("target", SIMULATORS)
def test_a_readme_says_what_is_not_the_same(study: Path, target: str, tmp_path: Path) -> None:
    out = tmp_path / "tank"
    done = here("export", study, "--flow", FLOW, "--to", target, "-o", out)
    assert done.code == 0
    assert str(out / "README.md") in done.out
    text = (out / "README.md").read_text()
    assert "Impacts" in text
    assert "latch" in text
    assert ("not run in" in text) == (target != "mujoco")
    assert "$" not in text.replace('"$PWD/build"', "")
    assert (out / "LICENSE").read_text().startswith("BSD 3-Clause")
    for name in re.findall(r"^\| `([\w./]+)`", text, flags=re.M):
        assert (out / name).exists(), name


class TestRefusals:
    def refused(self, tmp_path: Path, *words: object) -> str:
        """Return the one line; nothing may have been written."""
        before = contents(tmp_path)
        line = refusal(here("export", *words))
        assert contents(tmp_path) == before
        return line

    def test_a_folder_with_something_in_it(self, study: Path, tmp_path: Path) -> None:
        (tmp_path / "mine").mkdir()
        (tmp_path / "mine" / "thesis.tex").write_text("work of years")
        words = (study, "--flow", FLOW, "--to", "mujoco", "-o", tmp_path / "mine")
        assert "is not empty (thesis.tex, ...)" in self.refused(tmp_path, *words)

    def test_a_file_in_the_place_of_the_folder(self, study: Path, tmp_path: Path) -> None:
        words = (study, "--flow", FLOW, "--to", "mujoco", "-o", study)
        assert "study.toml is a file" in self.refused(tmp_path, *words)

    def test_an_unknown_target(self, study: Path, tmp_path: Path) -> None:
        words = (study, "--flow", FLOW, "--to", "mojuco", "-o", tmp_path / "out")
        line = self.refused(tmp_path, *words)
        assert "did you mean" in line
        assert "mujoco, webots, gazebo" in line

    def test_a_study_without_a_flow(self, study: Path, tmp_path: Path) -> None:
        line = self.refused(tmp_path, study, "--to", "mujoco", "-o", tmp_path / "out")
        assert "--flow" in line

    def test_a_recording(self, tmp_path: Path) -> None:
        words = (DATA / "recording.csv", "--to", "mujoco", "-o", tmp_path / "out")
        assert "is no study file (.toml) and no run directory" in self.refused(tmp_path, *words)

    @pytest.mark.parametrize("there", [True, False])
    def test_what_is_no_run(self, there: bool, tmp_path: Path) -> None:
        place = tmp_path / "empty"
        if there:
            place.mkdir()
        line = self.refused(tmp_path, place, "--to", "webots", "-o", tmp_path / "out")
        assert ("is not a run directory" if there else "does not exist") in line
        assert "driftwalk calibrate" in line

    @pytest.mark.slow
    def test_another_motion_model(self, calibrated: Path, tmp_path: Path) -> None:
        """A finished run whose calibration is about a body that moves by itself."""
        run = tmp_path / "run"
        run.mkdir()
        for file in calibrated.glob("*"):
            if file.is_file():
                (run / file.name).write_bytes(file.read_bytes())
        found = xr.load_dataset(calibrated / "calibration.nc", engine="h5netcdf")
        other = found.assign_attrs(model="active")
        (run / "calibration.nc").write_bytes(netcdf_bytes(other))
        line = self.refused(tmp_path, run, "--to", "gazebo", "-o", tmp_path / "out")
        assert "driftwalk fit" in line

    def test_a_flow_that_changes_in_time(self, study: Path, tmp_path: Path) -> None:
        flow = dw.tank30_flow()
        parts = {name: np.stack(2 * [flow[name].values]) for name in ("u", "v", "flag")}
        moving = build_flow_field(flow["x"], flow["y"], time=[0.0, 10.0], **parts)
        dw.save_flow(moving, tmp_path / "moving.nc")
        words = (study, "--flow", tmp_path / "moving.nc", "--to", "mujoco", "-o", tmp_path / "out")
        assert "changes in time" in self.refused(tmp_path, *words)

    def test_a_proof_without_what_it_needs(
        self, study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Before anything is written."""
        monkeypatch.setenv("PATH", str(tmp_path))
        monkeypatch.delenv("CC", raising=False)
        words = (study, "--flow", FLOW, "--to", "webots", "-o", tmp_path / "out", "--verify")
        assert "the proof needs a C compiler" in self.refused(tmp_path, *words)
