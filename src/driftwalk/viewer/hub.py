"""The browsers that are connected, and what makes the messages for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from driftwalk.viewer.messages import Message, Outbox, make_message

MOST_CLIENTS: Final = 32

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
        if len(self._boxes) >= MOST_CLIENTS:
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
        if self._boxes:
            self.hand_out(make_message(content))

    def hand_out(self, message: Message) -> None:
        """Let a message that is written already wait for every browser."""
        for box in self._boxes:
            box.put(message)
