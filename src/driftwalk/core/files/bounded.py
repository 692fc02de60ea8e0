"""Files and names from outside: one that has to be small, names as text, where a name may lead."""

from __future__ import annotations

from pathlib import Path, PurePath
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


def text_of_name(name: str | PurePath) -> str:
    r"""Return a name or a path as text that every file can hold.

    Python keeps the bytes of a name that are not of the locale's encoding as lone surrogates, which
    neither UTF-8 nor HDF5 take. Bytes of UTF-8, all of them in the locale C, become what they
    mean; others are spelled.

    Parameters
    ----------
    name : str or path
        As the operating system or the command line gave it.

    Examples
    --------
    >>> text_of_name("K\udcc3\udca4fer.csv")
    'Käfer.csv'
    >>> print(text_of_name("K\udce4fer.csv"))
    K\xe4fer.csv
    """
    return str(name).encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def path_inside(folder: Path, name: str) -> Path | None:
    """Return where a name leads, links followed; None when out of the folder, or nowhere.

    Parameters
    ----------
    folder : Path
        The folder. It may be reached through a link itself: the user named it.
    name : str
        What lies in it, parts joined by "/". It may come from a browser or from a file.

    Examples
    --------
    >>> path_inside(Path("."), "../secret") is None, path_inside(Path("."), "/etc") is None
    (True, True)
    """
    try:
        root = folder.resolve(strict=True)
        path = root.joinpath(name).resolve(strict=True)
    except (OSError, ValueError, RuntimeError):
        # No such file, a name that no file has, a ring of links.
        return None
    return path if path.is_relative_to(root) else None
