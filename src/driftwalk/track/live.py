"""Live output: a TCP server that sends each frame's result to its clients.

Two forms: JSON, one object a line, and SwisTrack's NMEA sentences. A client that reads slowly loses
frames, and the stream says how many; the tracker never waits for one.
"""

from __future__ import annotations

import base64
import contextlib
import errno
import json
import math
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from functools import reduce
from operator import xor
from typing import Any, Final, NamedTuple

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.extras import require_opencv
from driftwalk.core.text_files import json_value, parse_json
from driftwalk.track.types import Image


class LivePolicy(NamedTuple):
    """Limits of one live output."""

    most_clients: int = 32
    """Clients at one time; chosen by hand."""
    waiting_frames: int = 8
    """Frames that wait for a client; it loses older ones; chosen by hand."""
    patience_s: float = 3.0
    """Time for which the last lines are sent at the end [s]; chosen by hand."""


LIVE: Final = LivePolicy()


class _Message(NamedTuple):
    content: Any
    image: Image | None


class LiveServer(contextlib.AbstractContextManager["LiveServer"]):
    """Sends messages to every client that is connected.

    Parameters
    ----------
    port : int
        Port to listen on; 0 takes a free one.
    host : str
        Address to listen on. Loopback unless it is said otherwise: who can connect sees the frames.
    encode : callable, optional
        From what is published to the text to send; default: a line of JSON. Requests for images
        are answered in JSON alone.
    hello : mapping, optional
        A line of JSON that every client gets first, whenever it connects.

    Raises
    ------
    InputError
        When the port is in use or not allowed, or there is no such address.

    Examples
    --------
    >>> with LiveServer(0) as server:
    ...     with socket.create_connection((server.host, server.port)) as client:
    ...         connected = server.wait_for_clients(1)
    ...         server.publish({"frame": 3})
    ...         with client.makefile() as reader:
    ...             print(reader.readline(), end="")
    {"frame":3,"frames_lost_by_client":0}
    """

    def __init__(
        self,
        port: int,
        *,
        host: str = "127.0.0.1",
        encode: Callable[[Any], str] | None = None,
        hello: Mapping[str, Any] | None = None,
    ) -> None:
        self._encode = encode
        self._hello = "" if hello is None else json_line(hello)
        self._listener = _listen(host, port)
        self.host, self.port = self._listener.getsockname()[:2]
        self._changed = threading.Condition()
        self._clients: list[_Client] = []
        threading.Thread(target=self._welcome, daemon=True).start()

    def __exit__(self, *error: object) -> None:
        """Close the server."""
        self.close()

    @property
    def clients(self) -> int:
        """Number of clients that are connected."""
        with self._changed:
            return len(self._clients)

    def wait_for_clients(self, number: int, *, timeout: float = 5.0) -> bool:
        """Wait for this many clients; False when there are fewer after `timeout` [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: len(self._clients) >= number, timeout)

    def publish(self, content: Any, image: Image | None = None) -> None:
        """Send to every client, at once and without waiting for any.

        Parameters
        ----------
        content : object
            Argument of `encode`; a mapping that JSON can hold without `encode`.
        image : array, optional
            The frame, for clients that asked for it.
        """
        with self._changed:
            clients = list(self._clients)
        for client in clients:
            client.put(_Message(content, image))

    def close(self) -> None:
        """Stop listening and leave the clients."""
        # Closing alone does not wake a thread that waits in accept.
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        with self._changed:
            clients = list(self._clients)
        for client in clients:
            client.finish()
        # For them all together: one that does not read is not waited for any longer.
        until = time.monotonic() + LIVE.patience_s
        for client in clients:
            client.wait(until)

    def _welcome(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            with self._changed:
                if len(self._clients) >= LIVE.most_clients:
                    connection.close()
                    continue
                self._clients.append(_Client(connection, self))
                self._changed.notify_all()

    def _leave(self, client: _Client) -> None:
        with self._changed:
            if client in self._clients:
                self._clients.remove(client)
            self._changed.notify_all()


class _Client:
    """One connection: a thread that sends what waits, and one that reads requests."""

    def __init__(self, connection: socket.socket, server: LiveServer) -> None:
        self._connection, self._server = connection, server
        self._waiting: deque[_Message] = deque()
        self._changed = threading.Condition()
        self._lost = 0
        self._width: int | None = None
        self._over = False
        self._sender = threading.Thread(target=self._send, daemon=True)
        self._sender.start()
        threading.Thread(target=self._listen, daemon=True).start()

    def put(self, message: _Message) -> None:
        """Let a message wait; the oldest one is lost when too many do."""
        with self._changed:
            if len(self._waiting) >= LIVE.waiting_frames:
                self._waiting.popleft()
                self._lost += 1
            # An image is kept only if a client asked for images.
            wanted = self._width is not None
            self._waiting.append(message if wanted else message._replace(image=None))
            self._changed.notify()

    def finish(self) -> None:
        """Take no more; what waits is still sent."""
        with self._changed:
            self._over = True
            self._changed.notify()

    def wait(self, until: float) -> None:
        """Close as soon as all is sent, or at a moment of the monotonic clock."""
        self._sender.join(timeout=max(until - time.monotonic(), 0.0))
        self._hang_up()

    def _send(self) -> None:
        with contextlib.suppress(OSError):
            self._connection.sendall(self._server._hello.encode("utf-8"))
            while (text := self._next()) is not None:
                self._connection.sendall(text.encode("utf-8"))
        self._hang_up()

    def _next(self) -> str | None:
        with self._changed:
            self._changed.wait_for(lambda: bool(self._waiting) or self._over)
            if not self._waiting:
                return None
            message, lost = self._waiting.popleft(), self._lost
            width = self._width if message.image is not None else None
            if width is not None:
                self._width = None
        if self._server._encode is not None:
            return self._server._encode(message.content)
        extra: dict[str, Any] = {"frames_lost_by_client": lost}
        if width is not None and message.image is not None:
            extra["jpeg_base64"] = jpeg_text(message.image, width)
        return json_line({**message.content, **extra})

    def _listen(self) -> None:
        with contextlib.suppress(OSError), self._connection.makefile("rb") as lines:
            while line := lines.readline(4096):
                if not line.endswith(b"\n"):
                    break
                width = requested_width(line)
                with self._changed:
                    self._width = width if width is not None else self._width
        self._hang_up()

    def _hang_up(self) -> None:
        with self._changed:
            self._over = True
            self._waiting.clear()
            self._changed.notify()
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()
        self._server._leave(self)


def json_line(content: Mapping[str, Any]) -> str:
    """Return a message as one line of JSON; a number that is not finite becomes null."""
    return json.dumps(json_value(content), separators=(",", ":"), allow_nan=False) + "\n"


def requested_width(line: bytes) -> int | None:
    """Return the width of the image that a client asks for, ``{"jpeg_width": 320}``; else None.

    Examples
    --------
    >>> requested_width(b'{"jpeg_width": 320}'), requested_width(b"hello")
    (320, None)
    """
    try:
        request = parse_json(line)
    except FormatError:
        return None
    width = request.get("jpeg_width") if isinstance(request, dict) else None
    return width if isinstance(width, int) and 16 <= width <= 4096 else None


def jpeg_text(image: Image, width: int) -> str:
    """Return an image as JPEG in base64, scaled down to a width; never scaled up."""
    cv2 = require_opencv()
    rows, columns = image.shape[:2]
    if width < columns:
        size = width, max(1, round(rows * width / columns))
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 80])
    return base64.b64encode(data.tobytes()).decode("ascii") if done else ""


class Particle(NamedTuple):
    """One body in SwisTrack's form."""

    id: int
    """Number of the body."""
    column: float
    """Position in the image [px]."""
    row: float
    """Position in the image [px], down."""
    theta: float
    """Orientation in the world [rad], counter-clockwise."""
    x: float
    """Position [m]."""
    y: float
    """Position [m]."""


