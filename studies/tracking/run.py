"""Track videos whose truth is known, through the command line.

    python studies/tracking/run.py OUT --set moderate [--count 5] [--keep-videos]
    python studies/tracking/run.py OUT --set mouse --video mouse_video.mp4 --published tracked.csv

OUT holds the recordings and `SET.jsonl`. What is in there already is not done again, so a study
that was stopped goes on where it was; `--again` does it with this version of the tracker, whose
number stands in each line.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import xarray as xr
from closed_loop import close_loop
from commands import CommandFailed, driftwalk, driftwalk_json, tracker_version
from mouse import track_mouse
from scenes import SEEDS, Scene, motion_of, scenes_of, video_of
from score import score

import driftwalk as dw
from driftwalk.core.provenance import plain

TANK: Final = ("--tank", "30cm")


def main() -> None:
    """Do the scenes of a set that are not in the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--set", dest="set_name", choices=(*SEEDS, "mouse"), required=True)
    parser.add_argument("--count", type=int, default=None, help="scenes; default: all of the set")
    parser.add_argument("--again", action="store_true", help="what another version has done")
    parser.add_argument("--keep-videos", action="store_true", help="1 MB for two frames or so")
    parser.add_argument("--video", type=Path, help="the mouse's video")
    parser.add_argument("--published", type=Path, help="its published track")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = options.out / f"{options.set_name}.jsonl"
    if options.set_name == "mouse":
        if options.video is None or options.published is None:
            parser.error("--set mouse needs --video and --published")
        do(
            results,
            "mouse",
            partial(track_mouse, options.out, options.video, options.published),
            again=options.again,
        )
        return
    for scene in scenes_of(options.set_name, options.count):
        do(
            results,
            scene.seed,
            partial(film, scene, options.out, options.keep_videos),
            again=options.again,
        )


def do(results: Path, key: int | str, work: Callable[[], dict[str, Any]], *, again: bool) -> None:
    """Add a line to the results, unless there is one; or one of this version, to do it again."""
    version = tracker_version()
    done = [line["tracker"] for line in read_lines(results) if line["key"] == key]
    if version in done or (done and not again):
        return
    line = {"set": results.stem, "key": key, "tracker": version}
    try:
        line |= work()
    except CommandFailed as error:
        line["error"] = str(error)
    with results.open("a", encoding="utf-8") as file:
        file.write(json.dumps(plain(line), allow_nan=False) + "\n")
    print(in_words(line), flush=True)


def film(scene: Scene, out: Path, keep_video: bool) -> dict[str, Any]:
    """Draw, teach, track, and hold what was tracked beside the truth."""
    motion = motion_of(scene)
    video = video_of(scene, motion, out / "videos")
    recording = out / "recordings" / f"{scene.name}.nc"
    recording.parent.mkdir(exist_ok=True)
    teach(video, recording.with_suffix(".toml"))
    words = (video, "--markers", recording.with_suffix(".toml"), *TANK, "--bodies", scene.bodies)
    said, seconds = driftwalk_json("track", *words, "-o", recording, "--overwrite")
    found = score(xr.load_dataset(recording), dw.video_truth(motion, scene.settings))
    line = {
        "blocks": scene.bodies,
        "latching": scene.latching if scene.bodies > 1 else "none",
        **found,
        "counts": said["counts"],
        "frames_per_s": said["frames_per_s"],
        "seconds": round(seconds, 1),
    }
    if scene.set_name == "closed-loop":
        line |= close_loop(scene, motion, recording, found)
    if not keep_video:
        video.unlink()
    return line


def teach(video: Path, markers: Path) -> None:
    """Learn the markers; the proposal takes the red disc for the first, and so it is here."""
    words = (video, *TANK, "--side", "3cm", "-o", markers, "--overwrite")
    driftwalk("markers", "teach", *words)
    if dw.track.load_markers(markers).colour_1.a_star < 0.0:
        raise CommandFailed(f"{markers}: the first disc was taken for the second")


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Return the lines of a file of results, none where there is no file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def in_words(line: dict[str, Any]) -> str:
    """Return a result on one line."""
    head = f"{line['set']} {line['key']}: "
    if "error" in line:
        return f"{head}{line['error']}"
    if line["set"] == "mouse":
        return f"{head}median {line['median_px']:.2f} px, {line['lost']} frames lost"
    words = head + (
        f"{line['position_rms_mm']:.3f} mm, {line['angle_rms_deg']:.2f} deg, recall "
        f"{line['recall_visible']:.2%}, {line['false']} false, {line['swaps']} swaps, "
        f"{line['unmarked']} unmarked, z {line['z_total']:.2f}"
    )
    for angle, fit in line.get("fits", {}).items():
        words += (
            f"; {angle}: C_d {fit['drag_coefficient_difference']:+.2%}, sigma_F "
            f"{fit['force_std_N_difference']:+.2%}, noise "
            f"{fit['tracking_noise_difference_mm']:+.4f} mm"
        )
    return words


if __name__ == "__main__":
    main()
