"""The page of the notebook, run line by line, and what its calls refuse."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import driftwalk as dw

PAGE = Path(__file__).resolve().parents[2] / "docs" / "tutorials" / "notebook.md"
RECORDING = Path(str(files("driftwalk.datasets") / "tank30_ode_a" / "recording.csv"))
SECONDS = 60.0
# The page is for a real recording and takes minutes; these sizes take seconds.
SMALLER = {
    'rec, model, folder="run/"': 'rec, model, study=SMALL, folder="run/"',
    "runs=1000": 'runs=12, duration="20s"',
}
SMALL = dw.apply_overrides(
    dw.Study(),
    {"calibration.replicates": 1, "calibration.refined_replicates": 1, "calibration.bootstrap": 4},
)


def blocks() -> list[str]:
    return re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the first minute of the bundled recording as track.csv."""
    folder = tmp_path_factory.mktemp("notebook")
    lines = RECORDING.read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines[1:] if float(line.split(",")[0]) <= SECONDS]
    (folder / "track.csv").write_text("\n".join([lines[0], *kept]) + "\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def names(place: Path) -> dict[str, object]:
    """Return the names of the notebook after its last line."""
    found: dict[str, object] = {"SMALL": SMALL}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        for block in blocks():
            for long, short in SMALLER.items():
                block = block.replace(long, short)
            exec(compile(block, str(PAGE), "exec"), found)
    return found


def test_the_page_has_every_line_of_the_notebook() -> None:
    text = "\n".join(blocks())
    for call in (
        *SMALLER,
        "dw.load(",
        "dw.fit(",
        "like=rec",
        "dw.compare(rec, sim)",
        "dw.report([",
    ):
        assert call in text, call


@pytest.mark.slow
def test_the_notebook_runs(names: dict[str, object], place: Path) -> None:
    fit, sim, cal, four = (names[name] for name in ("fit", "sim", "cal", "four"))
    assert isinstance(fit, xr.Dataset)
    assert isinstance(sim, xr.Dataset)
    assert isinstance(cal, xr.Dataset)
    assert isinstance(four, xr.Dataset)
    assert (fit.attrs["kind"], cal.attrs["kind"], four.attrs["kind"]) == (
        "fit",
        "calibration",
        "assembly",
    )
    assert sim.sizes["replicate"] == 8
    assert set(cal["ks_distance"].dims) == {"speed", "tumble_rate"}
    assert (place / "run" / "manifest.json").is_file()
    assert (place / "four" / "manifest.json").is_file()
    assert "Self-assembly" in (place / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_run_directory_resumes_and_is_not_made_twice(
    names: dict[str, object], place: Path
) -> None:
    """Stored work is found again by Python; a finished run is not overwritten silently."""
    rec, model = names["rec"], names["model"]
    before = (place / "run" / "calibration.nc").read_bytes()
    with pytest.raises(dw.RunDirectoryError, match="finished run"):
        dw.calibrate(rec, model, study=SMALL, folder=place / "run")
    assert (place / "run" / "calibration.nc").read_bytes() == before


@pytest.fixture(scope="module")
def recording(place: Path) -> xr.Dataset:
    return dw.load(place / "track.csv", tank="circle:30cm", block="3cm", stop=30.0)


def test_tank_and_block_come_from_the_recording(recording: xr.Dataset) -> None:
    wide = recording.assign_attrs(arena=dw.model.Tank(diameter_m=0.4).to_arena_json())
    assert dw.conditions.study_for([wide]).tank.diameter_m == 0.4
    assert dw.conditions.study_for([recording]).block.side_m == 0.03
    friction = dw.apply_overrides(dw.Study(), {"tank.wall_friction": 1.0})
    settled = dw.conditions.study_for([wide], friction)
    assert (settled.tank.diameter_m, settled.tank.wall_friction) == (0.4, 1.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"tank_diameter": "50cm"}, "0.3 m, and the study says a circle of diameter 0.5 m"),
        ({"side": 0.05}, "a block of side 0.03 m, and the study says 0.05 m"),
        ({"tank_diametre": 0.3}, "no argument 'tank_diametre'; did you mean 'tank_diameter'"),
    ],
)
def test_two_answers_are_an_error(
    recording: xr.Dataset, settings: dict[str, object], words: str
) -> None:
    for call in (dw.fit, dw.calibrate):
        with pytest.raises(dw.InputError, match=re.escape(words)):
            call(recording, **settings)


