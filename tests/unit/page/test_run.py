"""The page of a run directory: finished or not, of another version, damaged, hostile."""

from __future__ import annotations

import json
import time
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from made_up_fit import made_up_fit
from page_reading import part_of
from synthetic_assembly import assembly_path, class_times, distribution
from synthetic_calibration import answered, bundled_flow, bundled_recording, synthetic_calibration

from driftwalk import __version__
from driftwalk.core.errors import InputError, RunDirectoryError
from driftwalk.core.files.rundir import RunDirectory
from driftwalk.core.provenance import manifest
from driftwalk.model import Study
from driftwalk.page import joined_page, manifest_section, report_html, report_page, write_report
from driftwalk.schema import build_trajectory
from driftwalk.schema.answers.citation import (
    PAPER_AUTHORS,
    PAPER_TITLE,
    PAPER_VENUE,
    PAPER_YEAR,
    TITLE,
    bibtex,
    citation,
)

HOSTILE = "<script>alert('1')</script> & \"quotes\""
SPECIFICATION = {"study": {"seed": 1}, "body": None}


def make_run(
    folder: Path,
    datasets: Mapping[str, xr.Dataset],
    *,
    finished: bool = True,
    specification: Mapping[str, Any] = SPECIFICATION,
    **facts: Any,
) -> Path:
    """Make a run directory with these datasets."""
    about = manifest(command="driftwalk calibrate r.csv", study={"seed": 1}, seeds={}, inputs={})
    with RunDirectory(folder, specification=specification) as run:
        for name, dataset in datasets.items():
            run.write(name, bytes(dataset.to_netcdf(engine="h5netcdf")))
        if finished:
            run.finish(about | facts)
    return folder


@pytest.fixture(scope="module")
def datasets() -> dict[str, xr.Dataset]:
    return {
        "calibration.nc": synthetic_calibration(points=5).assign_attrs(kind="calibration"),
        "flow.nc": bundled_flow(),
        "recording.nc": bundled_recording(rows=100),
    }


@pytest.mark.slow
def test_a_finished_run(tmp_path: Path, datasets: dict[str, xr.Dataset]) -> None:
    page = report_page(make_run(tmp_path / "run", datasets))
    assert (page["format"], page["version"], page["view"]) == ("driftwalk page", 1, "report")
    assert (page["title"], page["subtitle"]) == ("Calibration", "run")
    assert page["state"] == {"finished": True, "progress": 1.0, "words": None}
    stored = json.loads((tmp_path / "run" / "manifest.json").read_text(encoding="utf-8"))
    assert page["created_utc"] == stored["finished_utc"]
    ids = [part["id"] for part in page["sections"]]
    assert len(set(ids)) == len(ids)
    assert {"summary", "warnings", "recording-1", "flow", "map", "bootstrap"} <= set(ids)
    assert ids[-1] == "manifest"
    assert part_of(page, "warnings")["items"] == []


@pytest.mark.slow
def test_the_same_run_gives_the_same_bytes(tmp_path: Path, datasets: dict[str, xr.Dataset]) -> None:
    folder = make_run(tmp_path / "run", datasets)
    first = report_html(report_page(folder))
    assert report_html(report_page(folder / ".." / "run")) == first


@pytest.mark.slow
def test_the_manifest_is_whole(tmp_path: Path, datasets: dict[str, xr.Dataset]) -> None:
    part = part_of(report_page(make_run(tmp_path / "run", datasets)), "manifest")
    stored = json.loads((tmp_path / "run" / "manifest.json").read_text(encoding="utf-8"))
    assert part["command"] == "driftwalk calibrate r.csv"
    entries = part["entries"]
    # The study stands in the manifest twice, in the page once.
    entries["specification"]["study"] = entries["study"]
    assert {**entries, "command": part["command"]} == stored


