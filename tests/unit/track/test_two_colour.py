"""Two-colour markers on drawn frames, against the exact poses."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from drawn_blocks import camera_of, marker_of, moving_blocks

import driftwalk as dw
from driftwalk.core.errors import InputError


def errors(level: str, frames: int, **changes: object) -> tuple[np.ndarray, float, int]:
    """Return rows of errors (plain, then in standard deviations; visible), recall, extras."""
    settings = dw.video_settings(level, **changes)
    blocks = moving_blocks(frames)
    truth = dw.video_truth(blocks, settings)
    detector = dw.track.TwoColourDetector(marker_of(settings), camera_of(settings))
    rows, wanted, hits, extra = [], 0, 0, 0
    for index, (_, image) in enumerate(dw.render_video(blocks, settings)):
        found, _ = detector.detect(image)
        places = np.array([[item.x, item.y] for item in found]).reshape(-1, 2)
        near = set()
        for body in range(truth.sizes["body"]):
            one = truth.isel(time=index, body=body)
            # A hair below 0.7: the bars hide 30 % to the grain of the points that count it.
            seen = float(one.visible) > 0.695
            wanted += seen
            off = places - [float(one.x), float(one.y)]
            apart = np.hypot(off[:, 0], off[:, 1])
            if apart.size and apart.min() < 0.004:
                at = int(apart.argmin())
                near.add(at)
                hits += seen
                turn = math.remainder(found[at].theta - float(one.theta), 2 * math.pi)
                three = np.array([*off[at], turn])
                std = np.sqrt(np.diag(found[at].covariance))
                rows.append([*three, *(three / std), float(one.visible)])
        extra += len(found) - len(near)
    return np.array(rows), hits / wanted, extra


@pytest.mark.slow
def test_moderate_level_meets_the_stated_errors() -> None:
    rows, recall, extra = errors("moderate", 20)
    assert recall >= 0.995
    assert extra == 0
    assert math.sqrt((rows[:, :2] ** 2).sum(axis=1).mean()) <= 0.15e-3
    assert math.degrees(math.sqrt((rows[:, 2] ** 2).mean())) <= 0.5
    # The covariance says how large the errors are, to a factor of two.
    spread = np.sqrt((rows[:, 3:6] ** 2).mean(axis=0))
    assert ((spread > 0.5) & (spread < 2.0)).all(), spread


@pytest.mark.slow
def test_heavy_level_finds_what_can_be_seen() -> None:
    rows, recall, extra = errors("heavy", 20, seed=3)
    assert recall >= 0.95
    assert extra == 0
    seen = rows[rows[:, 6] > 0.695]
    assert math.sqrt((seen[:, :2] ** 2).sum(axis=1).mean()) <= 0.3e-3


@pytest.mark.slow
def test_marker_angle_brightness_and_tilt() -> None:
    """An offset marker in half the light, before a tilted, turned camera with distortion."""
    settings = dw.video_settings(
        "clean",
        marker_angle_rad=0.7,
        rotation_rad=0.4,
        tilt_x_per_m=0.4,
        tilt_y_per_m=-0.3,
        lens_k1=-0.06,
    )
    blocks = moving_blocks(2)
    lens = dw.track.Lens(
        focal_x_px=640,
        focal_y_px=640,
        centre_column_px=319.5,
        centre_row_px=239.5,
        k1=-0.06,
    )
    # The plane from four points that were projected by hand, with the numbers of the settings.
    world = np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])
    cos, sin = math.cos(0.4), math.sin(0.4)
    turned = world @ np.array([[cos, sin], [-sin, cos]])
    depth = 1 + turned @ np.array([0.4, -0.3])
    straight = turned * [1, -1] * 1500 / depth[:, None] + [319.5, 239.5]
    nine, _ = cv2.findHomography(straight, world)
    camera = dw.track.Camera(
        width_px=640, height_px=480, homography_px_to_m=tuple(nine.ravel()), lens=lens
    )
    detector = dw.track.TwoColourDetector(marker_of(settings), camera)
    for index, (_, image) in enumerate(dw.render_video(blocks, settings)):
        dim = (image * 0.5).astype(np.uint8)
        found, _ = detector.detect(dim)
        assert len(found) == 4
        for body in range(4):
            one = blocks.isel(time=index, body=body)
            best = min(found, key=lambda f: math.hypot(f.x - float(one.x), f.y - float(one.y)))
            assert math.hypot(best.x - float(one.x), best.y - float(one.y)) < 0.1e-3
            turn = math.remainder(best.theta - float(one.theta), 2 * math.pi)
            assert abs(math.degrees(turn)) < 0.5


@pytest.mark.slow
def test_rejected_candidates_have_reasons() -> None:
    settings = dw.video_settings("clean")
    _, image = next(dw.render_video(moving_blocks(1), settings))
    image[20:60, 20:60] = settings.disc_1[::-1]
    cv2.circle(image, (600, 440), 7, settings.disc_2[::-1], -1)
    cv2.circle(image, (40, 440), 2, settings.disc_2[::-1], -1)
    found, rejected = dw.track.TwoColourDetector(marker_of(settings), camera_of(settings)).detect(
        image
    )
    assert len(found) == 4
    kinds = {(round(r.column / 20), r.kind) for r in rejected}
    assert kinds == {(2, "too large"), (30, "no partner"), (2, "too small")}
    drawn = dw.track.explain_frame(image, found, rejected, camera=camera_of(settings))
    assert drawn.shape == image.shape
    assert (drawn != image).any()


@pytest.mark.slow
def test_blocks_side_by_side_keep_their_own_discs() -> None:
    """Two blocks face to face: the next disc of the other colour may be the neighbour's."""
    from driftwalk.schema import build_trajectory

    settings = dw.video_settings("moderate")
    blocks = build_trajectory([0.0], [[-0.015, 0.015]], [[0.0, 0.0]], [[0.0, 0.0]])
    _, image = next(dw.render_video(blocks, settings))
    found, rejected = dw.track.TwoColourDetector(marker_of(settings), camera_of(settings)).detect(
        image
    )
    assert sorted(round(f.x, 4) for f in found) == [-0.015, 0.015]
    assert rejected == []


