"""From a synthetic video to a recording, on the command line."""

from __future__ import annotations

import io
import json
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import end, here, refusal, start
from matroska import give_times
from ports import held_port

import driftwalk as dw
from driftwalk.cli.recordings.track import tell_progress
from driftwalk.cli.terminal.progress import ProgressReporter
from driftwalk.schema import build_trajectory
from driftwalk.track.live import LiveServer

cv2 = pytest.importorskip("cv2")

FRAMES = 40
DOCS = Path(__file__).resolve().parents[3] / "docs" / "reference"
TANK = ("--tank", "30cm")


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    """Return two blocks, one of which comes to lie beside the other."""
    time = 0.1 * np.arange(FRAMES)
    apart = np.maximum(0.06 - 0.015 * time, 0.03)
    x = np.stack([np.full(FRAMES, -0.02), -0.02 + apart], axis=1)
    y = np.stack([0.002 * time, 0.002 * time], axis=1)
    theta = np.stack([np.zeros(FRAMES), np.full(FRAMES, np.pi / 2)], axis=1)
    return build_trajectory(time, x, y, theta)


@pytest.fixture(scope="module")
def folder(truth: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a video and its markers file."""
    place = tmp_path_factory.mktemp("video")
    settings = dw.video_settings("moderate", width_px=480, height_px=360, px_per_m=1100.0)
    dw.write_video(place / "video.mkv", truth, settings)
    done = here(
        "markers", "teach", place / "video.mkv", *TANK, "--side", "3cm", "-o", place / "m.toml"
    )
    assert done.code == 0, done.err
    assert (place / "m.png").stat().st_size > 1000
    return place


def tracked(folder: Path, out: Path, *words: object):
    return here(
        "track", folder / "video.mkv", "--markers", folder / "m.toml", *TANK, "-o", out, *words
    )


@pytest.mark.slow
def test_video_to_recording(folder: Path, truth: xr.Dataset, tmp_path: Path) -> None:
    out, overlay = tmp_path / "r.nc", tmp_path / "o.mp4"
    done = tracked(folder, out, "--bodies", "2", "--overlay", overlay, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["frames"] == FRAMES
    assert found["counts"]["dropped"] == 0
    recording = xr.load_dataset(out, engine="h5netcdf")
    assert recording.attrs["complete"] == "yes"
    assert recording["time"].values == pytest.approx(truth["time"].values)
    order = np.argsort(recording["x"].values[0])
    for name, allowed in (("x", 0.15e-3), ("y", 0.15e-3)):
        error = recording[name].values[:, order] - truth[name].values
        assert np.isfinite(error).all()
        assert np.sqrt(np.mean(error**2)) < allowed
    turned = recording["theta"].values[:, order] - truth["theta"].values
    assert np.degrees(np.sqrt(np.mean(np.angle(np.exp(1j * turned)) ** 2))) < 0.5
    assert not recording["ambiguous"].values.any()
    assert overlay.stat().st_size > 1000
    # Everything downstream reads it without an option.
    described = json.loads(here("info", out, "--json").out)
    assert described["arena"] == {"shape": "circle", "diameter_m": 0.3, "center_m": [0.0, 0.0]}
    observed = dw.observe(dw.load(out), side=0.03)
    assert observed["class"].values[observed["outcome"].values[[0, -1]]].tolist() == ["1+1", "2"]


def test_progress_of_a_file_that_holds_more_than_it_states() -> None:
    text = io.StringIO()
    with ProgressReporter("track", stream=text, seconds_between_lines=0) as progress:
        for done, dropped in ((5, 0), (6, 1), (11, 3)):
            tell_progress(progress, done, 10, dropped)
        tell_progress(progress, 5, 0, 0)
    assert text.getvalue().splitlines() == [
        "track: 5 of 10 (50 %)",
        "track: 6 of 10 (60 %): 1 frame dropped up to now",
        "track: 11 of 11 (100 %): the source stated 10, there are more; 3 frames dropped up to now",
    ]


@pytest.mark.slow
def test_one_dark_object_among_brighter_ones(tmp_path: Path) -> None:
    """A larger bright thing that comes now and then is not taken for the dark one."""
    random = np.random.default_rng(0)
    columns = 20 + 3.0 * np.arange(40)
    for frame, column in enumerate(columns):
        image = np.full((160, 200), 150.0)
        rows, places = np.indices(image.shape)
        image[np.hypot(rows - 80, places - column) < 7] = 30
        if frame % 8 == 0:
            image[10:30, 150:190] = 240
        image += random.normal(0, 2, image.shape)
        cv2.imwrite(str(tmp_path / f"{frame:03d}.png"), np.clip(image, 0, 255).astype(np.uint8))
    out = tmp_path / "r.nc"
    words = ("--scale", "500px/m", "--fps", "10Hz", "--bodies", "1")
    done = here("track", tmp_path, "--markers", "blob", *words, "-o", out)
    assert done.code == 0, done.err
    assert "objects that are dark are followed" in done.err
    x = dw.load(out)["x"].values[:, 0]
    assert x == pytest.approx((columns - 99.5) / 500, abs=0.5e-3)


@pytest.mark.slow
def test_explained_frame(folder: Path, tmp_path: Path) -> None:
    done = tracked(folder, tmp_path / "r.nc", "--explain", "3")
    assert done.code == 0, done.err
    assert done.out.count("found") == 2
    assert (tmp_path / "r-frame-3.png").stat().st_size > 1000
    assert not (tmp_path / "r.nc").exists()
    named = tracked(folder, tmp_path / "named.png", "--explain", "3")
    assert named.code == 0, named.err
    assert (tmp_path / "named.png").read_bytes() == (tmp_path / "r-frame-3.png").read_bytes()
    assert "there is no frame 400" in refusal(
        tracked(folder, tmp_path / "r.nc", "--explain", "400")
    )


@pytest.mark.slow
def test_watching_tells_the_join(folder: Path) -> None:
    done = here(
        "watch", folder / "video.mkv", "--markers", folder / "m.toml", *TANK, "--bodies", "2"
    )
    assert done.code == 0, done.err
    lines = done.out.splitlines()
    assert sum("  join  " in line for line in lines) == 1
    assert [line.split()[-1] for line in lines if "  class  " in line][-2:] == ["1+1", "2"]


def keys(value: object) -> set[str]:
    """Return all keys in a message, at any depth."""
    if isinstance(value, dict):
        return set(value) | {key for inner in value.values() for key in keys(inner)}
    return {key for inner in value for key in keys(inner)} if isinstance(value, list) else set()


@pytest.fixture
def port() -> Iterator[int]:
    """Return a port for a tracker."""
    with held_port() as held:
        yield held


publish = LiveServer.publish


def publish_in_step(server: LiveServer, content: Any, image: Any = None) -> None:
    """Publish when a client is there, and wait until it is under way: none is lost to a client."""
    assert server.wait_for_clients(1, timeout=60)
    publish(server, content, image)
    while any(client._waiting for client in server._clients):
        time.sleep(0.001)


def streamed(port: int, video: Path, folder: Path, out: Path) -> list[dict[str, Any]]:
    """Track a video of two blocks, and return all that a client was sent."""
    lines: list[str] = []

    def read() -> None:
        while True:
            try:
                client = socket.create_connection(("127.0.0.1", port), timeout=0.1)
                break
            except OSError:
                time.sleep(0.01)
        client.settimeout(30)
        with client, client.makefile() as reader:
            lines.extend(reader)

    reader = threading.Thread(target=read)
    reader.start()
    words = ("--markers", folder / "m.toml", *TANK, "--bodies", "2", "--live", str(port))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(LiveServer, "publish", publish_in_step)
        done = here("track", video, *words, "-o", out)
    reader.join(timeout=30)
    assert done.code == 0, done.err
    return [json.loads(line) for line in lines]


@pytest.fixture(scope="module")
def gappy(folder: Path, truth: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the video as if 3 frames were missing before frame 20 and one before frame 30."""
    video = tmp_path_factory.mktemp("gappy") / "video.mkv"
    video.write_bytes((folder / "video.mkv").read_bytes())
    times = truth["time"].values + 0.3 * (np.arange(FRAMES) >= 20) + 0.1 * (np.arange(FRAMES) >= 30)
    return give_times(video, times.tolist())


@pytest.mark.slow
def test_dropped_frames_of_a_file_are_told_as_they_come(
    folder: Path, gappy: Path, tmp_path: Path, port: int
) -> None:
    """In the stream with the first frame after a gap, and in the recording the same at the end."""
    out = tmp_path / "r.nc"
    _, *messages, _ = streamed(port, gappy, folder, out)
    told = {message["frame"]: message["dropped_frames"] for message in messages}
    assert told == {frame: 3 * (frame >= 20) + (frame >= 30) for frame in range(FRAMES)}
    counts = json.loads(xr.load_dataset(out, engine="h5netcdf").attrs["counts"])
    assert counts["dropped"] == told[FRAMES - 1] == 4


@pytest.mark.slow
def test_watching_tells_dropped_frames(folder: Path, gappy: Path) -> None:
    done = here("watch", gappy, "--markers", folder / "m.toml", *TANK, "--bodies", "2")
    assert done.code == 0, done.err
    told = [line.split() for line in done.out.splitlines() if "  dropped  " in line]
    assert [" ".join(words) for words in told] == [
        "2.30 s dropped 3 (3 up to now)",
        "3.40 s dropped 1 (4 up to now)",
    ]


@pytest.mark.slow
def test_live_client_gets_poses_and_joins(folder: Path, tmp_path: Path, port: int) -> None:
    with socket.create_server(("127.0.0.1", port)):
        words = ("--bodies", "2", "--live", str(port))
        assert f"port {port} on 127.0.0.1 is in use" in refusal(
            tracked(folder, tmp_path / "no.nc", *words)
        )
    hello, *messages, over = streamed(port, folder / "video.mkv", folder, tmp_path / "r.nc")
    assert over == {"type": "end", "interrupted": None, "frames_lost_by_client": 0}
    last = messages[-1]
    assert last["frame"] == FRAMES - 1
    assert last["outcome"] == "2"
    assert last["possible"] == ["2"]
    assert last["hidden"] == []
    assert len(last["joined"]) == 1
    assert {body["id"] for body in last["bodies"]} == {"0", "1"}
    assert all(0 < message["latency_s"] < 10 for message in messages)
    assert all(message["type"] == "frame" for message in messages)
    assert hello["tank"] == {"shape": "circle", "diameter_m": 0.3, "center_m": [0.0, 0.0]}
    assert hello["block_side_m"] == 0.03
    assert (hello["body_count"], hello["source"], hello["observed"]) == (2, "video.mkv", True)
    assert (hello["image"]["width_px"], hello["image"]["height_px"]) == (480, 360)
    # The homography puts a body where the frame says that it is.
    body = last["bodies"][0]
    plane = np.array(hello["image"]["homography_px_to_m"]).reshape(3, 3)
    x, y, w = plane @ [body["column_px"], body["row_px"], 1.0]
    assert (x / w, y / w) == pytest.approx((body["x_m"], body["y_m"]), abs=1e-9)
    page = DOCS.joinpath("live-stream.md").read_text(encoding="utf-8")
    missing = {key for message in (hello, *messages, over) for key in keys(message)}
    assert {key for key in missing if f"`{key}`" not in page} == set()


@pytest.mark.slow
def test_interrupted_run_keeps_what_it_had(folder: Path, tmp_path: Path) -> None:
    """The detector presses Ctrl-C at the twentieth frame."""
    out = tmp_path / "r.nc"
    before = """
import os
from driftwalk.track import TwoColourDetector
whole, calls = TwoColourDetector.detect, []
def detect(self, image):
    calls.append(1)
    if len(calls) == 20:
        os.kill(os.getpid(), signal.SIGTERM)
    return whole(self, image)
TwoColourDetector.detect = detect
"""
    done = end(
        start(
            "track", folder / "video.mkv", "--markers", folder / "m.toml", *TANK, "-o", out,
            before=before,
        )
    )  # fmt: skip
    assert done.code == 130, done.err
    recording = dw.load(out)
    assert 15 <= recording.sizes["time"] <= 20
    assert recording.attrs["complete"] == "no"


@pytest.mark.slow
def test_mistakes_are_said_in_one_line(folder: Path, tmp_path: Path) -> None:
    video, markers, out = folder / "video.mkv", folder / "m.toml", tmp_path / "r.nc"
    assert "no scale: state --tank" in refusal(
        here("track", video, "--markers", markers, "-o", out)
    )
    assert "-o recording.nc" in refusal(here("track", video, "--markers", markers, *TANK))
    assert "no such markers file" in refusal(
        here("track", video, "--markers", "no.toml", *TANK, "-o", out)
    )
    assert "--polarity is for --markers blob" in refusal(tracked(folder, out, "--polarity", "dark"))
    text = tmp_path / "text.mp4"
    text.write_text("no video")
    assert "is not a video that OpenCV can read" in refusal(
        here("track", text, "--markers", markers, *TANK, "-o", out)
    )
    assert "watch needs markers with an orientation" in refusal(
        here("watch", video, "--markers", markers, *TANK)
    )
    assert "--squares is columns x rows" in refusal(
        here("camera", "calibrate", tmp_path / "a.png", "--squares", "9", "--square", "2cm",
             "-o", tmp_path / "c.toml")
    )  # fmt: skip
    assert not out.exists()