def test_inputs_are_named_without_their_folders() -> None:
    recording = {"path": "/home/me/<b>.csv", "sha256": "ab", "size_bytes": 3}
    part = manifest_section({"inputs": {"recording": recording, "odd": 1}, "study": {"a": 1}})
    assert part["inputs"] == [{"role": "recording", "name": "<b>.csv", "sha256": "ab"}]


def test_how_to_cite_is_what_the_citation_file_says() -> None:
    path = Path(__file__).parents[3] / "CITATION.cff"
    text = path.read_text(encoding="utf-8")
    paper = text[text.index("references:") :]
    assert f'title: "{TITLE}"' in text
    assert f"title: {PAPER_TITLE}" in paper
    assert f"collection-title: {PAPER_VENUE}" in paper
    assert f"year: {PAPER_YEAR}" in paper
    for family, given in PAPER_AUTHORS:
        assert f"family-names: {family}\n        given-names: {given}" in paper
    assert paper.count("family-names") == len(PAPER_AUTHORS)
    for words in (citation("1.2"), bibtex("1.2")):
        assert "1.2" in words
        assert PAPER_TITLE in words
    assert bibtex("1.2").count("{") == bibtex("1.2").count("}")


def test_the_version_of_the_package_is_cited() -> None:
    with (Path(__file__).parents[3] / "pyproject.toml").open("rb") as file:
        version = tomllib.load(file)["project"]["version"]
    assert f"version {version};" in manifest_section({})["cite"]


def test_an_unfinished_run_shows_what_is_there(
    tmp_path: Path, datasets: dict[str, xr.Dataset]
) -> None:
    there = {name: datasets[name] for name in ("flow.nc", "recording.nc")}
    specification = {**SPECIFICATION, "kind": "calibration"}
    run = make_run(tmp_path / "run", there, finished=False, specification=specification)
    page = report_page(run)
    assert page["title"] == "Calibration"
    assert page["state"]["finished"] is False
    assert page["state"]["progress"] is None
    words = part_of(page, "state")["paragraphs"][0]
    assert words == page["state"]["words"]
    assert words.startswith("This run is not finished. It was begun on ")
    assert "The same command continues it" in words
    assert part_of(page, "summary")["reason"] == "There is no calibration yet."
    assert part_of(page, "recording-1")["kind"] == "trajectory"
    assert part_of(page, "manifest")["entries"]["study"] == {"seed": 1}


@pytest.mark.parametrize(
    ("specification", "title"),
    [
        ({"kind": "calibration"}, "Calibration"),
        ({"kind": "fit"}, "Likelihood fit"),
        ({"kind": "recovery"}, "Recovery study"),
        ({"kind": "assembly"}, "Self-assembly"),
        ({"kind": "sensitivity"}, "Sensitivity of self-assembly"),
        ({"something": 1}, "Run"),
    ],
)
def test_a_run_with_nothing_in_it_says_so(
    tmp_path: Path, specification: dict[str, Any], title: str
) -> None:
    page = report_page(make_run(tmp_path / "run", {}, finished=False, specification=specification))
    assert page["title"] == title
    assert "not finished" in part_of(page, "state")["paragraphs"][0]
    kinds = {part["kind"] for part in page["sections"]}
    assert kinds <= {"summary", "empty", "manifest", "warnings"}


@pytest.mark.slow
def test_a_run_of_another_version_names_both(
    tmp_path: Path, datasets: dict[str, xr.Dataset]
) -> None:
    folder = make_run(tmp_path / "run", datasets, software={"driftwalk": "0.0.7"})
    page = report_page(folder)
    [remark] = part_of(page, "warnings")["items"]
    assert "0.0.7" in remark
    assert __version__ in remark
    assert part_of(page, "map")["kind"] == "map"
    assert "version 0.0.7;" in part_of(page, "manifest")["cite"]


