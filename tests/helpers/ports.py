"""Ports for servers that a test starts later, or twice."""

from __future__ import annotations

import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def held_port() -> Iterator[int]:
    """Give a port on which a server of the test may listen, at any time, and nobody else comes.

    Until a server listens, whoever connects is refused. On Linux the port is held by a socket that
    does not listen, which servers with ``SO_REUSEADDR`` (all that Python's create_server makes) may
    join; elsewhere it is only free to begin with.
    """
    with socket.socket() as holder:
        holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        holder.bind(("127.0.0.1", 0))
        port = int(holder.getsockname()[1])
        if sys.platform != "linux":
            holder.close()
        yield port
