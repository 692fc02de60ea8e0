"""`driftwalk assemble`: what many blocks build, and how often."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from driftwalk.cli.inputs.model_source import RUN_NAMES, assembly_source, with_binding, with_glued
from driftwalk.cli.inputs.recordings import opening_note
from driftwalk.cli.options.run import RunOptions, with_run_options
from driftwalk.cli.options.shared_types import PANEL, FlowFile, Run, option
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.output import print_prediction
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import ASSEMBLY_KEYS
from driftwalk.schema.kinds.flow import flow_series_words

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.runs import AssemblyResult
    from driftwalk.schema.answers.parts import Answer


@with_run_options
@with_study_options(ASSEMBLY_KEYS, "runs", *RUN_NAMES)
def assemble(
    given: StudyOptions,
    run: Run = None,
    flow: FlowFile = None,
    earlier: Annotated[
        Path | None,
        option(
            "--from RUN",
            "Fit of glued blocks, or of free ones in one recording: what a hidden face and a "
            "neighbour feel.",
            show_default=False,
        ),
    ] = None,
    binding: Annotated[
        Path | None,
        option(
            "--binding FILE",
            "Kinds of blocks, types of their faces, and which of them latch, as a TOML table.",
            panel=PANEL,
            show_default=False,
        ),
    ] = None,
    film: Annotated[str, option("--film gif|mp4|none", "Film of the first run.")] = "gif",
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

    # Before anything is read: the film is drawn last, and a wrong one would cost the whole run.
    _check_film(film)
    given, quantiles = with_glued(with_binding(given, binding), earlier)
    refused = [] if given.file is None else ["--study"]
    source = assembly_source(run, flow, given, refused=refused)
    work = AssemblyWork(
        source.study,
        source.flow,
        source.uncertainty,
        source.inputs if earlier is None else {**source.inputs, "glued": earlier / "fit.nc"},
        options.threads,
        film,
        quantiles,
    )
    begun = opening_note(source.study, given, about="simulation", otherwise=str(run))
    said = [*source.warnings, *([] if source.not_drawn is None else [source.not_drawn])]
    result = options.run(work, "assemble", begun=begun, warnings=said)
    series = flow_series_words(result.distribution.attrs, holds="the intervals hold")
    warnings = [*said, *series, *_left_out(result)]
    print_prediction(assembled(work.study, result), options.out, run, warnings, json=options.json)


def _check_film(film: str) -> None:
    """Refuse a film that cannot be made before anything is simulated for it."""
    if film not in ("gif", "mp4", "none"):
        raise InputError(f"--film takes gif, mp4 or none, got '{film}'")
    if film != "none":
        from driftwalk.plot import require_film_writer

        require_film_writer(f".{film}")


def assembled(study: Study, result: AssemblyResult) -> Answer:
    """Return the answer of an assembly run."""
    from driftwalk.schema.answers.assembly import assembly_answer

    forces = study.forces
    return assembly_answer(
        result.distribution,
        times=result.times,
        settings={
            "drag_coefficient": forces.drag_coefficient,
            "force_std_N": forces.force_std_N,
            "approach_resistance_N_s": study.interaction.approach_resistance_N_s,
        },
        drawn=result.drawn,
        sizes=result.sizes,
        sizes_drawn=result.sizes_drawn,
        steady=result.steady,
        apart=_difference(result),
        attraction=result.attraction,
    )


def _difference(result: AssemblyResult) -> dict[str, float]:
    """Return how far the two distributions are apart, and how far they would be by chance."""
    from driftwalk.assembly import l1_distance, l1_noise_floor

    if result.drawn is None:
        return {}
    pair = (result.distribution, result.drawn)
    counts = [dict(zip(d["class"].values, d["count"].values, strict=True)) for d in pair]
    runs = [int(d.attrs["runs"]) for d in pair]
    names = dict.fromkeys([*counts[0], *counts[1]])
    pooled = {
        str(name): float(sum(count.get(name, 0) for count in counts)) / sum(runs) for name in names
    }
    floor = l1_noise_floor(pooled, *runs)
    return {
        "l1_distance": l1_distance(*pair),
        "l1_noise_floor": floor.mean,
        "l1_noise_floor_95": floor.quantile,
    }


def _left_out(result: AssemblyResult) -> list[str]:
    """Return a warning where runs have no outcome."""
    pairs = (("", result.distribution), (" with drawn parameters", result.drawn))
    return [
        f"{found.attrs['left_out']} runs{what} broke down and are left out; use a smaller time step"
        for what, found in pairs
        if found is not None and found.attrs["left_out"]
    ]