@pytest.mark.slow
def test_a_manifest_of_another_version_is_refused(
    tmp_path: Path, datasets: dict[str, xr.Dataset]
) -> None:
    later = {"manifest_version": 99, "software": {"driftwalk": "9.9.9"}}
    folder = make_run(tmp_path / "run", datasets, **later)
    with pytest.raises(InputError, match=r"driftwalk 9\.9\.9 \(manifest version 99, .* reads 1\)"):
        report_page(folder)


@pytest.mark.slow
def test_a_damaged_file_costs_its_sections_and_is_named(
    tmp_path: Path, datasets: dict[str, xr.Dataset]
) -> None:
    folder = make_run(tmp_path / "run", datasets)
    (folder / "flow.nc").write_bytes((folder / "flow.nc").read_bytes()[:500])
    page = report_page(folder)
    assert "flow.nc cannot be read" in part_of(page, "warnings")["items"][0]
    assert not [part for part in page["sections"] if part["kind"] == "flow"]
    assert part_of(page, "map")["kind"] == "map"


@pytest.mark.slow
def test_a_finished_run_of_which_nothing_can_be_read_is_refused(
    tmp_path: Path, datasets: dict[str, xr.Dataset]
) -> None:
    folder = make_run(tmp_path / "run", {"calibration.nc": datasets["calibration.nc"]})
    (folder / "calibration.nc").write_bytes(b"no longer")
    with pytest.raises(InputError, match=r"finished run, but calibration\.nc cannot be read"):
        report_page(folder)
    bare = make_run(tmp_path / "bare", {})
    with pytest.raises(InputError, match="it holds no result that driftwalk can show"):
        report_page(bare)


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        report_page(tmp_path / "nowhere")
    (tmp_path / "file").write_text("x", encoding="utf-8")
    with pytest.raises(InputError, match="is not a directory"):
        report_page(tmp_path / "file")
    with pytest.raises(InputError, match="is not a run directory: give one that calibrate"):
        report_page(tmp_path)


@pytest.mark.slow
def test_the_runs_inside_a_directory_are_named(
    tmp_path: Path, datasets: dict[str, xr.Dataset]
) -> None:
    make_run(tmp_path / "demo" / "fit", {"fit.nc": made_up_fit()})
    make_run(tmp_path / "demo" / "calibrate", datasets)
    with pytest.raises(InputError, match="holds some: name calibrate or fit in it"):
        report_page(tmp_path / "demo")


def test_a_damaged_record_is_refused(tmp_path: Path) -> None:
    (tmp_path / ".run.json").write_text("{}", encoding="utf-8")
    with pytest.raises(RunDirectoryError, match="is damaged"):
        report_page(tmp_path)


@pytest.mark.slow
def test_several_recordings_of_a_fit(tmp_path: Path) -> None:
    recording = bundled_recording(rows=50)
    files = {"fit.nc": made_up_fit(), "recording.nc": recording, "recording-2.nc": recording}
    page = report_page(make_run(tmp_path / "run", files, specification={"kind": "fit"}))
    assert part_of(page, "recording-1-of-2")["kind"] == "trajectory"


@pytest.mark.slow
def test_pages_of_runs_that_belong_together_are_joined(
    tmp_path: Path, datasets: dict[str, xr.Dataset]
) -> None:
    recording = datasets["recording.nc"]
    fit = {"fit.nc": made_up_fit(), "recording.nc": recording}
    first = report_page(make_run(tmp_path / "fit", fit, specification={"kind": "fit"}))
    second = report_page(make_run(tmp_path / "map", datasets, finished=False))
    page = joined_page([first, second], title="Both")
    assert (page["title"], page["subtitle"]) == ("Both", "fit, map")
    assert page["state"]["finished"] is False
    assert "This run is not finished" in page["state"]["words"]
    ids = [part["id"] for part in page["sections"]]
    assert len(set(ids)) == len(ids)
    # Each run shows the recording, the joined page does it once.
    of_recording = [
        [part["id"] for part in one["sections"] if part["kind"] == "trajectory"]
        for one in (first, second, page)
    ]
    assert [len(found) for found in of_recording] == [1, 1, 1]
    cited = [part["cite"] for part in page["sections"] if part["kind"] == "manifest"]
    assert cited[0] is None
    assert cited[1]
    # That neither run warned of anything stands there for each.
    assert {"fit-warnings", "map-warnings"} <= set(ids)
    fold = [(part["run"], part["title"]) for part in page["sections"] if part["id"] == "map-state"]
    assert fold == [("Calibration · map", "Not finished")]
    for wrong in ([], [first, first]):
        with pytest.raises(InputError, match="names of their own"):
            joined_page(wrong, title="None")


