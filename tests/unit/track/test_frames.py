"""Where frames come from: times, what is counted, what goes wrong."""

from __future__ import annotations

import tempfile
import threading
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from drawn_blocks import moving_blocks
from hypothesis import given, settings, strategies as st
from matroska import give_times

import driftwalk as dw
from driftwalk.core.errors import FormatError, InputError
from driftwalk.track.frames import FrameFilter, FrameGaps


def small(level: str = "moderate") -> dw.datasets.VideoSettings:
    return dw.video_settings(level, width_px=160, height_px=120, px_per_m=375.0)


def picture(value: int, height: int = 8) -> np.ndarray:
    return np.full((height, 10, 3), value, dtype=np.uint8)


def test_a_video_gives_its_times_and_pixels(tmp_path: Path) -> None:
    blocks = moving_blocks(5, rate=8.0)
    path = dw.write_video(tmp_path / "synthetic.mkv", blocks, small())
    source = dw.open_source(path)
    frames = list(source)
    drawn = [image for _, image in dw.render_video(blocks, small())]
    assert [f.time for f in frames] == pytest.approx(blocks["time"].values, abs=1e-3)
    assert all((f.image == image).all() for f, image in zip(frames, drawn, strict=True))
    assert source.counts.to_dict() == {"frames": 5, "dropped": 0, "duplicates": 0, "stale": 0}
    assert source.interrupted is None


def test_dropped_duplicate_and_stale_frames_are_counted() -> None:
    counts = dw.track.FrameCounts()
    keep = FrameFilter("list", counts, gaps=FrameGaps())
    times = [0.0, 0.1, 0.1, 0.2, 0.5, 0.6, 0.7]
    values = [1, 2, 2, 3, 4, 4, 5]
    frames = [
        keep.accept(i, t, picture(v)) for i, (t, v) in enumerate(zip(times, values, strict=True))
    ]
    keep.settle()
    assert [f.time for f in frames if f is not None] == [0.0, 0.1, 0.2, 0.5, 0.7]
    assert counts.to_dict() == {"frames": 5, "dropped": 2, "duplicates": 1, "stale": 1}


def test_a_size_that_changes_names_the_frame() -> None:
    keep = FrameFilter("list", dw.track.FrameCounts())
    keep.accept(0, 0.0, picture(1))
    with pytest.raises(FormatError, match=r"list: frame 1 is 10 x 9 pixels, .* 10 x 8"):
        keep.accept(1, 0.1, picture(1, height=9))


def test_times_of_images_may_vary_and_repeat(tmp_path: Path) -> None:
    """From a list of times: one frame twice, one that shows nothing new, and a gap."""
    times = [0.0, 0.1, 0.2, 0.2, 0.3, 0.7, 0.8, 0.9]
    lines = ["file,time_s"]
    for index, time in enumerate(times):
        cv2.imwrite(str(tmp_path / f"{index}.png"), picture(10 * (index - (index == 5))))
        lines.append(f"{index}.png,{time}")
    (tmp_path / "times.csv").write_text("\n".join(lines))
    source = dw.open_source(tmp_path)
    assert [frame.time for frame in source] == [0.0, 0.1, 0.2, 0.3, 0.8, 0.9]
    assert source.counts.to_dict() == {"frames": 6, "dropped": 3, "duplicates": 1, "stale": 1}


def test_images_need_times_or_a_rate(tmp_path: Path) -> None:
    for index in range(3):
        cv2.imwrite(str(tmp_path / f"{index}.png"), picture(40 * index))
    with pytest.raises(InputError, match="state their rate"):
        dw.open_source(tmp_path)
    assert [f.time for f in dw.open_source(tmp_path, rate=4.0)] == [0.0, 0.25, 0.5]
    (tmp_path / "times.csv").write_text("file,time_s\n0.png,1.0\n2.png,1.75\n")
    assert [f.time for f in dw.open_source(tmp_path)] == [1.0, 1.75]
    (tmp_path / "times.csv").write_text("file,time_s\n0.png,soon\n")
    with pytest.raises(FormatError, match="line 2"):
        dw.open_source(tmp_path)
    for beyond in ("1e308", "inf", "nan"):
        (tmp_path / "times.csv").write_text(f"file,time_s\n0.png,1.0\n2.png,{beyond}\n")
        with pytest.raises(FormatError, match=r"line 3: has a time of .* which no clock shows"):
            dw.open_source(tmp_path)


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "no such video"), (b"", "nothing to read"), (b"x" * 999, "not a video")],
)
def test_what_is_no_video(tmp_path: Path, content: bytes | None, message: str) -> None:
    path = tmp_path / "film.mp4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FormatError, match=message):
        dw.open_source(path)


def test_a_video_without_frames(tmp_path: Path) -> None:
    path = tmp_path / "none.avi"
    cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"FFV1"), 10.0, (64, 48)).release()
    with pytest.raises(FormatError, match=r"none\.avi: "):
        list(dw.open_source(path))


