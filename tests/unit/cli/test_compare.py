"""`driftwalk compare` on recordings and simulations."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from driftwalk.cli.main import main
from driftwalk.comparison import ks_distance, steps
from driftwalk.record import load
from driftwalk.schema import body_track

BUNDLED = files("driftwalk.datasets") / "tank30_ode_a"
FIRST, SECOND = (str(BUNDLED / name) for name in ("recording.csv", "recording_second_seed.csv"))
STEPS = ["step_length", "turning_angle"]


def result_of(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    assert main(["compare", *arguments, "--json"]) == 0
    values: dict[str, object] = json.loads(capsys.readouterr().out)
    return values


@pytest.fixture(scope="module")
def synthetic(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A synthetic recording of two bodies, and a synthetic simulation of two replicates."""
    folder = tmp_path_factory.mktemp("synthetic")
    walks = np.cumsum(np.random.default_rng(5).normal(0, 0.01, (2, 2, 400)), axis=-1)
    lines = ["t,x_m,y_m,body"]
    for body, (x, y) in zip("pq", walks, strict=True):
        lines += [f"{k / 10},{x[k]!r},{y[k]!r},{body}" for k in range(400)]
    recording = folder / "two.csv"
    recording.write_text("\n".join(lines).replace("np.float64(", "").replace(")", ""))
    dims = ("replicate", "time", "body")
    data = {name: (dims, walks[:, i, :, None]) for i, name in enumerate("xy")}
    data["theta"] = (dims, np.zeros((2, 400, 1)))
    simulation = xr.Dataset(
        {**data, "status": ("replicate", np.zeros(2, np.int32))},
        coords={"time": np.arange(400) / 10, "body": np.array(["block"], dtype=object)},
        attrs={"kind": "simulation"},
    )
    path = folder / "sim.nc"
    simulation.to_netcdf(path, engine="h5netcdf")
    return {"recording": recording, "simulation": path}


def test_distance_is_that_of_the_steps(capsys: pytest.CaptureFixture[str]) -> None:
    values = result_of([FIRST, SECOND, "--permutations", "0"], capsys)
    points = [
        np.column_stack([steps(load(path))[name].values for name in STEPS])
        for path in (FIRST, SECOND)
    ]
    assert values["ks_distance"] == pytest.approx(ks_distance(*points), rel=1e-12)
    assert values["p_value"] is None
    assert values["step_interval_s"] == pytest.approx(0.1)


def test_a_recording_is_at_no_distance_from_itself(capsys: pytest.CaptureFixture[str]) -> None:
    values = result_of([FIRST, FIRST, "--permutations", "0", "--step-interval", "500ms"], capsys)
    assert values["ks_distance"] == 0.0
    assert values["step_interval_s"] == 0.5


def test_recording_and_simulation(
    synthetic: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    recording, simulation = str(synthetic["recording"]), str(synthetic["simulation"])
    quiet = ["--permutations", "0"]
    same = result_of([recording, simulation, "--body", "q", "--replicate", "1", *quiet], capsys)
    other = result_of([recording, simulation, "--body", "q", *quiet], capsys)
    bodies = result_of([recording, recording, "--body", "p", "--body-b", "q", *quiet], capsys)
    assert same["ks_distance"] == 0.0
    assert other["ks_distance"] == bodies["ks_distance"] != 0.0


@pytest.mark.slow
def test_comparison_is_written(
    tmp_path: Path, synthetic: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "comparison.nc"
    simulation = str(synthetic["simulation"])
    arguments = [simulation, simulation, "--permutations", "9", "--out", str(path)]
    assert main(["compare", *arguments]) == 0
    assert "ks_distance" in capsys.readouterr().out
    with xr.open_dataset(path, engine="h5netcdf") as stored:
        assert stored.attrs["kind"] == "comparison"
        assert float(stored["ks_distance"]) == 0.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{recording}", "{recording}"], "name one with --body"),
        (["{recording}", "{recording}", "--body", "z"], "no such body"),
        (["{simulation}", "{simulation}", "--replicate", "2"], "no replicate 2; it has 2"),
        (["{recording}", "/nowhere.csv", "--body", "p"], "/nowhere.csv: there is no such file"),
        (["{simulation}", "{simulation}", "--step-interval", "2h"], "choose another step interval"),
        (["{simulation}", "{simulation}", "--ties", "loose"], "--ties"),
    ],
)
def test_mistakes_are_one_line(
    arguments: list[str],
    words: str,
    synthetic: dict[str, Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    paths = {name: str(path) for name, path in synthetic.items()}
    assert main(["compare", *(text.format(**paths) for text in arguments)]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_damaged_simulation_is_refused(
    tmp_path: Path, synthetic: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "damaged.nc"
    path.write_bytes(synthetic["simulation"].read_bytes()[:1000])
    assert main(["compare", str(path), str(synthetic["simulation"])]) == 2
    assert "damaged.nc" in capsys.readouterr().err


def test_replicates_of_a_simulation_are_trajectories(synthetic: dict[str, Path]) -> None:
    from driftwalk.cli.inputs.recordings import load_motion
    from driftwalk.cli.options.recording import RecordingOptions

    motion = load_motion(synthetic["simulation"], RecordingOptions(replicate=1))
    assert motion.attrs["kind"] == "trajectory"
    assert body_track(motion).x.size == 400
