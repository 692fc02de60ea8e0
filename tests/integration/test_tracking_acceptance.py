"""How well tracking has to work, on short versions of the videos of studies/tracking.

The bars are those of docs/validation.md. The scores that they are measured with are held against
cases counted by hand.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import xarray as xr
from command_line import apart, here

import driftwalk as dw
from driftwalk.record import save_trajectory
from driftwalk.schema import build_trajectory

pytest.importorskip("cv2")

STUDY = Path(__file__).resolve().parents[2] / "studies" / "tracking"
TANK = ("--tank", "30cm")
NAN = float("nan")
FRAMES = 1000
FIRST_FRAMES = f"""\
import itertools
from driftwalk.track.frames import VideoFile
whole = VideoFile.__iter__
VideoFile.__iter__ = lambda self: itertools.islice(whole(self), {FRAMES})
"""


@pytest.fixture(scope="module", autouse=True)
def _study_on_the_path() -> Iterator[None]:
    sys.path.insert(0, str(STUDY))
    yield
    sys.path.remove(str(STUDY))


@pytest.fixture(scope="module")
def scenes() -> ModuleType:
    return import_module("scenes")


@pytest.fixture(scope="module")
def scores() -> ModuleType:
    return import_module("score")


def still(x: list[list[float]], ambiguous: list[list[float]] | None = None) -> xr.Dataset:
    """Return a recording of bodies on the x axis, with errors of 1 mm and 0.01 rad stated."""
    at = np.array(x)
    found = build_trajectory(0.1 * np.arange(len(at)), at, 0.0 * at, 0.0 * at)
    marks = np.zeros_like(at) if ambiguous is None else np.array(ambiguous)
    covariance = np.broadcast_to([1e-6, 0.0, 1e-6, 0.0, 0.0, 1e-4], (*at.shape, 6))
    return found.assign(
        visible=(("time", "body"), np.ones_like(at)),
        ambiguous=(("time", "body"), marks),
        covariance=(("time", "body", "part"), covariance),
    )


TRUE = [[-0.05, 0.05]] * 4


def test_the_score_of_a_recording_that_is_right_but_for_known_errors(scores: ModuleType) -> None:
    """1 mm in x everywhere: as large as is stated in x, nothing in y and theta."""
    tracked = still([[0.051, -0.049]] * 3 + [[NAN, -0.049]])
    found = scores.score(tracked, still(TRUE))
    assert found["swaps"] == found["false"] == 0
    assert found["lost"] == 1
    assert found["recall"] == found["recall_visible"] == 7 / 8
    assert found["position_rms_mm"] == pytest.approx(1.0)
    assert found["position_rms_per_axis_mm"] == pytest.approx(1.0 / np.sqrt(2.0))
    assert found["x_bias_mm"] == pytest.approx(1.0)
    assert (found["z_x"], found["z_theta"]) == (pytest.approx(1.0), 0.0)
    assert found["z_total"] == pytest.approx(np.sqrt(1.0 / 3.0))


def test_a_measurement_that_shows_nothing_is_false_and_takes_no_block(scores: ModuleType) -> None:
    found = scores.score(still([[-0.05, 0.1], *TRUE[1:]]), still(TRUE))
    assert (found["false"], found["lost"], found["swaps"]) == (1, 1, 0)


EXCHANGED = [TRUE[0], TRUE[0], [0.05, -0.05], [0.05, -0.05]]


@pytest.mark.parametrize(
    ("marks", "unmarked", "unmarked_at_sample"),
    [
        ([[0, 0], [0, 0], [0, 0], [0, 0]], 2, 2),
        ([[0, 0], [0, 0], [0.1, 0], [0, 0]], 1, 1),
        ([[0.5, 0.5], [0.5, 0.5], [0, 0], [0.5, 0.5]], 2, 2),
        ([[0, 0], [0, 0], [0.1, 0.1], [0, 0]], 0, 0),
    ],
)
def test_exchanges_are_counted_and_so_are_those_without_a_mark(
    scores: ModuleType, marks: list[list[float]], unmarked: int, unmarked_at_sample: int
) -> None:
    found = scores.score(still(EXCHANGED, marks), still(TRUE))
    assert found["swaps"] == 2
    assert (found["unmarked"], found["unmarked_at_sample"]) == (unmarked, unmarked_at_sample)


def test_a_mark_while_nothing_is_seen_counts(scores: ModuleType) -> None:
    tracked = still(
        [TRUE[0], [NAN, NAN], [0.05, -0.05], [0.05, -0.05]], [[0, 0], [0.5, 0.5], [0, 0], [0, 0]]
    )
    found = scores.score(tracked, still(TRUE))
    assert (found["swaps"], found["unmarked"], found["unmarked_at_sample"]) == (2, 0, 2)


def run_driftwalk(*words: object) -> dict:
    """Run a command with --json."""
    done = here(*words, "--json")
    assert done.code == 0, done.err
    return json.loads(done.out)


def filmed(scenes: ModuleType, folder: Path, set_name: str, seed: int, frames: int) -> tuple:
    """Draw, teach and track; return the recording's file, the motion and the truth."""
    scene = scenes.Scene(set_name, seed)
    motion = scenes.motion_of(scene).isel(time=slice(0, frames))
    video = dw.write_video(folder / "video.mkv", motion, scene.settings)
    markers = folder / "markers.toml"
    taught = here("markers", "teach", video, *TANK, "--side", "3cm", "-o", markers)
    assert taught.code == 0, taught.err
    out = folder / "recording.nc"
    words = ("--markers", markers, *TANK, "--bodies", scene.bodies, "-o", out)
    assert run_driftwalk("track", video, *words)["frames"] == frames
    video.unlink()
    return out, motion, dw.video_truth(motion, scene.settings)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [301])
