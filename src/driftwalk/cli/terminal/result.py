"""The answer of a command that makes a run, as the kind of the run declares it."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from driftwalk.cli.terminal.output import print_json
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def print_result(found: xr.Dataset, folder: Path, *, json: bool) -> None:
    """Print what a run found: one JSON object, or lines for people.

    Parameters
    ----------
    found : xarray.Dataset
        The result of the run.
    folder : Path
        The run directory.
    json : bool
        Whether one JSON object is printed.
    """
    from driftwalk.schema.runs import kind_of

    kind = kind_of(found)
    if kind is None or not kind.terminal:
        raise InputError("no command prints a dataset of this kind")
    answer = import_module(kind.terminal)
    if json:
        print_json(answer.summary(found))
    else:
        answer.print_answer(found, folder)
