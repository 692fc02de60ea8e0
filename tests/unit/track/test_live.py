"""The live server: what clients get, and that a slow one holds up nobody."""

from __future__ import annotations

import base64
import contextlib
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TextIO

import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.track.live import LIVE, LiveServer, Particle, jpeg_text, nmea_frame, requested_width


@pytest.fixture
def connect() -> Iterator[Callable[..., tuple[socket.socket, TextIO]]]:
    """Give a function that connects a client: its socket, and a file to read from."""
    with contextlib.ExitStack() as opened:

        def to(server: LiveServer, *, small: bool = False) -> tuple[socket.socket, TextIO]:
            client = opened.enter_context(socket.socket())
            if small:
                client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            client.connect((server.host, server.port))
            client.settimeout(20)
            return client, opened.enter_context(client.makefile(newline=""))

        yield to


def left(server: LiveServer) -> bool:
    """Say whether every client is gone after a while."""
    deadline = time.monotonic() + 10
    while server.clients and time.monotonic() < deadline:
        server.publish({"frame": 0})
        time.sleep(0.01)
    return server.clients == 0


def test_each_client_gets_every_frame_in_order(connect) -> None:
    with LiveServer(0) as server:
        readers = [connect(server)[1] for _ in range(3)]
        assert server.wait_for_clients(3)
        for frame in range(5):
            server.publish({"frame": frame, "theta_rad": float("nan")})
        for reader in readers:
            lines = [json.loads(reader.readline()) for _ in range(5)]
            assert [line["frame"] for line in lines] == list(range(5))
            assert lines[0] == {"frame": 0, "theta_rad": None, "frames_lost_by_client": 0}


def test_hello_comes_first_however_late_a_client_connects(connect) -> None:
    with LiveServer(0, hello={"type": "hello", "tank": None}) as server:
        for frame in range(3):
            server.publish({"frame": frame})
        for number in (1, 2):
            _, reader = connect(server)
            assert json.loads(reader.readline()) == {"type": "hello", "tank": None}
            assert server.wait_for_clients(number)
            server.publish({"frame": 3})
            assert json.loads(reader.readline())["frame"] == 3


@pytest.mark.slow
def test_slow_client_loses_frames_and_the_tracker_does_not_wait(connect) -> None:
    """One client never reads 400 messages of 100 kB; another one reads them all the while."""
    payload = "x" * 100_000
    with LiveServer(0) as server:
        _, reader = connect(server, small=True)
        _, quick = connect(server)
        assert server.wait_for_clients(2)
        longest = 0.0
        for frame in range(400):
            began = time.perf_counter()
            server.publish({"frame": frame, "payload": payload})
            longest = max(longest, time.perf_counter() - began)
            assert json.loads(quick.readline())["frame"] == frame
        assert longest < 1.0
        frames, lost = [], 0
        while not frames or frames[-1] < 399:
            line = json.loads(reader.readline())
            frames.append(line["frame"])
            lost = line["frames_lost_by_client"]
        assert frames == sorted(set(frames))
        assert 0 < lost <= 400 - len(frames)


@pytest.mark.slow
def test_the_last_lines_wait_for_a_client_that_is_busy(connect) -> None:
    with LiveServer(0) as server:
        _, reader = connect(server, small=True)
        assert server.wait_for_clients(1)
        for frame in range(3):
            server.publish({"frame": frame, "payload": "x" * 3_000_000})
        found: list[int] = []

        def read_late() -> None:
            time.sleep(1.0)
            found.extend(json.loads(line)["frame"] for line in reader)

        busy = threading.Thread(target=read_late)
        busy.start()
    busy.join()
    assert found == [0, 1, 2]