def varying(path: Path, times: list[float]) -> Path:
    """Write a video whose frames come at these times [s], no two frames alike."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"FFV1"), 25.0, (64, 48))
    for index in range(len(times)):
        writer.write(np.full((48, 64, 3), 2 * index, np.uint8))
    writer.release()
    return give_times(path, times)


def test_times_are_those_of_the_stream_where_the_rate_varies(tmp_path: Path) -> None:
    """A gap, a time that is there twice, and one that goes back: to the millisecond."""
    times = [0.0, 0.04, 0.08, 0.12, 0.32, 0.36, 0.4, 0.4, 0.44, 0.42, 0.48, 0.52]
    source = dw.open_source(varying(tmp_path / "varying.mkv", times))
    frames = list(source)
    assert [frame.index for frame in frames] == [0, 1, 2, 3, 4, 5, 6, 8, 10, 11]
    expected = [times[frame.index] for frame in frames]
    assert [frame.time for frame in frames] == pytest.approx(expected, abs=1e-6)
    assert source.counts.to_dict() == {"frames": 10, "dropped": 4, "duplicates": 2, "stale": 0}
    assert source.interrupted is None


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(10, 300), min_size=3, max_size=40))
def test_a_varying_rate_is_not_taken_for_a_file_cut_off(gaps_ms: list[int]) -> None:
    """OpenCV makes the number of frames from duration and rate, which says nothing here."""
    times = (np.cumsum([0, *gaps_ms]) / 1000).tolist()
    with tempfile.TemporaryDirectory() as folder:
        source = dw.open_source(varying(Path(folder) / "varying.mkv", times))
        assert [frame.time for frame in source] == pytest.approx(times, abs=1e-6)
    assert source.interrupted is None


def test_a_file_cut_off_says_where(tmp_path: Path) -> None:
    path = dw.write_video(tmp_path / "whole.mkv", moving_blocks(30), small())
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    source = dw.open_source(path)
    number = len(list(source))
    assert 12 <= number <= 16
    assert source.interrupted == f"{path} ends after {number} frames, at {number / 10} s of 3.0 s"


def overlay_of(path: Path, times: list[float]) -> tuple[float, list[int]]:
    """Write pictures of rising brightness at these times; return rate and brightness read back."""
    writer = dw.track.OverlayWriter(path)
    for index, time in enumerate(times):
        writer.write(np.full((48, 64, 3), 10 * index, np.uint8), time)
    writer.close()
    capture = cv2.VideoCapture(str(path))
    rate = capture.get(cv2.CAP_PROP_FPS)
    seen = []
    while (read := capture.read())[0]:
        seen.append(round(float(read[1].mean()) / 10))
    return rate, seen


def test_an_overlay_plays_as_fast_as_its_source(tmp_path: Path) -> None:
    assert overlay_of(tmp_path / "a.mkv", [0.125 * i for i in range(20)]) == (8.0, [*range(20)])
    # Where frames are missing the one before stays: the third comes 0.5 s late.
    times = [0.0, 0.1, 0.2, *(0.7 + 0.1 * i for i in range(15))]
    rate, seen = overlay_of(tmp_path / "b.mkv", times)
    assert rate == pytest.approx(10.0)
    assert seen == [0, 1, *[2] * 5, *range(3, 18)]
    # Few pictures, and one alone.
    assert overlay_of(tmp_path / "c.mkv", [5.0, 5.2, 5.4]) == (5.0, [0, 1, 2])
    assert overlay_of(tmp_path / "d.mkv", [5.0])[1] == [0]


class Camera:
    """Hands out numbered frames; `gate` holds it until the test has worked on one."""

    def __init__(self, frames: int) -> None:
        self.left, self.gate, self.ahead = frames, threading.Event(), 3
        self.released = False

    def read(self) -> tuple[bool, Any]:
        if self.ahead == 0:
            self.gate.wait(60.0)
        self.ahead -= 1
        self.left -= 1
        return (True, picture(self.left)) if self.left >= 0 else (False, None)

    def release(self) -> None:
        self.released = True


def test_a_camera_hands_out_the_newest_and_may_disappear() -> None:
    camera = Camera(frames=6)
    # A clock that goes on by a second with each frame that is read.
    live = dw.track.LiveCamera(camera, "camera:0", patience=60.0, now=lambda: 100.0 - camera.left)
    frames, waited = [], []
    for frame in live:
        frames.append(frame)
        waited.append(live.waited_s)
        camera.gate.set()
    assert frames
    assert frames[-1].index == 5
    assert len(frames) + live.counts.dropped == 6
    assert frames[-1].time - frames[0].time == frames[-1].index - frames[0].index
    # What is handed on is at most as old as the frames that were read since.
    assert all(0.0 <= age <= 6.0 for age in waited)
    assert live.interrupted == "camera:0 stopped after 6 frames"
    assert camera.released
