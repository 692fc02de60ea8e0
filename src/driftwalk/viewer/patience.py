"""How long a connection may hold the server without asking for anything, and what it may say.

uvicorn is imported here, so this module is imported when a server is started.
"""

from __future__ import annotations

import asyncio
import logging
from typing import Any, Final

from uvicorn.protocols.http.auto import AutoHTTPProtocol

REQUEST_S: Final = 10.0
"""For how long a connection may take to send a whole request [s].

The head of one has some hundred bytes: a phone on a bad line needs a second or two. Those who send
half of it and wait would otherwise hold a file of the system each, for ever.
"""


class PatientHTTP(AutoHTTPProtocol):  # type: ignore[misc, valid-type]
    """HTTP of uvicorn, which closes a connection that is slow to ask, whatever trickles in."""

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for the first request."""
        super().connection_made(transport)
        self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        if self._deadline is not None:
            self._deadline.cancel()
        super().connection_lost(exc)

    def on_response_complete(self) -> None:
        """Begin to wait for the next request."""
        self._wait()
        super().on_response_complete()

    def _wait(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = self.loop.call_later(REQUEST_S, self._give_up)

    def _give_up(self) -> None:
        # An answer that is on its way may take longer, and a WebSocket has taken over for good.
        answering = self.cycle is not None and not self.cycle.response_complete
        if not answering and self.transport.get_protocol() is self:
            self.transport.abort()


def without_undecodable(record: logging.LogRecord) -> bool:
    """Return whether a record is for the user: bad UTF-8 of a browser ends its connection alone.

    Parameters
    ----------
    record : logging.LogRecord
        What uvicorn has to say.
    """
    error = record.exc_info[1] if record.exc_info else None
    return not isinstance(error, UnicodeDecodeError)
