"""`driftwalk view` and `driftwalk play` as a user runs them, with what can be wrong."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import shutil
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import FLOW, here, refusal
from finished_run import write_finished_run
from page_server import PageServer, received, say, served
from ports import held_port
from websockets.exceptions import ConnectionClosedError, InvalidStatus
from websockets.sync.client import connect

import driftwalk as dw
from driftwalk.core.files.rundir import RunDirectory
from driftwalk.viewer.watch.run_page import RunSource

HOSTILE = "<script>alert(1)<|script>&\"'"


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a finished calibration in a folder with a hostile name."""
    return write_finished_run(tmp_path_factory.mktemp("view") / HOSTILE)


@pytest.fixture(scope="module")
def server(finished: Path) -> Iterator[PageServer]:
    """Serve the finished run."""
    with served("view", finished) as started:
        yield started


def test_page_of_a_finished_run(server: PageServer, finished: Path) -> None:
    assert server.address == f"http://127.0.0.1:{server.port}/"
    page = server.get("/")
    assert page.status == 200
    assert page.headers["x-content-type-options"] == "nosniff"
    assert page.headers["cache-control"] == "no-store"
    policy = page.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "<script>alert" not in page.body.decode()
    for name in ("driftwalk.js", "driftwalk.css"):
        assert server.get(f"/{name}").status == 200
    with server.socket() as channel:
        sent = received(channel, "page")["page"]
    assert sent["view"] == "run"
    assert sent["state"]["finished"] is True
    found = xr.load_dataset(finished / "calibration.nc", engine="h5netcdf")
    section = next(part for part in sent["sections"] if part["kind"] == "map")
    distance = found["ks_distance"].values
    # The first parameter lies along x.
    np.testing.assert_allclose(dw.page.decode_array(section["value"]), distance.T)


def test_files_and_report(server: PageServer, finished: Path) -> None:
    stored = server.get("/files/figures/map.png")
    assert stored.body == (finished / "figures" / "map.png").read_bytes()
    assert stored.headers["content-type"] == "application/octet-stream"
    assert stored.headers["content-disposition"].startswith("attachment")
    report = server.get("/report.html")
    assert report.headers["content-disposition"].startswith("attachment")
    assert b"<script>alert" not in report.body
    assert report.body.startswith(b"<!doctype html>")


@pytest.mark.parametrize(
    "path",
    [
        *("/files/../../etc/passwd", "/files/%2e%2e/study.toml", "/files/..%2fstudy.toml"),
        *("/files//etc/passwd", "/files/.lock", "/files/figures", "/files/", "/files/%00"),
        *("/../study.toml", "/docs", "/openapi.json", "/nothing", "/static/driftwalk.js"),
    ],
)
def test_no_other_path(server: PageServer, path: str) -> None:
    answer = server.get(path)
    assert answer.status == 404
    assert b"force_std" not in answer.body
    assert "content-security-policy" in answer.headers


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Host": "evil.example", "Origin": "http://evil.example"},
    ],
)
def test_strangers_are_turned_away(server: PageServer, headers: dict[str, str]) -> None:
    for path in ("/", "/driftwalk.js", "/files/calibration.nc", "/report.html"):
        assert server.get(path, **headers).status == 403
    if "Host" not in headers:
        with pytest.raises(InvalidStatus, match="403"), server.socket(**headers):
            pass


def test_only_reading(server: PageServer) -> None:
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert server.get("/", method=method).status == 405


def test_nonsense_on_the_socket_is_survived(server: PageServer) -> None:
    with server.socket() as channel:
        received(channel, "page")
        for text in ("", "{", "[]", "null", '{"type":{}}', '{"type":"cell","row":"x"}', "[" * 9999):
            channel.send(text)
        for depth in (300, 480, 900, 940, 960, 980):
            nested = "[" * depth + "NaN" + "]" * depth
            channel.send(f'{{"type":"cell","id":{nested},"row":{nested}}}')
        channel.send(f'{{"type":"cell","id":"map","row":{10**400},"column":true}}')
        channel.send(b"\xff\x00")
        say(channel, type="cell", id="map", row=0, column=0)
        while received(channel, "cell")["row"] != 0:
            pass
    with server.socket() as channel:
        received(channel, "page")