def test_positions_outside_the_tank_are_refused(place: Path) -> None:
    small = dw.load(place / "track.csv", tank="circle:12cm@0,0", stop=30.0)
    with pytest.raises(dw.InputError, match="of the positions lie outside the tank"):
        dw.fit(small)


def test_recordings_in_two_tanks_are_refused(recording: xr.Dataset) -> None:
    other = recording.assign_attrs(arena=dw.model.Tank(diameter_m=0.4).to_arena_json())
    with pytest.raises(dw.InputError, match="state the tank once"):
        dw.fit([recording, other])


def test_a_simulation_is_in_the_tank_of_its_recording(recording: xr.Dataset) -> None:
    """The block bounces off the wall that the recording has, not off the default study's."""
    narrow = recording.isel(time=slice(0, 600)).assign_attrs(
        arena='{"shape": "circle", "diameter_m": 0.25, "center_m": [0.0, 0.0]}'
    )
    water = dw.uniform_flow(0.08, 0.0)
    run = dw.simulate(dw.Study(), water, like=narrow, replicates=2)
    assert '"diameter_m": 0.25' in run.attrs["arena"]
    # The centre stays half a side from the wall; five sd of the camera's noise come on top.
    assert float(np.hypot(run["x"], run["y"]).max()) < 0.125 - 0.015 + 5 * 3e-4
    stated = dw.apply_overrides(dw.Study(), {"tank.diameter_m": 0.3})
    with pytest.raises(dw.InputError, match="state the tank once"):
        dw.simulate(stated, water, like=narrow)


def test_a_study_needs_a_flow(recording: xr.Dataset) -> None:
    for call in (dw.simulate, dw.assemble):
        with pytest.raises(dw.InputError, match="give `flow`, a flow field or a fit"):
            call(dw.Study())
    with pytest.raises(dw.InputError, match="a study, a fit or a calibration is needed"):
        dw.simulate(recording)


def test_only_a_calibration_of_the_block_simulates_blocks() -> None:
    """A calibration of a user's model has no drag coefficient, and no block."""
    speed = ("speed", [0.1, 0.2], {"units": "m/s", "long_name": "speed"})
    other = xr.Dataset(
        {"ks_distance": ("speed", [0.3, 0.2])},
        {"speed": speed},
        {"kind": "calibration", "model": "tumble"},
    )
    for call in (dw.simulate, dw.assemble):
        with pytest.raises(dw.InputError, match="about the model tumble"):
            call(other, dw.tank30_flow())


def test_replicates_of_the_same_model_are_exchangeable() -> None:
    """A replicate in the place of the recording: p is uniform on 1/9 ... 1.

    With 24 of them, p = 1/9 more than 9 times has a probability below 2e-4.
    """
    study, flow = dw.Study(), dw.tank30_flow()
    time = np.arange(400) * 0.1
    runs = dw.simulate(study, flow, sample_time=time, replicates=24 * 9, seed=5)
    smallest = 0
    for first in range(0, 24 * 9, 9):
        own = runs.isel(replicate=first)
        others = runs.isel(replicate=slice(first + 1, first + 9))
        smallest += float(dw.compare(own, others)["p_value"]) < 1.5 / 9
    assert smallest <= 9


def test_another_model_is_told_from_the_recording() -> None:
    """Twice the force: the recording is the farthest of nine."""
    flow = dw.tank30_flow()
    time = np.arange(6000) * 0.1
    strong = dw.apply_overrides(dw.Study(), {"forces.force_std_N": 1.2e-3})
    weak = dw.apply_overrides(dw.Study(), {"forces.force_std_N": 0.6e-3})
    own = dw.simulate(strong, flow, sample_time=time, replicates=1, seed=1).isel(replicate=0)
    found = dw.compare(own, dw.simulate(weak, flow, sample_time=time, replicates=8, seed=2))
    assert float(found["p_value"]) == pytest.approx(1 / 9)
    assert float(found["mean_ks_distance"]) > 2 * float(found["noise_floor"])


def test_ks_distances_are_those_of_single_comparisons(recording: xr.Dataset) -> None:
    runs = dw.simulate(dw.Study(), dw.tank30_flow(), like=recording, replicates=3, seed=3)
    found = dw.compare(recording, runs)
    single = [
        float(dw.compare(recording, runs.isel(replicate=k), permutations=0)["ks_distance"])
        for k in range(3)
    ]
    assert found["ks_distance"].values.tolist() == single