def nmea_frame(number: int, particles: Iterable[Particle]) -> str:
    r"""Return a frame as SwisTrack sent it until 2022: ``$PARTICLE`` with six arguments.

    The orientation is that in the image, whose rows go down: its sign is the opposite of theta's.
    A body without an orientation has 0.

    Parameters
    ----------
    number : int
        Number of the frame.
    particles : iterable of Particle
        The bodies that were seen.

    Returns
    -------
    str
        The sentences, each with its checksum.

    Examples
    --------
    >>> print(nmea_frame(2, [Particle(0, 10.0, 20.0, 0.5, 0.1, 0.2)]).replace("\r", ""), end="")
    $STEP_START*0D
    $FRAMENUMBER,2*40
    $PARTICLE,0,10.000000,20.000000,-0.500000,0.100000,0.200000*12
    $STEP_STOP*55
    """
    lines = ["STEP_START", f"FRAMENUMBER,{number}"]
    for one in particles:
        turned = -one.theta if math.isfinite(one.theta) else 0.0
        values = ",".join(f"{v:f}" for v in (one.column, one.row, turned, one.x, one.y))
        lines.append(f"PARTICLE,{one.id},{values}")
    lines.append("STEP_STOP")
    return "".join(f"${line}*{reduce(xor, line.encode('ascii')):02X}\r\n" for line in lines)


def _listen(host: str, port: int) -> socket.socket:
    if not 0 <= port <= 65535:
        raise InputError(f"a port is a number from 0 to 65535, got {port}")
    try:
        return socket.create_server((host, port))
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise InputError(
                f"port {port} on {host} is in use: choose another one, or 0 for a free port"
            ) from error
        # Python adds what it tried, which the message says already.
        reason = (error.strerror or str(error)).partition(" (while")[0]
        raise InputError(f"cannot listen on {host}, port {port}: {reason}") from error
