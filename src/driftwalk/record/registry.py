"""Where a recording comes from: a table in memory, or a file that one of the loaders reads.

Files under `record.loaders` are found automatically. A further format joins by one file that
defines ``LOADER``, an object with the members of `Loader`, or by an entry in the ``LOADERS`` of a
file of several. Nothing else has to be edited. Other packages name theirs by entry points of the
group ``driftwalk.loaders``: an error in one of them is one line with the name of its package, and
keeps no other file from being read.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib.metadata import entry_points
from os import PathLike
from pathlib import Path
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np

from driftwalk.core.errors import FormatError, InputError, naming_its_file, reason_of
from driftwalk.core.text_files import text_of_name
from driftwalk.record.bad_row import is_number, split_fields
from driftwalk.record.containers import ZIP, members, names_in
from driftwalk.record.raw import (
    ANGLE_UNITS,
    CLOCK_UNITS,
    LENGTH_UNITS,
    Marks,
    RawBody,
    RawRecording,
    ReadOptions,
)
from driftwalk.record.tables.in_memory import table_in_memory
from driftwalk.record.tables.rows import recording_of
from driftwalk.record.tables.text_source import detect_delimiter, first_lines
from driftwalk.record.text import encoding_notes, read_head
from driftwalk.schema.stores.netcdf import HDF5, kind_of_file

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
"""Starts of files of other kinds, and of damaged ones."""


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
    found = ", ".join(f"{name} ({lacks or 'it is damaged'})" for _, name, lacks in near[:3])
    nearest = f"if it is one that is read ({', '.join(loaders)})"
    if found:
        nearest = f"the nearest are {found}; if it is one of these"
    return f"it is {contents.described()}; {nearest}, name it with `format`"


def nearest_table(path: Path, head: bytes, loaders: Mapping[str, Any]) -> str:
    """Return which format a table that was read as a plain one may be, ``""`` where none is near.

    Parameters
    ----------
    path, head, loaders
        As in `unknown_file`.
    """
    near = _near(contents_of(path, head), loaders)
    share, name, lacks = next(iter(near), (0.0, "", ""))
    # With half the names of a format or fewer, a table is just a table.
    return f"; as {name} it {lacks}" if share > 0.5 and lacks else ""


def _near(contents: Contents, loaders: Mapping[str, Any]) -> list[tuple[float, str, str]]:
    """Return (share of the names that are there, format, what it lacks), the nearest first.

    Formats of the same container of which nothing is there come last, so that the user learns what
    is looked for.
    """
    near = []
    for name, loader in loaders.items():
        marks: tuple[Marks, ...] = getattr(loader, "marks", ())
        found = []
        for one in (one for one in marks if one.container == contents.container):
            missing = [f"'{mark}'" for mark in one.names if mark not in contents.names]
            lacks = f"lacks {', '.join(missing[:4])}" if missing else ""
            found.append((1.0 - len(missing) / len(one.names), name, lacks))
        near += sorted(found, key=lambda entry: -entry[0])[:1]
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

    name: str
    """Name of the format, as `load` takes it."""
    description: str
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
    return {**_own_loaders(), **_foreign()[0]}


@cache
def _foreign() -> tuple[dict[str, ForeignLoader], dict[str, str]]:
    """Return the loaders of other packages, and what is wrong with the broken ones."""
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
    broken = _foreign()[1]
    if format is not None and format not in known:
        reason = f"unknown `format` '{format}'; readable: {', '.join(known)}"
        raise InputError(f"`format` '{format}': {broken[format]}" if format in broken else reason)
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


GROUP: Final = "driftwalk.loaders"
_MEMBERS: Final = ("name", "description", "sniff", "read")


class ForeignLoader:
    """A loader of another package, whose errors name the package."""

    def __init__(self, loader: Any, package: str) -> None:
        if lacking := [name for name in _MEMBERS if not hasattr(loader, name)]:
            raise TypeError(f"it has no {' and no '.join(lacking)}")
        self._loader = loader
        self.name = str(loader.name)
        self.description = str(loader.description)
        self._by = f"the loader '{self.name}' of the package {package}"
        self.failed = ""
        """Error of the last attempt to recognise a file, ``""`` where there was none."""
        self.marks: tuple[Marks, ...] = tuple(getattr(loader, "marks", ()))

    def sniff(self, head: bytes, path: Path) -> float:
        """Return how sure the loader is; one that fails is not sure at all."""
        self.failed = ""
        try:
            return float(self._loader.sniff(head, path))
        except Exception as error:  # whatever another package's code raises
            kind = type(error).__name__
            self.failed = f"{self._by} failed to recognise it: {kind}: {reason_of(error)}"
            return 0.0

    def read(self, path: Path, options: ReadOptions) -> RawRecording:
        """Read the file by the other package's code."""
        try:
            raw: RawRecording = self._loader.read(path, options)
        except FormatError as error:
            line, column = error.line, error.column
            reason = f"{' '.join(error.reason.split())} ({self._by})"
            raise FormatError(reason, path=error.path, line=line, column=column) from error
        except InputError as error:
            raise InputError(f"{reason_of(error)} ({self._by})") from error
        except Exception as error:  # whatever another package's code raises
            kind = type(error).__name__
            raise FormatError(f"{self._by} failed: {kind}: {reason_of(error)}") from error
        try:
            _refuse_facts(raw)
            raw.bodies = [_own(body) for body in raw.bodies]
        except TypeError as error:
            raise FormatError(f"{self._by} returned {error}") from error
        return raw


