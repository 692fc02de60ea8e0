"""`driftwalk study recover`: what it prints and writes, that it survives, and what it refuses."""

from __future__ import annotations

import json
import shutil
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, NO_FIGURES, Done, apart, end, here, refusal, start
from redrawn import assert_drawn_alike
from signals_at_units import after_units, go_on, halted

import driftwalk as dw

TRUTH = """\
[forces]
drag_coefficient = 0.4
force_std_N = "0.6mN"
[observation]
position_noise_m = "0.3mm"
orientation_noise_rad = "0.5deg"
[fit]
spline_spacing_m = 0.04
[recover]
flow = "flow/true.csv"
recordings = 2
durations_s = ["1min", 90]
drag_coefficient_precision = 0.1
"""


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("truth")
    (folder / "flow").mkdir()
    shutil.copy(FLOW, folder / "flow" / "true.csv")
    (folder / "truth.toml").write_text(TRUTH, encoding="utf-8")
    return folder / "truth.toml"


def words(truth: Path, folder: Path, *more: object) -> list[object]:
    return ["study", "recover", "--study", truth, "-o", folder, *more]


@pytest.fixture(scope="module")
def finished(truth: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Done]:
    folder = tmp_path_factory.mktemp("recover") / "run"
    return folder, here(*words(truth, folder, "--threads", "1", "--json"))


def recovery(folder: Path) -> xr.Dataset:
    with xr.open_dataset(folder / "recovery.nc", engine="h5netcdf") as dataset:
        return dataset.load()


def assert_same_numbers(first: xr.Dataset, second: xr.Dataset) -> None:
    """Compare bit for bit all but the time that the fits took."""
    for name in set(first.variables) - {"fit_time"}:
        np.testing.assert_array_equal(first[name].values, second[name].values, err_msg=str(name))


def answer(done: Done) -> dict[str, Any]:
    assert done.code == 0, done.err
    found: dict[str, Any] = json.loads(done.out)
    return found


@pytest.mark.slow
def test_json_holds_the_summary(finished: tuple[Path, Done]) -> None:
    found = answer(finished[1])
    assert found["truth"]["drag_coefficient"] == 0.4
    assert found["truth"]["tracking_noise_m"] == pytest.approx(3e-4)
    assert found["truth"]["flow"] == "flow/true.csv"
    assert [part["duration_s"] for part in found["results"]] == [60.0, 90.0]
    stored = recovery(finished[0])
    for index, part in enumerate(found["results"]):
        assert part["recordings"] == 2
        assert part["used"] + part["at_the_wall"] + part["without_fit"] == 2
        errors = stored["force_std_error"].values[index, 0]
        assert part["force_std"]["bias"] == pytest.approx(errors.mean())
        # A minute of 10 Hz: sigma_F is known to 5 to 10 %; some 5 sd.
        assert abs(part["force_std"]["bias"]) < 0.3
    (needed,) = found["needed"]
    assert needed["drag_coefficient_precision"] == 0.1
    low, high = needed["duration_s_interval"]
    assert low < needed["duration_s"] < high
    assert "1 min, 1 min 30 s" in needed["basis"]


