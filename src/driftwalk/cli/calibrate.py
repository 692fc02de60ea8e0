"""`driftwalk calibrate`: from a recording to a calibrated motion model."""

from __future__ import annotations

from driftwalk.cli.inputs.study_recording import read_with_flow, tank_note
from driftwalk.cli.options.model import ModelName, ParameterChoices, chosen_model
from driftwalk.cli.options.recording import RecordingFile, RecordingOptions, with_recording_options
from driftwalk.cli.options.shared import FlowFile, Json, Overwrite, RunFolder, Threads
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.cli.terminal.calibration_answer import print_answer, summary
from driftwalk.cli.terminal.output import print_json
from driftwalk.cli.terminal.progress import reported
from driftwalk.core.study_keys import CALIBRATION_KEYS


@with_recording_options
@with_study_options(
    CALIBRATION_KEYS,
    *("tank_diameter", "side", "mass", "depth", "force_interval"),
    *("wall_friction", "wall_restitution", "time_step", "step_interval"),
    *("position_noise", "orientation_noise", "replicates", "bootstrap", "seed"),
)
def calibrate(
    recording: RecordingFile,
    out: RunFolder,
    given: StudyOptions,
    how: RecordingOptions,
    model: ModelName = None,
    parameters: ParameterChoices = None,
    flow: FlowFile = None,
    threads: Threads = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Find the drag coefficient and the stochastic force that explain a recording.

    With --model: the one or two unknown parameters of another motion model. Simulates every setting
    of a grid for the length of the recording, compares step lengths and turning angles, and refines
    the grid around the minimum. Reports how well the parameters are known and whether the model
    explains the motion. After a kill, the same command continues.
    """
    from driftwalk.runs import CalibrationWork, run_calibration

    chosen = chosen_model(model, parameters)
    read, field, inputs = read_with_flow(recording, flow, given, how)
    work = CalibrationWork(
        read.trajectories[0], read.study, field, how.body, inputs, threads, chosen
    )
    with reported("calibrate") as told:
        found = run_calibration(work, out, overwrite=overwrite, begun=tank_note(read), **told)
    if json:
        print_json(summary(found))
    else:
        print_answer(found, out)
