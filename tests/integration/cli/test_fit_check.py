"""`driftwalk fit` asks at its end whether the model explains the recording."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import RECORDING, Done, here
from redrawn import assert_drawn_alike

import driftwalk as dw
from driftwalk.schema.answers.facts import facts_of

SHORT = ("--to", "150", "--spline-spacing", "3cm", "--force-interval", "16ms")
STUDIES = Path(__file__).resolve().parents[3] / "studies" / "real"
FIGURES = ("check_innovations", "check_map", "check_time", "check_steps")


@pytest.mark.slow
def test_json_says_whether_the_model_explains_it(fitted: tuple[Path, Done]) -> None:
    assert fitted[1].code == 0, fitted[1].err
    found = json.loads(fitted[1].out)
    assert found["verdict"] == "explains"
    assert found["verdict_reasons"] == []
    # Two halves of a short recording: a distance is of the size of its floor, within a factor.
    assert 0.0 < found["ks_distance"] < 4.0 * found["ks_noise_floor"] < 1.0


@pytest.mark.slow
def test_the_check_is_written_with_its_figures(fitted: tuple[Path, Done]) -> None:
    folder = fitted[0]
    for name in FIGURES:
        assert (folder / "figures" / f"{name}.png").stat().st_size > 1000
        assert (folder / "figures" / f"{name}.svg").stat().st_size > 1000
    with xr.open_dataset(folder / "check.nc", engine="h5netcdf") as stored:
        assert stored.attrs["kind"] == "model_check"
        assert stored["verdict"] == "explains"
        assert stored.attrs["ks_distance"] == json.loads(fitted[1].out)["ks_distance"]
        assert stored["x"].attrs["units"] == "m"


@pytest.mark.slow
def test_people_are_told_and_the_check_can_be_left_out(tmp_path: Path) -> None:
    done = here("fit", RECORDING, *SHORT, "-o", tmp_path / "run", "--no-check")
    assert done.code == 0, done.err
    assert "verdict                not checked\n" in done.out
    assert not (tmp_path / "run" / "check.nc").exists()
    assert not (tmp_path / "run" / "figures" / "check_map.png").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_recording_that_is_not_explained_gets_the_reasons(tmp_path: Path) -> None:
    """The bundled recording by a camera that is jolted: one second in ten is a millimetre off."""
    generator = np.random.default_rng(2)
    offset = 1.5e-3 * generator.normal(size=(2, 1000))
    lines = RECORDING.read_text(encoding="utf-8").splitlines()
    first = next(k for k, line in enumerate(lines) if line[:1].isdigit())
    for k in range(first, min(first + 1500, len(lines))):
        cells = lines[k].split(",")
        time = float(cells[0])
        if time % 10.0 < 1.0:
            for column in (1, 2):
                moved = float(cells[column]) + offset[column - 1, int(time // 10.0)]
                cells[column] = f"{moved:.6f}"
        lines[k] = ",".join(cells)
    path = tmp_path / "jolted.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    done = here("fit", path, *SHORT, "-o", tmp_path / "run")
    assert done.code == 0, done.err
    assert "verdict                does not explain:" in done.out
    assert "excess kurtosis" in done.out
    assert "noise floor" in done.out


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_check_that_cannot_be_made_says_so_and_the_fit_is_kept(tmp_path: Path) -> None:
    """Synthetic: a body that rests, but for a jump in every eighth of 110 intervals."""
    generator = np.random.default_rng(1)
    spread = np.where(np.arange(110) % 8 == 0, 5e-3, 1e-6)[:, None]
    places = np.cumsum(spread * generator.normal(size=(110, 2)), axis=0)
    rows = [f"{0.1 * k:.1f},{x:.7f},{y:.7f}" for k, (x, y) in enumerate(places)]
    path = tmp_path / "jumps.csv"
    path.write_text("\n".join(["t_s,x_m,y_m", *rows]), encoding="utf-8")
    # Under the law of a floating body the search finds a drag for the jumps.
    how = ("--law", "paper", "--spline-spacing", "3cm", "-o", tmp_path / "run")
    done = here("fit", path, *how)
    assert done.code == 0, done.err
    lines = done.out.splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith("verdict"))
    assert lines[at].endswith("cannot tell:")
    assert "the model cannot be checked: the fit used" in lines[at + 1]
    assert not (tmp_path / "run" / "check.nc").exists()
    found = json.loads(here("fit", path, *how, "--overwrite", "--json").out)
    assert found["verdict"] == "cannot tell"
    assert found["verdict_reasons"] == [found["check_left_out"]]
    assert found["check_left_out"] in lines[at + 1]
    with xr.open_dataset(tmp_path / "run" / "fit.nc", engine="h5netcdf") as stored:
        assert stored.attrs["check_left_out"] == found["check_left_out"]
        assert not np.isfinite(facts_of(stored)["drag_coefficient_interval"][1])
    assert found["drag_coefficient"] is None  # the recording does not determine it
    assert here("report", tmp_path / "run", "-o", tmp_path / "page.html").code == 0
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert found["check_left_out"] in page


@pytest.mark.study
@pytest.mark.usefixtures("no_figures")
def test_a_robot_that_drives_itself_is_not_explained(
    shared_data: Callable[[str], Path], tmp_path: Path
) -> None:
    """A real recording: no truth, but an answer, its flow and a verdict.

    In every run: `test_a_recording_that_is_not_explained_gets_the_reasons`.
    """
    name = "destab_driveA_100pc_0_noisevar_10_randdur_600.csv"
    recording = shared_data("smarticles-rattling") / name
    study = STUDIES / "smarticles.toml"
    words = ("--study", study, "--to", "120", "-o", tmp_path / "run", "--json")
    done = here("fit", recording, *words)
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["verdict"] == "does not explain"
    assert any("excess kurtosis" in text for text in found["verdict_reasons"])
    # Where the noise of the track is not determined, no steps are simulated.
    floor = found["ks_noise_floor"]
    assert floor is None or found["ks_distance"] > 3.0 * floor
    assert 0.0 < found["force_std_N"] < np.inf
    assert np.isfinite(dw.load_flow(tmp_path / "run" / "flow.nc")["u"].values).all()


@pytest.mark.slow
def test_its_figures_are_drawn_again_alike(fitted: tuple[Path, Done], tmp_path: Path) -> None:
    assert_drawn_alike(fitted[0], tmp_path / "out")
