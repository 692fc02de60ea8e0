"""`driftwalk report`, from the command that makes a run to the document, for every kind of run.

The recording is the bundled one, which another engine simulated.
"""

from __future__ import annotations

import json
import re
import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, RECORDING, Done, calibration, contents, here, refusal
from page_reading import page_in, part_of, values

from driftwalk.page import decode_array, report_html

TANK = ("--tank", "30cm")
DOCS = Path(__file__).parents[3] / "docs"
TRUTH = """\
[forces]
drag_coefficient = 0.4
force_std_N = 6e-4
force_interval_s = 0.01

[observation]
position_noise_m = "0.3mm"
orientation_noise_rad = "0.5deg"

[fit]
spline_spacing_m = 0.03
angle = "given"

[recover]
recordings = 2
durations_s = [60.0]
flow = "random"
"""

pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture(scope="module")
def run(calibrated_minute: tuple[Path, Done]) -> Path:
    folder, done = calibrated_minute
    # The run says what to do next.
    assert f"driftwalk report {folder} -o report.html" in done.out
    return folder


def report_of(source: Path, out: Path, *more: object) -> dict[str, Any]:
    """Make a report and return the data in it."""
    done = here("report", source, "--out", out, *more)
    assert done.code == 0, done.err
    assert re.fullmatch(rf"report  {re.escape(str(out))}, [\d.]+ MB\n", done.out)
    return page_in(out.read_text(encoding="utf-8"))


def kinds_of(page: dict[str, Any]) -> dict[str, str]:
    return {part["id"]: part["kind"] for part in page["sections"]}


@pytest.mark.slow
def test_a_calibration(run: Path, tmp_path: Path) -> None:
    before = contents(run)
    page = report_of(run, tmp_path / "report.html")
    assert contents(run) == before
    kinds = kinds_of(page)
    assert "empty" not in kinds.values()
    assert {"trajectory", "flow", "map", "lines", "table", "manifest"} <= set(kinds.values())
    found = calibration(run).transpose("force_std", "drag_coefficient", ...)
    part = part_of(page, "map")
    np.testing.assert_array_equal(
        values(part["value"]), found["ks_distance"].values.astype(np.float32)
    )
    excerpt = part["cells"]["excerpt_x"]
    np.testing.assert_allclose(
        values(excerpt), found["excerpt_x"].values, rtol=0, atol=0.5001 * excerpt["step"]
    )
    assert part["cells"]["excerpt_x"]["step"] <= 1e-4
    np.testing.assert_allclose(
        values(part["cells"]["density"]),
        found["step_density"].values,
        atol=0.5001 * part["cells"]["density"]["step"],
    )
    recording = xr.load_dataset(run / "recording.nc", engine="h5netcdf")
    np.testing.assert_allclose(
        values(part_of(page, "recording-1")["x"]), recording["x"].values[:, 0], atol=1e-5
    )
    text = " ".join(part_of(page, "summary")["paragraphs"])
    drag = float(found["estimate"].sel(parameter="drag_coefficient"))
    assert f"C_d = {drag:.4g} (90 % interval" in text
    assert part_of(page, "manifest")["inputs"][0]["name"] == "recording.csv"


@pytest.mark.slow
def test_a_report_is_made_quickly_and_always_the_same(run: Path, tmp_path: Path) -> None:
    # Processor time: what else the machine does is not counted.
    begin = time.process_time()
    report_of(run, tmp_path / "a.html")
    assert time.process_time() - begin < 30.0
    report_of(run, tmp_path / "b.html")
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


