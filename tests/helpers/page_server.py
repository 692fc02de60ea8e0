"""A page's server in a process of its own, and clients of it: what several tests share."""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import signal
from collections.abc import Iterator
from typing import Any, NamedTuple
from urllib.parse import urlsplit

from command_line import end, start
from websockets.sync.client import connect


class Answer(NamedTuple):
    """What a server answered."""

    status: int
    headers: dict[str, str]
    body: bytes


class PageServer:
    """A command that serves a page."""

    def __init__(self, *words: object, port: int = 0, before: str = "") -> None:
        # No warning of a library reaches a user.
        strict = os.environ | {"PYTHONWARNINGS": "error"}
        self.process = start(*words, "--port", port, "--no-open", before=before, env=strict)
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().strip()
        if not self.address:
            raise AssertionError(f"the server did not start: {end(self.process)}")
        self.parts = urlsplit(self.address)

    @property
    def port(self) -> int:
        assert self.parts.port is not None
        return self.parts.port

    def get(self, path: str = "/", *, method: str = "GET", **headers: str) -> Answer:
        """Ask for a path as it stands: nothing is made tidy."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        try:
            connection.putrequest(method, path, skip_host="Host" in headers)
            for name, value in headers.items():
                connection.putheader(name, value)
            connection.endheaders()
            answer = connection.getresponse()
            found = {name.lower(): value for name, value in answer.getheaders()}
            return Answer(answer.status, found, answer.read())
        finally:
            connection.close()

    def socket(self, *, query: str = "", **headers: str) -> Any:
        """Open the WebSocket of the page."""
        url = f"ws://127.0.0.1:{self.port}/ws{query}"
        origin = headers.pop("Origin", None)
        return connect(url, origin=origin, additional_headers=headers, max_size=None)

    def stop(self) -> tuple[int, str]:
        """End the server as Ctrl-C does; return its exit code and what it said."""
        self.process.send_signal(signal.SIGINT)
        done = end(self.process)
        return done.code, done.err


@contextlib.contextmanager
def served(*words: object, port: int = 0, before: str = "") -> Iterator[PageServer]:
    """Serve a page, and end the server afterwards."""
    server = PageServer(*words, port=port, before=before)
    try:
        yield server
    finally:
        if server.process.poll() is None:
            _, said = server.stop()
            assert "Warning" not in said, said


def received(socket: Any, kind: str, *, within: int = 200) -> dict[str, Any]:
    """Return the next message of a type; frames are acknowledged as a browser would."""
    for _ in range(within):
        content: dict[str, Any] = json.loads(socket.recv(timeout=30))
        if content["type"] in ("tank", "frame"):
            say(socket, type="ready")
        if content["type"] == kind:
            return content
    raise AssertionError(f"no message of type '{kind}' among {within}")


def say(socket: Any, **content: Any) -> None:
    """Send a message."""
    socket.send(json.dumps(content))
