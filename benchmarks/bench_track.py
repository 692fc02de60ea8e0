"""How many frames a second the detector of two-colour markers does, beside ArUco detection.

    python benchmarks/bench_track.py [--rounds 7] [--frames 10]

One core, decoding left out, processor time. Every image is a synthetic one with moderate noise.
ArUco tags of the block's size are drawn on the same places for the peer, and both must find all
objects of every frame, else the script fails. Sizes: 640 x 480 with 4 markers, 1920 x 1080 with 16,
and 1, 4, 16, 32 and 64 markers at 1920 x 1080 for the growth with their number.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import cv2
import numpy as np
from timing import interleaved, spread

import driftwalk as dw
from driftwalk.schema import build_trajectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "unit"))
from drawn_blocks import camera_of, marker_of

SIDE_OF_TAG = 0.8
CASES = ((640, 480, 4), (1920, 1080, 1), (1920, 1080, 4), (1920, 1080, 16), (1920, 1080, 32))
CASES = (*CASES, (1920, 1080, 64))


def settings_for(width: int, height: int, markers: int) -> dw.VideoSettings:
    """A tank that fills the image, its blocks small enough for all to fit."""
    scale = height * 0.95 / 0.30
    side = min(0.03, 0.19 / math.sqrt(markers))
    return dw.video_settings(
        "moderate",
        width_px=width,
        height_px=height,
        px_per_m=scale,
        block_side_m=side,
        marker_spacing_m=14 / 30 * side,
        marker_diameter_m=side / 3,
    )


def blocks(markers: int, frames: int, side: float):
    """Blocks on a grid in the tank, that sway and turn."""
    per_line = math.ceil(math.sqrt(markers))
    step = 1.3 * side
    line = (np.arange(per_line) - (per_line - 1) / 2) * step
    x, y = (part.ravel()[:markers] for part in np.meshgrid(line, line))
    time = np.arange(frames) / 10
    sway = 0.03 * side * np.sin(time)[:, None]
    return build_trajectory(time, x + sway, y - sway, 0.7 * np.arange(markers) + time[:, None])


def with_tags(trajectory, settings: dw.VideoSettings) -> list[np.ndarray]:
    """The same frames with coded tags in the place of the blocks, noise and blur alike."""
    tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    side = settings.block_side_m * settings.px_per_m
    images = []
    for index in range(trajectory.sizes["time"]):
        image = np.full((settings.height_px, settings.width_px), 196, np.uint8)
        for body in range(trajectory.sizes["body"]):
            tag = tags.generateImageMarker(body, 60)
            one = trajectory.isel(time=index, body=body)
            angle, scale = float(one.theta), SIDE_OF_TAG * side / 60
            turn = scale * np.array(
                [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]
            )
            middle = np.asarray(settings.middle_px)
            place = middle + np.array([float(one.x), -float(one.y)]) * settings.px_per_m
            moved = np.column_stack([turn, place - turn @ [29.5, 29.5]])
            cv2.warpAffine(
                tag,
                moved,
                image.shape[::-1],
                dst=image,
                flags=cv2.INTER_AREA,
                borderMode=cv2.BORDER_TRANSPARENT,
            )
        blurred = cv2.GaussianBlur(image, (0, 0), settings.blur_px).astype(np.float32)
        noise = np.random.default_rng(index).normal(0, settings.noise_std, (*image.shape, 3))
        images.append(np.clip(blurred[..., None] + noise, 0, 255).astype(np.uint8))
    return images


def run(width: int, height: int, markers: int, *, rounds: int, frames: int) -> None:
    settings = settings_for(width, height, markers)
    trajectory = blocks(markers, frames, settings.block_side_m)
    images = [image for _, image in dw.render_video(trajectory, settings)]
    tagged = with_tags(trajectory, settings)
    ours = dw.TwoColourDetector(marker_of(settings), camera_of(settings))
    peer = dw.TagDetector("4X4_100", camera_of(settings))
    for name, detector, shown in (("two colours", ours, images), ("ArUco", peer, tagged)):
        found = [len(detector.detect(image)[0]) for image in shown]
        if min(found) < markers:
            raise SystemExit(f"{name}: {min(found)} of {markers} found at {width} x {height}")
    times = interleaved(
        {
            "two colours": lambda: [ours.detect(image) for image in images],
            "ArUco": lambda: [peer.detect(image) for image in tagged],
        },
        rounds=rounds,
    )
    for name, result in times.items():
        rates = spread(result.rates(frames), digits=0)
        print(f"{width} x {height}, {markers:2d} markers, {name:12s} {rates} frames/s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--frames", type=int, default=10)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    for width, height, markers in CASES:
        run(width, height, markers, rounds=arguments.rounds, frames=arguments.frames)


if __name__ == "__main__":
    main()