@pytest.mark.slow
def test_the_example_of_the_docs_reads_it(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    report_of(run, tmp_path / "report.html")
    monkeypatch.chdir(tmp_path)
    text = (DOCS / "reference" / "page-data.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    exec(text.split("```python\n")[1].split("```")[0], names)
    np.testing.assert_array_equal(
        names["values"], calibration(run)["ks_distance"].values.T.astype(np.float32)
    )
    np.testing.assert_array_equal(decode_array(names["array"]), names["values"])


@pytest.mark.slow
def test_a_fit(tmp_path: Path) -> None:
    made = here(
        *("fit", RECORDING, "--to", "60s", *TANK, "--spline-spacing", "4cm", "--no-check"),
        *("--angle", "none", "--out", tmp_path / "fit"),
    )
    assert made.code == 0, made.err
    assert made.out.endswith(f"driftwalk report {tmp_path / 'fit'} -o report.html\n")
    page = report_of(tmp_path / "fit", tmp_path / "report.html")
    kinds = kinds_of(page)
    assert kinds["flow"] == "flow"
    assert kinds["check"] == "empty"
    fit = xr.load_dataset(tmp_path / "fit" / "fit.nc", engine="h5netcdf")
    np.testing.assert_allclose(values(part_of(page, "flow")["u"]), fit["u"].values, rtol=1e-6)


@pytest.fixture(scope="module")
def assembled(run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("assembled") / "four"
    made = here(
        *("assemble", run, "--runs", "20", "--duration", "60s", "--threads", "1"),
        *("--film", "none", "--out", folder),
    )
    assert made.code == 0, made.err
    return folder


@pytest.mark.slow
def test_self_assembly(assembled: Path, tmp_path: Path) -> None:
    page = report_of(assembled, tmp_path / "report.html")
    kinds = kinds_of(page)
    assert "empty" not in kinds.values()
    assert {"classes", "class_times", "replay"} <= set(kinds.values())
    path = xr.load_dataset(assembled / "path.nc", engine="h5netcdf")
    runs = xr.load_dataset(assembled / "assembly.nc", engine="h5netcdf")
    replay = part_of(page, "replay")
    assert len(replay["runs"]) == 4
    for index, one in enumerate(replay["runs"]):
        np.testing.assert_allclose(
            values(one["x"]), path["x"].values[index].T, atol=0.51 * one["x"]["step"]
        )
        np.testing.assert_array_equal(values(one["assembly"]), path["assembly"].values[index].T)
        joined = int(runs["event_count"][index])
        exact = runs["event_time"].values[index, :joined]
        assert [event["time"] for event in one["events"]] == exact.tolist()
    names = [series["name"] for series in part_of(page, "classes")["series"]]
    assert names == ["parameters found", "parameters drawn"]


@pytest.mark.slow
def test_a_sensitivity_analysis(run: Path, tmp_path: Path) -> None:
    made = here(
        *("sensitivity", run, "--runs", "15", "--realisations", "3", "--duration", "60s"),
        *("--vary", "drag-coefficient=0.2:1:0.4", "--vary", "force-std=0.2mN,1mN"),
        *("--threads", "1", "--out", tmp_path / "map"),
    )
    assert made.code == 0, made.err
    page = report_of(tmp_path / "map", tmp_path / "report.html")
    kinds = kinds_of(page)
    assert "empty" not in kinds.values()
    found = xr.load_dataset(tmp_path / "map" / "sensitivity.nc", engine="h5netcdf")
    found = found.transpose("force_std", "drag_coefficient", ...)
    part = part_of(page, "l1")
    np.testing.assert_allclose(values(part["value"]), found["l1_distance"].values, rtol=1e-6)
    np.testing.assert_allclose(values(part["shares"]), found["proportion"].values, rtol=1e-6)


@pytest.mark.slow
def test_a_recovery_study(tmp_path: Path) -> None:
    (tmp_path / "truth.toml").write_text(TRUTH, encoding="utf-8")
    made = here(
        *("study", "recover", "--study", tmp_path / "truth.toml", "--threads", "1"),
        *("--out", tmp_path / "recover"),
    )
    assert made.code == 0, made.err
    page = report_of(tmp_path / "recover", tmp_path / "report.html")
    found = xr.load_dataset(tmp_path / "recover" / "recovery.nc", engine="h5netcdf")
    part = part_of(page, "estimates-drag-coefficient")
    exact = found["drag_coefficient"].values.ravel()
    np.testing.assert_allclose(values(part["series"][0]["y"]), exact)


def test_a_recording(tmp_path: Path) -> None:
    page = report_of(RECORDING, tmp_path / "report.html", "--to", "60s", *TANK)
    assert page["title"] == "Recording"
    part = part_of(page, "recording-1")
    exact = np.loadtxt(RECORDING, delimiter=",", skiprows=1, max_rows=601)
    np.testing.assert_allclose(values(part["x"]), exact[:, 1], atol=1e-5)
    assert part["arena"]["diameter_m"] == 0.3


def test_a_trajectory_file(run: Path, tmp_path: Path) -> None:
    page = report_of(run / "recording.nc", tmp_path / "report.html")
    assert part_of(page, "recording-1")["kind"] == "trajectory"


@pytest.mark.slow
def test_a_simulation(tmp_path: Path) -> None:
    """The first replicate, and the page says that nobody measured it."""
    simulation = tmp_path / "sim.nc"
    made = here(
        *("simulate", "--flow", FLOW, "--duration", "5s", "--replicates", "2", "-o", simulation)
    )
    assert made.code == 0, made.err
    page = report_of(simulation, tmp_path / "report.html")
    part = part_of(page, "recording-1")
    with xr.open_dataset(simulation, engine="h5netcdf") as stored:
        first = stored.isel(replicate=0, body=0).load()
    np.testing.assert_allclose(values(part["x"]), first["x"], atol=1e-5)
    assert part["arena"]["diameter_m"] == 0.3
    assert any("simulated" in text for text in part_of(page, "warnings")["items"])
    line = refusal(here("report", simulation, "-o", tmp_path / "r.html", *TANK))
    assert "--tank: for a recording" in line


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "report.html"
    (tmp_path / "folder").mkdir()
    assert "is not a run directory" in refusal(here("report", tmp_path / "folder", "-o", out))
    assert "does not exist" in refusal(here("report", tmp_path / "nowhere", "-o", out))
    assert "folder" in refusal(here("report", FLOW, "-o", tmp_path / "no" / "report.html"))
    assert not out.exists()


def test_options_of_reading_are_for_recordings(run: Path, tmp_path: Path) -> None:
    line = refusal(here("report", run, "-o", tmp_path / "r.html", "--from", "5s", *TANK))
    assert "--from, --tank: for a recording" in line


@pytest.mark.slow
def test_another_file_is_not_replaced_unless_asked(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "report.html"
    out.write_text("mine", encoding="utf-8")
    assert "exists already" in refusal(here("report", run, "-o", out))
    assert out.read_text(encoding="utf-8") == "mine"
    assert report_of(run, out, "--overwrite")["title"] == "Calibration"


@pytest.mark.slow
def test_another_ending_is_refused(run: Path, tmp_path: Path) -> None:
    assert "ends in .html" in refusal(here("report", run, "-o", tmp_path / "report.pdf"))


def test_an_unfinished_run_is_told_on_stderr_and_in_the_page(run: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    stored = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
    record = {key: stored[key] for key in ("specification", "fingerprint", "started_utc")}
    (folder / ".run.json").write_text(json.dumps(record), encoding="utf-8")
    shutil.copy(run / "flow.nc", folder)
    done = here("report", folder, "-o", tmp_path / "report.html")
    assert done.code == 0
    assert done.err.startswith("driftwalk: This run is not finished.")
    page = page_in((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert page["state"]["finished"] is False
    assert part_of(page, "flow")["kind"] == "flow"
    assert part_of(page, "summary")["kind"] == "empty"


@pytest.mark.slow
def test_a_run_in_which_settings_failed_shows_why(run: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(run, folder)
    found = calibration(run)
    found["status"][0, 0], found["status"][1, 1] = 1, 6
    found["ks_distance"][1, 1] = np.nan
    found.to_netcdf(folder / "calibration.nc", engine="h5netcdf")
    part = part_of(report_of(folder, tmp_path / "report.html"), "map")
    assert part["statuses"] == {"1": "no motion (D = 1)", "6": "not finite, too few steps"}
    assert np.isnan(values(part["value"])[1, 1])


@pytest.mark.slow
def test_a_hostile_run_adds_nothing_to_the_document(run: Path, tmp_path: Path) -> None:
    text = "</script><script>alert(1)</script>"
    folder = tmp_path / text.replace("/", "∕") / "'\"><b>"
    shutil.copytree(run, folder)
    stored = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    stored["command"] = text
    stored["inputs"][text] = {"path": f"../{text}", "sha256": text}
    (folder / "manifest.json").write_text(json.dumps(stored), encoding="utf-8")
    found = calibration(run).assign_attrs(recording_name=text)
    found.to_netcdf(folder / "calibration.nc", engine="h5netcdf")
    out = tmp_path / "report.html"
    page = report_of(folder, out)
    assert page["subtitle"] == "'\"><b>"
    assert part_of(page, "manifest")["command"] == text
    document = out.read_text(encoding="utf-8")
    assert document == report_html(page)
    assert "alert(1)</script>" not in document
    assert document.count("<script") == 2
