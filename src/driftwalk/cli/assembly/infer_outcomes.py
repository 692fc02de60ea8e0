"""`driftwalk infer-outcomes`: parameters from the outcomes of self-assembly alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from driftwalk.cli.assembly.kinetics import files_of, opened_histories
from driftwalk.cli.inputs.model_source import RUN_NAMES, assembly_source
from driftwalk.cli.inputs.varied import parted_numbers, read_varied
from driftwalk.cli.options.run import RunOptions, with_run_options
from driftwalk.cli.options.shared_types import PANEL, FlowFile, argument, optional
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.core.errors import ConfigurationError
from driftwalk.core.study_keys import ASSEMBLY_KEYS, INFERRED_KEYS, INFERRED_RANGES
from driftwalk.model import declared

NAMES = tuple(name for name in RUN_NAMES if name not in ("duration", "seed", "confidence"))
"""Options for the study: the duration is that of the data, the others have no effect here."""
VARIED = {
    **{name.replace("_", "-"): name for name in INFERRED_KEYS},
    **{"C_d": "drag_coefficient", "sigma_F": "force_std", "σ_F": "force_std"},
}
"""Parameters by their names and symbols."""


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
    vary: list[str] | None = optional(
        "--vary NAME=FROM:TO",
        "Parameter to infer and its range: drag-coefficient=0.3:0.6. Two to four of them.",
        panel=PANEL,
    ),
    after: float | None = optional(
        "--after",
        "When the final classes were read; default: the end of the runs, or 5 min.",
        unit="s",
    ),
    runs: int = optional(
        "--runs N", "Simulated runs of each node of the emulator.", min=20, default=300
    ),
    truths: int = optional(
        "--truths N", "Simulated data sets of the self-check.", min=20, default=200
    ),
    seed: int = optional("--seed N", "Seed of the simulations.", min=0, default=1),
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
    ranges = read_varied(vary, VARIED, _range) if vary else INFERRED_RANGES
    # What varies is stated: no default of it is assumed.
    middle = {INFERRED_KEYS[name]: 0.5 * sum(ends) for name, ends in ranges.items()}
    model = assembly_source(None, flow, given.and_also(middle, keys=ASSEMBLY_KEYS))
    chosen: dict[str, Any] = {"vary": ranges, "runs": runs, "truths": truths, "seed": seed}
    if after is not None:
        chosen["after"] = after
    work = OutcomePosteriorWork(
        outcomes, model.flow, model.study, chosen, {**model.inputs, **inputs}, options.threads
    )
    options.answer(work, "infer-outcomes", warnings=model.warnings)


def _outcomes(source: Path) -> tuple[Any, dict[str, Path]]:
    """Return the outcomes of a table, or the histories of runs and recordings."""
    from driftwalk.assembly import read_outcomes

    if source.is_file() and source.suffix.lower() in (".csv", ".txt", ".tsv"):
        return read_outcomes(source), {"outcomes": source}
    paths = files_of(source)
    inputs = {f"outcomes file {number}": path for number, path in enumerate(paths, start=1)}
    return [opened_histories(path) for path in paths], inputs


def _range(name: str, words: list[str]) -> tuple[float, float]:
    """Return the ends of FROM:TO."""
    quantity = declared(INFERRED_KEYS[name]).quantity
    (ends, *more) = parted_numbers(words, "1" if quantity is None else quantity.unit)
    if more or len(ends) != 2:
        raise ConfigurationError("expected NAME=FROM:TO")
    return ends[0], ends[1]
