"""`driftwalk calibrate`: from a recording to a calibrated motion model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
from driftwalk.cli.terminal.output import print_json, print_note, report_command
from driftwalk.cli.terminal.progress import reported
from driftwalk.core.study_keys import CALIBRATION_KEYS, study_overrides
from driftwalk.schema.calibration_facts import calibration_facts

if TYPE_CHECKING:
    import xarray as xr

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


_KEYS = (
    "drag_coefficient",
    "drag_coefficient_interval",
    "force_std_N",
    "force_std_N_interval",
    "confidence",
    "force_interval_s",
    "force_noise_intensity_N2_s",
    "ks_distance",
    "ks_distance_standard_error",
    "noise_floor",
    "noise_floor_upper",
    "distance_to_floor_ratio",
    "interval_stretch",
    "second_half_ks_distance",
    "second_half_noise_floor",
    "first_half_drag_coefficient",
    "first_half_force_std_N",
    "coarse_drag_coefficient",
    "coarse_force_std_N",
    "wetted_depth_m",
    "position_noise_m",
    "orientation_noise_rad",
    "step_interval_s",
    "time_step_s",
    "duration_s",
    "recording_pairs",
)


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Return what ``--json`` prints: the answer with units in its keys."""
    facts = calibration_facts(found)
    return {
        **{key: facts.get(key) for key in _KEYS},
        "recording": facts["recording_name"],
        "warnings": facts["warnings"],
    }


def print_answer(found: xr.Dataset, folder: Path) -> None:
    """Print the answer for people, and where the figures are."""
    facts = calibration_facts(found)
    interval = facts["force_interval_s"]
    if facts["simulated_recording"] == "yes":
        print("This recording was simulated by another engine (ODE).")
    percent = f"{facts.get('confidence', 0.9):.0%} interval"
    drag = facts["drag_coefficient"]
    force = 1e3 * facts["force_std_N"]
    print(f"drag coefficient C_d   {drag:.4f}{_interval(facts, 'drag_coefficient', 1, percent)}")
    print(
        f"stochastic force σ_F   {force:.4f} mN, redrawn every {1e3 * interval:g} ms"
        f"{_interval(facts, 'force_std_N', 1e3, percent)}"
    )
    print(f"noise intensity σ_F²·τ {facts['force_noise_intensity_N2_s']:.4g} N² s")
    print(
        f"KS distance            {facts['ks_distance']:.4f} at the optimum, "
        f"noise floor {facts['noise_floor']:.4f}"
    )
    if "second_half_ks_distance" in facts:
        print(
            f"second half            {facts['second_half_ks_distance']:.4f} for a calibration on "
            f"the first, noise floor {facts['second_half_noise_floor']:.4f}"
        )
    for warning in facts["warnings"]:
        print_note(f"warning: {warning}")
    print(f"figures                {folder / 'figures'}")
    print(f"all in one page        {report_command(folder)}")


def _interval(facts: dict[str, Any], key: str, scale: float, percent: str) -> str:
    ends = facts.get(f"{key}_interval")
    if ends is None:
        return "   no interval without a bootstrap"
    return f"   {percent} {scale * ends[0]:.4f} to {scale * ends[1]:.4f}"
