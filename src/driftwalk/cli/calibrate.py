"""`driftwalk calibrate`: from a recording to a calibrated motion model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from driftwalk.cli.inputs.require_motion import require_motion
from driftwalk.cli.inputs.study_recording import default_tank_note, load_for_run
from driftwalk.cli.options.recording import RecordingFile, RecordingOptions, with_recording_options
from driftwalk.cli.options.shared import (
    Depth,
    FlowFile,
    ForceInterval,
    Json,
    Mass,
    OrientationNoise,
    PositionNoise,
    Replicates,
    Seed,
    Side,
    StepInterval,
    StudyFile,
    TankDiameter,
    TimeStep,
    WallFriction,
    WallRestitution,
    resolve_study,
)
from driftwalk.cli.terminal.calibration_answer import print_answer, summary
from driftwalk.cli.terminal.output import print_json
from driftwalk.cli.terminal.progress import reported
from driftwalk.core.study_keys import CALIBRATION_KEYS, study_overrides

Threads = Annotated[
    int | None,
    typer.Option(
        "--threads", min=1, help="Worker threads (default: all cores).", show_default=False
    ),
]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Move a finished run aside and start a new one.")
]


@with_recording_options
def calibrate(
    recording: RecordingFile,
    how: RecordingOptions,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="DIR", help="Run directory to make or continue.")
    ],
    study: StudyFile = None,
    flow: FlowFile = None,
    tank_diameter: TankDiameter = None,
    side: Side = None,
    mass: Mass = None,
    depth: Depth = None,
    force_interval: ForceInterval = None,
    wall_friction: WallFriction = None,
    wall_restitution: WallRestitution = None,
    time_step: TimeStep = None,
    step_interval: StepInterval = None,
    position_noise: PositionNoise = None,
    orientation_noise: OrientationNoise = None,
    replicates: Replicates = None,
    bootstrap: Annotated[
        int | None,
        typer.Option(
            "--bootstrap", min=0, help="Bootstrap recordings; 0 for none.", show_default=False
        ),
    ] = None,
    seed: Seed = None,
    threads: Threads = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Find the drag coefficient and the stochastic force that explain a recording.

    Simulates every setting of a grid for the length of the recording, compares step lengths and
    turning angles, and refines the grid around the minimum. Reports how well the parameters are
    known and whether the model explains the motion. After a kill, the same command continues.
    """
    from driftwalk.conditions import require_inside, study_in_arena
    from driftwalk.flow import load_flow
    from driftwalk.runs import CalibrationWork, run_calibration

    overrides = study_overrides(
        keys=CALIBRATION_KEYS,
        tank_diameter=tank_diameter,
        side=side,
        mass=mass,
        depth=depth,
        force_interval=force_interval,
        wall_friction=wall_friction,
        wall_restitution=wall_restitution,
        time_step=time_step,
        step_interval=step_interval,
        position_noise=position_noise,
        orientation_noise=orientation_noise,
        replicates=replicates,
        bootstrap=bootstrap,
        seed=seed,
    )
    chosen = resolve_study(study, overrides, keys=CALIBRATION_KEYS)
    unsaid = study is None and tank_diameter is None and how.arena is None
    loaded = load_for_run(recording, chosen, how, tank="unsaid" if unsaid else "stated")
    trajectory = loaded.trajectory
    require_motion(trajectory, recording, body=how.body)
    chosen = study_in_arena(chosen, trajectory)
    require_inside(chosen, trajectory, how.body)
    inputs = {"recording": recording}
    inputs.update({"flow": flow} if flow is not None else {})
    inputs.update({"study": study} if study is not None else {})
    given = None
    if flow is not None:
        given = load_flow(flow, arena=chosen.tank.to_arena(), own_flags="keep")
    remark = None if loaded.has_tank else default_tank_note(chosen)
    work = CalibrationWork(trajectory, chosen, given, how.body, inputs, threads)
    with reported("calibrate") as told:
        found = run_calibration(work, out, overwrite=overwrite, begun=remark, **told)
    if json:
        print_json(summary(found))
    else:
        print_answer(found, out)
