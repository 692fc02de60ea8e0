"""Who may talk to the server: the check that every request and every WebSocket has to pass.

A server on loopback is reached by every page that the user's browser has open. Two things keep such
a page out: the Host header must name this server (a name that an attacker points at 127.0.0.1 does
not), and the Origin header, where there is one, must be the server's own. On any other address a
random token has to stand in the query too.
"""

from __future__ import annotations

import hmac
import ipaddress
import re
import secrets
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

LOOPBACK_NAMES: Final = ("127.0.0.1", "localhost", "[::1]")
TOKEN: Final = "token"
_HOST: Final = re.compile(r"(\[[0-9a-f:.]+\]|[0-9a-z._-]+)(?::[0-9]{1,5})?", re.ASCII)

HEADERS: Final[dict[str, str]] = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "X-Frame-Options": "DENY",
}
"""Headers of every answer."""


@dataclass(frozen=True)
class Gate:
    """Decides whether a request may come in.

    Attributes
    ----------
    host : str
        The address on which the server listens.
    port : int
        Its port.
    token : str or None
        Token required in the query; None on loopback.
    """

    host: str
    port: int
    token: str | None = None

    def refusal(self, headers: Mapping[str, str], query: Mapping[str, str]) -> str | None:
        """Return why a request is turned away, None when it may come in.

        Parameters
        ----------
        headers : mapping
            Names in lower case.
        query : mapping
            The parameters of the address.
        """
        asked = headers.get("host", "").lower()
        if not self._knows(asked):
            return "this address is not one of the server's own names"
        origin = headers.get("origin")
        if origin is not None and origin.lower() != f"http://{asked}":
            return "the request comes from another site's page"
        if self.token is not None and not hmac.compare_digest(
            query.get(TOKEN, "").encode(), self.token.encode()
        ):
            return "the address lacks the token that was printed when the server started"
        return None

    def address(self) -> str:
        """Return the address to open in a browser."""
        host = self.host
        if is_any(host):
            host = socket.gethostname()
        elif ":" in host:
            host = f"[{host}]"
        query = "" if self.token is None else f"?{TOKEN}={self.token}"
        return f"http://{host}:{self.port}/{query}"

    def _knows(self, asked: str) -> bool:
        # The port may be another one: that of a tunnel through which the user has come.
        name = host_name(asked)
        own = {*LOOPBACK_NAMES, self.host.lower()}
        if self.token is None:
            return name in own
        # No name that an attacker chooses is among these, and a number cannot be pointed elsewhere.
        number = name[1:-1] if name.startswith("[") else name
        return name in own or name == socket.gethostname().lower() or _address(number) is not None


def make_gate(host: str, port: int) -> Gate:
    """Return the gate of a server; away from loopback with a token of 128 random bits.

    Parameters
    ----------
    host : str
        The address on which the server listens.
    port : int
        Its port.

    Examples
    --------
    >>> make_gate("127.0.0.1", 8765).address()
    'http://127.0.0.1:8765/'
    >>> len(make_gate("192.168.1.5", 8765).token)
    22
    """
    return Gate(host, port, None if is_loopback(host) else secrets.token_urlsafe(16))


def is_loopback(host: str) -> bool:
    """Return whether an address is reached from this machine alone.

    Examples
    --------
    >>> [is_loopback(host) for host in ("127.0.0.1", "::1", "localhost", "0.0.0.0", "lab")]
    [True, True, True, False, False]
    """
    address = _address(host)
    return host.lower() == "localhost" or (address is not None and address.is_loopback)


def is_any(host: str) -> bool:
    """Return whether an address means all addresses of the machine."""
    address = _address(host)
    return address is not None and address.is_unspecified


def _address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """Return the address that a name is as a number, None when it is none."""
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


def host_name(header: str) -> str:
    """Return the name in a Host header, without the port; empty when it is no such header.

    Examples
    --------
    >>> [host_name(header) for header in ("localhost:8765", "[::1]:8765", "lab", "lab, lab:80")]
    ['localhost', '[::1]', 'lab', '']
    """
    match = _HOST.fullmatch(header)
    return "" if match is None else match[1]
