"""One path by the command line: what a run found goes on into every command that simulates.

The recording is the bundled one.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, GRID, RECORDING, Done, assert_same_bits, here, refusal
from page_reading import page_in

import driftwalk as dw
from driftwalk.core.provenance import MANIFEST_KIND
from driftwalk.model import Study
from driftwalk.runs import read_found
from driftwalk.schema import build_dataset
from driftwalk.schema.answers.facts import facts_of, fitted_value
from driftwalk.schema.answers.verdict import DOES_NOT_EXPLAIN, EXPLAINS

TANK = ("--tank", "30cm")
BODY = ("--side", "28mm", "--mass", "10g", "--depth", "9mm")
COARSE = ("--spline-spacing", "4cm", "--no-check", "--angle", "none", "--force-interval", "16ms")
SIZE = ("--runs", "50", "--duration", "10s", "--threads", "1")
VARIED = ("--vary", "drag-coefficient=0.2,0.6", "--vary", "force-std=0.4mN,0.8mN")

pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture(scope="module")
def fitted(undrawn: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the run directory of a fit of a minute, of a block that is not the paper's."""
    folder = tmp_path_factory.mktemp("fitted") / "fit"
    done = here("fit", RECORDING, "--to", "60s", *TANK, *BODY, *COARSE, "-o", folder)
    assert done.code == 0, done.err
    return folder


@pytest.fixture(scope="module")
def assembled(fitted: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Done]:
    """Return four blocks of that fit, and what was printed."""
    folder = tmp_path_factory.mktemp("assembled") / "four"
    return folder, here("assemble", fitted, *SIZE, "--film", "none", "--json", "-o", folder)


def dataset(path: Path) -> xr.Dataset:
    with xr.open_dataset(path, engine="h5netcdf") as stored:
        return stored.load()


def comparison(best: str) -> xr.Dataset:
    """Return a comparison of models, made up: a walk of recorded steps, the best one, another."""
    models = ["steps", best, "active" if best == "block" else "block"]
    values = {
        "block": {"drag_coefficient": 0.5, "force_std": 7e-4},
        "active": {"speed": 0.02, "rotational_diffusion": 0.5, "turn_rate": 0.1},
    }
    names = [name for one in values.values() for name in one]
    row = [[values.get(model, {}).get(name, np.nan) for name in names] for model in models]
    number = dict.fromkeys(
        ("score", "score_std", "behind", "behind_std"), ("model", [1.0, 2.0, 3.0])
    )
    number |= dict.fromkeys(("free_numbers", "evaluations"), ("model", [1, 2, 3]))
    aspect = {name: (("model", "aspect"), np.ones((3, 1))) for name in
              ("held_out_distance", "trained_distance")}  # fmt: skip
    check = {name: (("model", "check"), np.ones((3, 1))) for name in
             ("check_median", "check_low", "check_high")}  # fmt: skip
    return build_dataset(
        "model_comparison",
        {
            **number, **aspect, **check,
            "baseline": ("model", [True, False, False]),
            "verdict": ("model", np.array([DOES_NOT_EXPLAIN, EXPLAINS, DOES_NOT_EXPLAIN])),
            "verdict_reason": ("model", np.array(["far", "", "far"])),
            "own_distance": ("aspect", [1.0]),
            "floor": ("aspect", [1.0]),
            "check_recorded": ("check", [1.0]),
            "check_unit": ("check", np.array(["1"], dtype=object)),
            "estimate": (("model", "parameter"), row),
            "parameter_unit": ("parameter", np.array(["1"] * len(names), dtype=object)),
            "end_score": (("model", "end"), np.ones((3, 1))),
        },
        {
            "model": ("model", np.array(models, dtype=object)),
            "aspect": ("aspect", np.array(["steps"], dtype=object)),
            "check": ("check", np.array(["speed"], dtype=object)),
            "parameter": ("parameter", np.array(names, dtype=object)),
            "finding": ("finding", np.array(["so it is"], dtype=object)),
            "warning": ("warning", np.array(["a short recording"], dtype=object)),
        },
        {"step_interval_s": 0.3, "duration_s": 60.0, "worlds": 64, "seed": 1, "arena": "{}",
         "source": "recording.csv", "simulated_recording": "no"},
    )  # fmt: skip


