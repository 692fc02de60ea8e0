"""From images of a board to poses: a bent lens and a tilted camera, on the command line."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from command_line import Done, here, refusal

import driftwalk as dw

cv2 = pytest.importorskip("cv2")

from drawn_blocks import marker_of, moving_blocks  # noqa: E402

WIDTH, HEIGHT, FOCAL = 480, 360, 500.0
MIDDLE = np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2])
TILTED = dw.video_settings(
    "moderate",
    width_px=WIDTH,
    height_px=HEIGHT,
    px_per_m=1080.0,
    centre_px=(243.0, 172.0),
    rotation_rad=0.1,
    tilt_x_per_m=0.35,
    tilt_y_per_m=-0.2,
    lens_k1=-0.12,
    lens_k2=0.05,
)
SQUARE, COLUMNS, ROWS = 0.03, 8, 6
TAG = 0.022
# How a board is held before the camera: turned [rad], at a place [m].
HELD = [
    ((0.45, 0.0, 0.1), (-0.03, 0.0, 0.40)),
    ((-0.4, 0.3, 0.0), (0.03, 0.02, 0.39)),
    ((0.1, -0.5, 0.2), (0.02, -0.02, 0.40)),
    ((0.3, 0.4, -0.2), (0.0, 0.02, 0.38)),
    ((-0.2, -0.3, 0.4), (0.0, -0.01, 0.42)),
]


RAYS = np.stack(
    np.meshgrid(
        *(((np.arange(n)[:, None] + np.arange(-1, 2) / 3).ravel()) for n in (WIDTH, HEIGHT))
    ),
    axis=-1,
).reshape(-1, 2)


@cache
def straight_rays() -> np.ndarray:
    """Return `straight` of nine points in each pixel of an image."""
    return straight(RAYS)


def straight(pixels: np.ndarray) -> np.ndarray:
    """Return pixels without the lens's distortion, by Newton's method on the radius."""
    bent = pixels - MIDDLE
    radius = np.hypot(*bent.T) / WIDTH
    without = radius.copy()
    for _ in range(8):
        square = without**2
        off = without * (1 + TILTED.lens_k1 * square + TILTED.lens_k2 * square**2) - radius
        without -= off / (1 + 3 * TILTED.lens_k1 * square + 5 * TILTED.lens_k2 * square**2)
    return bent * np.divide(without, radius, out=np.ones_like(radius), where=radius > 0)[:, None]


def water(pixels: np.ndarray) -> np.ndarray:
    """Return the places on the water [m] that pixels show: inverse of what the settings state."""
    return water_of(straight(pixels))


def water_of(without: np.ndarray) -> np.ndarray:
    """Return the places on the water [m] of pixels without distortion, from the middle."""
    ray = without + MIDDLE - np.array(TILTED.centre_px)
    a, b = ray[:, 0] / TILTED.px_per_m, -ray[:, 1] / TILTED.px_per_m
    depth = 1 / (1 - TILTED.tilt_x_per_m * a - TILTED.tilt_y_per_m * b)
    cos, sin = np.cos(TILTED.rotation_rad), np.sin(TILTED.rotation_rad)
    return np.stack([cos * a + sin * b, cos * b - sin * a], axis=-1) * depth[:, None]


def held(without: np.ndarray, turn: tuple, place: tuple) -> np.ndarray:
    """Return the places on a board that is held before the camera [m], x and y from its middle."""
    rays = np.column_stack([without / FOCAL, np.ones(len(without))])
    rotation, _ = cv2.Rodrigues(np.array(turn))
    back, direction = rotation.T @ np.array(place), rays @ rotation
    seen = (direction * (back[2] / direction[:, 2])[:, None] - back)[:, :2]
    return seen * [1, -1]


def pattern(kind: str) -> np.ndarray:
    """Return the board from above, 20 pixels a square, as OpenCV or a loop draws it."""
    if kind == "charuco":
        tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
        board = cv2.aruco.CharucoBoard((COLUMNS, ROWS), SQUARE, TAG, tags)
        return board.generateImage((20 * COLUMNS, 20 * ROWS))
    row, column = np.indices((ROWS, COLUMNS))
    return np.kron(np.where((row + column) % 2 == 0, 30, 225), np.ones((20, 20))).astype(np.uint8)


def picture(kind: str, places_of, *, seed: int) -> np.ndarray:
    """Return an image of a board with blur and noise, nine rays a pixel."""
    places = places_of(straight_rays())
    board = pattern(kind)
    at = np.floor((places * [1, -1] / SQUARE + [COLUMNS / 2, ROWS / 2]) * 20).astype(int)
    on = ((at >= 0) & (at < [20 * COLUMNS, 20 * ROWS])).all(axis=1)
    grey = np.full(len(places), 225.0)
    grey[on] = board[at[on, 1], at[on, 0]]
    grey = grey.reshape(HEIGHT, 3, WIDTH, 3).mean(axis=(1, 3))
    grey = cv2.GaussianBlur(grey, (0, 0), 0.8)
    grey += np.random.default_rng(seed).normal(0.0, 2.0, grey.shape)
    return np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


@pytest.fixture(scope="module", params=["chessboard", "charuco"])
def boards(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with images of a board; in the first it lies on the water."""
    folder = tmp_path_factory.mktemp(request.param)
    cv2.imwrite(str(folder / "0.png"), picture(request.param, water_of, seed=0))
    for number, (turn, place) in enumerate(HELD, start=1):
        image = picture(request.param, lambda p, t=turn, q=place: held(p, t, q), seed=number)
        cv2.imwrite(str(folder / f"{number}.png"), image)
    return folder


