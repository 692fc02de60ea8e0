"""`driftwalk assemble` from a calibration and from a flow field: what it prints, writes, refuses.

The recording is the bundled one, which another engine simulated.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import (
    FLOW,
    NO_FIGURES,
    RECORDING,
    Done,
    apart,
    assert_same_bits,
    contents,
    here,
    refusal,
)
from redrawn import assert_drawn_alike, drawn
from signals_at_units import after_units

from driftwalk.page import report_page
from driftwalk.schema.answers.facts import facts_of, fitted_value

CLASSES = ["I", "O", "T", "S", "L", "I3+1", "L3+1", "2+2", "2+1+1", "1+1+1+1"]
REQUIRED = {"proportions", "intervals", "complete", "runs"}
SIZE = ["--blocks", "4", "--runs", "60", "--duration", "30s", "--threads", "1"]
RESULTS = ("assembly.nc", "distribution.nc", "class_times.nc", "path.nc")
DRAWN = ("assembly_drawn.nc", "distribution_drawn.nc")

pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture(scope="module")
def calibrated(calibrated_minute: tuple[Path, Done]) -> Path:
    return calibrated_minute[0]


@pytest.fixture(scope="module")
def whole(calibrated: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Done]:
    """Return a run from the calibration, figures and all."""
    folder = tmp_path_factory.mktemp("whole") / "assembly"
    return folder, drawn("assemble", calibrated, *SIZE, "--json", "-o", folder)


def dataset(path: Path) -> xr.Dataset:
    with xr.open_dataset(path, engine="h5netcdf") as stored:
        return stored.load()


@pytest.mark.slow
def test_json_holds_both_distributions(whole: tuple[Path, Done]) -> None:
    done = whole[1]
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert set(found) >= REQUIRED
    for part in (found, found["drawn"]):
        assert list(part["proportions"]) == CLASSES
        assert sum(part["proportions"].values()) == pytest.approx(1.0)
        assert part["runs"] == 60
        for name, (low, high) in part["intervals"].items():
            assert 0.0 <= low <= part["proportions"][name] <= high <= 1.0
        whole_ones = sum(part["proportions"][name] for name in "IOTSL")
        assert part["complete"] == pytest.approx(whole_ones)
        assert part["complete_interval"][0] <= part["complete"] <= part["complete_interval"][1]
    both = [np.array(list(part["proportions"].values())) for part in (found, found["drawn"])]
    assert found["l1_distance"] == pytest.approx(np.abs(both[0] - both[1]).sum())
    assert 0.0 < found["l1_noise_floor"] < found["l1_noise_floor_95"]
    assert found["drawn"]["parameters"] == ["drag_coefficient", "force_std", "flow"]
    assert (found["blocks"], found["duration_s"], found["seed"]) == (4, 30.0, 1)


@pytest.mark.slow
def test_the_parameters_are_the_calibrations(whole: tuple[Path, Done], calibrated: Path) -> None:
    found, known = json.loads(whole[1].out), dataset(calibrated / "calibration.nc")
    for name in ("drag_coefficient", "force_std_N", "force_interval_s"):
        assert found[name] == facts_of(known)[name]
    fixed, drawn = (dataset(whole[0] / name) for name in ("assembly.nc", "assembly_drawn.nc"))
    assert (fixed["drag_coefficient"] == fitted_value(known, "drag_coefficient")).all()
    assert (fixed["force_std"] == fitted_value(known, "force_std")).all()
    for name in ("drag_coefficient", "force_std"):
        border = known[f"region_{name}"].values
        assert np.unique(drawn[name]).size == 60
        assert border.min() <= drawn[name].min()
        assert drawn[name].max() <= border.max()
    # The two kinds of runs have random numbers of their own.
    assert (fixed["x"].values != drawn["x"].values).all()


@pytest.mark.slow
def test_the_run_directory_is_complete(whole: tuple[Path, Done], calibrated: Path) -> None:
    folder = whole[0]
    names = {path for path in contents(folder) if not path.startswith("figures/")}
    assert names == {*RESULTS, *DRAWN, "manifest.json", ".lock", "figures"}
    figures = {path.name for path in (folder / "figures").iterdir()}
    assert {"outcomes.png", "class_times.svg", "film_strip.png"} <= figures
    kinds = {name: dataset(folder / name).attrs["kind"] for name in (*RESULTS, *DRAWN)}
    assert kinds == {
        "assembly.nc": "assembly",
        "distribution.nc": "outcome_distribution",
        "class_times.nc": "class_times",
        "path.nc": "assembly_path",
        "assembly_drawn.nc": "assembly",
        "distribution_drawn.nc": "outcome_distribution",
    }
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["seeds"] == {"assembly": 1}
    assert manifest["study"]["assembly"]["runs"] == 60
    for name in ("calibration.nc", "flow.nc"):
        assert hashlib.sha256((calibrated / name).read_bytes()).hexdigest() in json.dumps(manifest)
    listed = {entry["path"]: entry["sha256"] for entry in manifest["files"]}
    for name in (*RESULTS, *DRAWN):
        assert listed[name] == hashlib.sha256((folder / name).read_bytes()).hexdigest()


@pytest.mark.slow
def test_the_path_is_that_of_the_first_runs(whole: tuple[Path, Done]) -> None:
    fixed, path = (dataset(whole[0] / name) for name in ("assembly.nc", "path.nc"))
    assert path["run"].values.tolist() == [0, 1, 2, 3]
    assert path["time"].values[[0, -1]].tolist() == pytest.approx([0.0, 30.0])
    apart = len(set(fixed["assembly"].values[2].tolist()))
    assert len(set(path["assembly"].values[2, -1].tolist())) == apart


@pytest.mark.slow
def test_from_a_flow_field(tmp_path: Path) -> None:
    """The form of the issue's second example, and that the result does not depend on threads."""
    given = ["--flow", FLOW, "--drag-coefficient", "0.45", "--force-std", "0.55mN"]
    found = []
    for threads, size in (("1", "--tank"), ("2", "--study")):
        study = tmp_path / "study.toml"
        study.write_text('[tank]\ndiameter_m = "30cm"\n', encoding="utf-8")
        tank = [size, "0.30" if size == "--tank" else study]
        folder = tmp_path / f"run{threads}"
        words = [*given, *tank, *SIZE, "--threads", threads, "-o", folder]
        done = here("assemble", *words)
        assert done.code == 0, done.err
        assert "60 runs of 30 s; C_d = 0.45, σ_F = 0.55 mN redrawn every 10 ms" in done.out
        assert "l1 distance" not in done.out
        assert not any((folder / name).exists() for name in DRAWN)
        found.append(dataset(folder / "assembly.nc"))
    assert_same_bits(*found)
    again = here("assemble", *given, *SIZE, "--json", "-o", tmp_path / "json")
    printed = json.loads(again.out)
    assert set(printed) >= REQUIRED
    assert printed["drawn"] is None


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["disc:4cm", "rectangle:4x2cm"])
def test_what_latches_as_it_lies_assembles_and_has_a_page(shape: str, tmp_path: Path) -> None:
    words = ["--flow", FLOW, "--body-shape", shape, "--mass", "24g", *SIZE]
    done = here("assemble", *words, "--json", "-o", tmp_path / "run")
    assert done.code == 0, done.err
    printed = json.loads(done.out)
    assert printed["hidden_face_drag"] == "full"
    classes = set(printed["proportions"])
    assert classes & {"chain3", "chain4", "chain3+1", "star4"}
    assert not classes & {"I", "L3", "T", "L3+1"}
    assert here("report", tmp_path / "run", "-o", tmp_path / "page.html").code == 0


