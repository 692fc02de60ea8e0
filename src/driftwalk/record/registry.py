"""Registry of the readable formats, and recognition by the names that a file holds.

Files under `record.loaders` are found automatically. A further format joins by one file that
defines ``LOADER``, an object with the members of `Loader`, or by an entry in the ``LOADERS`` of a
file of several. Nothing else has to be edited. Other packages name theirs by entry points, see
`record.plugin_loaders`.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, Protocol, runtime_checkable

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.plugin_loaders import ForeignLoaders, foreign_loaders
from driftwalk.record.raw import Marks, RawRecording, ReadOptions
from driftwalk.record.stores.hdf5 import names_in
from driftwalk.record.stores.npz import NPY, ZIP, members
from driftwalk.record.text import read_head
from driftwalk.record.text_head import detect_delimiter, first_lines
from driftwalk.schema.stores.netcdf import HDF5

OTHERS: Final = {
    b"CDF": "NetCDF 3",
    b"SQLite format 3": "an SQLite database",
    b"%PDF": "a PDF",
    b"\x89PNG": "an image",
    b"\xff\xd8\xff": "an image",
    b"MATLAB 5.0": "a MATLAB file",
    b"{": "JSON",
    b"[": "JSON",
}
"""Starts of files of other kinds."""
_NAME: Final = re.compile(rb"[A-Za-z_]\w{2,}")


@dataclass(frozen=True)
class Contents:
    """Container of a file and the names in it."""

    container: str
    """As in `Marks`, or ``""``."""
    kind: str
    """The same in words."""
    names: tuple[str, ...]

    def described(self) -> str:
        """Return what the file is in a few words."""
        shown = [f"'{name:.30}'" for name in self.names[:6]]
        more = ", …" if len(self.names) > 6 else ""
        return f"{self.kind} with {', '.join(shown)}{more}" if shown else self.kind


def contents_of(path: Path, head: bytes) -> Contents:
    """Return what a file holds; it does not raise.

    Parameters
    ----------
    path : Path
        File or folder.
    head : bytes
        Its start, empty for a folder.
    """
    if path.is_dir():
        return Contents("folder", "a folder", tuple(sorted(one.name for one in path.iterdir())))
    if head.startswith(HDF5):
        names = tuple(sorted(names_in(path, head)))
        return Contents("HDF5", "HDF5" if names else "HDF5 that is empty or damaged", names)
    if head.startswith(ZIP):
        names = tuple(sorted(members(path)))
        return Contents("npz", "NumPy's .npz" if names else "a zip file", names)
    if head.startswith(NPY):
        return Contents("npy", "NumPy's .npy", _fields_of_npy(head))
    for start, kind in OTHERS.items():
        if head.lstrip().startswith(start):
            return Contents("", kind, ())
    lines = first_lines(head, 4)
    if not lines:
        return Contents("", "no text", ())
    if head.lstrip().startswith(b"<"):
        elements = re.findall(r"<([A-Za-z]\w*)", " ".join(lines))
        return Contents("XML", "XML", tuple(dict.fromkeys(elements)))
    delimiter = detect_delimiter(lines[:2])
    fields = [one for line in lines for one in split_fields(line, delimiter)]
    names = tuple(dict.fromkeys(one for one in fields if one and not is_number(one)))
    return Contents("table", "a table", names)


def _fields_of_npy(head: bytes) -> tuple[str, ...]:
    """Return names that stand in the start of a pickled dictionary, or the type of an array."""
    end = head.find(b"\n") + 1
    found = re.search(rb"\{.*?\}", head[:end])
    try:
        header = ast.literal_eval(found.group().decode("latin1")) if found else {}
    except (ValueError, SyntaxError):
        header = {}
    if header.get("descr") != "|O":
        return (f"array of {header.get('descr', 'unknown type')}",)
    words = (word.decode() for word in _NAME.findall(head[end:]))
    return tuple(dict.fromkeys(words))


def unknown_file(path: Path, head: bytes, loaders: Mapping[str, Any]) -> str:
    """Return what a file is that no loader recognises, and which formats it is nearest to.

    Parameters
    ----------
    path : Path
        The file.
    head : bytes
        Its start.
    loaders : mapping
        Loaders by their names; those with `marks` can be near.
    """
    contents = contents_of(path, head)
    if contents.container == "HDF5" and {"frames", "instances", "points"} <= set(contents.names):
        return "it is a SLEAP project: export it as analysis HDF5 or CSV"
    near = _near(contents, loaders)
    found = [f"{name} ({lacks or 'it is damaged'})" for _, name, lacks in near[:3]]
    if found:
        nearest = f"the nearest are {', '.join(found)}; if it is one of these, name it"
    else:
        nearest = f"if it is one that is read ({', '.join(loaders)}), name it"
    return f"it is {contents.described()}; {nearest} with `format`"


def nearest_table(path: Path, head: bytes, loaders: Mapping[str, Any]) -> str:
    """Return which format a table that was read as a plain one may be, ``""`` where none is near.

    Parameters
    ----------
    path, head, loaders
        As in `unknown_file`.
    """
    near = _near(contents_of(path, head), loaders)
    # With half the names of a format or fewer, a table is just a table.
    if not near or near[0][0] <= 0.5:
        return ""
    _, name, lacks = near[0]
    return f"; as {name} it {lacks}" if lacks else ""


def _near(contents: Contents, loaders: Mapping[str, Any]) -> list[tuple[float, str, str]]:
    """Return (share of the names that are there, format, what it lacks), the nearest first.

    Formats of the same container of which nothing is there come last, so that the user learns what
    is looked for.
    """
    near = []
    for name, loader in loaders.items():
        marks: tuple[Marks, ...] = getattr(loader, "marks", ())
        shares = [
            (len(set(one.names) & set(contents.names)) / len(one.names), one)
            for one in marks
            if one.container == contents.container
        ]
        if shares:
            share, one = max(shares, key=lambda entry: entry[0])
            missing = [f"'{mark}'" for mark in one.names if mark not in contents.names]
            near.append((share, name, f"lacks {', '.join(missing[:4])}" if missing else ""))
    near.sort(key=lambda entry: (-entry[0], entry[1]))
    anything = [entry for entry in near if entry[0] > 0.0]
    return anything or (near if contents.container != "table" else [])


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
