"""Studies of real recordings, and quick calibrations with them on reduced grids."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from driftwalk.cli.main import main
from driftwalk.model import Study, apply_overrides, load_study

SharedData = Callable[[str], Path]
STUDIES = Path(__file__).resolve().parents[2] / "studies" / "real"
RECORDINGS = {
    "rummynose": ("rummynose-single-epfl", "rummy_single_seven_trajectories.txt"),
    "smarticles": (
        "smarticles-rattling",
        "destab_driveA_100pc_0_noisevar_10_randdur_600.csv",
    ),
    "tenebrio": ("tenebrio-ubitrail", "tenebrio_ubitrail.csv.gz"),
    "mouse": ("tracktor-mouse-termite", "mouse_video_tracked.csv"),
    "termite": ("tracktor-mouse-termite", "termite_video_tracked.csv"),
    "hexbug": ("hexbug-gatech", "training_video1-centroid_data"),
}


def reduced(study: Study, *, cells: int) -> Study:
    """Return the study with few settings over the same range, and a short bootstrap."""
    grid = study.calibration
    drag = (grid.drag_coefficient_max - grid.drag_coefficient_min) / cells
    force = (grid.force_std_max_N - grid.force_std_min_N) / cells
    return apply_overrides(
        study,
        {
            "calibration.drag_coefficient_step": drag,
            "calibration.force_std_step_N": force,
            "calibration.replicates": 1,
            "calibration.refined_drag_coefficient_step": drag / 4,
            "calibration.refined_force_std_step_N": force / 4,
            "calibration.refined_replicates": 2,
            "calibration.bootstrap": 10,
        },
    )


def calibrate(
    recording: Path, study: Study, folder: Path, capsys: pytest.CaptureFixture[str], *options: str
) -> dict[str, Any]:
    """Calibrate by command line and return what ``--json`` prints."""
    file = folder / "study.toml"
    file.write_text(study.to_toml(), encoding="utf-8")
    run = [str(recording), "--study", str(file), "-o", str(folder / "run"), "--threads", "1"]
    code = main(["calibrate", *run, *options, "--json"])
    printed = capsys.readouterr()
    assert code == 0, printed.err
    found: dict[str, Any] = json.loads(printed.out)
    return found


def assert_consistent(found: dict[str, Any], study: Study, folder: Path) -> None:
    grid = study.calibration
    assert 0.0 < found["ks_distance"] < 1.0
    assert 0.0 < found["noise_floor"] < 0.5
    assert found["distance_to_floor_ratio"] == pytest.approx(
        found["ks_distance"] / found["noise_floor"]
    )
    for key, least, most in (
        ("drag_coefficient", grid.drag_coefficient_min, grid.drag_coefficient_max),
        ("force_std_N", grid.force_std_min_N, grid.force_std_max_N),
    ):
        low, high = found[f"{key}_interval"]
        assert least <= low <= found[key] <= high <= most
    assert found["force_noise_intensity_N2_s"] == pytest.approx(
        found["force_std_N"] ** 2 * found["force_interval_s"]
    )
    far = found["ks_distance"] > max(2.0 * found["noise_floor"], found["noise_floor_upper"])
    assert not (far and found["verdict"] == "explains")
    assert (folder / "run" / "figures" / "force_std_panels.png").stat().st_size > 0


@pytest.mark.parametrize("name", RECORDINGS)
def test_the_block_is_a_cube_of_water_and_its_ranges_hold_the_estimates(name: str) -> None:
    study = load_study(STUDIES / f"{name}.toml")
    assert study.block.mass_kg == pytest.approx(1000.0 * study.block.side_m**3, rel=1e-4)
    assert study.wetted_depth_m == study.block.side_m
    assert len(study.calibration.drag_coefficients) == 41
    assert len(study.calibration.force_stds_N) == 41


@pytest.mark.slow
@pytest.mark.parametrize("name", RECORDINGS)
def test_a_flow_field_is_extracted_with_every_study(
    name: str, shared_data: SharedData, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, file = RECORDINGS[name]
    study = STUDIES / f"{name}.toml"
    out = tmp_path / "flow.nc"
    recording = str(shared_data(folder) / file)
    assert main(["flow", recording, "--study", str(study), "-o", str(out), "--json"]) == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert "warning" not in found, found.get("warning")
    assert found["samples_used"] > 2000
    assert 0.25 < found["measured_share"] <= 1.0


@pytest.mark.slow
def test_calibrate_a_termite(
    shared_data: SharedData, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, file = RECORDINGS["termite"]
    study = reduced(load_study(STUDIES / "termite.toml"), cells=5)
    found = calibrate(shared_data(folder) / file, study, tmp_path, capsys)
    assert_consistent(found, study, tmp_path)
    # Every 0.1 s of 46.6 s, two ends without a pair.
    assert found["recording_pairs"] == 465
    assert found["duration_s"] == pytest.approx(46.63, abs=0.01)
    # A block that is not driven stops: chance alone moves a body that walks by itself.
    assert found["force_std_N"] > 0.2 * study.calibration.force_std_max_N


@pytest.mark.study
def test_calibrate_a_smarticle(
    shared_data: SharedData, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A termite in every run."""
    folder, file = RECORDINGS["smarticles"]
    study = reduced(load_study(STUDIES / "smarticles.toml"), cells=5)
    recording = shared_data(folder) / file
    found = calibrate(recording, study, tmp_path, capsys, "--body", "2", "--to", "100")
    assert_consistent(found, study, tmp_path)
    assert found["duration_s"] == pytest.approx(100.0, abs=0.2)
    assert found["step_interval_s"] == 0.2
    # Dry friction stops it within a tenth of its length: far beyond any body in water.
    assert found["drag_coefficient"] > 5.0
    assert math.isclose(found["wetted_depth_m"], study.block.side_m)
