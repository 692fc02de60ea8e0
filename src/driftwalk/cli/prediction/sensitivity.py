"""`driftwalk sensitivity`: how much what blocks build depends on the model."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from driftwalk.cli.inputs.assembly_source import (
    RUN_HELP,
    RUN_NAMES,
    Source,
    load_flow_for,
    refuse_found,
    source_from_flow,
    source_from_run,
)
from driftwalk.cli.inputs.study_recording import opening_note
from driftwalk.cli.options.cluster import ClusterAt, ClusterOptions, Workers
from driftwalk.cli.options.shared import FlowFile, Json, Overwrite, RunFolder, Threads
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.options.vary import VARY_KEYS, Vary, vary_overrides
from driftwalk.cli.terminal.answer import print_prediction
from driftwalk.core.errors import InputError
from driftwalk.core.study_keys import SENSITIVITY_KEYS
from driftwalk.schema.kinds.flow import flow_series_words

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.runs import SensitivityResult
    from driftwalk.schema.answers.parts import Answer


@with_study_options(SENSITIVITY_KEYS, "runs", "realisations", *RUN_NAMES)
def sensitivity(
    out: RunFolder,
    given: StudyOptions,
    run: Annotated[
        Path | None,
        typer.Argument(metavar="RUN", help=RUN_HELP, show_default=False),
    ] = None,
    flow: FlowFile = None,
    vary: Vary = None,
    sobol: Annotated[
        int | None,
        typer.Option(
            "--sobol",
            min=8,
            metavar="N",
            help="Base samples for Sobol' indices, a power of two.",
            show_default=False,
        ),
    ] = None,
    threads: Threads = None,
    cluster: ClusterAt = None,
    cluster_options: ClusterOptions = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Measure how much self-assembly depends on the model.

    Simulates self-assembly at every setting of a map over the drag coefficient and the stochastic
    force, or over the axes that --vary names. Measures the distance between their outcomes and the
    outcomes of a reference, which has the parameters of a RUN or of a study (--flow). If you stop
    the run, the same command continues it.
    """
    from driftwalk.runs import SensitivityWork, run_work

    given = given.and_also(vary_overrides(vary or []), keys=VARY_KEYS)
    if run is None:
        source = source_from_flow(given, flow)
    else:
        refuse_found(run, given.overrides)
        source = source_from_run(run, flow, given)
    named = VARY_KEYS["vary flow"] in given.overrides
    if run is not None and not named and given.file is None and source.study.sensitivity.flow:
        # A run may be someone else's: it does not say which files of this machine are read.
        raise InputError(
            f"the study of {run} names flow files ({', '.join(source.study.sensitivity.flow)}): "
            "name the files again, --vary flow=FILE,FILE, or give the study file, --study FILE"
        )
    paths = _flow_paths(source.study, Path() if named or given.file is None else given.file.parent)
    work = SensitivityWork(
        study=source.study,
        flow=source.flow,
        flows={name: load_flow_for(path, source.study) for name, path in paths.items()},
        samples=sobol,
        inputs={**source.inputs, **{f"flow {name}": path for name, path in paths.items()}},
        threads=threads,
    )
    begun = opening_note(source.study, given, about="simulation", otherwise=str(run))
    with Workers(cluster, cluster_options).reported("sensitivity") as told:
        result = run_work(work, out, overwrite=overwrite, begun=begun, **told)
    warnings = [*source.warnings, *_warnings(source, result)]
    print_prediction(sensitivity_of(result), out, run, warnings, json=json)


def sensitivity_of(result: SensitivityResult) -> Answer:
    """Return the answer of a sensitivity study."""
    from driftwalk.assembly import disconnected_alignment
    from driftwalk.schema.answers.sensitivity import sensitivity_answer

    aligned = None
    if result.components is not None:
        # Without it, all classes that vary are of one kind.
        with suppress(InputError):
            aligned = disconnected_alignment(result.components)._asdict()
    return sensitivity_answer(
        result.sensitivity,
        reference=result.reference,
        components=result.components,
        sobol=result.indices,
        aligned=aligned,
    )


def _flow_paths(study: Study, folder: Path) -> dict[str, Path]:
    """Return the files of the flow fields; those of a study file are relative to its folder."""
    return {name: folder / name for name in study.sensitivity.flow or ()}


def _warnings(source: Source, result: SensitivityResult) -> list[str]:
    """Return what the user should know about the answer."""
    found = result.sensitivity
    axes = [str(name) for name in found["l1_distance"].dims]
    left_out = int(found["left_out"].sum()) + int(result.reference.attrs["left_out"])
    said: Sequence[tuple[bool, str]] = (
        (
            left_out > 0,
            f"{left_out} runs broke down and are left out; use a smaller time step",
        ),
        (
            "tank_diameter" in axes
            and float(found["tank_diameter"].min()) < min(source.study.tank.extent_m),
            "all tanks use the same flow field: the wall of a smaller tank cuts it "
            "off and does not change it; to include that effect, give each tank its "
            "own field",
        ),
        (
            "blocks" in axes and bool(np.isnan(found["l1_distance"].values).any()),
            "outcomes with another number of blocks share no class with the "
            "reference: they have no l1 distance",
        ),
        (
            result.components is None,
            "there are no principal components: they need two settings with different outcomes",
        ),
    )
    series = flow_series_words(result.reference.attrs, holds="shares and distances hold")
    return [*series, *(text for holds, text in said if holds)]
