"""Queue of messages to a browser: at most one of each kind, the newest.

A browser that draws slowly, or a network that is slow, must see the present and not a queue of the
past. Frames that come many times a second are sent only after the browser has said that it has
drawn the last one.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from driftwalk.core.text.json_text import json_value

PACED: Final = frozenset({"tank", "frame"})
"""Kinds that wait until the browser has drawn the last one."""
REPLACED_BY: Final[dict[str, tuple[str, ...]]] = {
    "page": ("section", "state"),
    "hello": ("frame", "lost", "end", "note"),
    "lost": ("frame",),
}
"""Kinds that a message makes void: a page contains its sections, another stream has its frames."""


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
