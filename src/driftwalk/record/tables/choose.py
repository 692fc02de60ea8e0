"""Choose the table of a file that holds the recording."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from driftwalk.core.errors import FormatError, InputError, argument_text
from driftwalk.core.text.did_you_mean import listed
from driftwalk.record.raw import ReadOptions
from driftwalk.record.tables.rows import columns_of
from driftwalk.record.tables.source import TableSource


def the_one_that_fits(
    tables: Mapping[str, TableSource], options: ReadOptions, path: Path, what: str
) -> TableSource:
    """Return the table that the user names, or the only one that holds positions.

    Parameters
    ----------
    tables : mapping
        Tables by their names.
    options : ReadOptions
        `sheet` names one, by its name or its number from 1.
    path : Path
        The file, for errors.
    what : str
        What such a table is called, "sheet" or "variable".

    Raises
    ------
    FormatError
        When there is none, or several.
    """
    if not tables:
        raise FormatError(f"has no {what} that is a table", path=path)
    if options.sheet is not None:
        return _named(tables, options.sheet, path, what)
    if len(tables) == 1:
        return next(iter(tables.values()))
    fitting: list[str] = []
    reasons: list[str] = []
    for name, table in tables.items():
        try:
            columns_of(table, options)
            fitting.append(name)
        except InputError as error:
            reasons.append(error.reason if isinstance(error, FormatError) else str(error))
    if len(fitting) > 1:
        choice = argument_text("sheet", fitting[0])
        raise FormatError(
            f"holds positions in more than one {what}, {listed(fitting)}: name it, as in {choice}",
            path=path,
        )
    if not fitting:
        raise FormatError(
            f"has no {what} with positions among {listed(list(tables))}; {reasons[0]}", path=path
        )
    return tables[fitting[0]]


def _named(tables: Mapping[str, TableSource], wanted: str, path: Path, what: str) -> TableSource:
    if wanted in tables:
        return tables[wanted]
    if wanted.isdecimal() and 1 <= int(wanted) <= len(tables):
        return list(tables.values())[int(wanted) - 1]
    raise FormatError(
        f"{argument_text('sheet', wanted)}: no such {what}; it has {listed(list(tables))}",
        path=path,
    )
