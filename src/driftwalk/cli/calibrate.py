"""`driftwalk calibrate`: from a recording to a calibrated motion model."""

from __future__ import annotations

from driftwalk.cli.inputs.recordings import read_for_models
from driftwalk.cli.options.model import ModelName, chosen_model
from driftwalk.cli.options.recording import RecordingFile, RecordingOptions, with_recording_options
from driftwalk.cli.options.run import RunOptions, with_run_options
from driftwalk.cli.options.shared_types import FlowFile, flag, optional
from driftwalk.cli.options.study import StudyOptions, with_study_options
from driftwalk.core.study_keys import CALIBRATION_KEYS


@with_run_options
@with_recording_options
@with_study_options(
    CALIBRATION_KEYS,
    *("body_shape", "side", "mass", "depth", "force_interval"),
    *("wall_friction", "wall_restitution", "time_step", "step_interval"),
    *("position_noise", "orientation_noise", "replicates", "bootstrap", "seed"),
    "flow_repeat",
)
def calibrate(
    recording: RecordingFile,
    given: StudyOptions,
    how: RecordingOptions,
    model: ModelName = None,
    parameters: list[str] | None = optional(
        "--parameter NAME=VALUE|LOW,HIGH",
        "Known value, or range of the search, of a parameter of --model; repeat for others.",
    ),
    flow: FlowFile = None,
    posterior: bool = flag(
        "--posterior",
        "Also write posterior.csv: draws from the approximate posterior of a --model with "
        "more than two parameters.",
    ),
    *,
    options: RunOptions,
) -> None:
    """Find the drag coefficient and the stochastic force that explain a recording.

    With --model, finds the unknown parameters of another motion model. One or two parameters are
    searched on a grid: driftwalk simulates every setting for the length of the recording, compares
    step lengths and turning angles, and refines the grid around the minimum. More parameters are
    estimated from summaries of the motion. Reports how well the parameters are known and whether
    the model explains the motion. If you stop the run, the same command continues it.
    """
    from driftwalk.runs import CalibrationWork

    chosen = chosen_model(model, parameters)
    models = ["block" if chosen is None else chosen]
    read, begun = read_for_models(recording, flow, given, how, models)
    work = CalibrationWork(**read, threads=options.threads, model=chosen, posterior=posterior)
    options.answer(work, "calibrate", begun=begun)
