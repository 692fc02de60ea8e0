"""Films: of blocks that assemble, and of recordings."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from PIL import Image
from synthetic_assembly import ARENA, assembly_end, assembly_path

from driftwalk.core.errors import InputError
from driftwalk.plot import film, write_animation
from driftwalk.plot.film import FRAMES_PER_S
from driftwalk.plot.parts.style import PALETTE
from driftwalk.schema import build_trajectory


@pytest.fixture(scope="module")
def path():
    return assembly_path()


def two_bodies(**attrs: object) -> xr.Dataset:
    """Two bodies for 4 s at 10 Hz: one is still, one is away from 1 s to 3 s."""
    time = np.arange(41) / 10.0
    x = np.column_stack([np.full(41, -0.05), np.full(41, 0.05)])
    x[10:30, 1] = np.nan
    known = {"arena": ARENA, "block_side_m": 0.03, **attrs}
    attributes = {name: value for name, value in known.items() if value is not None}
    return build_trajectory(time, x, 0.0 * x, 0.0 * x, attrs=attributes)


def frames_of(file: Path) -> list[Image.Image]:
    """Return a picture per 80 ms: of equal ones in a row, a GIF holds one that lasts longer."""
    with Image.open(file) as opened:
        found = []
        for number in range(opened.n_frames):
            opened.seek(number)
            found += [opened.convert("RGB")] * round(opened.info["duration"] / 80)
    return found


def pixels(frame: Image.Image, color: str) -> np.ndarray:
    """Return where a frame has about this colour."""
    wanted = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)])
    return np.argwhere(
        np.abs(np.asarray(frame.convert("RGB"), dtype=int) - wanted).max(axis=2) < 12
    )


@pytest.mark.slow
def test_gif_has_its_frames_and_shows_the_blocks_where_they_are(path, tmp_path) -> None:
    file = write_animation(path, tmp_path / "run.gif", seconds=2.0)
    with Image.open(file) as film:
        assert film.n_frames == round(2.0 * FRAMES_PER_S[".gif"])
        assert film.info["duration"] == 80
        assert film.size == (400, 400)
        for frame, time in ((0, 0.0), (24, 300.0)):
            film.seek(frame)
            seen = pixels(film, PALETTE[0])
            sample = round(time)
            blue = path["assembly"].values[0, sample] == 0
            x, y = (100 * path[name].values[0, sample, blue].mean() for name in "xy")
            # 400 pixels; axes over 94 and 90 % of them; the tank of 30 cm and a margin of 3 %.
            per_cm = 0.9 * 400 / (30 * 1.06)
            assert seen.mean(axis=0)[1] == pytest.approx(200 + per_cm * x, abs=2.0)
            assert seen.mean(axis=0)[0] == pytest.approx(400 * (1 - 0.48) - per_cm * y, abs=2.0)
            area = blue.sum() * (3.0 * per_cm) ** 2
            assert 0.8 * area < len(seen) < 1.02 * area


@pytest.mark.slow
def test_a_recording_is_shown_in_real_time_and_a_body_that_is_away_is_not_shown(tmp_path) -> None:
    seen = frames_of(write_animation(two_bodies(), tmp_path / "a.gif", speed=1.0))
    assert len(seen) == 51
    blue, orange = ([len(pixels(frame, PALETTE[body])) for frame in seen] for body in (0, 1))
    assert min(blue) > 500
    # Seen last at 0.9 s and held for three samples more, then away until 3 s.
    times = np.arange(51) * 0.08
    away = (times > 1.3 - 1e-9) & (times < 3.0 - 1e-9)
    assert (np.array(orange)[away] == 0).all()
    assert (np.array(orange)[~away] > 500).all()


def test_speed_shortens_the_film(tmp_path) -> None:
    assert len(frames_of(write_animation(two_bodies(), tmp_path / "a.gif", speed=4.0))) == 13


@pytest.mark.slow
def test_a_block_lies_in_the_picture_as_it_does_in_the_tank(tmp_path) -> None:
    """Turned by 45 degrees, a square is as wide as its diagonal."""
    recording = two_bodies()
    recording["theta"][:, 0] = np.pi / 4.0
    first = frames_of(write_animation(recording, tmp_path / "a.gif", speed=4.0))[0]
    per_cm = 0.9 * 400 / (30 * 1.06)
    for body, width in ((0, 3.0 * np.sqrt(2.0)), (1, 3.0)):
        rows = pixels(first, PALETTE[body])[:, 0]
        assert np.ptp(rows) == pytest.approx(per_cm * width, abs=6.0)


@pytest.mark.slow
@pytest.mark.parametrize("unknown", ["theta", "side"])
def test_without_a_side_or_an_orientation_a_body_is_a_disc(unknown, tmp_path) -> None:
    recording = two_bodies(block_side_m=None if unknown == "side" else 0.03)
    if unknown == "theta":
        recording["theta"][:] = np.nan
    first = frames_of(write_animation(recording, tmp_path / "a.gif", speed=4.0))[0]
    places = pixels(first, PALETTE[0])
    radius = np.ptp(places[:, 0]) / 2.0
    # Where the pointer of an unknown side covers it, the disc is not blue.
    assert np.pi * radius**2 * 0.75 < len(places) < np.pi * (radius + 1.0) ** 2


@pytest.mark.slow
def test_a_tank_that_nobody_knows_is_framed_by_the_motion(tmp_path) -> None:
    first = frames_of(write_animation(two_bodies(arena=None), tmp_path / "a.gif", speed=4.0))[0]
    left, right = (pixels(first, PALETTE[body])[:, 1].mean() for body in (0, 1))
    # 10 cm apart, in a picture of 0.94 x 400 pixels; the frame is 2 x (5.4 + 3) cm.
    assert right - left == pytest.approx(10.0 * 0.9 * 400 / 16.8, abs=12.0)


@pytest.mark.slow
def test_frames_are_told_as_they_are_written(tmp_path: Path) -> None:
    told: list[tuple[int, ...]] = []
    write_animation(
        two_bodies(), tmp_path / "two.gif", seconds=0.8, progress=lambda *now: told.append(now)
    )
    assert told == [(number, 10) for number in range(1, 11)]


def test_what_cannot_be_filmed_is_refused(path) -> None:
    nowhere = two_bodies()
    nowhere["x"][:] = np.nan
    for wrong, message in (
        (lambda: write_animation(path, "run.avi"), "that ends in .gif or .mp4"),
        (lambda: write_animation(path, "run.gif", seconds=0.0), "at least 0.2 s"),
        (lambda: write_animation(path, "run.gif", run=2), "run=2: the dataset has 2 runs"),
        (lambda: write_animation(path, "run.gif", speed=-1.0), "speed must be positive"),
        (lambda: write_animation(path, "run.gif", speed=float("nan")), "speed must be positive"),
        (lambda: write_animation(path, "run.gif", speed=1.0, seconds=1.0), "give one"),
        (lambda: write_animation(path, "run.gif", speed=1e-3), "at least 1 times as fast"),
        (lambda: write_animation(assembly_end(path), "run.gif"), "got assembly"),
        (lambda: write_animation(nowhere, "run.gif"), "nothing to film"),
    ):
        with pytest.raises(InputError, match=message):
            wrong()


def test_a_film_is_whole_or_not_there(path, tmp_path, monkeypatch) -> None:
    with pytest.raises(InputError, match=r"the folder .*nowhere does not exist"):
        write_animation(path, tmp_path / "nowhere" / "run.gif", seconds=0.2)

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(film, "_outlines", stop)
    with pytest.raises(KeyboardInterrupt):
        write_animation(path, tmp_path / "run.gif", seconds=0.2)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_opencv_writes_an_mp4_where_there_is_no_ffmpeg(tmp_path, monkeypatch) -> None:
    cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed: pip install driftwalk[track]")
    monkeypatch.setattr(film.shutil, "which", lambda _name: None)
    file = write_animation(two_bodies(), tmp_path / "a.mp4", speed=4.0)
    video = cv2.VideoCapture(str(file))
    assert video.get(cv2.CAP_PROP_FPS) == 25.0
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 26
    read, first = video.read()
    video.release()
    assert read
    assert first.shape == (800, 800, 3)
    per_cm = 0.9 * 800 / (30 * 1.06)
    wanted = np.array([int(PALETTE[0][at : at + 2], 16) for at in (5, 3, 1)])
    near = np.abs(first.astype(int) - wanted).max(axis=2) < 40
    row, column = np.argwhere(near).mean(axis=0)
    assert column == pytest.approx(400 - per_cm * 5.0, abs=3.0)
    assert row == pytest.approx(800 * (1 - 0.48), abs=3.0)


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_ffmpeg_writes_an_mp4_that_lasts_as_long_as_asked(path, tmp_path: Path) -> None:
    file = write_animation(path, tmp_path / "run.mp4", seconds=2.0)
    told = subprocess.run(["ffmpeg", "-i", str(file)], capture_output=True, text=True, check=False)
    assert "Duration: 00:00:02.00" in told.stderr
    assert "800x800" in told.stderr
    assert "h264" in told.stderr


@pytest.mark.slow
def test_a_run_of_five_minutes_gives_a_small_file(path, tmp_path) -> None:
    assert write_animation(path, tmp_path / "run.gif").stat().st_size < 3_000_000