@pytest.mark.slow
def test_the_run_directory_is_whole(finished: tuple[Path, Done]) -> None:
    folder = finished[0]
    for name in ("recovery.png", "recovery.svg", "error_by_length.png", "error_by_length.svg"):
        assert (folder / "figures" / name).stat().st_size > 1000
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["seeds"] == {"recovery": 1}
    assert set(manifest["inputs"]) == {"truth", "flow"}
    assert not (folder / ".shards").exists()
    stored = recovery(folder)
    assert stored.attrs["kind"] == "recovery"
    assert stored["drag_coefficient"].dims == ("duration", "angle", "recording")


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.slow
def test_interrupted_and_continued_with_another_number_of_processes(
    truth: Path, finished: tuple[Path, Done], tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    before = NO_FIGURES + after_units(signal.SIGINT, 2)
    done = apart(*words(truth, folder, "--threads", "2"), before=before)
    assert (done.code, done.out) == (130, "")
    assert done.err.endswith("driftwalk: interrupted\n")
    assert "Traceback" not in done.err
    assert not (folder / "manifest.json").exists()
    kept = shards(folder)
    # Ctrl-C keeps what the other process had just finished too.
    assert 2 <= len(kept) < 4
    halting = NO_FIGURES + after_units(signal.SIGSTOP, 1)
    with halted(start(*words(truth, folder, "--threads", "1"), before=halting)) as process:
        # What had been finished is not computed again.
        assert {path: shards(folder)[path] for path in kept} == kept
        assert len(shards(folder)) == len(kept) + 1
        go_on(process)
        assert end(process).code == 0
    assert_same_numbers(recovery(folder), recovery(finished[0]))


def shards(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.glob(".shards/*/[0-9]*.npz")}


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_people_read_a_table_of_random_flows_without_orientation(tmp_path: Path) -> None:
    text = TRUTH.replace('orientation_noise_rad = "0.5deg"\n', "")
    path = tmp_path / "truth.toml"
    path.write_text(f'{text}angle = ["none"]\nflow_speed_m_s = 0.03\n', encoding="utf-8")
    # The option replaces the flow that the file names, and that is not there.
    options = ("--flow", "random", "--threads", "1", "--duration", "60")
    done = here(*words(path, tmp_path / "run", *options))
    assert done.code == 0, done.err
    head = "truth: C_d 0.4, σ_F 0.6 mN every 10 ms, tracking noise 0.3 mm, flow: random, swirl"
    assert head in done.out
    for name in ("C_d", "σ_F", "tracking noise", "flow"):
        assert name in done.out
    assert "angle none: for C_d to 10.0 % (rms) record" in done.out
    assert str(tmp_path / "run" / "recovery.nc") in done.out
    # Done is done.
    assert "--overwrite" in refusal(here(*words(path, tmp_path / "run", *options)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("drag_coefficient = 0.4\n", ""), "the truth lacks [forces] drag_coefficient"),
        (('force_std_N = "0.6mN"\n', ""), "the truth lacks [forces] force_std_N"),
        (("0.6mN", "0mN"), "the truth lacks [forces] force_std_N"),
        (('position_noise_m = "0.3mm"\n', ""), "lacks [observation] position_noise_m"),
        (('orientation_noise_rad = "0.5deg"\n', ""), "lacks [observation] orientation_noise_rad"),
        (('flow = "flow/true.csv"\n', ""), "the flow of the water is missing"),
        (("flow/true.csv", "nowhere.nc"), "nowhere.nc: there is no such file"),
        (("recordings = 2", "recordings = 1"), "[recover] recordings: must be at least 2"),
        (('"1min"', '"3s"'), "the fit needs 100 at least"),
        (("recordings = 2", "recording = 2"), "did you mean 'recordings'"),
        (("[recover]", "[tank]\ndiameter_m = 0.6\n[recover]"), "does not cover the tank"),
    ],
)
def test_mistakes_are_one_line(
    change: tuple[str, str], message: str, truth: Path, tmp_path: Path
) -> None:
    assert change[0] in TRUTH
    wrong = truth.parent / f"{tmp_path.name}.toml"
    wrong.write_text(TRUTH.replace(*change, 1), encoding="utf-8")
    assert message in refusal(here(*words(wrong, tmp_path / "run")))
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--recordings", "1"), "--recordings"),
        (("--duration", "long"), "expected"),
        (("--precision", "2"), "drag_coefficient_precision"),
        (("--precision", "good"), "--precision"),
        (("--flow", "nowhere.nc"), "there is no such file"),
    ],
)
def test_wrong_options_are_one_line(
    options: tuple[str, str], message: str, truth: Path, tmp_path: Path
) -> None:
    assert message in refusal(here(*words(truth, tmp_path / "run", *options)))


@pytest.mark.slow
def test_python_gives_the_same(truth: Path, finished: tuple[Path, Done]) -> None:
    """Not bit for bit: this process may use more threads for its linear algebra."""
    study = dw.apply_overrides(
        dw.load_study(truth), {"recover.durations_s": [60.0], "recover.recordings": 2}
    )
    flow = dw.load_flow(FLOW, arena=study.tank.to_arena())
    found = dw.recovery_study(study, flow)
    stored = recovery(finished[0]).isel(duration=[0], recording=slice(0, 2))
    for name in ("drag_coefficient", "force_std_z", "flow_error", "wall_share"):
        assert found[name].values == pytest.approx(
            stored[name].values, rel=1e-4, abs=1e-9
        )  # threads of BLAS


@pytest.mark.slow
def test_its_figures_are_drawn_again_alike(finished: tuple[Path, Done], tmp_path: Path) -> None:
    assert_drawn_alike(finished[0], tmp_path / "out")