@pytest.mark.slow
def test_bad_utf_8_ends_only_its_sender_and_ctrl_c_ends_the_server(finished: Path) -> None:
    with (
        served("view", finished) as started,
        started.socket() as other,
        started.socket() as channel,
    ):
        received(channel, "page")
        # A text frame, masked with zeros, of two bytes that no UTF-8 has.
        channel.socket.sendall(b"\x81\x82\x00\x00\x00\x00\xff\xfe")
        with pytest.raises(ConnectionClosedError, match="1007"):
            received(channel, "never")
        received(other, "page")
        say(other, type="cell", id="map", row=0, column=0)
        received(other, "cell")
        # Ctrl-C ends it while a browser is there.
        code, words = started.stop()
    assert code == 0
    assert words == "driftwalk: Ctrl-C ends it\n"


QUICK = "from driftwalk.viewer import app\napp.REQUEST_S = 0.5\n"


def send_slowly(raw: socket.socket) -> None:
    """Send a byte now and then, for half a minute."""
    for _ in range(300):
        raw.sendall(b"x")
        time.sleep(0.1)


@pytest.mark.slow
def test_half_a_request_is_not_waited_for(finished: Path) -> None:
    """Nothing, half of a head, a byte now and then: all are closed; who has asked stays."""
    with served("view", finished, before=QUICK) as started, started.socket() as channel:
        received(channel, "page")
        head = f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{started.port}\r\n".encode()
        whole = head + b"\r\n"
        with contextlib.ExitStack() as opened:
            slow = []
            for sent in (b"", head, b"G", whole + head):
                raw = opened.enter_context(socket.create_connection(("127.0.0.1", started.port)))
                raw.settimeout(30.0)
                raw.sendall(sent)
                slow.append(raw)
            trickle = opened.enter_context(socket.create_connection(("127.0.0.1", started.port)))
            trickle.sendall(head + b"X: ")
            with pytest.raises((ConnectionResetError, BrokenPipeError)):
                send_slowly(trickle)
            for raw in slow:
                with contextlib.suppress(ConnectionResetError):
                    while raw.recv(65536):
                        pass
        # A WebSocket is no request that is waited for.
        say(channel, type="cell", id="map", row=0, column=0)
        received(channel, "cell")
        assert started.get("/").status == 200


def test_a_browser_that_goes_away_is_forgotten(server: PageServer) -> None:
    for _ in range(40):
        with closing(socket.create_connection(("127.0.0.1", server.port))) as raw:
            key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n"
            head = f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n"
            raw.sendall(f"{head}Upgrade: websocket\r\nConnection: Upgrade\r\n{key}\r\n".encode())
            assert raw.recv(12) == b"HTTP/1.1 101"
            # Torn off, with the page on its way.
    with server.socket() as channel:
        received(channel, "page")


def test_an_origin_that_is_given_twice_is_refused(server: PageServer) -> None:
    own = f"127.0.0.1:{server.port}"
    for origins in (
        ("http://evil.example", f"http://{own}"),
        (f"http://{own}", "http://e.example"),
    ):
        head = "".join(f"Origin: {origin}\r\n" for origin in origins)
        with closing(socket.create_connection(("127.0.0.1", server.port))) as raw:
            raw.sendall(f"GET / HTTP/1.1\r\nHost: {own}\r\n{head}\r\n".encode())
            assert raw.recv(12) == b"HTTP/1.1 403"


def test_a_message_without_measure_ends_only_its_sender(server: PageServer) -> None:
    with server.socket() as other, server.socket() as channel:
        received(channel, "page")
        channel.send("x" * 70_000)
        with pytest.raises(ConnectionClosedError, match="1009"):
            received(channel, "never")
        received(other, "page")
        say(other, type="cell", id="map", row=0, column=0)
        received(other, "cell")


@pytest.mark.slow
def test_so_many_browsers_and_no_more(server: PageServer) -> None:
    """Fifty that never read: the first 32 are let in, and whoever leaves makes room."""
    with contextlib.ExitStack() as stalled:
        for _ in range(50):
            stalled.enter_context(server.socket())
        with server.socket() as channel, pytest.raises(ConnectionClosedError, match="1013"):
            received(channel, "page")
        # Other requests are answered all the same.
        assert server.get("/").status == 200
    with server.socket() as channel:
        received(channel, "page")


@pytest.mark.slow
def test_away_from_loopback_a_token_is_asked_for(finished: Path) -> None:
    with served("view", finished, "--host", "0.0.0.0") as started:
        token = started.parts.query
        assert token.startswith("token=")
        assert started.get("/").status == 403
        assert started.get("/?token=guess").status == 403
        page = started.get(f"/?{token}")
        assert page.status == 200
        assert f"driftwalk.js?{token}" in page.body.decode()
        with started.socket(query=f"?{token}") as channel:
            received(channel, "page")
        with pytest.raises(InvalidStatus, match="403"), started.socket():
            pass
        code, words = started.stop()
        assert code == 0
        assert "not encrypted" in words
        # It stands in the address that was printed, and nowhere else.
        assert token.removeprefix("token=") not in words


