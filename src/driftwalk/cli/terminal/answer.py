"""The answer of a command on stdout, its warnings on stderr, and where everything is."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.cli.terminal.argument_names import to_options
from driftwalk.cli.terminal.output import (
    command_text,
    print_json,
    print_next,
    print_note,
    printable,
    sibling,
)
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.schema.answers.parts import Answer, Part


def print_result(found: xr.Dataset, folder: Path, *, json: bool, **more: Any) -> None:
    """Print the answer of a run, as one JSON object or for people, and what comes next.

    Parameters
    ----------
    found : xarray.Dataset
        The main dataset of the run.
    folder : Path
        The run directory.
    json : bool
        Whether programs read it.
    **more
        What else the run made, see `answer_of`.
    """
    from driftwalk.schema.check import kind_name
    from driftwalk.schema.runs import answer_of

    answer = answer_of(found, **more)
    if answer is None:
        raise InputError(f"no command prints a dataset of kind {kind_name(found)!r}")
    if json:
        print_json(answer.facts)
        return
    print_parts(answer.parts)
    print_places(found, folder, answer.warnings)


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
    from driftwalk.schema.answers.parts import Answer
    from driftwalk.schema.runs import open_run_folder

    run = open_run_folder(folder)
    found = None if run.kind is None else run.dataset(run.kind.file)
    if run.kind is None or found is None:
        why = "; ".join(run.problems.values()) or f"its result is not there ({run.state})"
        raise InputError(f"{folder} holds a run, but {why}")
    answer = run.answer(run.kind, found) or Answer([], {}, [])
    warnings = [*run.problems.values(), *run.faults(), *answer.warnings]
    if json:
        finished = run.state == "finished"
        facts = {"kind": run.kind.name, "finished": finished, **answer.facts}
        print_json({**facts, "warnings": warnings})
        return
    print(f"{run.kind.title}: {printable(str(folder / run.kind.file))}")
    print_parts(answer.parts)
    print_warnings(warnings)
    print_report_next(folder)


def print_parts(parts: Iterable[Part]) -> None:
    """Print parts of an answer."""
    from driftwalk.schema.answers.parts import lines_of

    for line in lines_of(parts):
        print(printable(to_options(line)))
    # Through a pipe the answer would wait in the buffer for what follows, such as the figures.
    sys.stdout.flush()


def print_row(label: str, text: object) -> None:
    """Print a row.

    Examples
    --------
    >>> print_row("flow", "fit/flow.nc")
    flow                   fit/flow.nc
    """
    from driftwalk.schema.answers.parts import Row

    print_parts([Row(label, str(text))])


def print_places(found: xr.Dataset, folder: Path, warnings: Iterable[str]) -> None:
    """Print the warnings, where everything is, and the command that comes next."""
    print_warnings(warnings)
    from driftwalk.schema.runs import kind_of

    kind = kind_of(found)
    assert kind is not None, "the result of a run"
    for label, name in kind.places.items():
        print_row(label, folder / name)
    following = _following(found, kind.name)
    if not following:
        print_report_next(folder)
        return
    print_row("all in one page", command_text("report", folder, "-o", "report.html"))
    command, *words, result = following
    print_next(command, folder, *words, "-o", sibling(folder, result))


def _following(found: xr.Dataset, kind: str) -> list[str]:
    """Return the command that takes a run further, its options, and a name for its result."""
    from driftwalk.schema.answers.parts import undetermined
    from driftwalk.schema.parameters import is_block

    if kind == "fit" or (kind == "calibration" and is_block(found)):
        # Nothing can be simulated with what is not known.
        return [] if kind == "fit" and undetermined(found) else ["assemble", "assembly"]
    if kind not in ("calibration", "model_calibration"):
        return []
    # The user names a model that is none of driftwalk's own.
    named = ["--model", str(found.attrs["model"])] if "model_source_sha256" in found.attrs else []
    return ["simulate", *named, "motion.nc"]


def print_warnings(texts: Iterable[str]) -> None:
    """Print warnings on stderr."""
    for text in texts:
        print_note(f"warning: {text}")


def print_prediction(
    answer: Answer, folder: Path, run: Path | None, warnings: Sequence[str], *, json: bool
) -> None:
    """Print the answer of simulated assemblies; `run` is what their parameters were taken from."""
    if json:
        print_json({**answer.facts, "warnings": warnings})
        return
    print_parts(answer.parts)
    print_row("figures", folder / "figures")
    print_warnings(warnings)
    print_report_next(*([] if run is None else [run]), folder)


def print_report_next(*runs: Path) -> None:
    """Print the command that makes one page of some runs, which comes next."""
    print_next("report", *runs, "-o", "report.html")
