"""`driftwalk infer-outcomes`: parameters from the outcomes of self-assembly alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from driftwalk.cli.assembly.kinetics import files_of, opened_histories
from driftwalk.cli.inputs.model_source import RUN_NAMES, assembly_source
from driftwalk.cli.options.run import RunOptions, with_run_options
from driftwalk.cli.options.shared_types import PANEL, FlowFile, argument, option
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import print_result
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.study_keys import ASSEMBLY_KEYS, INFERRED_KEYS, INFERRED_RANGES
from driftwalk.core.units import parse_quantity
from driftwalk.model import declared

if TYPE_CHECKING:
    import xarray as xr

NAMES = tuple(name for name in RUN_NAMES if name not in ("duration", "seed", "confidence"))
"""Options for the study: the duration is that of the data, the others have no effect here."""
SYMBOLS = {"C_d": "drag_coefficient", "sigma_F": "force_std", "σ_F": "force_std"}
"""Symbols of parameters, and their names."""


@with_run_options
@with_study_options(ASSEMBLY_KEYS, *NAMES)
def infer_outcomes(
    given: StudyOptions,
    source: Annotated[
        Path,
        argument(
            "OUTCOMES",
            "Table of classes and counts, or of runs; a run of driftwalk assemble; or a file or a "
            "folder of driftwalk classify.",
        ),
    ],
    flow: FlowFile = None,
    vary: Annotated[
        list[str] | None,
        option(
            "--vary NAME=FROM:TO",
            "Parameter to infer and its range: drag-coefficient=0.3:0.6. Two to four of them.",
            panel=PANEL,
        ),
    ] = None,
    after: Annotated[
        float | None,
        option(
            "--after",
            "When the final classes were read; default: the end of the runs, or 5 min.",
            unit="s",
        ),
    ] = None,
    runs: Annotated[
        int, option("--runs N", "Simulated runs of each node of the emulator.", min=20)
    ] = 300,
    truths: Annotated[
        int, option("--truths N", "Simulated data sets of the self-check.", min=20)
    ] = 200,
    seed: Annotated[int, option("--seed N", "Seed of the simulations.", min=0)] = 1,
    *,
    options: RunOptions,
) -> None:
    """Infer drag coefficient and stochastic force from the outcomes of self-assembly alone.

    Learns from simulated runs how the outcomes depend on the parameters, and checks on simulated
    data sets that its regions hold the truth, before it states one. If you stop the run, the same
    command continues it.
    """
    from driftwalk.runs import OutcomePosteriorWork

    outcomes, inputs = _outcomes(source)
    ranges = _ranges(vary) if vary else INFERRED_RANGES
    # What varies is stated: no default of it is assumed.
    middle = {INFERRED_KEYS[name]: 0.5 * sum(ends) for name, ends in ranges.items()}
    model = assembly_source(None, flow, given.and_also(middle, keys=ASSEMBLY_KEYS))
    chosen: dict[str, Any] = {"vary": ranges, "runs": runs, "truths": truths, "seed": seed}
    if after is not None:
        chosen["after"] = after
    work = OutcomePosteriorWork(
        outcomes, model.flow, model.study, chosen, {**model.inputs, **inputs}, options.threads
    )
    found: xr.Dataset = options.run(work, "infer-outcomes", warnings=model.warnings)
    print_result(found, options.out, json=options.json)


def _outcomes(source: Path) -> tuple[Any, dict[str, Path]]:
    """Return the outcomes of a table, or the histories of runs and recordings."""
    from driftwalk.assembly import read_outcomes

    if source.is_file() and source.suffix.lower() in (".csv", ".txt", ".tsv"):
        return read_outcomes(source), {"outcomes": source}
    paths = files_of(source)
    inputs = {f"outcomes file {number}": path for number, path in enumerate(paths, start=1)}
    return [opened_histories(path) for path in paths], inputs


def _ranges(given: list[str]) -> dict[str, tuple[float, float]]:
    """Return the ranges of ``NAME=FROM:TO``; a unit after the end holds for the start too."""
    found: dict[str, tuple[float, float]] = {}
    for text in given:
        words, sign, ends = text.partition("=")
        name, parts = words.strip().replace("-", "_"), ends.split(":")
        name = SYMBOLS.get(name, name)
        if name not in INFERRED_KEYS or not sign or len(parts) != 2:
            names = ", ".join(one.replace("_", "-") for one in INFERRED_KEYS)
            raise InputError(f"--vary {text}: expected NAME=FROM:TO with a name out of {names}")
        if name in found:
            raise InputError(f"--vary {text}: {words} is named twice")
        quantity = declared(INFERRED_KEYS[name]).quantity
        unit = "1" if quantity is None else quantity.unit
        tail = parts[1].strip().lstrip("0123456789.eE+-")
        first = parts[0].strip() + ("" if parts[0].strip()[-1:].isalpha() else tail)
        try:
            found[name] = (parse_quantity(first, unit), parse_quantity(parts[1], unit))
        except ConfigurationError as error:
            raise InputError(f"--vary {text}: {error}") from error
    return found
