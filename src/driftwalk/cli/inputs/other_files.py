"""Kinds of files that are not recordings, and the commands that take them."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from driftwalk.core.errors import FormatError, InputError

VIDEOS: Final = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".webm", ".wmv")
KINDS: Final = {
    "assembly_path": "the motion of runs of driftwalk assemble: driftwalk classify takes it, and "
    "driftwalk report its run directory",
    "flow_field": "a flow field, and no positions: it is for --flow",
}
_OTHER: Final = (
    "not a recording but a result of kind '{}': driftwalk report takes its run directory"
)


@contextlib.contextmanager
def explained() -> Iterator[None]:
    """Say of a file that no reader of recordings could read what it is instead.

    Raises
    ------
    InputError
        In the place of a `FormatError`, where it is known.
    """
    try:
        yield
    except FormatError as error:
        other = None if error.path is None else what_else(Path(error.path))
        if other is None and error.path is not None and "format is not recognised" in error.reason:
            other = _maybe_a_field(Path(error.path))
        if other is None:
            raise
        raise InputError(f"{error.path} {other}") from error


def what_else(path: Path) -> str | None:
    """Return what a file is instead of a recording and what to do with it, None when unknown.

    Parameters
    ----------
    path : Path
        A file that no reader of recordings could read.

    Examples
    --------
    >>> from importlib.resources import files
    >>> what_else(Path(str(files("driftwalk.datasets") / "tank30_ode_a" / "recording.csv")))
    """
    # NumPy comes with them, which the help of the commands does without.
    from driftwalk.core.files.run_layout import state_of
    from driftwalk.schema.stores.netcdf import kind_of_file

    if path.is_dir() and state_of(path) in ("unfinished", "finished"):
        recording = path / "recording.nc"
        inside = f", and its recording is {recording}" if recording.is_file() else ""
        return f"is a run directory: driftwalk report takes it{inside}"
    if not path.is_file():
        return None
    if path.suffix.lower() in VIDEOS:
        return "is a video: driftwalk track makes a recording of it"
    if _is_field(path):
        return f"holds {KINDS['flow_field']}"
    kind = kind_of_file(path) if path.suffix.lower() == ".nc" else None
    if kind is None or kind in ("trajectory", "simulation"):
        return None
    return f"holds {KINDS.get(kind, _OTHER.format(kind))}"


def _is_field(path: Path) -> bool:
    from driftwalk.flow import flow_format

    try:
        return flow_format(path) is not None
    except FormatError:
        return True  # a field that only its own program reads


def _maybe_a_field(path: Path) -> str | None:
    """Return how a `.nc` that is no known recording may be read as a flow field, None of others."""
    from driftwalk.schema.stores.netcdf import is_netcdf, kind_of_file, open_netcdf

    named = path.is_file() and path.suffix.lower() == ".nc"
    if not named or not is_netcdf(path) or kind_of_file(path) is not None:
        return None
    try:
        names = ", ".join(list(map(str, open_netcdf(path).variables))[:12])
    except FormatError:
        return None  # damaged: it may have been anything
    return (
        f"is NetCDF of no recording that is known, with {names}: if it is a flow field, name its "
        "variables with --flow-variables u=NAME,v=NAME,x=NAME,y=NAME"
    )