def test_four_blocks_with_moderate_noise(
    scenes: ModuleType, scores: ModuleType, tmp_path: Path, seed: int
) -> None:
    """Measured: 0.018 mm, 0.10 degrees, all samples."""
    out, _, truth = filmed(scenes, tmp_path, "moderate", seed, 40)
    found = scores.score(xr.load_dataset(out), truth)
    assert found["position_rms_mm"] <= 0.15
    assert found["angle_rms_deg"] <= 0.5
    assert found["recall"] >= 0.995
    assert found["swaps"] == found["false"] == 0
    assert 0.5 < found["z_total"] < 2.0


@pytest.mark.study
@pytest.mark.parametrize("seed", [302])
def test_four_blocks_with_heavy_noise(
    scenes: ModuleType, scores: ModuleType, tmp_path: Path, seed: int
) -> None:
    """With moderate noise in every run."""
    out, _, truth = filmed(scenes, tmp_path, "heavy", seed, 40)
    found = scores.score(xr.load_dataset(out), truth)
    assert found["recall_visible"] >= 0.95
    assert found["unmarked"] == 0


@pytest.mark.study
def test_a_fit_of_tracked_poses_is_that_of_the_true_ones(
    scenes: ModuleType, scores: ModuleType, tmp_path: Path
) -> None:
    """The poses themselves are scored by `test_four_blocks_with_moderate_noise` in every run."""
    out, motion, truth = filmed(scenes, tmp_path, "closed-loop", 301, 200)
    errors = scores.score(xr.load_dataset(out), truth)
    sizes = 1e-3 * errors["position_sd_per_axis_mm"], np.radians(errors["angle_sd_deg"])
    loop = import_module("closed_loop")
    true = save_trajectory(loop.with_noise(motion, *sizes, seed=1), tmp_path / "true.nc")
    tracked_fit, true_fit = (
        run_driftwalk(
            *("fit", file, *TANK, "--law", "paper", "--no-check", "--spline-spacing", "4cm"),
            *("-o", tmp_path / file.stem),
        )
        for file in (out, true)
    )
    for name in ("drag_coefficient", "force_std_N"):
        assert tracked_fit[name] == pytest.approx(true_fit[name], rel=0.03)
    assert tracked_fit["tracking_noise_m"] == pytest.approx(sizes[0], rel=0.2, abs=0.02e-3)


@pytest.mark.slow
def test_the_mouse_beside_its_published_track(
    shared_data: Callable[[str], Path], tmp_path: Path
) -> None:
    """Half a minute of the video; its background, though, is that of all of it.

    The study tracks all of it: of the last 6,000 frames four are stale, the picture before again.
    """
    folder = shared_data("tracktor-mouse-termite")
    out = tmp_path / "recording.nc"
    words = ("--markers", "blob", "--scale", "500px/m", "--bodies", "1", "-o", out)
    done = apart("track", folder / "mouse_video.mp4", *words, before=FIRST_FRAMES)
    assert done.code == 0, done.err
    rows = (folder / "mouse_video_tracked.csv").read_text(encoding="utf-8").splitlines()
    published = tmp_path / "published.csv"
    published.write_text("\n".join([*rows[: FRAMES + 1], ""]), encoding="utf-8")
    found = import_module("mouse").beside_published(out, published)
    assert found["frames_published"] == found["frames"] == FRAMES
    assert found["lost"] == found["far"] == 0
    assert found["median_px"] <= 5.0
