"""A short calibration from the command line: what it prints, writes and warns of.

The recording is the bundled one, which another engine simulated; the still flow is synthetic.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from command_line import (
    FLOW,
    GRID,
    NO_FIGURES,
    RECORDING,
    Done,
    apart,
    assert_same_bits,
    calibration,
    contents,
    end,
    here,
    leave_out_figures,
    refusal,
    start,
)

import driftwalk
from driftwalk.figures.calibration import ks_map_figure
from driftwalk.plot.parts.style import print_style
from driftwalk.schema.answers.facts import facts_of

FIGURES = (
    *("flow", "trajectory", "steps", "ks_map"),
    *("drag_coefficient_panels", "force_std_panels", "validation"),
)
REQUIRED = (
    *("drag_coefficient", "drag_coefficient_interval", "force_std_N", "force_std_N_interval"),
    *("force_interval_s", "force_noise_intensity_N2_s", "ks_distance", "noise_floor"),
)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("study") / "study.toml"
    path.write_text(GRID, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def finished(study: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Done]:
    """Return a whole run of five minutes of recording, figures and all."""
    folder = tmp_path_factory.mktemp("whole") / "run"
    return folder, here(*words(study, folder, "300s"), "--flow", FLOW, "--json")


def words(study: Path, folder: Path, until: str = "60s") -> list[object]:
    return [
        *("calibrate", RECORDING, "--to", until, "--study", study, "--out", folder),
        *("--threads", "1"),
    ]


@pytest.mark.slow
def test_json_holds_the_answer_with_its_intervals(finished: tuple[Path, Done]) -> None:
    done = finished[1]
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert set(REQUIRED) <= set(found)
    for name in ("drag_coefficient", "force_std_N"):
        low, high = found[f"{name}_interval"]
        assert low <= found[name] <= high
    assert found["confidence"] == 0.9
    intensity = found["force_std_N"] ** 2 * found["force_interval_s"]
    assert found["force_noise_intensity_N2_s"] == pytest.approx(intensity)
    stored = calibration(finished[0])
    for name in ("drag_coefficient", "force_std_N", "noise_floor", "ks_distance"):
        assert found[name] == facts_of(stored)[name]
    assert 0 < found["noise_floor"] < found["ks_distance"] < 0.5
    # The estimate is the lowest point of the stored surface, to half a step of its grid.
    surface = stored["refined_surface"]
    lowest = surface.isel(surface.argmin(surface.dims))
    for name, key in (("drag_coefficient", "drag_coefficient"), ("force_std", "force_std_N")):
        axis = surface[f"refined_{name}"].values
        assert found[key] == pytest.approx(
            lowest[f"refined_{name}"].item(), abs=0.51 * np.diff(axis).max()
        )
    assert (found["duration_s"], found["recording_pairs"]) == (300.0, 2999)
    assert found["recording"] == "recording.csv"
    assert isinstance(found["warnings"], list)


@pytest.mark.slow
def test_the_run_directory_is_complete(finished: tuple[Path, Done]) -> None:
    folder = finished[0]
    figures = {f"figures/{name}.{kind}" for name in FIGURES for kind in ("png", "svg")}
    results = {"calibration.nc", "flow.nc", "recording.nc", "manifest.json", ".lock", "figures"}
    assert set(contents(folder)) == figures | results
    for name in FIGURES:
        png = (folder / "figures" / f"{name}.png").read_bytes()
        assert png.startswith(b"\x89PNG\r\n\x1a\n")
        assert png.endswith(b"IEND\xaeB`\x82")
        assert ET.parse(folder / "figures" / f"{name}.svg").getroot().tag.endswith("svg")


@pytest.mark.slow
def test_the_manifest_says_how_the_run_came_about(finished: tuple[Path, Done], study: Path) -> None:
    folder = finished[0]
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    text = json.dumps(manifest)
    assert driftwalk.__version__ in text
    assert manifest["seeds"] == {"calibration": 1}
    assert manifest["study"]["calibration"]["bootstrap"] == 10
    assert manifest["study"]["forces"]["force_interval_s"] == 0.01
    for file in (RECORDING, FLOW, study):
        assert hashlib.sha256(file.read_bytes()).hexdigest() in text
    assert manifest["started_utc"] <= manifest["finished_utc"]
    listed = {entry["path"]: entry for entry in manifest["files"]}
    for name, entry in listed.items():
        content = (folder / name).read_bytes()
        assert entry["sha256"] == hashlib.sha256(content).hexdigest()
    assert {"calibration.nc", "flow.nc", "figures/ks_map.svg"} <= set(listed)
    assert any("machine" in key or "platform" in key for key in manifest)


@pytest.mark.slow
def test_the_calibration_has_units_and_no_missing_cell(finished: tuple[Path, Done]) -> None:
    found = calibration(finished[0])
    units = {"drag_coefficient": "1", "force_std": "N", "ks_distance": "1", "excerpt_x": "m"}
    units |= {"ks_step_length": "m", "ks_turning_angle": "rad", "recording_step_length": "m"}
    units |= {"step_length_edge": "m", "turning_angle_edge": "rad", "bootstrap_force_std": "N"}
    assert {name: found[name].attrs["units"] for name in units} == units
    assert found["ks_distance"].shape == (5, 5)
    assert np.isfinite(found["ks_distance"]).all()
    assert np.isfinite(found["refined_ks_distance"]).all()
    assert (found["status"] == 0).all()
    assert facts_of(found)["force_std_N"] == json.loads(finished[1].out)["force_std_N"]


@pytest.mark.slow
def test_a_finished_run_is_kept_as_it_is(finished: tuple[Path, Done], study: Path) -> None:
    folder = finished[0]
    before = contents(folder)
    line = refusal(here(*words(study, folder, "300s"), "--flow", FLOW))
    assert "holds a finished run" in line
    assert "--overwrite" in line
    assert contents(folder) == before


@pytest.fixture(scope="module")
def undrawn_run(study: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Done]:
    """Return a run of a minute without figures, and what it printed."""
    folder = tmp_path_factory.mktemp("undrawn") / "run"
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        done = here(*words(study, folder), "--flow", FLOW)
    assert done.code == 0, done.err
    return folder, done


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_overwrite_moves_the_finished_run_aside(
    undrawn_run: tuple[Path, Done], study: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    shutil.copytree(undrawn_run[0], folder)
    first = contents(folder)
    assert here(*words(study, folder), "--flow", FLOW, "--overwrite", "--seed", "2").code == 0
    kept = list((folder / "previous").iterdir())
    assert len(kept) == 1
    moved = contents(kept[0])
    assert {name: moved[name] for name in first if name != ".lock"} == {
        name: data for name, data in first.items() if name != ".lock"
    }
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["seeds"] == {"calibration": 2}
    # A mistake after that takes nothing away.
    before = contents(folder)
    refusal(here(*words(study, folder), "--flow", FLOW, "--overwrite", "--body", "z"))
    assert contents(folder) == before


@pytest.mark.slow
def test_no_force_is_printed_without_its_interval(undrawn_run: tuple[Path, Done]) -> None:
    done = undrawn_run[1]
    lines = [line for line in done.out.splitlines() if "σ_F" in line and "mN" in line]
    assert len(lines) == 1
    assert re.search(r"\d mN, redrawn every 10 ms   90 % interval [\d.]+ to [\d.]+$", lines[0])
    assert "N² s" in done.out
    assert "noise floor" in done.out
    assert "simulated by another engine" not in done.out


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
@pytest.mark.parametrize("how", [["--bootstrap", "0"], ["--study", "coarse"]])
def test_a_force_without_bootstrap_says_that_it_has_no_interval(
    how: list[str], study: Path, tmp_path: Path
) -> None:
    coarse = tmp_path / "coarse.toml"
    coarse.write_text(f'{GRID}refine = "none"\n', encoding="utf-8")
    options = [coarse if word == "coarse" else word for word in how]
    done = here(*words(study, tmp_path / "run"), "--flow", FLOW, *options)
    assert done.code == 0
    line = next(line for line in done.out.splitlines() if "stochastic force" in line)
    assert line.endswith("no interval without a bootstrap")
    found = json.loads(here("info", tmp_path / "run", "--json").out)
    assert found["force_std_N_interval"] is None


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_options_go_over_the_study_and_flow_formats_agree(study: Path, tmp_path: Path) -> None:
    netcdf = tmp_path / "flow.nc"
    driftwalk.save_flow(driftwalk.tank30_flow(), netcdf)
    options = ["--force-interval", "16ms", "--depth", "archimedes", "--json"]
    results = []
    for flow in (FLOW, netcdf):
        folder = tmp_path / flow.suffix[1:]
        done = here(*words(study, folder), "--flow", flow, *options)
        assert done.code == 0, done.err
        found = json.loads(done.out)
        assert found["force_interval_s"] == 0.016
        assert found["time_step_s"] == 0.008
        assert found["wetted_depth_m"] == pytest.approx(0.0116 / (1000 * 0.03**2))
        results.append(calibration(folder))
    assert_same_bits(*results)


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_the_field_that_driftwalk_flow_wrote_is_taken(study: Path, tmp_path: Path) -> None:
    field = tmp_path / "flow.nc"
    taken = ["flow", RECORDING, "--tank", "30cm", "--to", "60s", "--out", field]
    assert here(*taken).code == 0
    first, second = tmp_path / "first", tmp_path / "second"
    assert here(*words(study, first), "--flow", field).code == 0
    assert here(*words(study, second)).code == 0
    # The same field as calibrate takes from the recording by itself, but for the halves.
    found = [calibration(folder) for folder in (first, second)]
    halves = [name for name in found[0].variables if "_half_" in str(name)]
    assert len(halves) == 3
    told = ["warning", "verdict", "verdict_reason"]
    assert_same_bits(*(item.drop_vars([*halves, *told]) for item in found))
    given, own = ([*item["warning"].values, *item["verdict_reason"].values] for item in found)
    assert [text for text in own if not text.startswith("the flow was taken from")] == given


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_an_optimum_at_the_edge_and_a_bad_fit_are_warned_of(study: Path, tmp_path: Path) -> None:
    narrow = tmp_path / "narrow.toml"
    text = GRID.replace("drag_coefficient_min = 0.2", "drag_coefficient_min = 0.8")
    narrow.write_text(
        text.replace("drag_coefficient_max = 0.6", "drag_coefficient_max = 1.1"), encoding="utf-8"
    )
    run = tmp_path / "run"
    done = here(*words(narrow, run, "120s"), "--flow", FLOW)
    assert done.code == 0
    assert "  the optimum lies at the edge of the grid: drag" in done.out
    assert "verdict                cannot tell:" in done.out
    reasons = calibration(run)["verdict_reason"].values.tolist()
    assert any("edge of the grid" in text for text in reasons)


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_setting_in_which_nothing_moves_has_distance_1_and_is_hatched(tmp_path: Path) -> None:
    """A block at rest in still water, without a force: nothing can move it."""
    resting = tmp_path / "resting.csv"
    header, *rows = RECORDING.read_text(encoding="utf-8").splitlines()[:601]
    pose = rows[0].split(",", 1)[1]
    early = [f"{0.1 * k:.1f},{pose}" for k in range(100)]
    late = [f"{float(row.split(',')[0]) + 10:.1f},{row.split(',', 1)[1]}" for row in rows]
    resting.write_text("\n".join([header, *early, *late]), encoding="utf-8")
    still = tmp_path / "still.csv"
    nodes = np.linspace(-0.15, 0.15, 16)
    lines = [f"{x:.4f},{y:.4f},0,0" for y in nodes for x in nodes]
    still.write_text("\n".join(["x,y,u,v", *lines]), encoding="utf-8")
    study = tmp_path / "study.toml"
    text = GRID.replace('force_std_min_N = "0.2mN"', "force_std_min_N = 0")
    text = text.replace("drag_coefficient_min = 0.2", "drag_coefficient_min = 0")
    study.write_text(text, encoding="utf-8")
    run = tmp_path / "run"
    done = here("calibrate", resting, "--flow", still, "--study", study, "--out", run)
    assert done.code == 0, done.err
    found = calibration(run)
    rest = found.sel(force_std=0.0)
    assert (rest["ks_distance"] == 1.0).all()
    masks = dict(
        zip(
            found["status"].attrs["flag_meanings"].split(),
            found["status"].attrs["flag_masks"],
            strict=True,
        )
    )
    assert ((rest["status"] & masks["no_motion"]) != 0).all()
    assert ((found.sel(force_std=slice(1e-5, None))["status"] & masks["no_motion"]) == 0).all()
    with print_style():
        ks_map_figure(found).savefig(tmp_path / "ks_map.svg")
    svg = (tmp_path / "ks_map.svg").read_text(encoding="utf-8")
    assert svg.count('<g id="no motion (D = 1)">') >= found.sizes["drag_coefficient"]


# In processes of their own: what depends on the terminal, the threads and the instruction set.

CHATTY = (
    "from driftwalk.cli.terminal.progress import ProgressReporter\n"
    "ProgressReporter.__init__.__kwdefaults__['seconds_between_lines'] = 0.0\n"
)


@pytest.mark.slow
def test_threads_and_instruction_sets_do_not_change_a_bit(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    options = ["--flow", FLOW, "--threads"]
    assert apart(*words(study, first)[:-2], *options, 1, before=NO_FIGURES).code == 0
    monkeypatch.setenv("DRIFTWALK_INSTRUCTION_SET", "baseline")
    assert apart(*words(study, second)[:-2], *options, 2, before=NO_FIGURES).code == 0
    assert_same_bits(calibration(first), calibration(second))
    sets = [
        json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        for folder in (first, second)
    ]
    assert '"baseline"' in json.dumps(sets[1])
    if '"baseline"' in json.dumps(sets[0]):
        pytest.skip("this processor has the baseline's instructions only")


@pytest.mark.slow
def test_progress_through_a_pipe_is_plain_lines(study: Path, tmp_path: Path) -> None:
    started = words(study, tmp_path / "run")
    done = apart(*started, "--flow", FLOW, before=NO_FIGURES + CHATTY)
    assert done.code == 0
    lines = [line for line in done.err.splitlines() if line.startswith("calibrate: ")]
    assert len(lines) > 5
    assert all(re.fullmatch(r"calibrate: \d+ %(, [\w ]+ left)?: [\w ]+", line) for line in lines)
    shares = [int(line.split()[1]) for line in lines]
    assert shares == sorted(shares)
    assert shares[-1] == 100
    assert "\x1b" not in done.err


# On a fast machine the whole run takes no longer than a user's bar waits before it judges.
JUDGES_AT_ONCE = (
    "import driftwalk.cli.terminal.progress as progress\nprogress.SECONDS_TO_JUDGE = 0.1\n"
)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals of POSIX")
def test_progress_on_a_terminal_is_a_bar_with_the_time_left(study: Path, tmp_path: Path) -> None:
    import os
    import pty

    master, slave = pty.openpty()
    process = start(
        *words(study, tmp_path / "run", "120s"),
        *("--flow", FLOW),
        before=NO_FIGURES + JUDGES_AT_ONCE,
        stderr=slave,
        stdin=subprocess.DEVNULL,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
    )
    os.close(slave)
    parts = []
    while True:
        try:
            part = os.read(master, 65536)
        except OSError:  # what Linux gives when the other end has closed
            break
        if not part:
            break
        parts.append(part)
    os.close(master)
    assert end(process).code == 0
    seen = b"".join(parts).decode()
    assert "\x1b" in seen
    assert "━" in seen
    assert re.search(r"\d+ %", seen)
    assert re.search(r"\d+ s left", seen), seen[-3000:]
