"""Follow a policy of modes over a tracker's stream, line by line, and find it again when lost."""

from __future__ import annotations

import socket
import time as clock
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from driftwalk.assembly import LiveControl
from driftwalk.core.errors import InputError
from driftwalk.viewer.live_client import FORMAT, LONGEST_LINE, VERSION, stream_line

if TYPE_CHECKING:
    import xarray as xr


def pilot(
    policy: xr.Dataset, host: str, port: int, *, patience_s: float = 2.0
) -> Iterator[dict[str, Any]]:
    """Return the decisions for a tank, as its tracker streams it, one after the other.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.
    host, port : str, int
        Where the tracker publishes (``driftwalk track --live PORT``).
    patience_s : float
        Time without a frame after which the safe mode is chosen [s].

    Returns
    -------
    iterator of dict
        ``type`` "decision", "safe" or "end", with the ``mode``, its ``flow_scale`` and
        ``force_std_N``. The last one is the end.

    Raises
    ------
    InputError
        When there is no tracker of driftwalk, or its tank is not that of the policy.

    Examples
    --------
    ``for line in pilot(policy, "127.0.0.1", 5000): print(line)``
    """
    control = LiveControl(policy)
    connected = False
    until = clock.monotonic() + float(policy.attrs["by_s"])
    while True:
        try:
            with socket.create_connection((host, port), timeout=patience_s) as stream:
                connected = True
                yield from _follow(control, stream, f"{host}:{port}", patience_s)
        except OSError as error:
            if not connected:
                raise InputError(
                    f"no tracker on {host}:{port}: {error.strerror or error}"
                ) from error
        if control.ended:
            return
        yield control.safe("the stream has stopped")
        if clock.monotonic() > until:
            yield control.end()
            return
        clock.sleep(min(patience_s, 1.0))


def _follow(
    control: LiveControl, stream: socket.socket, address: str, patience_s: float
) -> Iterator[dict[str, Any]]:
    """Yield decisions until the stream ends or the tank is done."""
    hello, quiet = False, False
    for line in _lines(stream):
        content = None if line is None else stream_line(line)
        if line is None:
            if not quiet and hello:
                yield control.safe(f"no frame for {patience_s:g} s")
            quiet = True
        elif not hello:
            if content is None or content.get("format") != FORMAT:
                raise InputError(f"the program on {address} is not a tracker of driftwalk")
            if content.get("version") != VERSION:
                raise InputError(
                    f"the tracker on {address} speaks version {content.get('version')} of the "
                    f"stream, this driftwalk version {VERSION}"
                )
            control.hello(content)
            hello = True
        elif content is not None and content["type"] == "frame":
            quiet = False
            said = control.frame(content)
            if said is not None:
                yield said
            if control.ended:
                return


def _lines(stream: socket.socket) -> Iterator[bytes | None]:
    """Yield the lines of a stream; None when nothing came for the time of its limit."""
    rest = b""
    while True:
        try:
            part = stream.recv(1 << 16)
        except TimeoutError:
            yield None
            continue
        if not part or len(rest) > LONGEST_LINE:
            return
        *whole, rest = (rest + part).split(b"\n")
        yield from whole
