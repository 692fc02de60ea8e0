"""Camera: files, rim, boards drawn by an independent projection, tags and blobs."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from drawn_blocks import moving_blocks
from hypothesis import given, settings, strategies as st

import driftwalk as dw
from driftwalk.core.errors import FormatError, InputError
from driftwalk.track.rim import find_rim

MATRIX = np.array([[620.0, 0.0, 322.0], [0.0, 622.0, 236.0], [0.0, 0.0, 1.0]])
BENT = np.array([-0.21, 0.06, 0.001, -0.0008, 0.0])
LENS = dw.track.Lens(
    focal_x_px=620, focal_y_px=622, centre_column_px=322, centre_row_px=236,
    k1=-0.21, k2=0.06, p1=0.001, p2=-0.0008,
)  # fmt: skip


@settings(max_examples=50, deadline=None)
@given(st.floats(-0.3, 0.3), st.floats(-0.25, 0.25))
def test_the_lens_bends_as_opencv_does_and_back(u: float, v: float) -> None:
    place = np.array([[u, v, 1.0]])
    expected = cv2.projectPoints(place, np.zeros(3), np.zeros(3), MATRIX, BENT)[0].reshape(1, 2)
    straight = place[:, :2] * [620, 622] + [322, 236]
    assert LENS.bend(straight) == pytest.approx(expected, abs=1e-9)
    assert LENS.straighten(expected) == pytest.approx(straight, abs=1e-7)


def test_jacobian_and_inverse_agree_with_the_map() -> None:
    camera = dw.track.Camera.from_scale(640, 480, px_per_m=1500.0, lens=LENS)
    world = np.array([[0.05, -0.03], [-0.1, 0.08]])
    pixels = camera.to_pixel(world)
    assert camera.to_world(pixels) == pytest.approx(world, abs=1e-9)
    step = np.array([1e-3, -2e-3])
    moved = camera.to_world(pixels + step) - world
    assert camera.jacobian(pixels) @ step == pytest.approx(moved, rel=1e-3, abs=1e-12)


def test_there_is_no_default_scale() -> None:
    with pytest.raises(InputError, match="`diameter` of `camera_from_rim`"):
        dw.track.Camera(width_px=640, height_px=480).to_world(np.zeros((1, 2)))
    with pytest.raises(InputError, match="640 x 480"):
        dw.track.Camera(width_px=640, height_px=480).check_size(320, 240)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("width_px = 640\nheight_px = 480\nscale = 3\n", "unknown section or key 'scale'"),
        ("width_px = 640\n", "height_px is missing"),
        ("width_px = 640\nheight_px = 480\n[lens]\nfocal = 3\n", r"\[lens\]"),
        ("width_px 640", "is not a camera file"),
    ],
)
def test_a_wrong_camera_file_is_said(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "camera.toml"
    path.write_text(text)
    with pytest.raises(FormatError, match=message):
        dw.track.load_camera(path)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("spacing = 0.014", "did you mean 'spacing_m'"),
        ("block_side_m = -1", "more than 0 m"),
        ("kind = 'three'", "must be"),
    ],
)
def test_a_wrong_markers_file_is_said(tmp_path: Path, line: str, message: str) -> None:
    path = tmp_path / "markers.toml"
    path.write_text(
        f"{line}\nspacing_m = '14mm'\nsize_m = 0.01\n"
        "[colour_1]\na_star = 60\nb_star = 10\n[colour_2]\na_star = -40\nb_star = 20\n"
    )
    with pytest.raises(FormatError, match=message):
        dw.track.load_markers(path)


@pytest.mark.slow
@pytest.mark.parametrize("level", [pytest.param("moderate", marks=pytest.mark.slow), "heavy"])
def test_the_rim_gives_scale_and_centre(level: str) -> None:
    drawn = dw.video_settings(level, centre_px=(312.3, 244.8), px_per_m=1480.0)
    _, image = next(dw.render_video(moving_blocks(1), drawn))
    rim = find_rim(image)
    assert (rim.column, rim.row) == pytest.approx((312.3, 244.8), abs=0.05)
    assert rim.radius_px == pytest.approx(1480 * 0.15, rel=5e-4)
    camera = dw.track.camera_from_rim(image, diameter=0.30)
    assert camera.to_world(np.array([[312.3 + 148.0, 244.8]])) == pytest.approx(
        np.array([[0.1, 0.0]]), abs=1e-4
    )


def test_no_rim_is_said() -> None:
    with pytest.raises(InputError, match="no rim"):
        dw.track.camera_from_rim(np.full((240, 320, 3), 90, np.uint8), diameter=0.3)
    with pytest.raises(InputError, match="above zero"):
        dw.track.camera_from_rim(np.full((240, 320, 3), 90, np.uint8), diameter=0.0)


@cache
def board_rays() -> np.ndarray:
    """Return the directions of four rays a pixel through the lens."""
    column, row = np.meshgrid((np.arange(1280) - 0.5) / 2, (np.arange(960) - 0.5) / 2)
    pixels = np.stack([column.ravel(), row.ravel()], axis=-1)
    rays = (LENS.straighten(pixels) - [322, 236]) / [620, 622]
    return np.column_stack([rays, np.ones(len(rays))])


def drawn_board(turn: tuple[float, float, float], away: tuple[float, float, float]) -> np.ndarray:
    """Return a chessboard of 9 x 7 squares of 20 mm through the lens, four rays a pixel."""
    rotation, _ = cv2.Rodrigues(np.array(turn))
    # Where each ray meets the board: R p + t = s d, the third coordinate of p is zero.
    back = rotation.T @ np.array(away)
    direction = board_rays() @ rotation
    place = (direction * (back[2] / direction[:, 2])[:, None] - back)[:, :2] + [0.09, 0.07]
    square = np.floor(place / 0.02)
    on = ((square >= 0) & (square < [9, 7])).all(axis=1)
    dark = on & (square.sum(axis=1) % 2 == 0)
    grey = np.where(dark, 30.0, 220.0).reshape(480, 2, 640, 2).mean(axis=(1, 3))
    noise = np.random.default_rng(1).normal(0.0, 2.0, grey.shape)
    return np.repeat(np.clip(grey + noise, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


@pytest.mark.slow
def test_a_lens_is_found_from_drawn_boards() -> None:
    turns = [(0.0, 0.0, 0.0), (0.5, 0.0, 0.1), (-0.4, 0.3, 0.0), (0.1, -0.5, 0.2), (0.3, 0.4, -0.2)]
    aways = [
        (0, 0, 0.25),
        (-0.04, 0, 0.3),
        (0.04, 0.03, 0.28),
        (0.03, -0.03, 0.28),
        (0, 0.02, 0.26),
    ]
    images = [drawn_board(turn, away) for turn, away in zip(turns, aways, strict=True)]
    board = dw.track.Board(9, 7, 0.02)
    found = dw.track.calibrate_lens([*images, np.full_like(images[0], 200)], board)
    assert found.used == [0, 1, 2, 3, 4]
    assert found.not_found == [5]
    assert found.rms_px < 0.2
    assert found.lens.focal_x_px == pytest.approx(620, rel=0.01)
    grid = np.stack(np.meshgrid([60, 320, 580], [60, 240, 420]), axis=-1).reshape(-1, 2) * 1.0
    assert found.lens.k1 == pytest.approx(-0.21, abs=0.03)
    # The board lies flat at 0.25 m: a place 5 cm off is there on the plane that was found.
    camera = dw.track.camera_from_board(images[0], board, found.lens)
    true = (LENS.straighten(grid) - [322, 236]) / [620, 622] * 0.25
    seen = camera.to_world(grid)
    inside = np.abs(true).max(axis=1) < 0.09
    assert np.abs(seen - true * [1, -1])[inside].max() < 0.3e-3


def test_a_board_that_is_nowhere() -> None:
    grey = [np.full((240, 320, 3), 90, np.uint8)] * 3
    with pytest.raises(InputError, match="found in 0 of 3 images"):
        dw.track.calibrate_lens(grey, dw.track.Board(9, 7, 0.02))
    with pytest.raises(InputError, match="state their side"):
        dw.track.Board(9, 7, 0.02, kind="charuco")


def test_a_charuco_board_gives_the_plane() -> None:
    board = dw.track.Board(6, 5, 0.03, kind="charuco", marker_m=0.022)
    image = board.charuco_board(cv2).generateImage((360, 300))
    image = cv2.copyMakeBorder(image, 40, 40, 50, 50, cv2.BORDER_CONSTANT, value=255)
    camera = dw.track.camera_from_board(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), board)
    # 60 px for 30 mm, drawn upright: the middle of the picture is that of the board.
    middle = np.array([[229.5, 189.5], [229.5 + 60, 189.5 - 60]])
    assert camera.to_world(middle) == pytest.approx(np.array([[0, 0], [0.03, 0.03]]), abs=3e-4)


@pytest.mark.parametrize("angle", [0.0, 0.6, 2.5, -1.8])
def test_tags_tell_who_where_and_how(angle: float) -> None:
    tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    side, centre = 60, np.array([170.3, 121.6])
    tag = cv2.copyMakeBorder(tags.generateImageMarker(7, side), *[15] * 4, 0, value=255)
    middle = (side + 30 - 1) / 2
    # Counter-clockwise with y up is clockwise in rows.
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    map_ = np.column_stack([turn, centre - turn @ [middle, middle]])
    image = cv2.warpAffine(tag, map_, (320, 240), flags=cv2.INTER_AREA, borderValue=255)
    detector = dw.track.TagDetector("4x4_50", dw.track.Camera.from_scale(320, 240, px_per_m=1000.0))
    found, _ = detector.detect(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    assert [item.key for item in found] == ["7"]
    one = found[0]
    assert (one.x, one.y) == pytest.approx(((170.3 - 159.5) / 1e3, (119.5 - 121.6) / 1e3), abs=4e-4)
    assert abs(math.remainder(one.theta - angle, 2 * math.pi)) < math.radians(1.0)
    with pytest.raises(InputError, match="no dictionary '9X9'"):
        dw.track.TagDetector("9X9")


def test_blobs_are_found_before_an_uneven_background() -> None:
    generator = np.random.default_rng(5)
    shade = np.linspace(120, 220, 320)[None, :, None] * np.ones((240, 1, 3))
    images, places = [], []
    for index in range(15):
        place = np.array([60.0 + 13.7 * index, 120.0 + 50 * math.sin(index)])
        disc = np.zeros((240, 320))
        row, column = np.ogrid[:240, :320]
        disc = np.clip(12.5 - np.hypot(column - place[0], row - place[1]), 0, 1)[..., None]
        noisy = shade * (1 - 0.7 * disc) + generator.normal(0, 4, shade.shape)
        images.append(np.clip(noisy, 0, 255).astype(np.uint8))
        places.append(place)
    detector = dw.track.BlobDetector(dw.track.median_background(images), polarity="dark", objects=1)
    off = []
    for image, place in zip(images, places, strict=True):
        found, _ = detector.detect(image)
        assert len(found) == 1
        assert found[0].x is None
        off.append(math.hypot(found[0].column - place[0], found[0].row - place[1]))
    assert max(off) < 0.5