@pytest.mark.slow
def test_a_port_in_use(finished: Path) -> None:
    with closing(socket.create_server(("127.0.0.1", 0))) as taken:
        port = taken.getsockname()[1]
        words = refusal(here("view", finished, "--port", port, "--no-open"))
    assert f"port {port} on 127.0.0.1 is in use" in words
    assert "--port" in words


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["view"], "Missing argument"),
        (["view", "nowhere"], "nowhere: there is no such directory"),
        (["view", "."], "holds no run of driftwalk"),
        (["view", "lab"], "there is no such directory"),
        (["view", "lab:99999"], "expected an address and a port"),
        (["play", "--blocks", "200"], "do not fit into the tank"),
        (["play", "--blocks", "5000"], "--blocks over the bundled example"),
        (["play", "--study", "nowhere.toml"], "nowhere.toml"),
        (["play", "--flow", "nowhere.nc"], "nowhere.nc"),
        (["play", "--recording", "nowhere.csv"], "nowhere.csv"),
        (["play", "--parameter", "speed=1"], "belongs to a --model"),
        (["play", "--model", "activ"], "activ"),
        (["play", "--model", "active", "--parameter", "sped=1"], "did you mean 'speed'"),
        (["play", "--model", "active", "--parameter", "sped=1,2"], "sped"),
        (["play", "--model", "active", "--live", "0"], "--live publishes a tank of blocks"),
        (["play", "--model", "active", "--save", "a.html"], "--save writes a tank of blocks"),
        (["play", "--save", "a.html", "--live", "0"], "--live needs the server"),
        (["play", "--save", "a.txt"], "ends in .html"),
        (["play", "--model", "active", "--blocks", "3"], "--blocks: the page of a --model"),
        (["play", "--model", "active", "--flow", FLOW], "does not feel the water"),
        (["play", ".", "--model", "active"], "is not a run directory"),
    ],
)
def test_mistakes(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in refusal(here(*words))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--host", "no.such.host.invalid"], "cannot listen on no.such.host.invalid"),
        (["--host", "[::1]x"], "cannot listen on ::1]x"),
        (["--port", "70000"], "from 0 to 65535"),
        # The system takes an empty address for all of the machine's.
        (["--host", ""], "is empty"),
    ],
)
def test_no_such_address(finished: Path, words: list[str], said: str) -> None:
    told = refusal(here("view", finished, "--no-open", *words))
    assert said in told
    assert "while attempting" not in told


@pytest.mark.slow
@pytest.mark.skipif(not socket.has_ipv6, reason="this machine has no IPv6")
@pytest.mark.parametrize("host", ["::1", "[::1]"])
def test_the_other_loopback_address(finished: Path, host: str) -> None:
    with served("view", finished, "--host", host) as started:
        assert started.address == f"http://[::1]:{started.port}/"
        own = f"[::1]:{started.port}"
        with connect(f"ws://{own}/ws", origin=f"http://{own}") as channel:
            received(channel, "page")


