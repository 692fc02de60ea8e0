"""`driftwalk view`: a run or a tracker's stream in the browser."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from driftwalk.cli.options.shared_types import argument, option
from driftwalk.cli.terminal.output import print_note, print_warnings
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    from driftwalk.viewer import Source

Port = Annotated[int, option("--port", "Port to serve on; 0 for a free port.")]
Host = Annotated[
    str, option("--host ADDRESS", "Address to serve on; other machines need the printed token.")
]
Open = Annotated[
    bool | None, option("--open/--no-open", "Open the browser (default: only on a terminal).")
]


def view(
    source: Annotated[
        str,
        argument("RUN|ADDRESS:PORT", "Run directory, finished or not; or the address of a stream."),
    ],
    port: Port = 8765,
    host: Host = "127.0.0.1",
    open: Open = None,
) -> None:
    """Explore a run in the browser, or watch a tracker's stream.

    The page of an unfinished run fills as results arrive. Ctrl-C ends the server.
    """
    from driftwalk.viewer import LiveSource, RunSource, require_server

    address = None if Path(source).exists() else address_of(source)
    require_server()
    shown: Source = (
        RunSource(source, tell=lambda text: print_warnings([text]))
        if address is None
        else LiveSource(*address)
    )
    show(shown, host=host, port=port, open=open)


def show(source: Source, *, host: str, port: int, open: bool | None) -> None:
    """Serve a page, say where it is, and open the browser if that is wanted."""
    import threading
    import webbrowser

    from driftwalk.viewer import serve

    wanted = sys.stdout.isatty() if open is None else open

    def ready(address: str) -> None:
        print(address, flush=True)
        # It holds a token where other machines reach it.
        if "?" in address:
            print_note(
                "other machines need the whole address to open this page. The connection is not "
                "encrypted: anyone who can read the network traffic can read the page and its token"
            )
        print_note("Ctrl-C ends it")
        if wanted:
            # In a thread of its own: some systems wait until the browser is closed.
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

    serve(source, host=host, port=port, ready=ready)


def address_of(text: str) -> tuple[str, int] | None:
    """Return host and port of a stream, None of a text that ends in no port.

    The host is loopback when only the port is given.

    Raises
    ------
    InputError
        When the port is not one.

    Examples
    --------
    >>> address_of("192.168.1.5:5000"), address_of("5000"), address_of("[::1]:5000")
    (('192.168.1.5', 5000), ('127.0.0.1', 5000), ('::1', 5000))
    """
    name, _, port = text.rpartition(":")
    if not (port.isascii() and port.isdigit()):
        return None
    # A port has 16 bits.
    if not 0 < int(port) < 1 << 16:
        raise InputError(f"{text}: expected an address and a port, such as 127.0.0.1:5000")
    return name.strip("[]") or "127.0.0.1", int(port)
