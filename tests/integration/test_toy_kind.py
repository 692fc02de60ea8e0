"""A kind of run that one file declares has all that the built-in kinds have."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import xarray as xr
from command_line import here

from driftwalk.core.errors import InputError, RunDirectoryError
from driftwalk.core.files.run_layout import state_of
from driftwalk.core.provenance import read_manifest
from driftwalk.export.registry import draw_run
from driftwalk.notebook.result import as_result
from driftwalk.page import dataset_page, report_page
from driftwalk.runs import run_folder, run_work
from driftwalk.schema.runs import RUN_KINDS, RunKind, register, run_kind, run_kinds
from driftwalk.viewer import RunSource

SETS = 5
KILLED_AT = 3
HELPERS = Path(__file__).resolve().parents[1] / "helpers"
PROGRAM = f"""
import sys
sys.path.insert(0, {str(HELPERS)!r})
from pathlib import Path
from toy_kind import ToyWork
from driftwalk.runs import run_work
run_work(ToyWork({SETS}, killed_at={KILLED_AT}), Path(sys.argv[1]))
"""


@pytest.fixture(scope="module", autouse=True)
def toy() -> Iterator[RunKind]:
    """Declare the kind for this module alone."""
    from toy_kind import TOY

    register(TOY)
    yield TOY
    run_kinds.unregister("toy")


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("toy") / "run"
    done = subprocess.run([sys.executable, "-c", PROGRAM, folder], check=False, timeout=120)
    assert done.returncode != 0
    return folder


@pytest.fixture(scope="module")
def pages(killed: Path) -> tuple[dict, dict]:
    """Return the live page and the report of the killed run."""
    return dict(RunSource(killed).greeting()[0]["page"]), report_page(killed)


@pytest.fixture(scope="module")
def found(pages: tuple[dict, dict], killed: Path) -> xr.Dataset:
    """Return the result of the continued run."""
    from toy_kind import ToyWork

    shards = {path: path.stat().st_mtime_ns for path in killed.glob(".shards/*/*.npz")}
    assert len(shards) == KILLED_AT
    # What was computed before the kill is not computed again: here it would be killed once more.
    computed: list[int] = []

    class Counted(ToyWork):
        def _share(self, unit):
            computed.append(unit.start)
            return super()._share(unit)

    result = run_work(Counted(SETS), killed)
    assert computed == [3, 4]
    return result


@pytest.mark.slow
def test_a_killed_run_is_continued_to_its_manifest(found: xr.Dataset, killed: Path) -> None:
    from toy_kind import ToyWork

    assert state_of(killed) == "finished"
    manifest = read_manifest(killed / "manifest.json")
    assert manifest["specification"]["kind"] == "toy"
    assert manifest["seeds"] == {"toy": 1}
    stored = xr.load_dataset(killed / "toy.nc", engine="h5netcdf")
    xr.testing.assert_identical(stored, found)
    assert found.encoding["source"] == str(killed / "toy.nc")
    with pytest.raises(RunDirectoryError, match="finished run"):
        run_work(ToyWork(SETS), killed)
    with pytest.raises(InputError, match="needs a set"):
        run_work(ToyWork(0), killed)


@pytest.mark.slow
def test_its_figures_are_written_and_drawn_again(
    found: xr.Dataset, killed: Path, tmp_path: Path
) -> None:
    assert {path.name for path in (killed / "figures").iterdir()} == {"shares.png", "shares.svg"}
    again = draw_run(killed, tmp_path, ["svg"])
    assert [path.name for path in again] == ["shares.svg"]
    assert again[0].read_bytes() == (killed / "figures" / "shares.svg").read_bytes()


@pytest.mark.slow
def test_its_pages(pages: tuple[dict, dict], found: xr.Dataset, killed: Path) -> None:
    live, early = pages
    assert live["title"] == "A toy under way"
    assert live["state"]["progress"] == KILLED_AT / SETS
    assert live["sections"][0]["paragraphs"] == [f"{KILLED_AT} of {SETS} sets"]
    assert (early["title"], early["state"]["finished"]) == ("Toy", False)
    assert early["sections"][1]["paragraphs"] == ["Nothing is there yet."]
    for page in (report_page(killed), dataset_page(found), RunSource(killed).greeting()[0]["page"]):
        assert (page["title"], page["state"]["finished"]) == ("Toy", True)
        assert page["sections"][0]["paragraphs"][0].startswith("π                      3.")


@pytest.mark.slow
def test_its_answer_on_the_terminal_and_in_a_notebook(found: xr.Dataset, killed: Path) -> None:
    done = here("info", killed)
    assert done.code == 0, done.err
    assert "Toy" in done.out
    assert "π                      3." in done.out
    assert '"pi": 3.' in here("info", killed, "--json").out
    assert repr(as_result(found)).startswith("π                      3.")
    assert "<pre>π                      3." in as_result(found)._repr_html_()


@pytest.mark.slow
def test_a_report_of_the_command_line(found: xr.Dataset, killed: Path, tmp_path: Path) -> None:
    done = here("report", killed, "-o", tmp_path / "toy.html")
    assert done.code == 0, done.err
    page = (tmp_path / "toy.html").read_text(encoding="utf-8")
    gap = 22 * " "
    assert "\\u03c0" + gap + "3." in page or "π" + gap + "3." in page


def test_a_kind_is_declared_once(toy: RunKind) -> None:
    other = {**vars(toy), "file": "other.nc"}
    with pytest.raises(InputError, match=r"'toy' \(other.nc\) is declared already"):
        register(RunKind(**other))
    assert RUN_KINDS["toy"] is toy
    with pytest.raises(InputError, match="there is no kind of run 'joke': there are calibration"):
        run_kind("joke")


def test_a_result_knows_its_run_from_another_folder(
    toy: RunKind, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from toy_kind import ToyWork

    monkeypatch.chdir(tmp_path)
    found = run_work(ToyWork(1), Path("run"))
    monkeypatch.chdir("/")
    assert run_folder(found) == tmp_path / "run"
