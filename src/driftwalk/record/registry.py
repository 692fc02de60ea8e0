"""Registry of the readable formats: files under `record.loaders`, found automatically.

A further format joins by one file that defines ``LOADER``, an object with the members of `Loader`,
or by an entry in the ``LOADERS`` of a file of several. Nothing else has to be edited. Other
packages name theirs by entry points, see `record.plugin_loaders`.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Final, Protocol, runtime_checkable

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record.plugin_loaders import ForeignLoaders, foreign_loaders
from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.recognise import unknown_file
from driftwalk.record.text import read_head

PLAIN: Final = "csv"
"""Name of the format of plain tables."""


@runtime_checkable
class Loader(Protocol):
    """Reads one file format.

    It may have `marks`, a tuple of `record.raw.Marks`: the error about a
    file that is nearly of the format then names what it lacks.
    """

    @property
    def name(self) -> str:
        """Name of the format, as `load` takes it."""

    @property
    def description(self) -> str:
        """One line for the list of formats."""

    def sniff(self, head: bytes, path: Path, /) -> float:
        """Return how sure the loader is, 0 to 1, that the file is of its format.

        `head` is the start of the file (64 KiB), uncompressed and without a byte order mark, empty
        for a folder. It must not raise.
        """

    def read(self, path: Path, options: ReadOptions, /) -> RawRecording:
        """Read the file, or raise `FormatError`."""


@cache
def loaders() -> dict[str, Loader]:
    """Return every loader by its name, those of other packages last.

    Examples
    --------
    >>> "idtracker" in loaders()
    True
    """
    return {**_own_loaders(), **_foreign().loaders}


@cache
def _foreign() -> ForeignLoaders:
    """Return the loaders of other packages."""
    return foreign_loaders(_own_loaders())


def _own_loaders() -> dict[str, Loader]:
    import importlib
    import pkgutil

    from driftwalk.record import loaders as package

    found: list[Loader] = []
    for entry in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        if not entry.ispkg:
            module = importlib.import_module(entry.name)
            found += getattr(module, "LOADERS", None) or (module.LOADER,)
    return {loader.name: loader for loader in sorted(found, key=lambda one: one.name)}


def find_loader(path: Path, *, format: str | None = None, by_columns: bool = False) -> Loader:
    """Return the loader of a file, by the name of its format or by its content.

    Parameters
    ----------
    path : Path
        File or folder.
    format : str, optional
        Name of the format; None: the loader that is most sure.
    by_columns : bool
        Whether the user says what the columns hold: a text is then a plain table.

    Raises
    ------
    InputError
        When there is no such format or file, or nothing recognises the content.
    """
    known = loaders()
    broken = _foreign().broken
    if format is not None and format not in known:
        if format in broken:
            raise InputError(f"`format` '{format}': {broken[format]}")
        raise InputError(f"unknown `format` '{format}'; readable: {', '.join(known)}")
    if not path.exists():
        raise FormatError("there is no such file", path=path)
    if format is not None:
        return known[format]
    head = b"" if path.is_dir() else read_head(path)
    if not head.strip() and not path.is_dir():
        raise FormatError("the file is empty", path=path)
    if by_columns and known[PLAIN].sniff(head, path) > 0.0:
        return known[PLAIN]
    confidence = {name: loader.sniff(head, path) for name, loader in known.items()}
    best = max(confidence, key=lambda name: confidence[name])
    if confidence[best] <= 0.0:
        failed = [getattr(loader, "failed", "") for loader in known.values()]
        also = "".join(f"; {reason}" for reason in (*filter(None, failed), *broken.values()))
        raise FormatError(
            f"the format is not recognised: {unknown_file(path, head, known)}{also}", path=path
        )
    return known[best]
