"""`driftwalk sensitivity` from a calibration and from a flow field: answers, files, refusals.

The recording is the bundled one, which another engine simulated.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import (
    FLOW,
    NO_FIGURES,
    Done,
    apart,
    assert_same_bits,
    contents,
    here,
    refusal,
)
from redrawn import assert_drawn_alike, drawn
from signals_at_units import after_units

from driftwalk.schema.answers.facts import facts_of

SIZE = ["--blocks", "3", "--runs", "15", "--realisations", "3", "--duration", "60s"]
MAP = ["--vary", "drag-coefficient=0.2:1:0.4", "--vary", "force-std=0.2mN,1mN"]
NAMES = {"reference.nc", "sensitivity.nc", "components.nc", "manifest.json", ".lock", "figures"}
KEYS = {"settings", "runs", "classes", "reference", "l1", "components", "smallest_distance"}

pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture(scope="module")
def calibrated(calibrated_minute: tuple[Path, Done]) -> Path:
    return calibrated_minute[0]


@pytest.fixture(scope="module")
def whole(calibrated: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Done]:
    """Return a run from the calibration, figures and all."""
    folder = tmp_path_factory.mktemp("whole") / "sensitivity"
    return folder, drawn("sensitivity", calibrated, *SIZE, *MAP, "--json", "-o", folder)


def dataset(path: Path) -> xr.Dataset:
    with xr.open_dataset(path, engine="h5netcdf") as stored:
        return stored.load()


@pytest.mark.slow
def test_json_says_what_the_files_hold(whole: tuple[Path, Done], calibrated: Path) -> None:
    folder, done = whole
    assert done.code == 0, done.err
    said = json.loads(done.out)
    found, reference = dataset(folder / "sensitivity.nc"), dataset(folder / "reference.nc")
    assert set(said) >= KEYS
    assert (said["settings"], said["runs"], said["blocks"]) == (6, 15, 3)
    assert said["axes"] == {"drag_coefficient": [0.2, 0.6, 1.0], "force_std_N": [2e-4, 1e-3]}
    assert said["classes"] == ["I3", "L3", "2+1", "1+1+1"]
    known = facts_of(dataset(calibrated / "calibration.nc"))
    for key in ("drag_coefficient", "force_std_N", "force_interval_s"):
        assert said["reference"][key] == known[key]
    assert said["reference"]["runs"] == 45
    assert (
        list(said["reference"]["proportions"].values()) == reference["proportion"].values.tolist()
    )
    pairs = reference["realisation_proportion"].values
    each = [np.abs(pairs[a] - pairs[b]).sum() for a in range(3) for b in range(a)]
    assert said["reference"]["mean_pairwise_l1"] == pytest.approx(np.mean(each))
    distance = np.abs(found["proportion"].values - reference["proportion"].values).sum(axis=-1)
    l1 = said["l1"]
    assert (l1["min"], l1["max"]) == pytest.approx((distance.min(), distance.max()))
    assert l1["median"] == pytest.approx(np.median(distance))
    assert l1["share_above_floor"] == (distance > l1["noise_floor_95"]).mean()
    closest = np.unravel_index(distance.argmin(), distance.shape)
    assert said["smallest_distance"] == {
        "drag_coefficient": found["drag_coefficient"].values[closest[0]],
        "force_std_N": found["force_std"].values[closest[1]],
        "l1_distance": pytest.approx(distance.min()),
    }
    assert sum(said["components"]["explained_variance_ratio"]) == pytest.approx(1.0)
    assert said["sobol"] is None


@pytest.mark.slow
def test_the_run_directory_is_complete(whole: tuple[Path, Done], calibrated: Path) -> None:
    folder = whole[0]
    assert {path for path in contents(folder) if not path.startswith("figures/")} == NAMES
    figures = {path.name for path in (folder / "figures").iterdir()}
    assert {"outcomes.png", "l1_map.png", "class_panels.svg", "biplot.png"} <= figures
    kinds = [dataset(folder / f"{name}.nc").attrs["kind"] for name in ("sensitivity", "components")]
    assert kinds == ["sensitivity", "components"]
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["seeds"] == {"sensitivity": 1}
    for name in ("calibration.nc", "flow.nc"):
        assert hashlib.sha256((calibrated / name).read_bytes()).hexdigest() in json.dumps(manifest)
    listed = {entry["path"]: entry["sha256"] for entry in manifest["files"]}
    for name in ("sensitivity.nc", "figures/l1_map.png"):
        assert listed[name] == hashlib.sha256((folder / name).read_bytes()).hexdigest()


@pytest.mark.slow
def test_a_study_file_says_what_is_simulated(calibrated: Path, tmp_path: Path) -> None:
    """The form of the issue's example; the same by options; the model is the calibration's."""
    study = tmp_path / "study.toml"
    study.write_text(
        '[forces]\ndrag_coefficient = 0.9\n[tank]\ndiameter_m = "30cm"\n'
        "[assembly]\nblocks = 2\nduration_s = 5\n"
        '[sensitivity]\nruns = 5\nreference_realisations = 2\nlatching = ["collision", "none"]\n',
        encoding="utf-8",
    )
    done = here("sensitivity", calibrated, "--study", study, "--json", "-o", tmp_path / "a")
    assert done.code == 0, done.err
    said = json.loads(done.out)
    assert said["axes"] == {"latching": ["collision", "none"]}
    assert (said["settings"], said["runs"], said["blocks"], said["duration_s"]) == (2, 5, 2, 5.0)
    known = facts_of(dataset(calibrated / "calibration.nc"))
    assert said["reference"]["drag_coefficient"] == known["drag_coefficient"]
    words = ["--blocks", "2", "--duration", "5s", "--runs", "5", "--realisations", "2"]
    again = here(
        "sensitivity", calibrated, *words, "--vary", "latching=collision,none", "-o", tmp_path / "b"
    )
    assert again.code == 0, again.err
    first, second = (dataset(tmp_path / name / "sensitivity.nc") for name in "ab")
    assert_same_bits(first.drop_attrs(), second.drop_attrs())
    study.write_text('[tank]\ndiameter_m = "25cm"\n', encoding="utf-8")
    line = refusal(here("sensitivity", calibrated, "--study", study, "-o", tmp_path / "c"))
    assert f"[tank] diameter_m is 0.25, and {calibrated} was made with 0.3" in line


@pytest.mark.slow
def test_flows_of_a_study_lie_beside_it(tmp_path: Path) -> None:
    shutil.copy(FLOW, tmp_path / "one.csv")
    shutil.copy(FLOW, tmp_path / "two.csv")
    study = tmp_path / "study.toml"
    study.write_text('[sensitivity]\nflow = ["one.csv", "two.csv"]\n', encoding="utf-8")
    words = ["sensitivity", "--flow", FLOW, "--study", study, *SIZE, "--json"]
    said = json.loads(here(*words, "-o", tmp_path / "run").out)
    assert said["axes"] == {"flow": ["one.csv", "two.csv"]}
    found = dataset(tmp_path / "run" / "sensitivity.nc")
    assert found["trial"].values.tolist() == [1 << 32, (1 << 32) + 1]
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text(encoding="utf-8"))
    assert {"flow", "study", "flow one.csv", "flow two.csv"} == set(manifest["inputs"])


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_other_axes_and_the_answer_for_people(tmp_path: Path) -> None:
    words = ["--vary", "blocks=2:3:1", "--vary", "tank=25cm,30cm", "--sobol", "8"]
    done = here("sensitivity", "--flow", FLOW, *SIZE, *words, "-o", tmp_path / "run")
    assert done.code == 0, done.err
    lines = done.out.splitlines()
    assert lines[0] == "2 x 2 settings (tank_diameter, blocks), 15 runs of 60 s each"
    assert any(line.startswith("l1 distance of two realisations: ") for line in lines)
    assert any(line.startswith("smallest: ") and "blocks = 3" in line for line in lines)
    head = next(line for line in lines if line.startswith("Sobol' indices"))
    assert "tank_diameter" in head
    assert "the wall of a smaller tank cuts it off" in done.err
    assert "they have no l1 distance" in done.err
    found, indices = (dataset(tmp_path / "run" / f"{n}.nc") for n in ("sensitivity", "sobol"))
    assert found.sizes["class"] == 6
    assert np.isnan(found["l1_distance"].sel(blocks=2)).all()
    assert indices["low"].values.tolist() == [0.0, 0.0, 0.25]
    assert indices.sizes["setting"] == 8 * 5


@pytest.mark.slow
def test_figures_of_three_axes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tables: list[dict[str, Any]] = []
    monkeypatch.setattr(
        "driftwalk.figures.write_figures", lambda table, folder: tables.append(table)
    )
    words = ["--vary", "latching=collision,none", *MAP]
    done = here("sensitivity", "--flow", FLOW, *SIZE, *words, "-o", tmp_path / "run")
    assert done.code == 0, done.err
    drawn = {
        name.partition("/")[0]: draw.args[0]
        for name, draw in tables[0].items()
        if name.endswith("l1_map")
    }
    assert list(drawn) == ["latching_collision", "latching_none"]
    assert (drawn["latching_none"]["complete"] == 0).all()
    assert drawn["latching_collision"]["l1_distance"].dims == ("drag_coefficient", "force_std")


@pytest.mark.fast_cases(12)
@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--vary", "drag=1"], "expected NAME=VALUES with a name out of tank, blocks"),
        (["--vary", "blocks"], "expected NAME=VALUES"),
        (["--vary", "blocks="], "a value is missing after 'blocks='"),
        (["--vary", "blocks=2,,3"], "a value is missing"),
        (["--vary", "blocks=2", "--vary", "blocks=3"], "blocks is varied twice"),
        (["--vary", "blocks=2.5"], "expected a whole number, got 2.5"),
        (["--vary", "blocks=0"], "--vary blocks over the default study"),
        (["--vary", "force-std=1mm"], "expected a number in N"),
        (["--vary", "force-std=0:1mN"], "expected a number or FROM:TO:STEP, got '0:1mN'"),
        (["--vary", "force-std=0:1mN:0"], "no value from 0 N to 0.001 N in steps of 0 N"),
        (["--vary", "force-std=0.2mN,0.55"], "'0.55' has no unit, and a number before it has one"),
        (["--vary", "blocks=4:2:1"], "no value from 4 to 2 in steps of 1"),
        (["--vary", "drag-coefficient=0:1:1e-9"], "more than 1000000 values"),
        (["--vary", "latching=glue"], '"collision" or "connector" or "none"'),
        (["--vary", "flow=nowhere.nc"], "nowhere.nc: there is no such file"),
        (["--vary", "tank=30cm,50cm"], "at tank_diameter = 0.5: the flow field does not"),
        (["--vary", "blocks=2,200"], "at blocks = 200: 200 blocks of 0.03 m do not fit"),
        (["--blocks", "70"], "of 70 blocks found a place in the tank"),
        (["--runs", "0"], "'--runs'"),
        (["--realisations", "1"], "'--realisations'"),
        (["--sobol", "9"], "samples must be a power of two"),
        (["--sobol", "8", "--runs", "1"], "at least 2 runs of each setting"),
    ],
)
def test_a_bad_option(options: list[str], says: str, tmp_path: Path) -> None:
    words = ["sensitivity", "--flow", FLOW, "--runs", "5", *options]
    assert says in refusal(here(*words, "-o", tmp_path / "run"))
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_sources_that_cannot_be_used(calibrated: Path, tmp_path: Path) -> None:
    unfinished = tmp_path / "unfinished"
    shutil.copytree(calibrated, unfinished)
    (unfinished / "manifest.json").unlink()
    (unfinished / ".run.json").write_text("{}", encoding="utf-8")
    out = ["-o", tmp_path / "run"]
    assert "not finished: run its command again" in refusal(here("sensitivity", unfinished, *out))
    assert "or a flow field (--flow)" in refusal(here("sensitivity", *out))
    line = refusal(here("sensitivity", calibrated, "--force-std", "1mN", *out))
    assert "--force-std: not with a finished run" in line
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_finished_run_is_kept_until_overwrite(tmp_path: Path) -> None:
    words = ["sensitivity", "--flow", FLOW, *SIZE, "--vary", "blocks=2,3", "-o", tmp_path / "run"]
    assert here(*words).code == 0
    before = contents(tmp_path / "run")
    assert "holds a finished run" in refusal(here(*words))
    assert contents(tmp_path / "run") == before
    assert here(*words, "--overwrite", "--seed", "2").code == 0


# One setting per unit, without figures.
SMALL = f"""{NO_FIGURES}
from driftwalk.assembly.sensitivity import settings
settings.settings_per_unit = lambda *_: 1
"""


def shards(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.glob(".shards/*/[0-9]*.npz")}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_killed_interrupted_and_continued(
    whole: tuple[Path, Done], calibrated: Path, tmp_path: Path
) -> None:
    """Killed in the reference, interrupted in the map: the same bits in the end."""
    folder = tmp_path / "run"
    words = ["sensitivity", calibrated, *SIZE, *MAP, "--json", "-o", folder]
    killed = apart(*words, before=SMALL + after_units(signal.SIGKILL, 2))
    assert killed.code == -signal.SIGKILL
    first = shards(folder)
    done = apart(*words, before=SMALL + after_units(signal.SIGINT, 3))
    assert (done.code, done.out) == (130, "")
    # The opening line of the run, and the one that ends it.
    assert [line[:16] for line in done.err.splitlines()] == ["driftwalk: tank:", "driftwalk: inter"]
    kept = shards(folder)
    assert {path: kept[path] for path in first} == first
    assert "seed" in refusal(here(*words, "--seed", "2"))
    done = apart(*words, before=SMALL)
    assert done.code == 0, done.err
    assert done.out == whole[1].out
    for name in ("reference.nc", "sensitivity.nc", "components.nc"):
        assert_same_bits(dataset(folder / name), dataset(whole[0] / name))
    assert not (folder / ".shards").exists()


@pytest.mark.slow
def test_its_figures_are_drawn_again_alike(whole: tuple[Path, Done], tmp_path: Path) -> None:
    assert_drawn_alike(whole[0], tmp_path / "out")