@pytest.mark.slow
def test_the_answer_for_people_stands_side_by_side(calibrated: Path, tmp_path: Path) -> None:
    done = here("assemble", calibrated, *SIZE, "-o", tmp_path / "run")
    assert done.code == 0, done.err
    lines = done.out.splitlines()
    head = next(line for line in lines if line.startswith("class"))
    assert head.count("90 % simultaneous intervals") == 2
    row = next(line for line in lines if line.startswith("complete")).split()
    assert row.count("to") == 2
    assert any(line.startswith("l1 distance of the two: ") for line in lines)
    assert "drawn for each run: drag_coefficient, force_std, flow" in lines
    # The run says the same afterwards, without the row of its figures.
    assert here("info", tmp_path / "run").out.splitlines()[1:] == lines[:-1]


@pytest.mark.slow
def test_of_many_blocks_sizes_are_printed_and_stored(calibrated: Path, tmp_path: Path) -> None:
    """Nearly every run is a class of its own, with a name that is longer than a line."""
    many = ["--blocks", "16", "--runs", "12", "--duration", "20s", "--threads", "1"]
    done = here("assemble", calibrated, *many, "-o", tmp_path / "run")
    assert done.code == 0, done.err
    lines = done.out.partition("figures")[0].splitlines()
    assert max(map(len, lines)) <= 115
    assert [line.split()[0] for line in lines].count("blocks") == 2  # found, and drawn
    assert "l1 distance" not in done.out
    for words in ("mean size", "in largest", "free", "compactness: 0.", "complete: "):
        assert words in done.out
    long = dataset(tmp_path / "run/distribution.nc")["class"].values.tolist()
    assert max(map(len, long)) > 20
    assert not any(name in done.out for name in long if len(name) > 20)
    for end in ("", "_drawn"):
        end_of = dataset(tmp_path / f"run/assembly{end}.nc")["assembly"].values
        largest = [np.bincount(run).max() / 16 for run in end_of]
        sizes = dataset(tmp_path / f"run/sizes{end}.nc")
        assert sizes.attrs["kind"] == "assembly_sizes"
        assert float(sizes["largest_share"][-1]) == pytest.approx(np.mean(largest))
    again = here("assemble", calibrated, *many, "--json", "-o", tmp_path / "json")
    printed = json.loads(again.out)
    for part in (printed, printed["drawn"]):
        found = part["sizes"]
        assert sum(row["block_share"] for row in found["at_end"]) == pytest.approx(1.0)
        assert [row["to_blocks"] for row in found["at_end"]] == [*range(1, 9), 16]
        over = found["over_time"]
        assert (over["time_s"][-1], over["mean_size_blocks"][0]) == (20.0, 1.0)
        assert over["free_share_interval"][0] == [1.0, 1.0]
    page = report_page(tmp_path / "run")
    kinds = {part["id"]: part["kind"] for part in page["sections"]}
    assert "empty" not in kinds.values()
    assert [kinds[id] for id in ("sizes", "mean-size", "size-shares")] == ["lines"] * 3
    assert not {"classes", "class-times"} & set(kinds)