def foreign_loaders(taken: Container[str]) -> tuple[dict[str, ForeignLoader], dict[str, str]]:
    """Return the loaders of the installed packages, and what is wrong with the broken ones.

    Both by name: of the format, and of the entry point.

    Parameters
    ----------
    taken : container of str
        Names of formats that no other package may use.

    Examples
    --------
    >>> foreign_loaders([])[1]
    {}
    """
    found: dict[str, ForeignLoader] = {}
    broken: dict[str, str] = {}
    points = [
        (one.name, one.dist.name if one.dist is not None else one.value, one)
        for one in entry_points(group=GROUP)
    ]
    for name, package, point in sorted(points, key=lambda one: one[:2]):
        try:
            foreign = ForeignLoader(point.load(), package)
        except Exception as error:  # whatever another package's code raises
            reason = f"{type(error).__name__}: {reason_of(error)}"
            broken[name] = f"the package {package} has a broken loader ({reason})"
            continue
        if foreign.name in taken or foreign.name in found:
            broken[name] = (
                f"the package {package} has a loader named '{foreign.name}', which another loader "
                "is named already"
            )
        else:
            found[foreign.name] = foreign
    return found, broken


def _refuse_facts(raw: Any) -> None:
    """Raise a `TypeError` that says what a loader must not return."""
    if not isinstance(raw, RawRecording):
        raise TypeError(f"{type(raw).__name__}, and has to return a RawRecording")
    units = (
        ("clock_unit", raw.clock_unit, (*CLOCK_UNITS, "frame")),
        ("length_unit", raw.length_unit, (*LENGTH_UNITS, "px", "")),
        ("angle_unit", raw.angle_unit, tuple(ANGLE_UNITS)),
        ("y_axis", raw.y_axis, ("up", "down", "")),
    )
    for name, value, known in units:
        if value not in known:
            raise TypeError(f"{name} = {value!r}, which is none of {', '.join(map(repr, known))}")
    if not raw.bodies:
        raise TypeError("no bodies")


def _own(body: RawBody) -> RawBody:
    """Return a body whose arrays may be converted in place, or raise a `TypeError`."""
    names = ("clock", "x", "y", *(() if body.theta is None else ("theta",)))
    columns: dict[str, Any] = {name: np.asarray(getattr(body, name)) for name in names}
    times = columns["clock"]
    for name, values in columns.items():
        if values.dtype.kind not in "fiu" or values.shape != times.shape[:1]:
            raise TypeError(
                f"{name} of body '{body.name}' as {values.dtype} of shape {values.shape}, and it "
                f"has to be numbers, one for each of the {times.size} times"
            )
    copied: dict[str, Any] = {name: np.array(one, float) for name, one in columns.items()}
    return replace(body, name=str(body.name), **copied)


_OF_FILES: Final = ("delimiter", "header_line", "sheet", "topic", "x", "y", "theta", "keypoint")
"""Options that say something about a file alone."""


@dataclass(frozen=True)
class Origin:
    """A recording that is still to be read."""

    where: str
    """The file, or what the table is, for messages."""
    name: str
    """Name of the source, for the dataset."""
    format: str
    read: Callable[[ReadOptions], RawRecording]
    path: Path | None = None
    guessed: bool = False
    """Whether nothing but its content says that it is a plain table."""

    def explained(self, error: InputError) -> InputError:
        """Return an error of the reading with the file that it is about, and what may help."""
        if self.path is None or not isinstance(error, FormatError):
            return InputError(f"{self.where}: {' '.join(str(error).splitlines())}")
        # A table that no loader recognised may be a damaged file of one of these formats.
        hint = nearest_table(self.path, read_head(self.path), loaders()) if self.guessed else ""
        path = error.path or self.path
        return FormatError(error.reason + hint, path=path, line=error.line, column=error.column)

    def notes(self) -> list[str]:
        """Return what to say about the file apart from its contents."""
        return [] if self.path is None else encoding_notes(self.path)


def origin_of(
    data: str | PathLike[str] | Any,
    options: ReadOptions,
    *,
    format: str | None,
    replicate: int | None,
) -> Origin:
    """Return where a recording comes from.

    Parameters
    ----------
    data : path-like, or a table in memory
        What `load` was given.
    options : ReadOptions
        What is known about it.
    format : str, optional
        Name of the format; None: recognised by content.
    replicate : int, optional
        Replicate of a simulation, if one was named.

    Raises
    ------
    InputError
        When it is nothing that can be read, or an option is about something else.
    """
    if not (isinstance(data, str) or hasattr(data, "__fspath__")):
        table = table_in_memory(data)
        stated = {name: getattr(options, name) for name in _OF_FILES}
        stated |= {"format": format, "replicate": replicate}
        if given := [name for name, value in stated.items() if value is not None]:
            raise InputError(f"{table.what}: `{given[0]}` is about a file: leave it out")
        name = table.what.removeprefix("the ")
        return Origin(table.what, name, "table", partial(recording_of, table))
    path = Path(data)
    if replicate is not None and kind_of_file(path) != "simulation":
        raise InputError(f"{path}: no simulation, so it has no replicates: omit `replicate`")
    named = format or ("matrices" if options.y is not None else None)
    loader = find_loader(path, format=named, by_columns=bool(options.columns))
    read = partial(naming_its_file(loader.read), path)
    guessed = format is None and loader.name == PLAIN
    return Origin(str(path), text_of_name(path.name), loader.name, read, path, guessed)
