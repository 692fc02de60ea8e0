"""Recognise flow-field files and their program: recordings have the same file endings."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from driftwalk.core.errors import FormatError, InputError
from driftwalk.flow.readers import text
from driftwalk.flow.readers.columns import FIELD, column_of, holds_field, names_a_time
from driftwalk.flow.readers.netcdf import holds_velocities
from driftwalk.flow.readers.pivlab import holds_velocities as holds_pivlab, is_pivlab
from driftwalk.flow.readers.programs import HEAD
from driftwalk.flow.readers.text import Layout, TextOptions
from driftwalk.flow.rows import grid_rows
from driftwalk.schema.stores.netcdf import is_netcdf, kind_of_file, open_netcdf


def flow_format(path: str | PathLike[str]) -> str | None:
    """Return what kind of flow field a file holds, None of a recording or any other file.

    Rows of numbers without a header are a field when they fill a grid, a row for each node.

    Parameters
    ----------
    path : path-like
        Any file or folder.

    Returns
    -------
    str or None
        ``"driftwalk"``, ``"netcdf"``, ``"csv"``, ``"openpiv"``, ``"insight"``, ``"davis"``,
        ``"pivlab"``, ``"dantec"``, ``"tecplot"`` or ``"fiji"``.

    Raises
    ------
    FormatError
        When it is a field that only its own program reads.

    Examples
    --------
    >>> from importlib.resources import files
    >>> flow_format(str(files("driftwalk.datasets") / "tank30_ode_a" / "flow_true.csv"))
    'csv'
    >>> flow_format(str(files("driftwalk.datasets") / "tank30_ode_a" / "recording.csv"))
    """
    source = Path(path)
    if not source.is_file():
        return None
    text.refuse_binary(source)
    try:
        if is_pivlab(source):
            return "pivlab" if holds_pivlab(source) else None
        if is_netcdf(source):
            return _netcdf_format(source)
        return _text_format(source)
    except OSError as error:
        raise FormatError(f"cannot be opened: {error.strerror or error}", path=source) from error


def _text_format(path: Path) -> str | None:
    """Return the program of a text whose names, or whose rows, are those of a field."""
    try:
        head = text.read_text(path, most=HEAD)
        layout = text.layout_of(head, TextOptions())
    except FormatError:
        # A damaged field is still one of its program.
        return None if path.stat().st_size == 0 else text.signed(path)
    names, program = layout.names, layout.program
    if names_a_time(names):
        return None
    named = layout.header > 0 and set(FIELD) <= {column_of(one).base for one in names}
    if named or (program.sign and holds_field(names)):
        return program.name
    along = holds_field(names) and _goes_along_a_line(layout)
    return program.name if along and _fills_a_grid(path) else None


def _goes_along_a_line(layout: Layout) -> bool:
    """Whether the first two rows share x or y, as neighbouring nodes of a grid do.

    In most recordings they do not, and no more is read of those.
    """
    known = [column_of(name).quantity for name in layout.names]
    rows = [line.split(layout.delimiter) for _, line in layout.rows[:2]]
    if len(rows) < 2 or any(len(row) < len(known) for row in rows):
        return False
    return any(rows[0][at] == rows[1][at] for at in (known.index("x"), known.index("y")))


def _netcdf_format(path: Path) -> str | None:
    kind = kind_of_file(path)
    if kind is not None:
        return "driftwalk" if kind == "flow_field" else None
    try:
        return "netcdf" if holds_velocities(open_netcdf(path)) else None
    except InputError:
        return None


def _fills_a_grid(path: Path) -> bool:
    # A larger file whose names do not say so is taken for a recording.
    if path.stat().st_size > 64 << 20:
        return False
    try:
        grid_rows(text.read(path).rows)
    except InputError:
        return False
    return True
