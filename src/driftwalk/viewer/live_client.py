"""A tracker's stream: read over TCP, handed on to the browsers, found again when it was lost."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time as clock
from collections.abc import Sequence
from typing import Any, Final

from driftwalk.core.errors import InputError
from driftwalk.page.html import page_frame
from driftwalk.page.parts import section
from driftwalk.viewer.frame_filter import SoundFrames
from driftwalk.viewer.hub import Content, Publish, Source, parsed

FORMAT: Final = "driftwalk live"
VERSION: Final = 1
LONGEST_LINE: Final = 1 << 25
"""Longest line [byte] that is read: a frame with a large image."""
FIRST_PAUSE_S: Final = 0.25
LAST_PORT: Final = 65535
WIDTHS: Final = range(16, 4097)
"""Widths [px] in which a tracker sends its images."""


class LiveSource(Source):
    """Shows the stream of a tracker, or of a playground that publishes its tank.

    Parameters
    ----------
    host : str
        Where the tracker runs.
    port : int
        Its port (``driftwalk track --live PORT``).

    Raises
    ------
    InputError
        When that is not an address.

    Examples
    --------
    >>> LiveSource("127.0.0.1", 5000).title
    '127.0.0.1:5000'
    """

    view = "live"

    def __init__(self, host: str, port: int) -> None:
        if not host or not 0 < port <= LAST_PORT:
            raise InputError(f"no address of a stream: {host}:{port}")
        self._host, self._port = host, port
        self.title = f"{host}:{port}"
        self._last: dict[str, Content] = {
            "lost": {"type": "lost", "words": f"waiting for a tracker on {self.title}"}
        }
        self._events: list[Any] = []
        self._widths: dict[Publish, int] = {}
        self._writer: asyncio.StreamWriter | None = None

    def greeting(self) -> Sequence[Content]:
        """Return the page, and the last that came of the stream."""
        subtitle, tank = f"the stream of {self.title}", section("live", "live", "The tank")
        page = page_frame(self.view, "Live", subtitle=subtitle, sections=[tank])
        return [{"type": "page", "page": page}, *self._last.values()]

    async def run(self, publish: Publish) -> None:
        """Read the stream, and connect again whenever it is lost."""
        pause = FIRST_PAUSE_S
        while True:
            words = await self._connect(publish)
            if words is None:
                pause, words = FIRST_PAUSE_S, "the tracker is gone; the page waits for it"
            self._note({"type": "lost", "words": words}, publish)
            await asyncio.sleep(pause)
            # The time between two attempts to connect doubles, up to a second.
            pause = min(2.0 * pause, 1.0)

    async def receive(self, content: Content, reply: Publish) -> None:
        """Ask the tracker for its images, or no longer."""
        width = content.get("width")
        if content.get("type") != "video" or not isinstance(width, int):
            return
        wanted = width if width in WIDTHS else 0
        # The tracker answers every request: it must not be asked again for the same.
        if self._widths.get(reply, 0) != wanted:
            self._widths[reply] = wanted
            await self._ask()

    async def leave(self, reply: Publish) -> None:
        """Ask no longer for images that only this browser wanted."""
        self._widths.pop(reply, None)

    async def _connect(self, publish: Publish) -> str | None:
        """Read until the stream ends; return why it could not be read, None when it could."""
        try:
            reader, writer = await asyncio.open_connection(
                self._host, self._port, limit=LONGEST_LINE
            )
        except OSError:
            return f"waiting for a tracker on {self.title}"
        self._writer = writer
        try:
            return await self._read(reader, publish)
        except (OSError, ValueError, RecursionError):
            # ValueError: a line that is longer than any frame. RecursionError: one that is nested
            # so deep that it can be read, but not written again.
            return None
        finally:
            self._writer = None
            writer.close()
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    async def _read(self, reader: asyncio.StreamReader, publish: Publish) -> str | None:
        hello = stream_line(await reader.readline())
        if hello is None or hello.get("type") != "hello" or hello.get("format") != FORMAT:
            return f"the program on {self.title} is not a tracker of driftwalk"
        if hello.get("version") != VERSION:
            return (
                f"the tracker on {self.title} speaks version {hello.get('version')} of the stream, "
                f"this page version {VERSION}; use one driftwalk for both"
            )
        self._last.clear()
        self._events.clear()
        self._note(hello, publish)
        await self._ask()
        frames = SoundFrames()
        # A line that the end cut short is no fault of the tracker's.
        while (line := await reader.readline()).endswith(b"\n"):
            await self._take(line, frames, publish)
            # Lines that have come already are read without a pause: the browsers take turns.
            await asyncio.sleep(0)
        self._say_left_out(frames, publish, last=True)
        return None

    async def _take(self, line: bytes, frames: SoundFrames, publish: Publish) -> None:
        """Hand on what a line says, as far as it can be drawn."""
        content = stream_line(line)
        kind = "" if content is None else content["type"]
        if content is None:
            frames.note_unreadable()
        elif kind == "end":
            self._note(content, publish)
        elif kind == "frame":
            sound = frames.take(content)
            if sound is not None:
                self._note(self._with_events(sound), publish)
            if "jpeg_base64" in content:
                await self._ask()
        self._say_left_out(frames, publish, last=kind == "end")

    def _say_left_out(self, frames: SoundFrames, publish: Publish, *, last: bool = False) -> None:
        words = frames.words(now=clock.monotonic(), last=last)
        if words is not None:
            self._note({"type": "note", "words": words}, publish)

    def _with_events(self, content: dict[str, Any]) -> dict[str, Any]:
        """Return a frame with the last events of all frames before it."""
        events = content.get("events")
        if isinstance(events, list):
            # Every frame repeats them: a browser that misses frames misses no event.
            self._events = [*self._events, *events][-50:]
            return {**content, "events": self._events}
        return content

    def _note(self, content: dict[str, Any], publish: Publish) -> None:
        """Publish, and keep it for browsers that connect later."""
        kind = str(content["type"])
        if kind == "lost" and "end" in self._last:
            # It has ended as it should; that it is gone now is no news.
            return
        if self._last.get(kind) != content:
            self._last[kind] = content
            publish(content)

    async def _ask(self) -> None:
        """Ask for the next image where one is wanted: the tracker answers each request once."""
        width = max(self._widths.values(), default=0)
        if self._writer is not None and width:
            with contextlib.suppress(OSError):
                self._writer.write(json.dumps({"jpeg_width": width}).encode() + b"\n")
                await self._writer.drain()


def stream_line(line: bytes) -> dict[str, Any] | None:
    """Return the object in a line of the stream, None when there is none.

    Examples
    --------
    >>> stream_line(b'{"type": "end"}'), stream_line(b"$STEP_START*0D")
    ({'type': 'end'}, None)
    """
    content = parsed(line)
    return None if content is None or not isinstance(content.get("type"), str) else content
