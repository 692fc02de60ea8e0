"""`driftwalk export` of motion and figures, and `driftwalk cite`, as a user runs them."""

from __future__ import annotations

import csv
import hashlib
import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, contents, here, refusal
from finished_run import write_finished_run

import driftwalk as dw
from driftwalk.export.data.writers import first_stamp, topics
from driftwalk.record import load, save_trajectory
from driftwalk.schema import body_names, body_track, build_trajectory
from driftwalk.schema.stores.netcdf import netcdf_bytes

EXACT = {"csv": "{}.csv", "trackpy": "{}.trackpy.csv", "movement": "{}.movement.nc"}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_finished_run(tmp_path_factory.mktemp("calibration") / "run")


@pytest.fixture(scope="module")
def blocks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the path of two runs of three blocks, as `driftwalk assemble` stores it."""
    path = dw.assembly_path(
        dw.Study(), dw.tank30_flow(), runs=[0, 1], blocks=3, duration=3.0, sample_interval=0.1
    )
    file = tmp_path_factory.mktemp("assembly") / "path.nc"
    file.write_bytes(netcdf_bytes(path))
    return file


def assert_same(back: xr.Dataset, recording: xr.Dataset, names: Mapping[str, str]) -> None:
    for name in body_names(recording):
        expected = body_track(recording, name)
        if expected.time.size:
            for found, other in zip(body_track(back, names[name]), expected, strict=True):
                np.testing.assert_array_equal(found, other)


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("file", "options"),
    [
        ("formats-2/movement_0.15_sleap.nc", {"keypoint": "thorax", "metres_per_pixel": 1e-3}),
        ("formats-2/trackpy_tracks.csv", {"frame_rate": 25.0, "metres_per_pixel": 1e-6}),
        ("format-vicon/QBii_Square_2m_cw.csv", {}),
        ("tenebrio-ubitrail/tenebrio_ubitrail.csv.gz", {"metres_per_pixel": 1e-3}),
    ],
)
@pytest.mark.parametrize("to", EXACT)
def test_a_real_recording_comes_back_as_it_was(
    file: str,
    options: Mapping[str, Any],
    to: str,
    shared_data: Callable[[str], Path],
    tmp_path: Path,
) -> None:
    """The recordings of others, some with gaps and some with several bodies."""
    folder, _, name = file.partition("/")
    source = shared_data(folder) / name
    recording = load(source, **options).isel(time=slice(2000))
    save_trajectory(recording, tmp_path / "a.nc")
    done = here("export", tmp_path / "a.nc", "--to", to, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    back = load(tmp_path / "out" / EXACT[to].format("a"))
    names = {name: name for name in body_names(recording)}
    # "05" is no number that would be written again.
    if to == "trackpy" and not all(name.isdecimal() and str(int(name)) == name for name in names):
        names = {name: str(number) for number, name in enumerate(names)}
    assert_same(back, recording, names)


@pytest.mark.slow
def test_a_bag_holds_the_poses_to_the_nanosecond(tmp_path: Path) -> None:
    pytest.importorskip("rosbags", reason="rosbags is not installed: pip install driftwalk[ros]")
    time = np.array([-0.5, 0.1, 0.25, 1.0 / 3.0])
    x = np.array([[0.1, np.nan], [1 / 3, 0.2], [np.nan, 0.3], [-0.1, 0.4]])
    theta = np.array([[3.0, np.nan], [-3.0, 0.5], [0.0, np.nan], [1e-9, -0.5]])
    recording = build_trajectory(time, x, -x, theta, body=["robot a", "7"])
    save_trajectory(recording, tmp_path / "a.nc")
    done = here("export", tmp_path / "a.nc", "--to", "ros", "-o", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    notes = " ".join(json.loads(done.out)["notes"])
    assert "/robot_a is robot a, /body_7 is 7" in notes
    assert "2 s are added" in notes
    assert first_stamp(recording) == 2
    back = load(tmp_path / "out" / "a_bag", topic=",".join(topics(recording)))
    for name, topic in zip(["robot a", "7"], ["robot_a", "body_7"], strict=True):
        found, expected = body_track(back, topic), body_track(recording, name)
        np.testing.assert_allclose(found.time - 2.0, expected.time, rtol=0, atol=0.6e-9)
        np.testing.assert_array_equal(found.x, expected.x)
        np.testing.assert_array_equal(found.y, expected.y)
        # A quaternion of doubles holds half of the angle.
        np.testing.assert_allclose(found.theta, expected.theta, rtol=0, atol=1e-15)


@pytest.mark.slow
def test_the_tank_is_said_where_it_is_lost_and_kept_where_it_is_not(tmp_path: Path) -> None:
    recording = dw.tank30_recording().isel(time=slice(50))
    save_trajectory(recording, tmp_path / "a.nc")
    for to in ("csv", "trackpy"):
        done = here("export", tmp_path / "a.nc", "--to", to, "-o", tmp_path / to)
        assert "--tank 0.3@0,0" in done.err
        page = (tmp_path / to / "README.md").read_text()
        (call,) = re.findall(r"`driftwalk\.load\((.*)\)`", page)
        name, tank = re.fullmatch(r'"(.*)", tank="(.*)"', call).groups()
        back = load(tmp_path / to / name, tank=tank)
        np.testing.assert_array_equal(back["x"].values, recording["x"].values)
        assert json.loads(back.attrs["arena"]) == json.loads(recording.attrs["arena"])
    done = here("export", tmp_path / "a.nc", "--to", "movement", "-o", tmp_path / "movement")
    assert done.err == f"next: read {tmp_path / 'movement' / 'README.md'}\n"
    back = load(tmp_path / "movement" / "a.movement.nc")
    assert json.loads(back.attrs["arena"]) == json.loads(recording.attrs["arena"])


def test_a_tank_with_corners_lies_next_to_the_table(tmp_path: Path) -> None:
    corners = [[-0.1, -0.1], [0.2, -0.1], [-0.1, 0.2]]
    arena = json.dumps({"shape": "polygon", "vertices_m": corners})
    recording = build_trajectory([0.0, 0.1], [0.0, 0.01], [0.0, 0.0], attrs={"arena": arena})
    save_trajectory(recording, tmp_path / "a.nc")
    assert here("export", tmp_path / "a.nc", "--to", "csv", "-o", tmp_path / "out").code == 0
    back = load(tmp_path / "out" / "a.csv", tank=f"polygon:{tmp_path / 'out' / 'tank.csv'}")
    np.testing.assert_allclose(json.loads(back.attrs["arena"])["vertices_m"], corners, atol=1e-15)
    np.testing.assert_allclose(back["x"].values, recording["x"].values, rtol=0, atol=1e-16)


def test_movement_itself_reads_its_file(tmp_path: Path) -> None:
    validators = pytest.importorskip(
        "movement.validators.datasets", reason="movement is not installed (114 packages)"
    )
    recording = dw.tank30_recording().isel(time=slice(50))
    save_trajectory(recording, tmp_path / "a.nc")
    here("export", tmp_path / "a.nc", "--to", "movement", "-o", tmp_path / "out")
    with xr.open_dataset(tmp_path / "out" / "a.movement.nc") as read:
        validators.ValidPosesInputs.validate(read)
        x = read["position"].sel(space="x", keypoints="centroid", individuals="0").values
    np.testing.assert_array_equal(x, recording["x"].values[:, 0])


@pytest.mark.slow
def test_every_replicate_of_a_simulation_goes_out(tmp_path: Path) -> None:
    words = ("--flow", FLOW, "--duration", "2s", "--replicates", "3", "-o", tmp_path / "s.nc")
    assert here("simulate", *words).code == 0
    assert here("export", tmp_path / "s.nc", "--to", "csv", "-o", tmp_path / "out").code == 0
    with xr.open_dataset(tmp_path / "s.nc", engine="h5netcdf", decode_times=False) as stored:
        for number in range(3):
            back = load(tmp_path / "out" / f"replicate_{number}.csv")
            np.testing.assert_array_equal(back["x"].values, stored["x"].values[number])
    one = tmp_path / "one"
    assert here("export", tmp_path / "s.nc", "--replicate", "2", "--to", "csv", "-o", one).code == 0
    assert [file.name for file in one.glob("*.csv")] == ["replicate_2.csv"]


@pytest.mark.slow
def test_blocks_that_assemble_go_out_by_run(blocks: Path, tmp_path: Path) -> None:
    assert here("export", blocks, "--to", "trackpy", "-o", tmp_path / "out").code == 0
    with xr.open_dataset(blocks, engine="h5netcdf", decode_times=False) as stored:
        for run in (0, 1):
            back = load(tmp_path / "out" / f"run_{run}.trackpy.csv")
            for name in ("x", "y", "theta"):
                expected = stored[name].sel(run=run).transpose("time", "block").values
                np.testing.assert_array_equal(back[name].values, expected)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["path", "simulation"])
def test_rectangles_keep_shape_and_size_and_are_not_classified(kind: str, tmp_path: Path) -> None:
    raft = dw.Study(block={"shape": "rectangle", "side_m": 0.04, "width_m": 0.02})
    simulated = (
        dw.assembly_path(raft, dw.tank30_flow(), duration=1.0)
        if kind == "path"
        else dw.simulate(raft, dw.tank30_flow(), sample_time=[0.0, 0.1])
    )
    (tmp_path / "raft.nc").write_bytes(netcdf_bytes(simulated))
    done = here("export", tmp_path / "raft.nc", "--to", "movement", "-o", tmp_path / "out")
    assert done.code == 0, done.err
    back = load(next((tmp_path / "out").glob("*.nc")))
    found = {name: back.attrs[f"block_{name}"] for name in ("shape", "side_m", "width_m")}
    assert found == {"shape": "rectangle", "side_m": 0.04, "width_m": 0.02}
    if kind == "path":
        line = refusal(here("classify", tmp_path / "raft.nc"))
        assert "the shape of the bodies is 'rectangle', and only squares are classified" in line


def test_a_film_shows_the_first_of_several_runs_and_says_so(blocks: Path, tmp_path: Path) -> None:
    done = here("export", blocks, "--to", "gif", "--speed", "5", "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert "run_0, the first of 2" in done.err
    assert (tmp_path / "out" / "run_0.gif").stat().st_size > 1000


@pytest.mark.slow
def test_figures_come_with_the_numbers_that_they_draw(run: Path, tmp_path: Path) -> None:
    done = here("export", run, "--to", "svg", "-o", tmp_path / "out")
    assert done.code == 0, done.err
    calibration = xr.open_dataset(run / "calibration.nc", engine="h5netcdf")
    expected = np.sort(calibration["ks_distance"].values.ravel())
    calibration.close()
    drawings = sorted((tmp_path / "out").glob("*.svg"))
    assert drawings
    for drawing in drawings:
        table = drawing.with_suffix(".csv")
        digest = hashlib.sha256(table.read_bytes()).hexdigest()
        assert f"{table.name}, SHA-256 {digest}" in drawing.read_text()
    with (tmp_path / "out" / "ks_map.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    cells = [float(row["value"]) for row in rows if row["kind"] == "QuadMesh" and row["value"]]
    # The map shows 1 - D of each of the 25 settings; its colour bar is another mesh.
    shown = {round(value, 12) for value in cells}
    assert {round(1.0 - value, 12) for value in expected} <= shown


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("{run}", "--to", "csv", "--seed", "1"), "csv has no use for --seed"),
        (("{run}", "--to", "gif", "--speed", "0"), "speed must be positive"),
        (("{run}", "--to", "gif"), "at most 1200 s are written"),
        (("{run}", "--to", "csv", "--replicate", "1"), "a recording, which has no replicates"),
        (("{blocks}", "--to", "csv", "--replicate", "7"), "no run 7"),
        (("{blocks}", "--to", "pdf"), "is not the directory of a finished run"),
        (("nowhere.nc", "--to", "csv"), "does not exist"),
        (("{flow}", "--to", "movement"), "flow"),
    ],
)
def test_what_cannot_be_exported_is_refused(
    words: tuple[str, ...], message: str, run: Path, blocks: Path, tmp_path: Path
) -> None:
    places = {"run": run, "blocks": blocks, "flow": FLOW}
    out = tmp_path / "out"
    said = refusal(here("export", *(word.format(**places) for word in words), "-o", out))
    assert message in said
    assert contents(tmp_path) == {}


@pytest.mark.slow
def test_a_run_says_what_to_cite(run: Path) -> None:
    done = here("cite", run)
    assert done.code == 0, done.err
    assert done.out.startswith("cite      The driftwalk developers, driftwalk: calibrated")
    computed = next(line for line in done.out.splitlines() if line.startswith("computed"))
    manifest = json.loads((run / "manifest.json").read_text())
    assert manifest["inputs"]["recording"]["sha256"][:16] in computed
    assert f"seed calibration {manifest['seeds']['calibration']}" in computed
    assert "Fasano" in done.out
    assert "Wood" not in done.out
    entries = here("cite", run, "--bibtex").out
    assert entries.count("@") == 2
    assert json.loads(here("cite", run, "--json").out)["version"] == dw.__version__


@pytest.mark.slow
def test_what_has_nothing_to_cite_is_refused(tmp_path: Path, blocks: Path) -> None:
    assert "finished run" in refusal(here("cite", tmp_path))
    assert "assembly_path" in refusal(here("cite", blocks))
    assert "neither" in refusal(here("cite", FLOW))
