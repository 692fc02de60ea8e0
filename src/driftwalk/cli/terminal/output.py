"""Output of a command: JSON or a table, the answer of a run, warnings, and what to type next."""

from __future__ import annotations

import json
import os
import shlex
import sys
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.cli.terminal.argument_names import in_options, to_options
from driftwalk.core.errors import InputError
from driftwalk.core.files.atomic import require_free
from driftwalk.core.text_files import json_value

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.schema.answers.parts import Answer, Part


_UNSEEN = ("Cc", "Cf")
"""Categories of Unicode that a terminal obeys instead of showing: escape, right to left."""


def print_json(values: Mapping[str, Any]) -> None:
    """Print one JSON object on stdout.

    Parameters
    ----------
    values : mapping
        Keys with units in their names; numbers, text, lists, mappings, numpy scalars and arrays.
        The order of the keys is kept; a number that is not finite becomes null, which JSON lacks.
        Warnings name options where the library names arguments, see `in_options`.

    Examples
    --------
    >>> print_json({"ks_distance": float("nan")})
    {
      "ks_distance": null
    }
    """
    print(to_json(values))


def to_json(values: Mapping[str, Any]) -> str:
    """Return the text that `print_json` prints."""
    return json.dumps(in_options(json_value(values)), indent=2, allow_nan=False, ensure_ascii=True)


def save_dataset(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset as NetCDF, and say so."""
    from driftwalk.core.files.atomic import write_atomic
    from driftwalk.schema.stores.netcdf import netcdf_bytes

    write_atomic(path, netcdf_bytes(dataset))
    print_note(f"wrote {path}")


def print_table(
    rows: Sequence[Sequence[Any]], *, columns: Sequence[str] | None = None, title: str | None = None
) -> None:
    """Print a table on stdout: aligned on a terminal, and the same text through a pipe.

    Parameters
    ----------
    rows : sequence of sequences
        The cells; a float is shown with six significant digits, None as an empty cell.
    columns : sequence of str, optional
        Heads of the columns, with units.
    title : str, optional
        A line above the table.

    Examples
    --------
    >>> print_table([["samples", 18001], ["duration (s)", 1800.0]])
    samples       18001
    duration (s)  1800
    """
    from driftwalk.schema.answers.parts import table_lines

    for line in table_lines(rows, columns or (), title or ""):
        print(printable(line))


def print_note(text: str) -> None:
    """Print a remark or warning on stderr, where it does not disturb the output.

    It may be one of the library: options take the place of arguments, see `to_options`.
    """
    print(f"driftwalk: {' '.join(printable(to_options(text)).split())}", file=sys.stderr)


def printable(text: str) -> str:
    r"""Return a text whose control characters are spelled out: one of a file may be for a terminal.

    Examples
    --------
    >>> printable("a" + chr(27) + "[2J, σ_F")
    'a\\x1b[2J, σ_F'
    """
    return "".join(
        ascii(one)[1:-1] if unicodedata.category(one) in _UNSEEN and one not in "\n\t" else one
        for one in text
    )


def command_text(name: str, *words: str | Path) -> str:
    """Return a command with its files and options, for a person to copy.

    Examples
    --------
    >>> command_text("fit", Path("my tracks.csv"), "--fps", "30")
    "driftwalk fit 'my tracks.csv' --fps 30"
    >>> command_text("report", Path("-run"))
    'driftwalk report ./-run'
    """
    # A file whose name begins with a dash would be taken for an option.
    shown = [f"./{one}" if isinstance(one, Path) and str(one)[0] == "-" else one for one in words]
    return shlex.join(["driftwalk", *name.split(), *map(str, shown)])


def print_next(name: str, *words: str | Path) -> None:
    """Print on stderr, as the last line of a command, the one that most users run next."""
    sys.stdout.flush()
    places = [*words]
    if "-o" in words[:-1]:
        at = words.index("-o") + 1
        places[at] = _free(words[at])
    print(f"next: {printable(command_text(name, *places))}", file=sys.stderr)


def _free(word: str | Path) -> str | Path:
    """Return a name for a result; numbered where a file or a finished run has it already."""
    place, number = Path(word), 1
    suffix = place.suffix if place.is_file() else ""  # a folder's name may hold a point
    while place.is_file() or (place / "manifest.json").is_file():
        number += 1
        place = Path(f"{str(word).removesuffix(suffix)}-{number}{suffix}")
    return word if number == 1 else place


def sibling(place: Path, name: str) -> Path:
    """Return a name for results that stand on a run or a file, in the same folder.

    Examples
    --------
    >>> sibling(Path("runs/fit"), "assembly").as_posix()
    'runs/fit-assembly'
    """
    return place.with_name(f"{place.name or 'run'}-{name}")


def require_place(path: Path, *, existing: str) -> None:
    """Refuse a file that cannot be written, before the work that it is for.

    Parameters
    ----------
    path : Path
        The file to be written.
    existing : {"error", "replace"}
        Behaviour if the file exists already.

    Raises
    ------
    InputError
        When it is there and not to be replaced, or its folder is not there or not writable.
    """
    require_free(path, existing=existing)
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"{path}: permission denied to write in the folder {path.parent}")


def print_result(
    found: xr.Dataset,
    folder: Path,
    *,
    json: bool,
    following: Sequence[str | Path] = (),
    **more: Any,
) -> None:
    """Print the answer of a run, as one JSON object or for people, and what comes next.

    Parameters
    ----------
    found : xarray.Dataset
        The main dataset of the run.
    folder : Path
        The run directory.
    json : bool
        Whether programs read it.
    following : sequence of str or Path
        The next command and its words, where the dataset alone does not say it.
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
    print_places(found, folder, answer.warnings, following)


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


def print_places(
    found: xr.Dataset, folder: Path, warnings: Iterable[str], words: Sequence[str | Path] = ()
) -> None:
    """Print the warnings, where everything is, and the command that comes next."""
    print_warnings(warnings)
    from driftwalk.schema.runs import following_of, kind_of

    kind, following = kind_of(found), following_of(found).command
    assert kind is not None, "the result of a run"
    for label, name in kind.places.items():
        print_row(label, folder / name)
    if not (words or following):
        print_report_next(folder)
        return
    print_row("all in one page", command_text("report", folder, "-o", "report.html"))
    if words:
        print_next(str(words[0]), *words[1:])
        return
    command, *model, result = following
    named = ["--model", *model] if model else []
    print_next(command, folder, *named, "-o", sibling(folder, result))


def print_warnings(texts: Iterable[str | None]) -> None:
    """Print warnings on stderr, and skip each None."""
    for text in filter(None, texts):
        print_note(f"warning: {text}")


def print_prediction(
    answer: Answer, folder: Path, run: Path | None, warnings: Sequence[str], *, json: bool,
    following: Sequence[str | Path] = (),
) -> None:  # fmt: skip
    """Print the answer of simulated assemblies; `run` is what their parameters were taken from.

    The next command is `following`, else that of their page.
    """
    if json:
        print_json({**answer.facts, "warnings": warnings})
        return
    print_parts(answer.parts)
    print_row("figures", folder / "figures")
    print_warnings(warnings)
    page = ["report", *([] if run is None else [run]), folder, "-o", "report.html"]
    if following:
        print_row("all in one page", command_text(*map(str, page)))
    name, *words = following or page
    print_next(str(name), *words)


def print_report_next(*runs: Path) -> None:
    """Print the command that makes one page of some runs, which comes next."""
    print_next("report", *runs, "-o", "report.html")