@pytest.mark.slow
def test_the_figures_of_many_blocks_are_of_sizes(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    many = ["--blocks", "10", "--runs", "4", "--duration", "5s", "--threads", "1"]
    done = drawn("assemble", "--flow", FLOW, *many, "--film", "none", "-o", folder)
    assert done.code == 0, done.err
    figures = {path.stem for path in (folder / "figures").iterdir()}
    assert figures == {"assembly_sizes", "film_strip"}
    assert_drawn_alike(folder, tmp_path / "again")


@pytest.mark.slow
def test_options_reach_the_simulation(tmp_path: Path) -> None:
    words = ["assemble", "--flow", FLOW, *SIZE, "--json"]
    plain = json.loads(here(*words, "-o", tmp_path / "plain").out)
    none = json.loads(here(*words, "--latching", "none", "-o", tmp_path / "none").out)
    assert none["proportions"]["1+1+1+1"] == 1.0
    assert plain["proportions"]["1+1+1+1"] < 1.0
    mirror = here(*words, "--chirality", "distinct", "-o", tmp_path / "mirror")
    assert {"Z", "J"} <= set(json.loads(mirror.out)["proportions"])
    other = here(*words, "--seed", "2", "--confidence", "0.99", "-o", tmp_path / "other")
    found = json.loads(other.out)
    assert (found["seed"], found["confidence"]) == (2, 0.99)
    assert found["proportions"] != plain["proportions"]


@pytest.mark.slow
def test_a_calibration_without_bootstrap_gives_one_distribution(
    calibrated: Path, tmp_path: Path
) -> None:
    bare = tmp_path / "bare"
    shutil.copytree(calibrated, bare)
    gone = ["region_level", "region_drag_coefficient", "region_force_std"]
    known = dataset(calibrated / "calibration.nc").drop_vars(gone)
    known.to_netcdf(bare / "calibration.nc", engine="h5netcdf")
    done = here("assemble", bare, *SIZE, "--json", "-o", tmp_path / "run")
    found = json.loads(done.out)
    assert found["drawn"] is None
    assert any("no joint region" in warning for warning in found["warnings"])
    assert not (tmp_path / "run" / "distribution_drawn.nc").exists()


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--blocks", "200"], "200 blocks of 0.03 m do not fit into the tank"),
        (["--blocks", "70"], "of 70 blocks found a place in the tank, a circle of diameter 0.3 m"),
        (["--blocks", "0"], "'--blocks'"),
        (["--runs", "0"], "'--runs'"),
        (["--duration", "0"], "--duration"),
        (["--duration", "5mm"], "--duration"),
        (["--latching", "conector"], "did you mean 'connector'?"),
        (["--chirality", "left"], "--chirality over"),
        (["--hidden-face-drag", "2"], "--hidden-face-drag over"),
        (["--confidence", "1"], "--confidence over"),
        (["--side", "40cm"], "the block does not fit"),
        (["--body-shape", "disc:3cm", "--latching", "connector"], "discs have no faces"),
        (["--body-shape", "xx"], "squares, discs and rectangles assemble"),
        (["--body-shape", "rectangle:4x2cm", "--faces", "NSNS"], "rectangles latch as they lie"),
        (["--faces", "N,S,N"], "the types of 4 faces, in the order +x, +y, -x, -y"),
        (["--faces", "NSNS", "--body-shape", "disc:3cm"], "leave out types of faces (--faces)"),
        (["--glued", "xx", "--blocks", "5"], "(--glued): give 4 blocks"),
        (["--seed=-1"], "--seed"),
    ],
)
@pytest.mark.parametrize("source", [pytest.param("calibration", marks=pytest.mark.slow), "flow"])
def test_a_bad_option(
    source: str, options: list[str], says: str, calibrated: Path, tmp_path: Path
) -> None:
    words = [calibrated] if source == "calibration" else ["--flow", FLOW]
    line = refusal(here("assemble", *words, "--runs", "5", *options, "-o", tmp_path / "run"))
    assert says in line
    assert not (tmp_path / "run").exists()


