"""A tracker's stream: read over TCP, filtered, handed on to the browsers, found again when lost.

A stream comes from another program, and any of its values may be wrong. Wrong values are left out,
counted, and reported in one sentence that is brought up to date now and then. A body that cannot be
drawn is left out, not its frame.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import time as clock
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

from driftwalk.core.errors import InputError
from driftwalk.page.html import page_frame
from driftwalk.page.parts import section
from driftwalk.viewer.hub import Content, Publish, Source, parsed
from driftwalk.viewer.server import LAST_PORT

SAID_EVERY_S: Final = 5.0
"""Time after which new counts are said [s]; a new reason is said at once; chosen by hand."""
MOST_REASONS: Final = 3
"""Reasons that are named of each kind, the most frequent ones; chosen by hand."""
KINDS: Final = {
    "line": ("line", "lines"),
    "frame": ("whole frame", "whole frames"),
    "body": ("body", "bodies"),
    "join": ("entry of 'joined'", "entries of 'joined'"),
    "event": ("event", "events"),
    "value": ("value", "values"),
}
"""Names of parts that can be left out, in singular and plural."""
FACES: Final = range(4)
"""Numbers of a block's faces."""

Fault = str | None
Check = Callable[[Any], Fault]


class SoundFrames:
    """Takes the frames of one stream and leaves out what cannot be drawn.

    Examples
    --------
    >>> frames = SoundFrames()
    >>> good = {"id": "a", "seen": True, "x_m": 0.1, "y_m": 0.0, "theta_rad": None}
    >>> odd = {**good, "id": "b", "x_m": "left"}
    >>> kept = frames.take({"frame": 0, "time_s": 0.0, "bodies": [good, odd]})
    >>> [body["id"] for body in kept["bodies"]]
    ['a']
    >>> frames.words(now=0.0)
    'left out, since it cannot be drawn: 1 body of 1 frame (x_m is not a number)'
    """

    def __init__(self) -> None:
        self._reasons: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}
        self._frames: Counter[str] = Counter()
        self._said = ""
        self._next = -math.inf

    def take(self, content: dict[str, Any]) -> dict[str, Any] | None:
        """Return a frame with all of it that can be drawn; None when nothing can.

        Parameters
        ----------
        content : dict
            A line of the stream, of type ``frame``.
        """
        fault = _first_fault(content, FRAME)
        if fault is not None:
            self._note("frame", [fault])
            return None
        found = {name: check(content.get(name)) for name, check in VALUES.items()}
        faults = {name: fault for name, fault in found.items() if fault is not None}
        self._note("value", [f"{name} {fault}" for name, fault in faults.items()])
        sound = {**content, **dict.fromkeys(faults), "bodies": self._bodies(content["bodies"])}
        event = partial(_first_fault, checks=EVENT)
        for kind, name, check in (("join", "joined", _join), ("event", "events", event)):
            if isinstance(sound.get(name), list):
                sound[name] = self._kept(kind, sound[name], check)
        return sound

    def note_unreadable(self) -> None:
        """Count a line of the stream that says nothing."""
        self._note("line", ["it is not a JSON object with a type"])

    def words(self, *, now: float, last: bool = False) -> str | None:
        """Return what there is to say of what was left out; None when there is nothing new.

        Parameters
        ----------
        now : float
            Time on any clock [s].
        last : bool
            Whether the stream ends: then the counts are said as they are.
        """
        if now < self._next and not last:
            return None
        told = {kind: reasons for kind, reasons in self._reasons.items() if reasons}
        words = "; ".join(_sentence(*one, self._frames[one[0]]) for one in told.items())
        if words == self._said:
            return None
        self._said, self._next = words, now + SAID_EVERY_S
        return f"left out, since it cannot be drawn: {words}"

    def _bodies(self, bodies: list[Any]) -> list[Any]:
        ids: set[str] = set()

        def check(body: Any) -> Fault:
            fault = _first_fault(body, BODY)
            if fault is None and body["id"] in ids:
                return "a frame has the same id twice"
            if fault is None:
                ids.add(body["id"])
            return fault

        return self._kept("body", bodies, check)

    def _kept(self, kind: str, parts: list[Any], check: Check) -> list[Any]:
        """Return the parts that are sound, and note the others."""
        faults = [check(part) for part in parts]
        self._note(kind, [fault for fault in faults if fault is not None])
        return [part for part, fault in zip(parts, faults, strict=True) if fault is None]

    def _note(self, kind: str, reasons: list[str]) -> None:
        if not reasons:
            return
        known = self._reasons[kind]
        if not known.keys() >= {*reasons}:
            self._next = -math.inf
        known.update(reasons)
        self._frames[kind] += 1