@pytest.fixture
def compared(tmp_path: Path) -> Callable[[str], Path]:
    """Return a function that makes the run directory of a comparison, by its best model."""

    def make(best: str) -> Path:
        folder = tmp_path / f"compare-{best}"
        folder.mkdir()
        comparison(best).to_netcdf(folder / "comparison.nc", engine="h5netcdf")
        dw.save_flow(dw.tank30_flow(), folder / "flow.nc")
        study = dw.apply_overrides(Study(), {"tank.diameter_m": 0.3, "block.side_m": 0.028})
        models = [{"name": "active", "fixed": {}, "clearance_m": 0.02}, {"name": "block"}]
        specification = {"kind": "model_comparison", "models": models, "flow_sha256": "0"}
        manifest = {"kind": MANIFEST_KIND, "manifest_version": 1, "study": study.to_dict(),
                    "specification": specification}  # fmt: skip
        (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
        return folder

    return make


@pytest.mark.slow
def test_a_fit_is_assembled_with_all_that_it_knows(
    fitted: Path, assembled: tuple[Path, Done]
) -> None:
    folder, done = assembled
    assert done.code == 0, done.err
    printed, known = json.loads(done.out), facts_of(dataset(fitted / "fit.nc"))
    for name in ("drag_coefficient", "force_std_N"):
        assert printed[name] == known[name]
    assert printed["force_interval_s"] == 0.016
    assert printed["drawn"]["parameters"][:2] == ["drag_coefficient", "force_std"]
    assert printed["drawn"]["parameters"][-1] == "flow"
    warning = known["warnings"][0].split(":")[0]
    assert any(text.startswith(f"of the fit: {warning}") for text in printed["warnings"])
    study = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["study"]
    assert (study["block"]["side_m"], study["block"]["mass_kg"]) == (0.028, 0.010)
    assert study["tank"]["diameter_m"] == 0.3
    floating = known["force_law"] == "floating body"
    assert study["forces"]["pressure_gradient"] is floating
    assert study["forces"]["added_mass_share"] == known.get("added_mass_share", 0.0)
    fixed, drawn = (dataset(folder / name) for name in ("assembly.nc", "assembly_drawn.nc"))
    assert (fixed["drag_coefficient"] == known["drag_coefficient"]).all()
    assert np.unique(drawn["drag_coefficient"]).size == 50
    # The median of 50 numbers lies within 0.6 of their standard deviation.
    low, high = known["drag_coefficient_interval"]
    assert low < float(np.median(drawn["drag_coefficient"])) < high


@pytest.mark.slow
def test_the_notebook_does_the_same(
    fitted: Path, assembled: tuple[Path, Done], tmp_path: Path
) -> None:
    with xr.open_dataset(fitted / "fit.nc", engine="h5netcdf") as stored:
        found = stored.load()
    dw.assemble(found, folder=tmp_path / "four", runs=50, duration="10s", threads=1)
    for name in ("assembly.nc", "assembly_drawn.nc", "distribution_drawn.nc"):
        assert_same_bits(dataset(tmp_path / "four" / name), dataset(assembled[0] / name))


@pytest.mark.slow
def test_the_fit_is_the_reference_of_a_sensitivity_analysis(fitted: Path, tmp_path: Path) -> None:
    small = ("--runs", "6", "--realisations", "2", "--duration", "5s", "--threads", "1")
    done = here("sensitivity", fitted, *VARIED, *small, "-o", tmp_path / "map", "--json")
    assert done.code == 0, done.err
    reference = dataset(tmp_path / "map" / "reference.nc").attrs
    known = dataset(fitted / "fit.nc")
    assert reference["drag_coefficient"] == fitted_value(known, "drag_coefficient")
    assert reference["force_std_N"] == fitted_value(known, "force_std")


@pytest.mark.slow
def test_a_fit_is_simulated(fitted: Path, tmp_path: Path) -> None:
    done = here("simulate", fitted, "--duration", "2s", "--seed", "3", "-o", tmp_path / "sim.nc")
    assert done.code == 0, done.err
    known = dataset(fitted / "fit.nc")
    study = dw.conditions.estimated_study(known, {"simulation.duration_s": 2.0})
    expected = dw.simulate(study, dw.fitted_flow(known), seed=3)
    found = dataset(tmp_path / "sim.nc")
    for name in ("x", "y", "theta"):
        np.testing.assert_array_equal(found[name], expected[name])
    again = dw.simulate(known, seed=3, sample_time=found["time"].values)
    np.testing.assert_array_equal(found["x"], again["x"])


@pytest.mark.slow
def test_one_page_shows_several_runs(
    fitted: Path, assembled: tuple[Path, Done], tmp_path: Path
) -> None:
    out = tmp_path / "report.html"
    done = here("report", fitted, assembled[0], "-o", out)
    assert done.code == 0, done.err
    page = page_in(out.read_text(encoding="utf-8"))
    assert page["subtitle"] == "fit, four"
    titles = [part["title"] for part in page["sections"]]
    assert any("fit" in title for title in titles), titles
    # Two runs of the same name are told apart.
    copy = tmp_path / "fit"
    shutil.copytree(fitted, copy)
    done = here("report", fitted, copy, RECORDING, "-o", tmp_path / "three.html")
    assert done.code == 0, done.err
    three = page_in((tmp_path / "three.html").read_text(encoding="utf-8"))
    assert three["subtitle"] == "fit, fit 2, recording.csv"


@pytest.mark.slow
def test_its_flow_serves_other_commands(fitted: Path, tmp_path: Path) -> None:
    """`--flow` takes a run directory in the place of the file in it."""
    (tmp_path / "study.toml").write_text(GRID, encoding="utf-8")
    words = ("calibrate", RECORDING, "--to", "20s", *TANK, "--study", tmp_path / "study.toml")
    done = here(*words, "--flow", fitted, "--threads", "1", "-o", tmp_path / "run")
    assert done.code == 0, done.err
    flow = dataset(tmp_path / "run" / "flow.nc")
    np.testing.assert_array_equal(flow["u"], dataset(fitted / "flow.nc")["u"])
    (tmp_path / "empty").mkdir()
    line = refusal(here(*words, "--flow", tmp_path / "empty", "-o", tmp_path / "other"))
    assert "holds no flow field (flow.nc)" in line


@pytest.mark.slow
def test_a_fit_is_the_truth_of_a_recovery_study(fitted: Path, tmp_path: Path) -> None:
    done = here(
        *("study", "recover", fitted, "--recordings", "2", "--duration", "30s"),
        *("--threads", "1", "--json", "-o", tmp_path / "recover"),
    )
    assert done.code == 0, done.err
    truth = dataset(tmp_path / "recover" / "recovery.nc")
    study = dw.model.parse_study(truth.attrs["study"])
    known = dataset(fitted / "fit.nc")
    assert study.forces.drag_coefficient == fitted_value(known, "drag_coefficient")
    assert study.block.side_m == 0.028


@pytest.mark.slow
def test_a_comparison_gives_its_best_model(compared: Callable[[str], Path], tmp_path: Path) -> None:
    best = compared("block")
    done = here("assemble", best, *SIZE, "--film", "none", "--json", "-o", tmp_path / "four")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert (found["drag_coefficient"], found["force_std_N"]) == (0.5, 7e-4)
    assert found["drawn"] is None
    assert "of the comparison of models: a short recording" in found["warnings"]
    assert any("has no uncertainty of its values" in text for text in found["warnings"])
    study = json.loads((tmp_path / "four" / "manifest.json").read_text())["study"]
    assert study["block"]["side_m"] == 0.028


@pytest.mark.slow
def test_what_is_not_about_the_block(compared: Callable[[str], Path], tmp_path: Path) -> None:
    """Self-assembly says why not; a simulation takes the model, its values and its clearance."""
    active = compared("active")
    for command in ("assemble", "sensitivity"):
        line = refusal(here(command, active, "-o", tmp_path / "out"))
        assert f"{active} closest to its recording is the model active" in line
        assert "self-assembly simulates blocks" in line
    words = ("--duration", "2s", "--replicates", "2", "-o", tmp_path / "sim.nc", "--json")
    done = here("simulate", active, *words)
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["model"] == "active"
    assert found["parameters"]["speed_m_s"] == 0.02
    model = read_found(active)
    assert model.known() == {"clearance": 0.02}
    # Another model of the comparison, named.
    with_name = here("simulate", active, "--model", "active", *words, "--overwrite")
    assert json.loads(with_name.out) == found


@pytest.mark.slow
def test_a_model_of_the_users_is_named_again(tmp_path: Path) -> None:
    """A run that someone sent executes nothing that its own files name."""
    marker = tmp_path / "executed"
    program = tmp_path / "mine.py"
    program.write_text(f"open({str(marker)!r}, 'w').close()\n", encoding="utf-8")
    for number, name in enumerate(("robot", f"{program}:robot", f"command:touch {marker}")):
        folder = tmp_path / f"run{number}"
        folder.mkdir()
        found = comparison("active")
        found["model"] = np.array(["steps", name, "block"], dtype=object)
        found.to_netcdf(folder / "comparison.nc", engine="h5netcdf")
        study = Study().to_dict()
        model = {"name": name, "file": str(program), "program": f"touch {marker}"}
        manifest = {"kind": MANIFEST_KIND, "manifest_version": 1, "study": study,
                    "specification": {"models": [model]}}  # fmt: skip
        (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
        commands = (
            ("assemble", folder, "-o", tmp_path / "out"),
            ("sensitivity", folder, "-o", tmp_path / "out"),
            ("study", "recover", folder, "-o", tmp_path / "out"),
            ("simulate", folder, "-o", tmp_path / "out.nc"),
            ("play", folder, "--no-open"),
            ("export", folder, "--to", "mujoco", "-o", tmp_path / "out"),
        )
        # Two of the commands for each way of naming a model.
        for words in commands[number::3]:
            line = refusal(here(*words))
            assert name in line
            if words[0] in ("simulate", "play"):
                assert "name its file or program again (--model)" in line
    assert not marker.exists()


@pytest.mark.slow
def test_what_the_run_says_is_not_said_twice(fitted: Path, tmp_path: Path) -> None:
    out = ("-o", tmp_path / "sim.nc")
    for options in (("--force-std", "1mN"), ("--study", "x.toml")):
        assert "not with a finished run" in refusal(here("simulate", fitted, *options, *out))
    line = refusal(here("simulate", fitted, "--model", "active", *out))
    assert "is about the block, and not about active" in line
    assert "give the directory of a finished fit" in refusal(here("simulate", RECORDING, *out))


@pytest.mark.slow
def test_a_recording_of_driftwalks_own_names_no_other_engine(tmp_path: Path) -> None:
    sim = tmp_path / "sim.nc"
    words = ("--duration", "60s", "--sample-rate", "10", *TANK)
    assert here("simulate", "--flow", FLOW, *words, "-o", sim).code == 0
    done = here("fit", sim, *COARSE, "-o", tmp_path / "fit")
    assert done.code == 0, done.err
    assert "This recording was simulated" in done.out
    assert "engine" not in done.out