def calibrated(boards: Path, out: Path, *words: object) -> Done:
    kind = ()
    if boards.name.startswith("charuco"):
        kind = ("--board", "charuco", "--tag", "22mm", "--dictionary", "DICT_4X4_250")
    images = sorted(boards.glob("?.png"))
    size = ("--squares", f"{COLUMNS}x{ROWS}", "--square", "30mm")
    return here("camera", "calibrate", *images, *size, *kind, "-o", out, *words)


@pytest.mark.slow
def test_board_to_metres_and_poses(boards: Path, tmp_path: Path) -> None:
    """Pixel to metre within 0.15 mm (rms 0.05 mm) where the board lay; poses within 0.2 mm."""
    toml = tmp_path / "camera.toml"
    done = calibrated(boards, toml, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["images_used"] == 1 + len(HELD)
    assert found["lens_rms_px"] < 0.3
    assert found["plane_rms_px"] < 0.3
    camera = dw.track.load_camera(toml)
    grid = np.stack(np.meshgrid(np.linspace(40, 440, 15), np.linspace(20, 340, 12)), axis=-1)
    pixels = grid.reshape(-1, 2)
    true = water(pixels)
    covered = (np.abs(true) < [COLUMNS * SQUARE / 2, ROWS * SQUARE / 2]).all(axis=1)
    off = np.hypot(*(camera.to_world(pixels) - true).T)
    assert covered.sum() > 60
    assert off[covered].max() < 0.15e-3
    assert np.sqrt((off[covered] ** 2).mean()) < 0.05e-3

    blocks = moving_blocks(20)
    video = dw.write_video(tmp_path / "video.mkv", blocks, TILTED)
    markers = dw.track.save_markers(tmp_path / "m.toml", marker_of(TILTED))
    for words in ((), ("--tank", "30cm")):
        out = tmp_path / f"r{len(words)}.nc"
        done = here("track", video, "--markers", markers, "--camera", toml, *words, "-o", out)
        assert done.code == 0, done.err
        assert "warning" not in done.err
        recording = dw.load(out)
        assert ("arena" in recording.attrs) == bool(words)
        dx, dy = (
            recording[name].values[:, :, None] - blocks[name].values[:, None] for name in "xy"
        )
        which = np.hypot(dx, dy)[0].argmin(axis=1)
        assert sorted(which) == [0, 1, 2, 3]
        assert np.hypot(dx, dy)[:, np.arange(4), which].max() < 0.2e-3
        turned = recording["theta"].values - blocks["theta"].values[:, which]
        assert np.degrees(np.abs(np.angle(np.exp(1j * turned)))).max() < 1.0


@pytest.mark.slow
def test_the_rim_gives_the_centre_where_the_board_lay_aside(boards: Path, tmp_path: Path) -> None:
    """The board's middle is moved by 2 cm in the file; the tank is found where it is."""
    toml = tmp_path / "camera.toml"
    assert calibrated(boards, toml).code == 0
    camera = dw.track.load_camera(toml)
    aside = np.array([[1, 0, 0.02], [0, 1, 0], [0, 0, 1]]) @ np.reshape(
        camera.homography_px_to_m, (3, 3)
    )
    nine = tuple(aside.ravel().tolist())
    dw.track.save_camera(toml, camera.model_copy(update={"homography_px_to_m": nine}))
    blocks = moving_blocks(8, bodies=1)
    video = dw.write_video(tmp_path / "video.mkv", blocks, TILTED)
    markers = dw.track.save_markers(tmp_path / "m.toml", marker_of(TILTED))
    track = ("track", video, "--markers", markers, "--camera", toml)
    done = here(*track, "--tank", "30cm", "-o", tmp_path / "centred.nc")
    assert done.code == 0, done.err
    assert here(*track, "-o", tmp_path / "aside.nc").code == 0
    centred, moved = dw.load(tmp_path / "centred.nc"), dw.load(tmp_path / "aside.nc")
    assert moved["x"].values - blocks["x"].values == pytest.approx(0.02, abs=0.2e-3)
    for name in ("x", "y"):
        assert centred[name].values == pytest.approx(blocks[name].values, abs=0.3e-3)
    done = here(*track, "--tank", "25cm", "-o", tmp_path / "wrong.nc")
    width = re.search(r"the rim is ([\d.]+) cm wide, not 25 cm", done.err)
    assert width is not None, done.err
    assert float(width[1]) == pytest.approx(30.0, abs=0.1)


@pytest.mark.slow
def test_boards_that_are_not_found(boards: Path, tmp_path: Path) -> None:
    toml, empty = tmp_path / "camera.toml", tmp_path / "empty.png"
    cv2.imwrite(str(empty), np.full((HEIGHT, WIDTH, 3), 120, np.uint8))
    size = ("--squares", f"{COLUMNS}x{ROWS}", "--square", "30mm")
    calibrate = ("camera", "calibrate", empty, *size, "-o", toml)
    assert "was found in 0 of 2 images, 3 are needed" in refusal(here(*calibrate, empty))
    assert "was not found in the image" in refusal(here(*calibrate, "--no-lens"))
    assert "no such image" in refusal(here(*calibrate, tmp_path / "gone.png"))
    text = tmp_path / "text.png"
    text.write_text("no image")
    assert "is not an image that OpenCV can read" in refusal(here(*calibrate, text))
    assert not toml.exists()
    if boards.name.startswith("chessboard"):
        wrong = ("--squares", f"{COLUMNS + 1}x{ROWS}", "--square", "30mm", "-o", toml)
        images = sorted(boards.glob("?.png"))
        assert "of 6 images, 3 are needed: check the number of squares" in refusal(
            here("camera", "calibrate", *images, *wrong)
        )
