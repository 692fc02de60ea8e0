"""Choose the reader of a file by its content, the most certain first."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError
from driftwalk.flow.readers import davis, insight, openpiv, pivlab, table
from driftwalk.flow.readers.raw import RawField

_TEXTS: Final = {"davis": davis, "insight": insight, "openpiv": openpiv}


def piv_format(path: Path) -> str | None:
    """Return the name of the PIV program that wrote a file, None of any other file.

    Raises
    ------
    FormatError
        When the file cannot be opened, or is one that only its program reads.
    """
    davis.refuse_binary(path)
    try:
        if pivlab.is_pivlab(path):
            return "pivlab"
        with path.open("rb") as file:
            head = file.read(1 << 14)
    except OSError as error:
        raise FormatError(f"cannot be opened: {error.strerror or error}", path=path) from error
    text = head.removeprefix(b"\xef\xbb\xbf").decode("utf-8", "replace")
    return next((name for name, reader in _TEXTS.items() if reader.sniff(text, path)), None)


def read_raw(path: Path) -> RawField:
    """Read a field that is no NetCDF file.

    Raises
    ------
    FormatError
        When it cannot be read.
    """
    name = piv_format(path)
    if name == "pivlab":
        return pivlab.read(path)
    return table.read(path) if name is None else _TEXTS[name].read(path)
