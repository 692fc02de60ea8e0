"""`driftwalk fit`: flow, drag, stochastic force and tracking noise from recordings, in seconds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from driftwalk.cli.inputs.model_source import given_files, load_flow_for
from driftwalk.cli.inputs.recordings import opening_note, read_for_run
from driftwalk.cli.options.recording import RecordingOptions, with_recording_options
from driftwalk.cli.options.shared_types import (
    Json,
    Overwrite,
    argument,
    flag,
    flow_of_run,
    option,
    optional,
)
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.argument_names import to_options
from driftwalk.cli.terminal.output import print_note, print_parts, print_places, print_result
from driftwalk.cli.terminal.progress import reported
from driftwalk.core.study_keys import FIT_KEYS

RecordingFiles = Annotated[
    list[Path],
    argument("RECORDING...", "Recordings of one block in one tank, read with the same options."),
]


@with_recording_options
@with_study_options(
    FIT_KEYS,
    *("body_shape", "side", "mass", "depth", "force_interval"),
    *("angle", "spline_spacing", "confidence", "switching_times", "flow_labels", "precision"),
    *("law", "pressure_gradient", "added_mass", "force_memory", "flow_strength"),
    *("flow_modes", "flow_repeat", "camera"),
    *("added_mass_std", "mass_std", "side_std", "flow_error", "flow_scale_error"),
)
def fit(
    recordings: RecordingFiles,
    out: Annotated[Path, option("--out -o DIR", "Run directory to make.")],
    given: StudyOptions,
    how: RecordingOptions,
    flow: Path | None = optional(
        "--flow FILE",
        "Flow that was measured, as by PIV, steady or a series: the prior of the fitted flow.",
        callback=flow_of_run,
    ),
    earlier: Path | None = optional(
        "--earlier-fit RUN",
        "For glued blocks (--body-shape xx): the finished fit of one block in the same water.",
    ),
    interaction: bool = flag(
        "--interaction",
        "Fit all free bodies of the recording together, and say how far they share the force.",
    ),
    no_check: bool = flag("--no-check", "Skip the check whether the model explains the recording."),
    compare_laws: bool = flag(
        "--compare-laws",
        "Compare force laws by evidence and held out prediction (takes some eight fits).",
    ),
    wall: bool = flag("--wall", "Estimate restitution and friction of the wall from the contacts."),
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Fit flow, drag, stochastic force and tracking noise to recordings, together.

    A filter predicts each position from the earlier ones; the fit chooses the parameters that make
    its errors most likely. The recording may have gaps and uneven sampling. The run directory holds
    the fit (fit.nc), the flow (flow.nc) for every command that takes one, the recording, the check
    of the model (check.nc), figures and manifest.json.
    """
    from driftwalk.likelihood import describe_measured, fit_work
    from driftwalk.runs import FitWork, read_earlier_fit, run_work
    from driftwalk.schema.answers.facts import sentences
    from driftwalk.schema.answers.fit import checked_parts, fitted_parts
    from driftwalk.schema.runs import run_kind

    before = None if earlier is None else read_earlier_fit(earlier)
    if interaction:
        given = given.and_also({"fit.interaction": True}, keys=FIT_KEYS)
    read = read_for_run(recordings, given, how, before=before)
    inputs = {"recording" if n == 0 else f"recording-{n + 1}": p for n, p in enumerate(recordings)}
    fitted = earlier and earlier / run_kind("fit").file
    inputs |= given_files(study=given.file, flow=flow, earlier=fitted)
    field = None if flow is None else load_flow_for(flow, read.study)
    effort = fit_work(sum(one.sizes["time"] for one in read.trajectories))
    source = "recording" if earlier is None else str(earlier)
    opening = opening_note(read.study, given, how=how, about="block", otherwise=source)

    def begun() -> None:
        opening()
        if field is not None:
            print_note(f"measured flow {describe_measured(field, read.study)}")
        if effort.notable:
            print_note(to_options(f"{effort.describe()}; to take less, {effort.advice()}"))

    # Each part of the answer is printed as soon as it is there; JSON at the end, in one piece.
    hint = "" if wall else "; --wall estimates restitution and friction from them"
    said: dict[str, Any] = {
        "fitted": lambda fit: print_parts(fitted_parts(fit, hint=hint)),
        "checked_model": lambda fit, check: print_parts(checked_parts(fit, check)),
    }
    work = FitWork(
        recordings=read.trajectories,
        study=read.study,
        body=how.body,
        inputs=inputs,
        check=not no_check,
        compare_laws=compare_laws,
        wall=wall,
        flow=field,
        earlier=before,
        **({} if json else said),
    )
    with reported("fit") as told:
        found = run_work(work, out, overwrite=overwrite, begun=begun, **told)
    if json:
        print_result(found.fit, out, json=True, check=found.check)
    else:
        print_places(found.fit, out, sentences(found.fit, "warning"))
