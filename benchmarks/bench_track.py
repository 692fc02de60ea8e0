"""How many frames a second detectors and tracker do, beside ArUco detection and trackpy.

    python benchmarks/bench_track.py [--rounds 7] [--frames 10] [--quick]

One core, decoding left out, processor time. Every image is a synthetic one with moderate
noise, but for one case at the heavy level.
Sizes: 640 x 480 with 4 two-colour markers, and 1 to 64 at 1920 x 1080; detection alone and with the
tracker's step. ArUco tags of the block's size are drawn on the same places for the peer. A line is
fitted to the best times over the number of markers. Dark discs on the same places are found by
`BlobDetector` and by trackpy's `locate`, which is left out where it is not installed. All must find
every object of every frame, else the exit code is 1.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from timing import interleaved, machine, spread

import driftwalk as dw
from driftwalk.schema import build_trajectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
from drawn_blocks import camera_of, marker_of

SIDE_OF_TAG = 0.8
CASES = ((640, 480, 4), *((1920, 1080, markers) for markers in (1, 4, 16, 32, 48, 64)))
BLOBS = ((640, 480, 4), (1920, 1080, 16))


def settings_for(
    width: int, height: int, markers: int, level: str = "moderate"
) -> dw.datasets.VideoSettings:
    """A tank that fills the image, its blocks small enough for all to fit."""
    scale = height * 0.95 / 0.30
    side = min(0.03, 0.19 / math.sqrt(markers))
    return dw.video_settings(
        level,
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


def with_tags(trajectory, settings: dw.datasets.VideoSettings) -> list[np.ndarray]:
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


def run(width: int, height: int, markers: int, *, rounds: int, frames: int) -> dict[str, float]:
    """Print the rates of one case; return what `timed` does."""
    settings = settings_for(width, height, markers)
    trajectory = blocks(markers, frames, settings.block_side_m)
    images = [image for _, image in dw.render_video(trajectory, settings)]
    tagged = with_tags(trajectory, settings)
    ours = dw.track.TwoColourDetector(marker_of(settings), camera_of(settings))
    peer = dw.track.TagDetector("4X4_100", camera_of(settings))
    for name, detector, shown in (("two colours", ours, images), ("ArUco", peer, tagged)):
        require(name, [detector.detect(image)[0] for image in shown], markers)
    tracker = dw.track.Tracker(dw.track.TrackerSettings(max_speed=0.3, bodies=markers))
    frame = itertools.count()

    def follow() -> None:
        for image in images:
            # As if the time went on: the last frame of a round and the first differ by one step.
            tracker.step(0.1 * next(frame), ours.detect(image)[0])

    return timed(
        f"{width} x {height}, {markers:2d} markers",
        {
            "two colours": lambda: [ours.detect(image) for image in images],
            "and tracker": follow,
            "ArUco": lambda: [peer.detect(image) for image in tagged],
        },
        rounds=rounds,
        frames=frames,
    )


def run_heavy(width: int, height: int, markers: int, *, rounds: int, frames: int) -> None:
    """Print the rate under glare, bars and strong noise, where not all markers can be seen.

    The moderate level is timed by turns with it, so that both have the same disturbances.
    """
    ways = {}
    for level in ("moderate", "heavy"):
        settings = settings_for(width, height, markers, level)
        trajectory = blocks(markers, frames, settings.block_side_m)
        images = [image for _, image in dw.render_video(trajectory, settings)]
        detector = dw.track.TwoColourDetector(marker_of(settings), camera_of(settings))
        found = sum(len(detector.detect(image)[0]) for image in images)
        print(f"{level} level: {found} of {markers * frames} markers found")
        ways[level] = partial(_detect_all, detector, images)
    timed(f"{width} x {height}, {markers:2d} markers", ways, rounds=rounds, frames=frames)


def _detect_all(detector: dw.track.TwoColourDetector, images: Sequence[np.ndarray]) -> None:
    for image in images:
        detector.detect(image)


def require(name: str, found: Sequence[Sequence[object]], markers: int) -> None:
    """End with an error when something was not found."""
    least = min(map(len, found))
    if least < markers:
        raise SystemExit(f"{name}: {least} of {markers} found")


def timed(
    case: str, ways: Mapping[str, Callable[[], object]], *, rounds: int, frames: int
) -> dict[str, float]:
    """Print frames a second of each way; return seconds a frame in its least disturbed round."""
    times = interleaved(ways, rounds=rounds)
    for name, result in times.items():
        rates = spread(result.rates(frames), digits=0)
        print(f"{case}, {name:12s} {rates} frames/s", flush=True)
    return {name: min(result.processor) / frames for name, result in times.items()}


def say_growth(name: str, markers: list[int], seconds: list[float]) -> None:
    """Print the line that fits the times best, and what is furthest from it."""
    slope, first = np.polyfit(markers, seconds, 1)
    expected = first + slope * np.array(markers)
    worst = np.abs(np.array(seconds) / expected - 1.0).max()
    print(
        f"{name}: {1e3 * first:.2f} ms + {1e3 * slope:.3f} ms a marker, "
        f"at most {worst:.0%} off that line"
    )


def run_blobs(width: int, height: int, objects: int, *, rounds: int, frames: int) -> None:
    """Print the rates of finding dark discs, beside trackpy where it is installed."""
    settings = settings_for(width, height, objects)
    trajectory = blocks(objects, frames, settings.block_side_m)
    radius = settings.marker_diameter_m * settings.px_per_m / 2
    background = np.full((height, width, 3), 196, np.uint8)
    images = []
    for index in range(frames):
        image = background.copy()
        for body in range(objects):
            one = trajectory.isel(time=index, body=body)
            place = np.asarray(settings.middle_px)
            place = place + np.array([float(one.x), -float(one.y)]) * settings.px_per_m
            # OpenCV takes parts of a pixel as whole numbers, here sixteenths.
            cv2.circle(
                image,
                np.rint(16 * place).astype(int),
                round(16 * radius),
                (60,) * 3,
                -1,
                cv2.LINE_AA,
                4,
            )
        blurred = cv2.GaussianBlur(image, (0, 0), settings.blur_px).astype(np.float32)
        noise = np.random.default_rng(index).normal(0, settings.noise_std, blurred.shape)
        images.append(np.clip(blurred + noise, 0, 255).astype(np.uint8))
    ours = dw.track.BlobDetector(background, camera_of(settings), polarity="dark", objects=objects)
    ways = {"blobs": lambda: [ours.detect(image)[0] for image in images]}
    try:
        import trackpy
    except ImportError:
        print("trackpy is not installed: blobs are timed alone")
    else:
        trackpy.quiet()
        size = 2 * round(radius) + 1
        grey = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in images]
        ways["trackpy"] = lambda: [
            trackpy.locate(image, size, invert=True, topn=objects) for image in grey
        ]
    for name, way in ways.items():
        require(name, way(), objects)
    timed(f"{width} x {height}, {objects:2d} objects", ways, rounds=rounds, frames=frames)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--frames", type=int, default=10)
    parser.add_argument("--quick", action="store_true", help="the small images, to try the script")
    arguments = parser.parse_args()
    cases, blobs = (CASES[:1], BLOBS[:1]) if arguments.quick else (CASES, BLOBS)
    cv2.setNumThreads(1)
    how = {"rounds": arguments.rounds, "frames": arguments.frames}
    print(machine())
    seconds = {case: run(*case, **how) for case in cases}
    large = [case for case in cases if case[0] == 1920]
    for name in ("two colours", "and tracker", "ArUco") if large else ():
        say_growth(name, [case[2] for case in large], [seconds[case][name] for case in large])
    run_heavy(*cases[0], **how)
    for case in blobs:
        run_blobs(*case, **how)


if __name__ == "__main__":
    main()