def test_kinds_of_blocks_from_a_file(tmp_path: Path) -> None:
    rules = tmp_path / "rules.toml"
    kind = '[[kinds]]\nname = "{}"\ncount = {}\nfaces = ["{}", "none", "none", "none"]\n'
    rules.write_text(kind.format("A", 2, "N") + kind.format("B", 3, "S"))
    words = ("assemble", "--flow", FLOW, "--binding", rules, "--runs", "20", "--duration", "20s")
    found = here(*words, "--film", "none", "--json", "-o", tmp_path / "five")
    assert found.code == 0
    told = json.loads(found.out)
    assert told["blocks"] == 5
    assert told["faces"].startswith("2 A (N,none,none,none), 3 B (S,none,none,none); N latches")
    kept = xr.open_dataset(tmp_path / "five" / "assembly.nc")
    assert kept["pole"].values.tolist() == [[1, 0, 0, 0]] * 2 + [[-1, 0, 0, 0]] * 3
    clash = refusal(here(*words, "--blocks", "4", "-o", tmp_path / "four"))
    assert "the kinds count 5 blocks, and --blocks says 4" in clash
    both = refusal(here(*words, "--faces", "NSNS", "-o", tmp_path / "both"))
    assert "both say which faces latch" in both


@pytest.mark.slow
def test_a_calibration_that_cannot_be_used(calibrated: Path, tmp_path: Path) -> None:
    unfinished, empty, other = (tmp_path / name for name in ("unfinished", "empty", "other"))
    empty.mkdir()
    shutil.copytree(calibrated, unfinished)
    (unfinished / "manifest.json").unlink()
    (unfinished / ".run.json").write_text("{}", encoding="utf-8")
    shutil.copytree(calibrated, other)
    (other / "calibration.nc").unlink()
    fit = tmp_path / "fit"
    shutil.copytree(other, fit)
    (fit / "fit.nc").touch()
    damaged = tmp_path / "damaged"
    shutil.copytree(calibrated, damaged)
    (damaged / "calibration.nc").write_bytes(b"\x89HDF\r\n\x1a\n")
    wrong = tmp_path / "wrong"
    shutil.copytree(calibrated, wrong)
    shutil.copy(calibrated / "flow.nc", wrong / "calibration.nc")
    says = {
        unfinished: "holds a run that is not finished: run its command again",
        empty: "is not a run directory",
        tmp_path / "nowhere": "does not exist",
        RECORDING: "is not a run directory",
        other: "no fit, calibration or comparison of models: give the directory",
        fit: "fit.nc: is not a NetCDF file",
        damaged: "cannot be read as NetCDF",
        wrong: "expected a dataset 'calibration', got flow_field",
    }
    for folder, words in says.items():
        line = refusal(here("assemble", folder, "-o", tmp_path / "run"))
        assert str(folder) in line
        assert words in line
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_what_does_not_go_together(calibrated: Path, tmp_path: Path) -> None:
    for options in (["--study", "x.toml"], ["--force-std", "1mN"], ["--force-interval", "16ms"]):
        line = refusal(here("assemble", calibrated, *options, "-o", tmp_path / "run"))
        assert f"{options[0]}: not with a finished run" in line
    assert "or a flow field (--flow)" in refusal(here("assemble", "-o", tmp_path / "run"))
    missing = here("assemble", "--flow", tmp_path / "no.nc", "-o", tmp_path / "run")
    assert "no such file" in refusal(missing)


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_finished_run_is_kept_until_overwrite(calibrated: Path, tmp_path: Path) -> None:
    words = ["assemble", calibrated, *SIZE, "-o", tmp_path / "run"]
    assert here(*words).code == 0
    before = contents(tmp_path / "run")
    assert "holds a finished run" in refusal(here(*words))
    assert contents(tmp_path / "run") == before
    assert here(*words, "--overwrite", "--seed", "2").code == 0
    moved = list((tmp_path / "run" / "previous").iterdir())
    assert [len(list(folder.glob("*.nc"))) for folder in moved] == [6]


