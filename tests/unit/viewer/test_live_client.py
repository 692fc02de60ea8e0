"""The client of a tracker's stream, against the real server of streams and against others."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from typing import Any

import numpy as np
import pytest
from ports import held_port

from driftwalk.core.errors import InputError
from driftwalk.track import LiveServer
from driftwalk.viewer.hub import make_message
from driftwalk.viewer.live_client import LiveSource, stream_line

HELLO = {"type": "hello", "format": "driftwalk live", "version": 1, "source": "test"}


def frame(number: int, **more: Any) -> dict[str, Any]:
    return {"type": "frame", "frame": number, "time_s": 0.1 * number, "bodies": [], **more}


@pytest.fixture
def port() -> Iterator[int]:
    """Return a port for a server that comes later, again, or never."""
    with held_port() as held:
        yield held


class Heard(list[Any]):
    """Everything that was published, and a wait for something among it."""

    async def until(self, wanted: Callable[[Any], bool]) -> Any:
        async with asyncio.timeout(10):
            while True:
                for content in self:
                    if wanted(content):
                        return content
                await asyncio.sleep(0.01)


@asynccontextmanager
async def listening(port: int) -> AsyncIterator[tuple[LiveSource, Heard]]:
    source, heard = LiveSource("127.0.0.1", port), Heard()
    task = asyncio.create_task(source.run(heard.append))
    try:
        yield source, heard
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


def kind(name: str) -> Callable[[Any], bool]:
    return lambda content: content["type"] == name


def test_hello_and_frames_are_handed_on() -> None:
    async def run() -> None:
        with LiveServer(0, hello=HELLO) as server:
            async with listening(server.port) as (source, heard):
                assert (await heard.until(kind("hello")))["source"] == "test"
                server.publish(frame(7))
                assert (await heard.until(kind("frame")))["frame"] == 7
                # A browser that comes later sees the last of both.
                kinds = [content["type"] for content in source.greeting()]
                assert kinds == ["page", "hello", "frame"]

    asyncio.run(run())


@pytest.mark.slow
def test_no_event_is_missed_with_a_frame() -> None:
    async def run() -> None:
        with LiveServer(0, hello=HELLO) as server:
            async with listening(server.port) as (_, heard):
                await heard.until(kind("hello"))
                for number in range(60):
                    event = {
                        "time_s": number,
                        "kind": "join",
                        "bodies": ["a", "b"],
                        "outcome": None,
                    }
                    server.publish(frame(number, events=[event] if number % 10 == 5 else []))
                    await heard.until(lambda c, n=number: c.get("frame") == n)
                last = heard[-1]["events"]
                assert [event["time_s"] for event in last] == [5, 15, 25, 35, 45, 55]
                server.publish(frame(60, events=None))
                assert (await heard.until(lambda c: c.get("frame") == 60))["events"] is None

    asyncio.run(run())


def test_a_lost_tracker_is_found_again(port: int) -> None:
    async def run() -> None:
        async with listening(port) as (source, heard):
            with LiveServer(port, hello=HELLO) as server:
                await heard.until(kind("hello"))
                server.publish(frame(1))
                await heard.until(kind("frame"))
            assert "gone" in (await heard.until(kind("lost")))["words"]
            heard.clear()
            with LiveServer(port, hello={**HELLO, "source": "again"}):
                assert (await heard.until(kind("hello")))["source"] == "again"
                # Nothing of the old stream is left.
                assert [c["type"] for c in source.greeting()] == ["page", "hello"]

    asyncio.run(run())


@pytest.mark.slow
def test_the_end_is_no_loss() -> None:
    async def run() -> None:
        with LiveServer(0, hello=HELLO) as server:
            async with listening(server.port) as (_, heard):
                await heard.until(kind("hello"))
                server.publish({"type": "end", "interrupted": None})
                await heard.until(kind("end"))
                server.close()
                await asyncio.sleep(0.6)
                assert [c["type"] for c in heard] == ["hello", "end"]

    asyncio.run(run())


def test_an_odd_body_is_left_out_and_said() -> None:
    """As a tracker in another language may send them: NaN, which is no JSON, and a missing key."""
    good = {"id": "a", "seen": True, "x_m": 0.1, "y_m": 0.0, "theta_rad": 0.5}
    bad = [{**good, "id": "b", "x_m": float("nan")}, {"id": "c", "seen": True}]

    async def run() -> None:
        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            writer.write(json.dumps(HELLO).encode() + b"\n")
            for number in range(40):
                line = json.dumps(frame(number, bodies=[*bad, good]))
                writer.write(line.encode() + b"\nnot a line\n")
            await writer.drain()
            await reader.read()
            writer.close()

        server = await asyncio.start_server(answer, "127.0.0.1", 0)
        async with server, listening(server.sockets[0].getsockname()[1]) as (source, heard):
            last = await heard.until(lambda content: content.get("frame") == 39)
            assert last["bodies"] == [good]
            frames = [content for content in heard if content["type"] == "frame"]
            assert [content["frame"] for content in frames] == list(range(40))
            # Two reasons and an unreadable line: not a sentence for each of the forty frames.
            notes = [content["words"] for content in heard if content["type"] == "note"]
            assert 1 <= len(notes) <= 2
            assert "2 bodies of 1 frame" in notes[0]
            assert "x_m is not a finite number" in notes[0]
            # A browser that comes later is told too.
            assert notes[-1] in [content.get("words") for content in source.greeting()]

    asyncio.run(run())


async def request_arrived(server: LiveServer) -> None:
    """Wait until the server's only client has asked for an image."""
    async with asyncio.timeout(10):
        while server._clients[0]._width is None:
            await asyncio.sleep(0.005)