def _sentence(kind: str, reasons: Counter[str], frames: int) -> str:
    one, several = KINDS[kind]
    named = [reason for reason, _ in reasons.most_common(MOST_REASONS)]
    more = ["..."] if len(reasons) > MOST_REASONS else []
    parts = reasons.total()
    what = f"{parts} {several if parts > 1 else one}"
    if kind not in ("line", "frame"):
        what += f" of {frames} frame{'s' if frames > 1 else ''}"
    return f"{what} ({', '.join(named + more)})"


def _first_fault(content: Any, checks: dict[str, Check]) -> Fault:
    """Return what is wrong with an object of which every key is needed."""
    if not isinstance(content, dict):
        return "it is not an object"
    for name, check in checks.items():
        if name not in content:
            return f"{name} is missing"
        if (fault := check(content[name])) is not None:
            return f"{name} {fault}"
    return None


def _number(value: Any) -> Fault:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return "is not a number"
    try:
        finite = math.isfinite(value)
    except OverflowError:
        # A whole number that no float can hold.
        finite = False
    return None if finite else "is not a finite number"


def _instance_of(kind: type, words: str) -> Check:
    return lambda value: None if isinstance(value, kind) else f"is not {words}"


def _texts(value: Any) -> Fault:
    good = isinstance(value, list) and all(isinstance(one, str) for one in value)
    return None if good else "is not a list of text"


def _or_null(check: Check) -> Check:
    return lambda value: None if value is None else check(value)


def _join(entry: Any) -> Fault:
    match entry:
        case [str(), face, str(), other] if _is_face(face) and _is_face(other):
            return None
    return "it is not [block, face, other block, face]"


def _is_face(value: Any) -> bool:
    return type(value) is int and value in FACES


_text, _list = _instance_of(str, "text"), _instance_of(list, "a list")
FRAME: Final[dict[str, Check]] = {"frame": _number, "time_s": _number, "bodies": _list}
"""Without these nothing of a frame can be drawn."""
BODY: Final[dict[str, Check]] = {
    "id": _text,
    "seen": _instance_of(bool, "true or false"),
    "x_m": _or_null(_number),
    "y_m": _or_null(_number),
    "theta_rad": _or_null(_number),
}
"""Values of a body that the page draws."""
EVENT: Final[dict[str, Check]] = {
    "time_s": _number,
    "kind": _text,
    "bodies": _texts,
    "outcome": _or_null(_text),
}
VALUES: Final[dict[str, Check]] = {
    "joined": _or_null(_list),
    "events": _or_null(_list),
    "outcome": _or_null(_text),
    "possible": _or_null(_texts),
    "hidden": _or_null(_texts),
    "latency_s": _or_null(_number),
    "dropped_frames": _or_null(_number),
    "frames_lost_by_client": _or_null(_number),
    "jpeg_base64": _or_null(_text),
}
"""Optional values of a frame that the page shows."""


FORMAT: Final = "driftwalk live"
VERSION: Final = 1
"""Version of the stream; another version is refused."""
LONGEST_LINE: Final = 1 << 25
"""Longest line [byte] that is read: a frame with a large image; chosen by hand."""
FIRST_PAUSE_S: Final = 0.25
"""Pause before the first new attempt to connect [s]; it doubles up to a second. By hand."""
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