@pytest.mark.slow
def test_a_proposal_gives_colours_size_and_spacing() -> None:
    settings = dw.video_settings("moderate")
    images = [image for _, image in dw.render_video(moving_blocks(3), settings)]
    proposal = dw.track.propose_markers(images, camera_of(settings), block_side=0.03)
    drawn, marker = marker_of(settings), proposal.marker
    assert proposal.pairs == 12
    assert marker.spacing_m == pytest.approx(0.014, rel=0.01)
    assert marker.size_m == pytest.approx(0.010, rel=0.05)
    for seen, true in ((marker.colour_1, drawn.colour_1), (marker.colour_2, drawn.colour_2)):
        assert abs(math.remainder(seen.hue_rad - true.hue_rad, 2 * math.pi)) < math.radians(5)
    assert proposal.picture.shape == images[0].shape


@pytest.mark.slow
def test_a_colour_that_never_appears_is_said_with_what_was_seen() -> None:
    settings = dw.video_settings("heavy")
    _, image = next(dw.render_video(moving_blocks(1), settings))
    blue = dw.track.TwoColourMarker(
        spacing_m=0.014,
        size_m=0.01,
        colour_1={"a_star": 10, "b_star": -50},
        colour_2=marker_of(settings).colour_2.model_dump(),
    )
    message = dw.track.missing_colours(blue, [image]) or ""
    assert message.startswith("colour 1 (blue) never appears; seen instead: ")
    assert "red" in message
    assert dw.track.missing_colours(marker_of(settings), [image]) is None
    grey = np.full((48, 64, 3), 90, np.uint8)
    with pytest.raises(InputError, match="all is grey"):
        dw.track.propose_markers([grey], camera_of(settings))


def test_a_bar_of_a_body_that_is_not_there_hides_nothing() -> None:
    """A bar may be placed in time where its body has a gap; nothing is painted there."""
    settings = dw.datasets.VideoSettings(
        width_px=320, height_px=240, px_per_m=750.0, bar_share=0.5, bar_time_share=0.9
    )
    blocks = moving_blocks(16, bodies=2)
    for name in ("x", "y", "theta"):
        blocks[name].values[10:, 1] = np.nan
    whole, alone = (
        dw.video_truth(one, settings)["visible"].values[10:, 0]
        for one in (blocks, blocks.isel(body=[0]))
    )
    assert np.array_equal(whole, alone)
    assert whole.max() > 0.0
