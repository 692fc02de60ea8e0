"""Real recordings of other people's trackers, and the bundled simulated one."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from driftwalk.cli.main import main
from driftwalk.core.errors import InputError
from driftwalk.record import describe, estimate_tracking_noise, fit_circle, load, save_trajectory
from driftwalk.schema import body_names, body_track

SharedData = Callable[[str], Path]
PX = ["--scale", "1mm"]
CASES: dict[str, tuple[str, str, list[str], int, int]] = {
    # name: folder, file, options, bodies, samples
    "tank30": ("tank30-ode-a", "recording.csv", [], 1, 18001),
    "rummynose": (
        "rummynose-single-epfl",
        "rummy_single_seven_trajectories.txt",
        ["--fps", "25", "--scale", "0.75mm", "--max-speed", "2"],
        1,
        106087,
    ),
    "smarticles": (
        "smarticles-rattling",
        "destab_driveA_100pc_0_noisevar_10_randdur_600.csv",
        PX,
        3,
        18018,
    ),
    "smarticles two drives": (
        "smarticles-rattling",
        "driveA&B_33-35_srate_0.3_randinit_1_noisevar_0_gaitdur_600_numinits_1.csv",
        PX,
        3,
        28821,
    ),
    "tenebrio": (
        "tenebrio-ubitrail",
        "tenebrio_ubitrail.csv.gz",
        ["--scale", "0.48mm"],
        6,
        162136,
    ),
    "mouse": (
        "tracktor-mouse-termite",
        "mouse_video_tracked.csv",
        [*PX, "--fps", "30"],
        1,
        10000,
    ),
    "mouse toxtrac": (
        "tracktor-mouse-termite",
        "mouse_video_toxtracked.txt",
        [*PX, "--fps", "30"],
        1,
        9405,
    ),
    "mouse idtracker": (
        "tracktor-mouse-termite",
        "mouse_video_idtracked.txt",
        [*PX, "--fps", "30"],
        1,
        9999,
    ),
    "termites": (
        "tracktor-mouse-termite",
        "termite_video_tracked.csv",
        [*PX, "--fps", "60"],
        8,
        22392,
    ),
    "termites toxtrac": (
        "tracktor-mouse-termite",
        "termite_video_toxtracked.txt",
        [*PX, "--fps", "60"],
        8,
        21560,
    ),
    "termites idtracker": (
        "tracktor-mouse-termite",
        "termite_video_idtracked.txt",
        [*PX, "--fps", "60"],
        8,
        22326,
    ),
    "flume": (
        "tracktor-mouse-termite",
        "flume_video_tracked.csv",
        [*PX, "--fps", "30"],
        1,
        4616,
    ),
    "hexbug": (
        "hexbug-gatech",
        "training_video1-centroid_data",
        [*PX, "--fps", "30"],
        1,
        24352,
    ),
    "supersmarticle": (
        "supersmarticle-sr19",
        ".",
        ["--x", "x.csv", "--y", "y.csv", "--theta", "theta.csv", "--fps", "120"],
        5,
        72005,
    ),
    "trajr": ("trajr-walks", "3537.csv", PX, 1, 1469),
    "trajr DLTdv": ("trajr-walks", "096xypts.csv", [*PX, "--fps", "50"], 1, 2030),
    "swistrack": (
        "format-swistrack",
        "ParticleSimulation_Particles.txt",
        ["--fps", "25"],
        10,
        10320,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_info_and_read(
    case: str, shared_data: SharedData, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, file, options, bodies, samples = CASES[case]
    recording = str(shared_data(folder) / file)
    assert main(["info", recording, *options, "--json"]) == 0
    described = json.loads(capsys.readouterr().out)
    assert len(described["bodies"]) == bodies
    assert sum(body["samples"] for body in described["bodies"].values()) == samples
    assert described["counts"]["samples"] == samples
    assert main(["info", recording, *options]) == 0
    out = tmp_path / "out.nc"
    assert main(["read", recording, "-o", str(out), *options]) == 0
    capsys.readouterr()
    converted = load(out)
    table = load(save_trajectory(converted, tmp_path / "out.csv"))
    for name in body_names(converted):
        for found, expected in zip(
            body_track(table, name), body_track(converted, name), strict=True
        ):
            np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("name", ["recording.csv", "recording_second_seed.csv"])
def test_tracking_noise_of_the_bundled_recordings(name: str) -> None:
    path = files("driftwalk.datasets") / "tank30_ode_a" / name
    found = estimate_tracking_noise(body_track(load(str(path))))
    assert found.position_noise_m == pytest.approx(3e-4, rel=0.05)
    assert found.orientation_noise_rad == pytest.approx(np.radians(0.5), rel=0.05)
    assert abs(found.position_noise_m - 3e-4) < 4.0 * found.position_noise_standard_error_m


@pytest.mark.slow
def test_no_tracking_noise_is_seen_where_there_is_none() -> None:
    path = files("driftwalk.datasets") / "tank30_ode_a" / "without_tracking_noise.csv"
    found = estimate_tracking_noise(body_track(load(str(path))))
    assert found.position_noise_m < 0.05e-3
    assert found.orientation_noise_rad < np.radians(0.05)


@pytest.mark.parametrize("name", ["recording.csv", "recording_second_seed.csv"])
def test_circle_of_the_centres_in_a_tank_of_30_cm(name: str) -> None:
    """The block cannot be farther out than 13.4 cm, and rarely lies flat against the wall."""
    track = body_track(load(str(files("driftwalk.datasets") / "tank30_ode_a" / name)))
    fit = fit_circle(track.x, track.y)
    assert np.hypot(fit.center_x, fit.center_y) < 6e-3
    assert 0.125 < fit.radius < np.sqrt(0.15**2 - 0.015**2) - 0.015 + 1e-3
    attrs = load(str(files("driftwalk.datasets") / "tank30_ode_a" / name), tank="circle:0.3").attrs
    assert json.loads(attrs["origin_shift_m"]) == [0.0, 0.0]


def test_the_fish_tank_is_found(shared_data: SharedData) -> None:
    path = shared_data("rummynose-single-epfl") / "rummy_single_seven_trajectories.txt"
    dataset = load(path, frame_rate=25.0, metres_per_pixel=1.0, max_speed=2700.0, tank="fit")
    found = json.loads(dataset.attrs["arena_found"])
    # The folder's notes: outermost track radius about 335 pixels.
    assert found["radius_of_centers_m"] == pytest.approx(338.0, abs=6.0)
    assert found["sectors_visited_share"] == 1.0


def test_the_same_mouse_through_three_trackers(shared_data: SharedData) -> None:
    folder = shared_data("tracktor-mouse-termite")
    options: dict[str, Any] = {"frame_rate": 30.0, "metres_per_pixel": 1e-3}
    tracktor = load(folder / "mouse_video_tracked.csv", **options)
    idtracker = load(folder / "mouse_video_idtracked.txt", **options)
    count = idtracker.sizes["time"]
    away = np.hypot(
        tracktor["x"].values[:count] - idtracker["x"].values,
        tracktor["y"].values[:count] - idtracker["y"].values,
    )
    assert float(np.nanmedian(away)) < 0.005  # pixels of 1 mm: five pixels


@pytest.mark.slow
def test_what_the_files_do_not_hold_is_asked_for(shared_data: SharedData) -> None:
    fish = shared_data("rummynose-single-epfl") / "rummy_single_seven_trajectories.txt"
    with pytest.raises(InputError, match="`frame_rate`"):
        load(fish, metres_per_pixel=1e-3)
    with pytest.raises(InputError, match="`metres_per_pixel`"):
        load(fish, frame_rate=25.0)
    table = shared_data("trajr-walks") / "3537.csv"
    with pytest.raises(InputError, match="does not name the unit of its positions"):
        load(table)
    walk = load(table, length_unit="m")
    assert any("is the unit" in text for text in describe(walk)["warnings"])
