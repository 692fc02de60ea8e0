"""Read a file that has to be small, without trusting its size."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError

MIB: Final = 1 << 20


def read_bounded(path: str | Path, *, most: int) -> bytes:
    """Return the content of a file that holds at most so many bytes.

    Parameters
    ----------
    path : path-like
        The file; a device or a pipe is not read beyond the bound either.
    most : int
        Bytes that it may hold.

    Raises
    ------
    FormatError
        When it holds more.
    OSError
        When it cannot be read.

    Examples
    --------
    >>> from importlib.resources import files
    >>> truth = files("driftwalk.datasets") / "tank30_ode_a" / "truth.json"
    >>> read_bounded(str(truth), most=MIB)[:1]
    b'{'
    """
    with Path(path).open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise FormatError(f"is larger than {most / MIB:g} MiB, too large for its kind", path=path)
    return content
