"""A small synthetic video with its markers file, and a camera that shows it over the network."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import cv2
import numpy as np
import pytest
import xarray as xr
from drawn_blocks import marker_of, moving_blocks

import driftwalk as dw
from driftwalk.track.frames import LiveCamera

SMALL = {"width_px": 240, "height_px": 180, "px_per_m": 560.0}
TANK = ("--tank", "30cm")


def film(folder: Path, trajectory: xr.Dataset | None = None, *, frames: int = 24) -> list[object]:
    """Write ``video.mkv`` and ``m.toml``; return the words for the command line after `track`."""
    settings = dw.video_settings("moderate", **SMALL)
    blocks = moving_blocks(frames, bodies=2) if trajectory is None else trajectory
    video = dw.write_video(folder / "video.mkv", blocks, settings)
    marker = marker_of(settings).model_copy(update={"block_side_m": settings.block_side_m})
    return [video, "--markers", dw.track.save_markers(folder / "m.toml", marker), *TANK]


def images_of(video: Path) -> list[np.ndarray]:
    """Return all images of a video."""
    return [frame.image for frame in dw.open_source(video)]


@contextlib.contextmanager
def network_camera(video: Path, *, shown: int, rate: float = 30.0) -> Iterator[str]:
    """Serve the images of a video as a network camera does; each connection ends after `shown`.

    It takes its time where the tracker does: the next image comes when the last one was taken.
    """
    opened: list[LiveCamera] = []
    open_camera = LiveCamera.open

    def open_and_note(text: str) -> LiveCamera:
        opened.append(open_camera(text))
        return opened[-1]

    def one_waits() -> bool:
        return any(
            camera._newest is not None and camera._thread.is_alive() and not camera._stop
            for camera in opened
        )

    files = [cv2.imencode(".jpg", image)[1].tobytes() for image in images_of(video)]

    class Handler(BaseHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            """Stay silent."""

        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=next")
            self.end_headers()
            with contextlib.suppress(OSError):
                for number in range(shown):
                    file = files[number % len(files)]
                    head = f"--next\r\nContent-Type: image/jpeg\r\nContent-Length: {len(file)}\r\n"
                    self.wfile.write(head.encode() + b"\r\n" + file + b"\r\n")
                    time.sleep(1.0 / rate)
                    while one_waits():
                        time.sleep(0.002)

    with (
        pytest.MonkeyPatch.context() as patch,
        ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server,
    ):
        patch.setattr(LiveCamera, "open", staticmethod(open_and_note))
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"camera:http://127.0.0.1:{server.server_port}/stream.mjpg"
        server.shutdown()
        thread.join()