def test_self_assembly_from_its_files(tmp_path: Path) -> None:
    files = {
        "assembly.nc": xr.Dataset(attrs={"kind": "assembly"}),
        "distribution.nc": distribution(),
        "class_times.nc": class_times(),
        "path.nc": assembly_path(samples=31),
    }
    page = report_page(make_run(tmp_path / "run", files))
    assert page["title"] == "Self-assembly"
    kinds = {part["id"]: part["kind"] for part in page["sections"]}
    assert kinds["classes"] == "classes"
    assert kinds["class-times"] == "class_times"
    # The runs' own events are missing here: the replay says so.
    assert kinds["replay"] == "empty"


@pytest.mark.slow
@pytest.mark.parametrize("name", [HOSTILE.replace("/", "∕"), "..\\..", "%2e%2e", "a\nb", "'; --"])
def test_a_hostile_name_is_only_text(
    tmp_path: Path, datasets: dict[str, xr.Dataset], name: str
) -> None:
    hostile = {
        "calibration.nc": answered(
            datasets["calibration.nc"], {"recording_name": HOSTILE, "warnings": [HOSTILE]}
        )
    }
    folder = make_run(tmp_path / name, hostile, command=HOSTILE, study={HOSTILE: HOSTILE})
    page = report_page(folder)
    assert page["subtitle"] == folder.resolve().name
    assert part_of(page, "warnings")["items"] == [HOSTILE]
    assert part_of(page, "manifest")["command"] == HOSTILE
    assert HOSTILE in part_of(page, "summary")["paragraphs"][1]
    text = report_html(page)
    assert "<script>alert" not in text
    assert text.count("<script") == 2


@pytest.mark.slow
def test_the_report_of_a_default_search_is_quick_and_small(tmp_path: Path) -> None:
    """As many settings, excerpts and bins as `driftwalk calibrate` keeps without any option."""
    search, generator = Study().calibration, np.random.default_rng(7)
    shape = (len(search.drag_coefficients), len(search.force_stds_N))
    assert shape == (41, 41)
    found = synthetic_calibration(points=shape[0]).assign_attrs(kind="calibration")
    # Half a minute at ten pictures a second, of a path as rough as a block's can be.
    walk = generator.normal(0.0, 2e-3, (2, *shape, 301)).cumsum(axis=-1)
    for name, values in zip("xy", np.clip(walk, -0.15, 0.15), strict=True):
        found[f"excerpt_{name}"] = (("drag_coefficient", "force_std", "excerpt_sample"), values)
    found["excerpt_time"] = ("excerpt_sample", 0.1 * np.arange(301))
    x, y = generator.normal(0.0, 1e-3, (2, 18_000)).cumsum(axis=-1)
    recording = build_trajectory(0.1 * np.arange(18_000), x, y, 0 * x)
    parts = {"calibration.nc": found, "flow.nc": bundled_flow(), "recording.nc": recording}
    folder = make_run(tmp_path / "run", parts)
    # Processor time: what else the machine does is not counted.
    begin = time.process_time()
    page = report_page(folder)
    path = write_report(page, tmp_path / "report.html")
    assert time.process_time() - begin < 30.0
    assert 1e6 < path.stat().st_size < 5e6
    assert part_of(page, "map")["cells"]["excerpt_x"]["shape"] == [*shape, 301]
