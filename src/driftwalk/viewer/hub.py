"""The browsers that are connected, the sources of their messages, and the queue of each browser.

A browser that draws slowly, or a network that is slow, must see the present and not a queue of the
past: at most one message of each kind waits, the newest. Frames that come many times a second are
sent only after the browser has said that it has drawn the last one.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from driftwalk.core.errors import FormatError
from driftwalk.core.text_files import json_value, parse_json

PACED: Final = frozenset({"tank", "frame"})
"""Kinds that wait until the browser has drawn the last one."""
REPLACED_BY: Final[dict[str, tuple[str, ...]]] = {
    "page": ("section", "state"),
    "hello": ("frame", "lost", "end", "note"),
    "lost": ("frame",),
}
"""Kinds that a message makes void: a page contains its sections, another stream has its frames."""

Content = Mapping[str, Any]
Publish = Callable[[Content], None]


class Source:
    """Source of a page: a run, a tracker's stream, or the playground.

    Attributes
    ----------
    view : str
        Which page it is.
    title : str
        Heading until the page itself arrives.
    """

    view: str
    title: str

    def greeting(self) -> Sequence[Content]:
        """Return what a browser is sent when it connects: the page as it is now."""
        raise NotImplementedError

    async def run(self, publish: Publish) -> None:
        """Watch, and publish what changes, until cancelled."""
        raise NotImplementedError

    async def receive(self, content: Content, reply: Publish) -> None:
        """Take a message of a browser: an object of JSON, which may hold anything.

        `reply` sends to this browser alone, and is the same function for all its messages.
        """

    async def leave(self, reply: Publish) -> None:
        """Forget a browser that has gone, known by its `reply`."""

    def watched(self, browsers: int) -> None:
        """Note how many browsers are connected, whenever that changes."""

    def file(self, name: str) -> Path | None:  # noqa: ARG002
        """Return a file that may be served, None where there is none of that name."""
        return None

    def report(self) -> str | None:
        """Return the page as a file that works alone, None where it cannot be one."""
        return None


class Hub:
    """Hands every message to every browser.

    Parameters
    ----------
    watched : callable
        Called with the number of browsers whenever it changes.
    """

    def __init__(self, watched: Callable[[int], None]) -> None:
        self._boxes: list[Outbox] = []
        self._watched = watched

    def join(self, greeting: Sequence[Content]) -> Outbox | None:
        """Return the outbox of a new browser, with the greeting in it; None when it is full."""
        if len(self._boxes) >= 32:
            return None
        box = Outbox()
        for content in greeting:
            box.put(make_message(content))
        self._boxes.append(box)
        self._watched(len(self._boxes))
        return box

    def leave(self, box: Outbox) -> None:
        """Forget a browser."""
        self._boxes.remove(box)
        self._watched(len(self._boxes))

    def publish(self, content: Content) -> None:
        """Let a message wait for every browser; called in the server's own thread."""
        if not self._boxes:
            return
        message = make_message(content)
        for box in self._boxes:
            box.put(message)


class Message(NamedTuple):
    """A message, written once however many browsers get it."""

    kind: str
    """The type, with the name of the section where it is one."""
    text: str
    """JSON."""


def make_message(content: Mapping[str, Any]) -> Message:
    """Return a message as it is sent; a number that is not finite becomes null.

    Parameters
    ----------
    content : mapping
        JSON's types; ``type`` says what it is.

    Examples
    --------
    >>> make_message({"type": "section", "section": {"id": "map", "value": float("nan")}})
    Message(kind='section map', text='{"type":"section","section":{"id":"map","value":null}}')
    """
    kind = str(content["type"])
    if kind == "section":
        kind = f"section {content['section']['id']}"
    return Message(kind, to_json(content))


def to_json(content: Any) -> str:
    """Return JSON without spaces, in which numbers that are not finite are null."""
    try:
        return json.dumps(content, separators=(",", ":"), allow_nan=False)
    except ValueError:
        return json.dumps(json_value(content), separators=(",", ":"), allow_nan=False)


def parsed(text: str | bytes) -> dict[str, Any] | None:
    """Return the object that a message holds, None when it holds none.

    Examples
    --------
    >>> parsed('{"type": "ready"}'), parsed("[1]"), parsed("{")
    ({'type': 'ready'}, None, None)
    """
    try:
        content = parse_json(text)
    except FormatError:
        return None
    return content if isinstance(content, dict) else None


class Outbox:
    """The messages that wait for one browser.

    Examples
    --------
    >>> box = Outbox()
    >>> for progress in (0.1, 0.2):
    ...     box.put(make_message({"type": "state", "progress": progress}))
    >>> asyncio.run(box.next())
    '{"type":"state","progress":0.2}'
    """

    def __init__(self) -> None:
        self._waiting: dict[str, str] = {}
        self._changed = asyncio.Event()
        self._drawn = True

    def put(self, message: Message) -> None:
        """Let a message wait; an unsent one of its kind is dropped."""
        void = REPLACED_BY.get(message.kind, ())
        for kind in [kind for kind in self._waiting if kind.partition(" ")[0] in void]:
            del self._waiting[kind]
        self._waiting[message.kind] = message.text
        self._changed.set()

    def drawn(self) -> None:
        """Note that the browser has drawn the last frame and takes another."""
        self._drawn = True
        self._changed.set()

    async def next(self) -> str:
        """Return the message to send; wait until there is one."""
        while (kind := self._sendable()) is None:
            self._changed.clear()
            await self._changed.wait()
        if kind in PACED:
            self._drawn = False
        return self._waiting.pop(kind)

    def _sendable(self) -> str | None:
        # A frame comes last: it is replaced soon, the others are not.
        first = next((kind for kind in self._waiting if kind not in PACED), None)
        if first is not None or not self._drawn:
            return first
        return next(iter(self._waiting), None)
