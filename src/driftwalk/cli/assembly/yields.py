"""`driftwalk yield`: which setting gives the most of an outcome class."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from driftwalk.cli.assembly.sensitivity import AXES, VARY_KEYS, flow_paths, vary_overrides
from driftwalk.cli.inputs.model_source import RUN_NAMES, assembly_source, load_flow_for
from driftwalk.cli.inputs.recordings import opening_note
from driftwalk.cli.options.run import RunOptions, with_run_options
from driftwalk.cli.options.shared_types import PANEL, FlowFile, Run, option
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import print_prediction
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.study_keys import SENSITIVITY_KEYS
from driftwalk.core.units import parse_quantity
from driftwalk.model import declared
from driftwalk.schema.kinds.flow import flow_series_words

_RANGE = re.compile(r"[^:;]+:[^:;]+")
"""Two ends; three parts are a range with a step, which is a list."""
UNSTATED = {
    "force_std": "the force was not stated",
    "drag_coefficient": "the drag coefficient was not stated",
}
"""Beginnings of warnings that do not hold where the parameter varies."""
REPLACED = ("--runs", "-o", "--out")
"""Options that another run of the command has with other values."""
Ranges = dict[str, tuple[float, float]]


@with_run_options
@with_study_options(SENSITIVITY_KEYS, *RUN_NAMES)
def maximise_yield(
    given: StudyOptions,
    target: Annotated[str, option("--target CLASS", "Outcome class to be reached, such as T.")],
    run: Run = None,
    flow: FlowFile = None,
    by: Annotated[
        str | None,
        option("--by TIME", "When it is to be reached; default: at the end of the runs."),
    ] = None,
    vary: Annotated[
        list[str] | None,
        option(
            "--vary NAME=VALUES",
            "Settings to compare: blocks=4,5, or a range to search: flow-scale=0.5:1.5. "
            "Repeatable.",
            panel=PANEL,
        ),
    ] = None,
    runs: Annotated[
        int,
        option(
            "--runs N",
            "Runs that choose by halving. At most five times as many are simulated to distinguish "
            "the best (six with a range to search).",
            min=1,
        ),
    ] = 6000,
    fresh_runs: Annotated[
        int, option("--fresh-runs N", "Runs that report the yield of a setting.", min=1)
    ] = 2000,
    within: Annotated[
        float, option("--within SHARE", "Difference of yields that does not matter.")
    ] = 0.02,
    *,
    options: RunOptions,
) -> None:
    """Find the setting in which most runs assemble into a target by a time.

    Compares the settings of --vary with the same random numbers: successive halving, a local search
    in ranges, and further runs until the others are worse or cannot be distinguished. Reports the
    yield from fresh runs, and the best yield for every time. If you stop the run, the same command
    continues it.
    """
    from driftwalk.runs import YieldWork
    from driftwalk.schema.answers.yields import more_runs, yield_answer

    lists, ranges = _varied(vary or [])
    given = given.and_also(vary_overrides(lists), keys=VARY_KEYS)
    source = assembly_source(run, flow, given)
    paths = flow_paths(source.study, given, run)
    work = YieldWork(
        source.study,
        source.flow,
        {
            "target": target,
            "by": None if by is None else parse_quantity(by, "s"),
            "ranges": ranges,
            "runs": runs,
            "fresh_runs": fresh_runs,
            "indifference": within,
        },
        {name: load_flow_for(path, source.study) for name, path in paths.items()},
        {**source.inputs, **{f"flow {name}": path for name, path in paths.items()}},
        options.threads,
    )
    begun = opening_note(source.study, given, about="simulation", otherwise=str(run))
    # A parameter that varies needs no value of its own.
    named = {text.partition("=")[0].strip().replace("-", "_") for text in vary or []}
    idle = [text for name, text in UNSTATED.items() if name in named]
    kept = [one for one in source.warnings if not one.startswith(tuple(idle))]
    found = options.run(work, "yield", begun=begun, warnings=kept)
    answer = yield_answer(found)
    series = flow_series_words(found.attrs, holds="yields hold")
    warnings = [*kept, *series, *answer.warnings]
    more = more_runs(found)
    again = [] if more is None else ["yield", *_again(sys.argv[2:], more, options.out)]
    print_prediction(answer, options.out, run, warnings, json=options.json, following=again)


yield_app = maximise_yield
"""The command's name is a word of Python."""


def _again(words: Sequence[str], runs: int, out: Path) -> list[str | Path]:
    """Return the words of this command with more runs, into another folder."""
    kept, replaced = [], False
    for word in words:
        name = word.partition("=")[0]
        if not replaced and name not in REPLACED:
            kept.append(word)
        replaced = word in REPLACED
    return [*kept, "--runs", str(runs), "-o", out]


def _varied(vary: list[str]) -> tuple[list[str], Ranges]:
    """Return the options with listed values, and the ranges of the others.

    Raises
    ------
    InputError
        When a range is of no number, or named twice.
    """
    lists: list[str] = []
    ranges: Ranges = {}
    for text in vary:
        name, _, values = text.partition("=")
        axis = name.strip().replace("_", "-")
        key = AXES.get(axis)
        if key is None or not _RANGE.fullmatch(values):
            lists.append(text)
            continue
        quantity, own = (
            declared(key).quantity,
            axis.replace("-", "_").replace("tank", "tank_diameter"),
        )
        if quantity is None or quantity.whole:
            raise InputError(f"--vary {text}: {axis} has no range; name its values")
        if own in ranges:
            raise InputError(f"--vary {text}: {axis} is varied twice")
        low, high = (word.strip() for word in values.split(":"))
        # "0.2:1.2mN" has one unit for both.
        unit = high.lstrip("+0123456789.eE-")
        try:
            first = parse_quantity(low + unit if _is_bare(low) else low, quantity.unit)
            ranges[own] = (first, parse_quantity(high, quantity.unit))
        except ConfigurationError as error:
            raise InputError(f"--vary {text}: {error}") from error
    return lists, ranges


def _is_bare(word: str) -> bool:
    return re.fullmatch(r"[+-]?[0-9.]+(e[+-]?[0-9]+)?", word, re.IGNORECASE) is not None
