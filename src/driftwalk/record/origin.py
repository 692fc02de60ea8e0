"""Where a recording comes from: a file that a loader reads, or a table in memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any, Final

from driftwalk.core.errors import FormatError, InputError, naming_its_file
from driftwalk.core.files.bounded import text_of_name
from driftwalk.record.raw import RawRecording, ReadOptions
from driftwalk.record.registry import PLAIN, find_loader, loaders, nearest_table
from driftwalk.record.tables.in_memory import table_in_memory
from driftwalk.record.tables.rows import recording_of
from driftwalk.record.text import encoding_notes, read_head
from driftwalk.schema.stores.netcdf import kind_of_file

IN_MEMORY: Final = "table"
"""Format of what is no file."""
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
        given = [name for name, value in stated.items() if value is not None]
        if given:
            raise InputError(f"{table.what}: `{given[0]}` is about a file: leave it out")
        name = table.what.removeprefix("the ")
        return Origin(table.what, name, IN_MEMORY, partial(recording_of, table))
    path = Path(data)
    if replicate is not None and kind_of_file(path) != "simulation":
        raise InputError(f"{path}: no simulation, so it has no replicates: omit `replicate`")
    named = format or ("matrices" if options.y is not None else None)
    loader = find_loader(path, format=named, by_columns=bool(options.columns))
    return Origin(
        where=str(path),
        name=text_of_name(path.name),
        format=loader.name,
        read=partial(naming_its_file(loader.read), path),
        path=path,
        guessed=format is None and loader.name == PLAIN,
    )