def test_a_flood_of_frames_lets_the_others_have_their_turn() -> None:
    number = 5000
    flood = b"".join(json.dumps(frame(index)).encode() + b"\n" for index in range(number))

    async def run() -> int:
        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            writer.write(json.dumps(HELLO).encode() + b"\n" + flood)
            await reader.read()
            writer.close()

        server = await asyncio.start_server(answer, "127.0.0.1", 0)
        async with server, listening(server.sockets[0].getsockname()[1]) as (_, heard):
            await heard.until(kind("hello"))
            turns = 0
            async with asyncio.timeout(20):
                while heard[-1].get("frame") != number - 1:
                    turns += 1
                    await asyncio.sleep(0)
        return turns

    # One for each frame, but for those that were read before the first look.
    assert asyncio.run(run()) > 0.5 * number


def test_a_line_that_the_end_cuts_short_is_no_fault() -> None:
    async def run() -> None:
        async def answer(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            lines = [json.dumps(content).encode() for content in (HELLO, frame(0))]
            writer.write(b"\n".join(lines) + b'\n{"type": "fra')
            await writer.drain()
            writer.close()

        server = await asyncio.start_server(answer, "127.0.0.1", 0)
        async with server, listening(server.sockets[0].getsockname()[1]) as (_, heard):
            assert "gone" in (await heard.until(kind("lost")))["words"]
            assert [content["type"] for content in heard] == ["hello", "frame", "lost"]

    asyncio.run(run())


def test_images_come_for_as_long_as_a_browser_wants_them() -> None:
    pytest.importorskip("cv2")

    async def run() -> None:
        picture = np.zeros((48, 64, 3), np.uint8)
        with LiveServer(0, hello=HELLO) as server:
            async with listening(server.port) as (source, heard):
                await heard.until(kind("hello"))
                reply = heard.append

                async def images(number: int, *, after_request: bool = False) -> int:
                    heard.clear()
                    for index in range(number):
                        if after_request:
                            await request_arrived(server)
                        server.publish(frame(index), picture)
                        await heard.until(lambda c, i=index: c.get("frame") == i)
                    return sum("jpeg_base64" in content for content in heard)

                assert await images(5) == 0
                await source.receive({"type": "video", "width": 32}, reply)
                assert await images(10, after_request=True) == 10
                # The last image was followed by a request, which is answered.
                await request_arrived(server)
                await source.leave(reply)
                assert await images(2) == 1
                assert await images(5) == 0

    asyncio.run(run())


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b"220 mail.example ESMTP\r\n", "is not a tracker of driftwalk"),
        (b'{"type": "hello", "format": "other"}\n', "is not a tracker of driftwalk"),
        (b'{"type": "hello", "format": "driftwalk live", "version": 2}\n', "speaks version 2"),
        (b"$STEP_START*0D\r\n", "is not a tracker of driftwalk"),
    ],
)
def test_others_are_named(line: bytes, words: str) -> None:
    async def run() -> None:
        async def answer(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            writer.write(line)
            await writer.drain()
            writer.close()
            await writer.wait_closed()

        server = await asyncio.start_server(answer, "127.0.0.1", 0)
        async with server, listening(server.sockets[0].getsockname()[1]) as (_, heard):
            assert words in (await heard.until(kind("lost")))["words"]

    asyncio.run(run())


@pytest.mark.slow
def test_a_line_nested_too_deep_ends_nothing() -> None:
    """Some depths can be read, but not written again: the page goes on without such a line."""

    async def run() -> None:
        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            writer.write(json.dumps(HELLO).encode() + b"\n")
            depth = next(depths, None)
            nested = b"[" * (depth or 0) + b"1e999" + b"]" * (depth or 0)
            whole = json.dumps(frame(depth or -1)).encode()
            writer.write(whole[:-1] + b', "x": %s}\n' % nested)
            await writer.drain()
            if depth is None:
                await reader.read()
            writer.close()

        depths = iter((300, 450, 480, 600, 900, 940, 970, 990, 2000))
        server = await asyncio.start_server(answer, "127.0.0.1", 0)
        # What is published is written, as the hub does.
        heard = Heard()
        source = LiveSource("127.0.0.1", server.sockets[0].getsockname()[1])

        def publish(content: Any) -> None:
            make_message(content)
            heard.append(content)

        async with server:
            task = asyncio.create_task(source.run(publish))
            await heard.until(lambda content: content.get("frame") == -1)
            assert not task.done()
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    asyncio.run(run())


def test_the_same_wish_for_images_is_passed_on_once() -> None:
    async def run() -> None:
        asked: list[bytes] = []

        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            writer.write(json.dumps(HELLO).encode() + b"\n")
            while line := await reader.readline():
                asked.append(line)
            writer.close()

        server = await asyncio.start_server(answer, "127.0.0.1", 0)
        async with server, listening(server.sockets[0].getsockname()[1]) as (source, heard):
            await heard.until(kind("hello"))
            for width in (*[64] * 500, 0, 0, 64, 64, 96):
                await source.receive({"type": "video", "width": width}, heard.append)
            # They come in order: with the last one all are there.
            async with asyncio.timeout(10):
                while not asked or b"96" not in asked[-1]:
                    await asyncio.sleep(0.01)
            assert [json.loads(line)["jpeg_width"] for line in asked] == [64, 64, 96]

    asyncio.run(run())


@pytest.mark.slow
def test_nobody_there_is_said_once(port: int) -> None:
    async def run() -> None:
        async with listening(port) as (source, heard):
            await asyncio.sleep(0.8)
            # The page says so from the beginning.
            assert heard == []
            assert "waiting" in source.greeting()[1]["words"]

    asyncio.run(run())


@pytest.mark.parametrize("line", [b"", b"\n", b"[]", b"{}", b'{"type": 1}', b"\xff", b"["])
def test_what_is_no_line_is_nothing(line: bytes) -> None:
    assert stream_line(line) is None


@pytest.mark.parametrize("width", [True, -5, 10**9, "640", None, 640.5])
def test_a_width_that_is_none_asks_for_nothing(width: Any) -> None:
    source = LiveSource("127.0.0.1", 1)
    asyncio.run(source.receive({"type": "video", "width": width}, print))
    assert max(source._widths.values(), default=0) == 0


@pytest.mark.parametrize(("host", "port"), [("", 5000), ("lab", 0), ("lab", 70000)])
def test_no_address(host: str, port: int) -> None:
    with pytest.raises(InputError, match="no address"):
        LiveSource(host, port)
