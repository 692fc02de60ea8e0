"""The answer of a run as its kind declares it: of the command that made it, and of `info`."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from driftwalk.cli.terminal.answer import print_report_next, print_warnings
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


def print_run(folder: Path, *, json: bool) -> None:
    """Print the answer of a finished run.

    Parameters
    ----------
    folder : Path
        The run directory.
    json : bool
        Whether one JSON object is printed.

    Raises
    ------
    InputError
        When there is no run, or one without a result.
    """
    from driftwalk.schema.runs import answer_of, open_run_folder

    run = open_run_folder(folder)
    found = None if run.kind is None else run.dataset(run.kind.file)
    if run.kind is None or found is None:
        why = "; ".join(run.problems.values()) or f"its result is not there ({run.state})"
        raise InputError(f"{folder} holds a run, but {why}")
    lines = answer_of(found)
    warnings = run.faults()
    if json:
        facts = {"kind": run.kind.name, "finished": run.state == "finished", "answer": lines}
        print_json({**facts, "warnings": warnings})
        return
    print(f"{run.kind.title}: {folder / run.kind.file}")
    for line in lines:
        print(line)
    print_warnings(warnings)
    print_report_next(folder)