# Small units, without figures and film.
SMALL = f"""{NO_FIGURES}
import driftwalk.assembly.runs.run
driftwalk.assembly.runs.run.runs_per_unit = lambda _: 25
"""


def shards(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.glob(".shards/*/[0-9]*.npz")}


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.slow
def test_killed_interrupted_and_continued(
    whole: tuple[Path, Done], calibrated: Path, tmp_path: Path
) -> None:
    """Killed among the fixed runs, interrupted among the drawn ones: the same bits in the end."""
    folder = tmp_path / "run"
    words = ["assemble", calibrated, *SIZE, "--json", "-o", folder]
    killed = apart(*words, before=SMALL + after_units(signal.SIGKILL, 2))
    assert killed.code == -signal.SIGKILL
    first = shards(folder)
    done = apart(*words, before=SMALL + after_units(signal.SIGINT, 2))
    assert (done.code, done.out) == (130, "")
    # The opening line of the run, and the one that ends it.
    assert [line[:16] for line in done.err.splitlines()] == ["driftwalk: tank:", "driftwalk: inter"]
    kept = shards(folder)
    assert {path: kept[path] for path in first} == first
    other = refusal(here(*words, "--seed", "2"))
    assert "seed" in other
    done = apart(*words, before=SMALL)
    assert done.code == 0, done.err
    assert json.loads(done.out) == json.loads(whole[1].out)
    for name in (*RESULTS, *DRAWN):
        assert_same_bits(dataset(folder / name), dataset(whole[0] / name))
    assert not (folder / ".shards").exists()


@pytest.mark.slow
def test_its_figures_are_drawn_again_alike(whole: tuple[Path, Done], tmp_path: Path) -> None:
    assert_drawn_alike(whole[0], tmp_path / "out")
