"""The server: where it listens, and how it begins and ends."""

from __future__ import annotations

import contextlib
import errno
import logging
import socket
from collections.abc import Callable
from typing import Any, Final

from driftwalk.core.errors import InputError
from driftwalk.viewer.hub import Source
from driftwalk.viewer.security import is_any, make_gate

LAST_PORT: Final = 65535
"""A port has 16 bits."""
LONGEST_MESSAGE: Final = 1 << 16
"""Longest message [byte] that is taken from a browser; chosen by hand."""


def serve(
    source: Source,
    *,
    host: str = "127.0.0.1",
    port: int = 8765,
    ready: Callable[[str], None] | None = None,
) -> None:
    """Show a page to browsers until Ctrl-C.

    Parameters
    ----------
    source : Source
        Source of the page: a `RunSource`, a `LiveSource` or a `PlaySource`.
    host : str
        Address to listen on. Away from loopback the page's address holds a random token, and anyone
        who has it sees the page.
    port : int
        Port to listen on; 0 takes a free one.
    ready : callable, optional
        Called with the page's address when it can be opened.

    Raises
    ------
    InputError
        When FastAPI or uvicorn is not installed, the port is in use or not allowed, or there is no
        such address.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.serve(dw.viewer.RunSource("run"), ready=print)  # doctest: +SKIP
    http://127.0.0.1:8765/
    """
    uvicorn = require_server()
    from driftwalk.viewer.app import PatientHTTP, make_app

    # As an address has it, in brackets.
    host = host.removeprefix("[").removesuffix("]")
    with _listen(host, port) as listener:
        gate = make_gate(host, listener.getsockname()[1])
        errors: list[BaseException] = []

        def failed(error: BaseException) -> None:
            errors.append(error)
            server.should_exit = True

        class Server(uvicorn.Server):  # type: ignore[misc, name-defined]
            async def startup(self, sockets: list[socket.socket] | None = None) -> None:
                await super().startup(sockets=sockets)
                if self.started and ready is not None:
                    ready(gate.address())

        server = Server(
            uvicorn.Config(
                make_app(source, gate, failed=failed),
                log_level="warning",
                access_log=False,
                lifespan="on",
                http=PatientHTTP,
                ws="websockets-sansio",
                ws_max_size=LONGEST_MESSAGE,
                ws_per_message_deflate=False,
                proxy_headers=False,
                server_header=False,
                # Browsers have a second to leave.
                timeout_graceful_shutdown=1,
            )
        )
        logging.getLogger("uvicorn.error").addFilter(without_undecodable)
        # Ctrl-C is how one ends it.
        with contextlib.suppress(KeyboardInterrupt):
            server.run(sockets=[listener])
    if errors:
        raise errors[0]


def without_undecodable(record: logging.LogRecord) -> bool:
    """Return whether a record is for the user: bad UTF-8 of a browser ends its connection alone.

    Parameters
    ----------
    record : logging.LogRecord
        What uvicorn has to say.
    """
    error = record.exc_info[1] if record.exc_info else None
    return not isinstance(error, UnicodeDecodeError)


def require_server() -> Any:
    """Return the module ``uvicorn``.

    Raises
    ------
    InputError
        When it, FastAPI or websockets is not installed.

    Examples
    --------
    >>> require_server().__name__
    'uvicorn'
    """
    try:
        import fastapi  # noqa: F401
        import uvicorn
        import websockets  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"this page needs {error.name}: pip install 'driftwalk[view]' "
            "(driftwalk report needs nothing)"
        ) from error
    return uvicorn


def _listen(host: str, port: int) -> socket.socket:
    if not 0 <= port <= LAST_PORT:
        raise InputError(f"a port is a number from 0 to {LAST_PORT}, got {port}")
    if not host:
        # The system would take it for all addresses of the machine.
        raise InputError("an address to serve on is empty: leave `host` out, or give one (0.0.0.0)")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    both = family == socket.AF_INET6 and is_any(host) and socket.has_dualstack_ipv6()
    try:
        return socket.create_server((host, port), family=family, dualstack_ipv6=both)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise InputError(
                f"port {port} on {host} is in use: choose another one (`port`), or 0 "
                "for a free port"
            ) from error
        reason = (error.strerror or str(error)).partition(" (while")[0]
        raise InputError(f"cannot listen on {host}, port {port}: {reason}") from error