def test_a_run_whose_manifest_is_damaged(finished: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(finished, folder)
    (folder / "manifest.json").write_text('{"kind": ')
    words = refusal(here("view", folder, "--no-open"))
    assert "the manifest of the run is damaged" in words
    assert "line 1" in words


@pytest.mark.parametrize("package", ["fastapi", "uvicorn", "websockets"])
def test_without_the_extra_one_line_says_what_to_install(
    finished: Path, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    for command in (["view", finished], ["play"]):
        words = refusal(here(*command))
        assert f"needs {package}: pip install 'driftwalk[view]'" in words


def test_a_run_of_a_later_version(finished: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(finished, folder)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["manifest_version"] = 99
    manifest["software"]["driftwalk"] = "9.9.9"
    (folder / "manifest.json").write_text(json.dumps(manifest))
    words = refusal(here("view", folder, "--no-open"))
    assert "9.9.9" in words
    assert "manifest version 99" in words


@pytest.mark.slow
def test_a_finished_run_that_lost_its_results(finished: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(finished, folder)
    (folder / "calibration.nc").unlink()
    page = RunSource(folder).greeting()[0]["page"]
    # An honest empty state in place of the map, the rest is shown.
    kinds = [section["kind"] for section in page["sections"]]
    assert "map" not in kinds
    assert "empty" in kinds


@pytest.mark.slow
def test_a_sweep_that_has_not_begun(tmp_path: Path) -> None:
    specification = {"study": dw.Study().to_dict(), "body": None, "kind": "calibration"}
    with RunDirectory(tmp_path / "run", specification=specification):
        source = RunSource(tmp_path / "run")
        page = source.greeting()[0]["page"]
        assert page["state"] == {"finished": False, "progress": 0.0, "words": "map: 0 %"}
        value = dw.page.decode_array(page["sections"][0]["value"])
        assert np.isnan(value).all()
        told: list[Any] = []
        asked = {"type": "cell", "id": "map", "row": 0, "column": 0}
        asyncio.run(source.receive(asked, told.append))
        assert [one["excerpt_x"] for one in told if one["type"] == "cell"] == [None]


@pytest.mark.slow
def test_play_shows_a_tank_and_speaks_as_a_tracker() -> None:
    with held_port() as port, served("play", "--blocks", 3, "--live", port) as started:
        with started.socket() as channel:
            page = received(channel, "page")["page"]
            assert [s["kind"] for s in page["sections"]] == ["tank", "controls", "density"]
            first = received(channel, "tank")
            assert len(first["x"]) == 3
            say(channel, type="set", name="blocks", value=4)
            for _ in range(200):
                if len(received(channel, "tank")["x"]) == 4:
                    break
            else:
                raise AssertionError("the number of blocks did not change")
            say(channel, type="set", name="force_std", value=-1)
            assert "stochastic force" in received(channel, "note")["words"]
            # At rest the density stays empty, however late it is looked at.
            say(channel, type="action", name="pause")
            say(channel, type="action", name="clear")
            while (density := received(channel, "density"))["steps"] > 0:
                pass
            assert density["noise_floor"] is None
            say(channel, type="action", name="run")
        live = f"127.0.0.1:{port}"
        with served("view", live) as watcher, watcher.socket() as channel:
            assert received(channel, "page")["page"]["view"] == "live"
            assert received(channel, "hello")["source"] == "playground"
            frame = received(channel, "frame")
            assert len(frame["bodies"]) == 4
            assert received(channel, "frame")["time_s"] > frame["time_s"]


@pytest.mark.slow
def test_play_does_without_a_bundled_flow(tmp_path: Path) -> None:
    with served("play", "--tank", "60cm", "--blocks", 2) as started:
        with started.socket() as channel:
            page = received(channel, "page")["page"]
            assert page["sections"][0]["arena"]["diameter_m"] == 0.6
            assert page["sections"][2]["recording"] is None
        code, words = started.stop()
    assert code == 0
    assert "the water moves in a random flow" in words
    # Not a word more than that: nothing complains at the end.
    assert words.count("\n") == 2


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="a directory cannot have this name elsewhere")
def test_the_folder_s_name_is_only_text(server: PageServer, finished: Path) -> None:
    assert finished.name == HOSTILE
    with server.socket() as channel:
        assert HOSTILE in json.dumps(received(channel, "page")["page"], ensure_ascii=False).replace(
            '\\"', '"'
        )


@pytest.mark.slow
def test_play_a_motion_model() -> None:
    choices = ("--parameter", "speed=0.02", "--parameter", "turn_rate=-1,1")
    with served("play", "--model", "active", *choices, "--tank", "20cm") as started:
        with started.socket() as channel:
            page = received(channel, "page")["page"]
            tank, controls, _ = page["sections"]
            assert (tank["arena"]["diameter_m"], tank["shape"]) == (0.2, "dot")
            knobs = {item["name"]: item for item in controls["items"]}
            assert knobs["parameter:speed"]["value"] == 0.02
            assert (knobs["parameter:turn_rate"]["min"], knobs["parameter:turn_rate"]["max"]) == (
                -1.0,
                1.0,
            )
            first = received(channel, "tank")
            assert len(first["x"]) == 4
            say(channel, type="set", name="parameter:speed", value=0.1)
            say(channel, type="set", name="bodies", value=2)
            for _ in range(200):
                if len(received(channel, "tank")["x"]) == 2:
                    break
            else:
                raise AssertionError("the number of bodies did not change")
            say(channel, type="set", name="parameter:speed", value=-1)
            assert "speed" in received(channel, "note")["words"]
        code, _ = started.stop()
    assert code == 0
