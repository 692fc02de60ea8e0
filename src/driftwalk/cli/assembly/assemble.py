"""`driftwalk assemble`: what many blocks build, and how often."""

from __future__ import annotations

from pathlib import Path

from driftwalk.cli.inputs.model_source import RUN_NAMES, assembly_source, with_binding, with_glued
from driftwalk.cli.inputs.recordings import opening_note
from driftwalk.cli.options.run import RunOptions, with_run_options
from driftwalk.cli.options.shared_types import PANEL, FlowFile, Run, optional
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import print_prediction
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import ASSEMBLY_KEYS


@with_run_options
@with_study_options(ASSEMBLY_KEYS, "runs", *RUN_NAMES)
def assemble(
    given: StudyOptions,
    run: Run = None,
    flow: FlowFile = None,
    earlier: Path | None = optional(
        "--earlier-fit RUN",
        "Fit of glued blocks, or of free blocks in one recording: drag of hidden faces, shared "
        "stirring.",
    ),
    binding: Path | None = optional(
        "--binding FILE",
        "Kinds of blocks, types of their faces, and which of them latch, as a TOML table.",
        panel=PANEL,
    ),
    film: str = optional("--film gif|mp4|none", "Film of the first run.", default="gif"),
    *,
    options: RunOptions,
) -> None:
    """Simulate self-assembly of many blocks, and report how often each structure forms.

    With the RUN of a fit or a calibration, uses the run's flow field and simulates twice: with the
    estimated parameters, and with parameters drawn from their uncertainty. The difference shows how
    much this uncertainty matters. Without RUN, uses the parameters of a study and a flow field
    (--flow). If you stop the run, the same command continues it.
    """
    from driftwalk.runs import AssemblyWork
    from driftwalk.schema.runs import answer_of, run_kind

    # Before anything is read: the film is drawn last, and a wrong one would cost the whole run.
    _check_film(film)
    given, quantiles = with_glued(with_binding(given, binding), earlier)
    refused = [] if given.file is None else ["--study"]
    source = assembly_source(run, flow, given, refused=refused)
    work = AssemblyWork(
        source.study,
        source.flow,
        source.uncertainty,
        source.inputs | ({} if earlier is None else {"glued": earlier / run_kind("fit").file}),
        options.threads,
        film,
        quantiles,
    )
    begun = opening_note(source.study, given, about="simulation", otherwise=str(run))
    said = [*source.warnings, *([] if source.not_drawn is None else [source.not_drawn])]
    made = {**vars(options.run(work, "assemble", begun=begun, warnings=said))}
    answer = answer_of(made.pop("assembly"), **made)
    assert answer is not None, "the kind declares one"
    print_prediction(answer, options.out, run, answer.warnings, json=options.json)


def _check_film(film: str) -> None:
    """Refuse a film that cannot be made before anything is simulated for it."""
    if film not in ("gif", "mp4", "none"):
        raise InputError(f"--film takes gif, mp4 or none, got '{film}'")
    if film != "none":
        from driftwalk.plot import require_film_writer

        require_film_writer(f".{film}")