@pytest.mark.slow
def test_clients_that_never_read_are_left_together(
    connect, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("driftwalk.track.live.LIVE", LIVE._replace(patience_s=1.0))
    server = LiveServer(0)
    _clients = [connect(server, small=True) for _ in range(8)]
    assert server.wait_for_clients(8)
    for frame in range(3):
        server.publish({"frame": frame, "payload": "x" * 10_000_000})
    began = time.monotonic()
    server.close()
    # One after the other they would take eight seconds.
    assert time.monotonic() - began < 7.0
    assert server.clients == 0


def test_client_that_leaves_is_forgotten(connect) -> None:
    with LiveServer(0) as server:
        client, reader = connect(server)
        assert server.wait_for_clients(1)
        reader.close()
        client.close()
        assert left(server)


def test_image_is_sent_once_on_request_and_scaled(connect) -> None:
    cv2 = pytest.importorskip("cv2")
    image = np.full((60, 80, 3), (10, 120, 240), np.uint8)
    with LiveServer(0) as server:
        client, reader = connect(server)
        assert server.wait_for_clients(1)
        client.sendall(b'nonsense\n{"jpeg_width": 40}\n')
        got = []
        deadline = time.monotonic() + 10
        while not any("jpeg_base64" in line for line in got) and time.monotonic() < deadline:
            server.publish({"frame": len(got)}, image)
            got.append(json.loads(reader.readline()))
        server.publish({"frame": len(got)}, image)
        assert "jpeg_base64" not in json.loads(reader.readline())
        data = np.frombuffer(base64.b64decode(got[-1]["jpeg_base64"]), np.uint8)
        shown = cv2.imdecode(data, cv2.IMREAD_COLOR)
        assert shown.shape == (30, 40, 3)
        assert np.abs(shown.astype(int) - image[0, 0]).max() < 8
    large = np.frombuffer(base64.b64decode(jpeg_text(image, 4000)), np.uint8)
    assert cv2.imdecode(large, cv2.IMREAD_COLOR).shape == (60, 80, 3)


@pytest.mark.parametrize(
    "line", [b"[]", b'{"jpeg_width": "wide"}', b'{"jpeg_width": 9e9}', b"\xff"]
)
def test_other_requests_are_ignored(line: bytes) -> None:
    assert requested_width(line) is None


def test_endless_request_ends_the_connection(connect) -> None:
    with LiveServer(0) as server:
        client, _ = connect(server)
        assert server.wait_for_clients(1)
        client.sendall(b"x" * 10_000)
        # Closed, or reset because the rest of the request was not read.
        with contextlib.suppress(ConnectionError):
            assert client.recv(1024) == b""
        assert left(server)


def test_port_in_use_and_no_such_port() -> None:
    with LiveServer(0) as server:
        assert server.host == "127.0.0.1"
        with pytest.raises(InputError, match=f"port {server.port} on 127.0.0.1 is in use"):
            LiveServer(server.port)
    with pytest.raises(InputError, match="0 to 65535, got 70000"):
        LiveServer(70000)
    with pytest.raises(InputError, match=r"cannot listen on 192\.0\.2\.1"):
        LiveServer(0, host="192.0.2.1")


def test_nmea_stream_reads_back(connect, tmp_path: Path) -> None:
    """What the project's own reader of SwisTrack logs makes of the stream: the same poses."""
    random = np.random.default_rng(0)
    poses = random.uniform(-0.1, 0.1, (20, 2, 3)) * (1, 1, 30)
    server = LiveServer(0, encode=lambda content: nmea_frame(*content))
    _, reader = connect(server)
    assert server.wait_for_clients(1)
    text = ""
    for frame, row in enumerate(poses):
        one = [Particle(i, 100.0 + i, 50.0, p[2], p[0], p[1]) for i, p in enumerate(row)]
        server.publish((frame, one))
        text += "".join(reader.readline() for _ in range(5))
    server.close()
    file = tmp_path / "stream.txt"
    file.write_text(text, newline="")
    recording = load(file, frame_rate=10.0)
    for part, name in enumerate(("x", "y")):
        np.testing.assert_allclose(recording[name].values, poses[..., part], atol=6e-7)
    turned = recording["theta"].values - poses[..., 2]
    np.testing.assert_allclose(np.sin(turned / 2), 0, atol=6e-7)
