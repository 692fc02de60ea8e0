"""`driftwalk fit`: flow, drag, stochastic force and tracking noise from recordings, in seconds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from driftwalk.cli.inputs.require_motion import require_motion
from driftwalk.cli.inputs.study_recording import default_tank_note, load_for_run
from driftwalk.cli.options.recording import RecordingOptions, with_recording_options
from driftwalk.cli.options.shared import (
    PANEL,
    Depth,
    ForceInterval,
    Json,
    Mass,
    Side,
    StudyFile,
    TankDiameter,
    quantity_option,
    resolve_study,
)
from driftwalk.cli.terminal.fit_answer import answer, print_answer
from driftwalk.cli.terminal.output import print_json
from driftwalk.cli.terminal.progress import reported
from driftwalk.core.study_keys import FIT_KEYS, study_overrides

RecordingFiles = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORDING...",
        help="Recordings of one block in one tank, read with the same options.",
    ),
]


@with_recording_options
def fit(
    recordings: RecordingFiles,
    how: RecordingOptions,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Run directory to make.")],
    study: StudyFile = None,
    tank_diameter: TankDiameter = None,
    side: Side = None,
    mass: Mass = None,
    depth: Depth = None,
    force_interval: ForceInterval = None,
    angle: Annotated[
        str | None,
        typer.Option(
            "--angle",
            metavar="auto|state|given|none",
            help="Use of the recorded orientation (default: auto).",
            rich_help_panel=PANEL,
            show_default=False,
        ),
    ] = None,
    spline_spacing: Annotated[
        Any,
        quantity_option("--spline-spacing", "m", "Distance between the knots of the flow.", "auto"),
    ] = None,
    confidence: Annotated[
        float | None, quantity_option("--confidence", "1", "Confidence of the intervals.")
    ] = None,
    switching_times: Annotated[
        str | None,
        typer.Option(
            "--switching-times",
            metavar="<s,s,...>",
            help="Times at which the pumps were switched, on each recording's clock; "
            "each interval has its own flow.",
            rich_help_panel=PANEL,
            show_default=False,
        ),
    ] = None,
    flow_labels: Annotated[
        str | None,
        typer.Option(
            "--flow-labels",
            metavar="A,B,...",
            help="Names of the flows between switching times; repeat a name for a "
            "flow that comes back.",
            rich_help_panel=PANEL,
            show_default=False,
        ),
    ] = None,
    precision: Annotated[
        float | None,
        quantity_option(
            "--precision", "1", "Wanted relative standard error of C_d (default: 0.1)."
        ),
    ] = None,
    no_check: Annotated[
        bool,
        typer.Option("--no-check", help="Skip the check whether the model explains the recording."),
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Move a finished run aside and start a new one.")
    ] = False,
    json: Json = False,
) -> None:
    """Fit flow, drag, stochastic force and tracking noise to recordings, together.

    A filter predicts each position from the earlier ones; the fit chooses the parameters that make
    its errors most likely. Gaps and uneven sampling are handled. The run directory holds the fit
    (fit.nc), the flow (flow.nc) for every command that takes one, the recording, the check of the
    model (check.nc), figures and manifest.json.
    """
    from driftwalk.conditions import require_inside, study_in_arena
    from driftwalk.runs import FitWork, run_fit

    overrides = study_overrides(
        keys=FIT_KEYS,
        tank_diameter=tank_diameter,
        side=side,
        mass=mass,
        depth=depth,
        force_interval=force_interval,
        angle=angle,
        spline_spacing=spline_spacing,
        confidence=confidence,
        switching_times=_items(switching_times),
        flow_labels=_items(flow_labels),
        precision=precision,
    )
    chosen = resolve_study(study, overrides, keys=FIT_KEYS)
    unsaid = study is None and tank_diameter is None and how.arena is None
    loaded = []
    for path in recordings:
        loaded.append(load_for_run(path, chosen, how, tank="unsaid" if unsaid else "stated"))
        require_motion(loaded[-1].trajectory, path, body=how.body)
    trajectories = [one.trajectory for one in loaded]
    chosen = study_in_arena(chosen, trajectories[0])
    for one in trajectories:
        require_inside(chosen, one, how.body)
    remark = None if loaded[0].has_tank else default_tank_note(chosen)
    inputs = {"recording" if n == 0 else f"recording-{n + 1}": p for n, p in enumerate(recordings)}
    inputs.update({"study": study} if study is not None else {})
    work = FitWork(trajectories, chosen, how.body, inputs, check=not no_check)
    with reported("fit") as told:
        found = run_fit(work, out, overwrite=overwrite, begun=remark, **told)
    if json:
        print_json(answer(found.fit, found.check))
    else:
        print_answer(found.fit, found.check, out)


def _items(text: str | None) -> list[str] | None:
    """Return what stands between the commas; what it means the study says."""
    return None if text is None else [item.strip() for item in text.split(",")]
